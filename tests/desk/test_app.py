"""Desk as a whole: session state, command palette, mouse, copying, errors."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.command import CommandPalette
from textual.content import Content
from textual.widgets import Static
from textual.widgets._toast import Toast

from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.design import DesignPanel
from railui.desk.presenters.search_plots import warnings_text
from railui.desk.widgets.dialogs import ChoiceDialog, HelpDialog
from railui.desk.widgets.form import Form
from railui.desk.widgets.plot import Plot
from tests.desk.conftest import OpenDesk

pytestmark = pytest.mark.asyncio
MASS = "vehicle.frame.mass"


async def test_the_next_session_restores_file_speed_and_theme(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.set("case.speed", "50 m/s")
        keys.desk.theme = "nord"
        await keys.press("ctrl+q")
    async with open_desk() as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None and panel.draft.file.source == bogie.resolve()
        assert panel.conditions.speed == 50.0 and keys.desk.theme == "nord"


async def test_square_brackets_are_literal_and_an_unreadable_state_file_is_ignored(
    open_desk: OpenDesk, bogie: Path, tmp_path: Path
) -> None:
    (tmp_path / "state/railui").mkdir(parents=True)
    (tmp_path / "state/railui/desk.json").write_text("{not json")
    named = bogie.rename(bogie.with_name("a [bold]b.yaml"))
    async with open_desk(named) as keys:
        keys.desk.notify("add `yw [m]`, or [/b]")
        await keys.wait_until(lambda: len(keys.desk._notifications) > 0, 10.0)
        (toast,) = [Toast(notification) for notification in keys.desk._notifications]
        assert "`yw [m]`, or [/b]" in str(toast.render())
        assert "a [bold]b" in str(keys.desk.query_one("#status", Static).render())
        title = keys.desk.query_one(DesignPanel).pane.border_title
        assert Content.from_markup(str(title)).plain.startswith("a [bold]b.yaml")


async def test_warnings_are_a_list_with_short_names_of_parameters() -> None:
    path = "vehicle.elements.primary.longitudinal_stiffness"
    lines = warnings_text([f"the knee is at the lower bound of {path}, 3 MN/m", "no curve"]).splitlines()
    assert lines == ["! the knee is at the lower bound of longitudinal stiffness primary, 3 MN/m", "! no curve"]


async def test_a_note_goes_with_its_panel(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(80, 24)) as keys:
        keys.desk.notify("a note")
        await keys.wait_until(lambda: len(keys.desk._notifications) > 0, 10.0)
        await keys.press("f5")
        await keys.wait_until(lambda: len(keys.desk._notifications) == 0, 2.0)


async def test_the_desk_asks_for_a_file_if_none_is_given(
    open_desk: OpenDesk, bogie: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bogie.parent)
    async with open_desk() as keys:
        assert isinstance(keys.desk.screen, ChoiceDialog)
        await keys.press("enter")
        assert keys.desk.query_one(DesignPanel).draft is not None


async def test_an_internal_error_in_a_job_is_shown_and_logged(
    open_desk: OpenDesk, bogie: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)

        def fails(*_: object) -> None:
            raise KeyError("on purpose")

        monkeypatch.setattr("railui.desk.presenters.design_results.evaluate_design", fails)
        panel.set(MASS, 3000.0)
        await keys.wait_until_idle()
        assert "on purpose" in panel.pane.error and panel.results is not None  # the last plots stay
        assert "on purpose" in (tmp_path / "state/railui/desk.log").read_text()


async def test_a_rig_cannot_run_on_a_track(open_desk: OpenDesk, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text("vehicle: {rig: {mass: 95 kg, stiffness: 4 kN/m}}\n")
    async with open_desk(rig) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert "rides no track" in panel.pane.error
        await keys.press("f4", "f5", "f2")


async def test_palette_help_and_copying(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        titles = {command.title for command in keys.desk.get_system_commands(keys.desk.screen)}
        assert {"Undo", "Effect", "Save as", "Campaign panel", "Heartbeat", "Find"} <= titles
        assert not {binding.description for binding in CampaignPanel.BINDINGS[:3]} & titles
        await keys.press("ctrl+p")
        assert isinstance(keys.desk.screen, CommandPalette)
        await keys.press("escape", "f1")
        assert isinstance(keys.desk.screen, HelpDialog) and len(keys.desk.screen.texts) == 2
        assert ("]", "Page: overview, stability, speed, map, ...") in keys.desk.screen.keys
        await keys.press("escape")
        keys.desk.query_one(Form).select(MASS)
        await keys.press("ctrl+c")
        assert keys.desk.clipboard == "2900 kg"
        keys.desk.query_one("#view0", Plot).focus()
        await keys.press("right", "Y")
        assert keys.desk.clipboard.startswith("line\tf [Hz]\te₁ [mm²/Hz]\n")
