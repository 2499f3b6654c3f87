"""Footer, help and command palette: one list of commands that work in the present focus."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.widgets import Footer
from textual.widgets._footer import FooterKey

from railui.desk.commands import active_commands, help_rows
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.widgets.dialogs import HelpDialog
from railui.desk.widgets.form import Form
from railui.desk.widgets.plot import Plot
from tests.desk.conftest import Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio


def palette(keys: Keyboard) -> list[str]:
    """Return the titles of the command palette, in their order."""
    return [command.title for command in keys.desk.get_system_commands(keys.desk.screen)]


def footer(keys: Keyboard) -> list[str]:
    """Return the texts of the footer."""
    return [key.description for key in keys.desk.query_one(Footer).query(FooterKey)]


async def test_footer_help_and_palette_have_the_same_commands(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        for number in range(10):  # two widgets of every panel
            if number % 2 == 0:
                await keys.press(f"f{2 + number // 2}")
            commands = active_commands(keys.desk.screen)
            titles = palette(keys)
            assert set(footer(keys)) == {command.title for command in commands if command.is_shown}
            assert set(footer(keys)) <= {*titles, "All"}
            assert {c.title for c in commands if not c.is_cursor} <= {*titles, "All"}
            assert len(titles) == len(set(titles))
            rows = help_rows(keys.desk.screen)
            await keys.press("question_mark")
            assert isinstance(keys.desk.screen, HelpDialog) and keys.desk.screen.keys == rows
            await keys.press("escape", "tab")


async def test_only_commands_that_work_are_offered(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        assert not {"Base", "A/B", "Remove effect"} & set(palette(keys))  # the design is its own base, without effects
        await keys.press("down", "down", "right")
        assert {"Base", "A/B"} <= set(palette(keys)) and "A/B" in footer(keys)
        keys.desk.query_one(DesignPanel)._add_effect("free_play primary_lateral")
        await keys.wait_until_idle()
        assert "Remove effect" in palette(keys)
        await keys.press("f4")
        assert "Start" in footer(keys) and not {"Pause", "Stop", "Take", "x axis"} & set(palette(keys))
        await keys.press("f3")
        assert not {"Start", "Pause", "Stop", "Take", "Report"} & set(palette(keys))
        panel = keys.desk.query_one(OptimisePanel)
        await keys.press("f4")
        await keys.pilot.press("s")
        await keys.wait_until(lambda: bool(panel.generations))
        await keys.pilot.pause()
        assert {"Pause", "Stop"} <= set(footer(keys)) and "Start" not in footer(keys)
        assert max(key.region.right for key in keys.desk.query_one(Footer).query(FooterKey)) <= 80
        await keys.pilot.press("k")
        await keys.wait_until(lambda: panel.job is None)
        await keys.wait_until_idle()
        assert "Start" in footer(keys) and "Pause" not in palette(keys)


async def test_the_palette_runs_a_command_of_the_focused_pane_which_is_enlarged_by_a_key(
    open_desk: OpenDesk, bogie: Path
) -> None:
    async with open_desk(bogie, size=(160, 48)) as keys:
        plot = keys.desk.query_one("#view0", Plot)
        plot.focus()
        await keys.wait_until_idle()
        await keys.press("ctrl+p")
        await keys.type("zoom in")
        await keys.press("enter", "enter")
        await keys.wait_until_idle()
        assert plot.window[1] - plot.window[0] == pytest.approx(0.5)
        for widget in (keys.desk.query_one("#view2", Plot), keys.desk.query_one(Form)):
            before = widget.outer_size
            widget.focus()
            await keys.press("z")
            assert keys.desk.screen.maximized is not None and widget.outer_size.height > before.height
            assert widget.has_focus
            await keys.press("z")
            assert keys.desk.screen.maximized is None and widget.outer_size == before and widget.has_focus
