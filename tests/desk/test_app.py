"""The desk as a whole: what it remembers, the palette, the mouse, copying, what it does not paint with."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.command import CommandPalette
from textual.content import Content
from textual.widgets import Static
from textual.widgets._toast import Toast

from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.design import DesignPanel
from railui.desk.widgets.dialogs import Ask, Help, Pick
from railui.desk.widgets.form import Form
from railui.desk.widgets.plot import Plot
from tests.desk.conftest import REPOSITORY, Sitting

pytestmark = pytest.mark.asyncio
MASS = "vehicle.frame.mass"


async def test_the_next_start_is_where_the_last_one_ended(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.set("case.speed", "50 m/s")
        keys.desk.theme = "nord"
        await keys.press("ctrl+q")
    async with sit() as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None and panel.draft.file.source == bogie.resolve()
        assert panel.case.speed == 50.0 and keys.desk.theme == "nord"


async def test_square_brackets_in_a_message_or_a_name_are_text(sit: Sitting, bogie: Path) -> None:
    named = bogie.rename(bogie.with_name("a [bold]b.yaml"))
    async with sit(named) as keys:
        keys.desk.notify("add `yw [m]`, or [/b]")
        await keys.until(lambda: len(keys.desk._notifications) > 0, 10.0)
        (toast,) = [Toast(told) for told in keys.desk._notifications]
        assert "`yw [m]`, or [/b]" in str(toast.render())
        assert "a [bold]b.yaml" in str(keys.desk.query_one("#status", Static).render())
        title = keys.desk.query_one(DesignPanel).side.border_title
        assert Content.from_markup(str(title)).plain.startswith("a [bold]b.yaml")


async def test_a_state_that_cannot_be_read_is_no_reason_to_fail(sit: Sitting, bogie: Path, tmp_path: Path) -> None:
    (tmp_path / "state/railui").mkdir(parents=True)
    (tmp_path / "state/railui/desk.json").write_text("{not json")
    async with sit(bogie) as keys:
        assert keys.desk.query_one(DesignPanel).looks is not None


async def test_every_key_of_a_panel_is_a_command_of_the_palette(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        told = {command.title for command in keys.desk.get_system_commands(keys.desk.screen)}
        assert {"Undo", "A/B", "Effect", "Save as", "Campaign", "Heartbeat", "Find"} <= told
        panels = keys.desk.query_one(DesignPanel), keys.desk.query_one(CampaignPanel)
        ours, theirs = ({key.description for key in panel.BINDINGS if key.description} for panel in panels)
        assert ours <= told and not theirs <= told
        await keys.press("ctrl+p")
        assert isinstance(keys.desk.screen, CommandPalette)


async def test_without_a_file_it_asks_for_one(sit: Sitting, bogie: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(bogie.parent)
    async with sit() as keys:
        assert isinstance(keys.desk.screen, Pick)
        await keys.press("enter")
        assert keys.desk.query_one(DesignPanel).draft is not None


async def test_help_tells_of_the_panel_and_of_what_has_the_keys(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        await keys.press("f1")
        assert isinstance(keys.desk.screen, Help)
        assert len(keys.desk.screen.texts) == 2 and ("x", "A/B") in keys.desk.screen.keys
        await keys.press("escape")


async def test_the_mouse_slides_a_value_too(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie, size=(160, 48)) as keys:
        panel, form = keys.desk.query_one(DesignPanel), keys.desk.query_one(Form)
        assert panel.draft is not None
        row = next(i for i, r in enumerate(form.rows) if getattr(r, "path", "") == MASS)
        begin, wide = form._rail(form.rows[row])  # type: ignore[arg-type]
        await keys.pilot.mouse_down(Form, offset=(begin + wide - 1, row))
        await keys.pilot.mouse_up(Form, offset=(begin + wide - 1, row))
        await keys.settle()
        assert panel.draft.design.value(MASS) == 20_000.0  # the end of the range


async def test_ctrl_c_copies_the_value_and_a_plot_its_table(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        keys.desk.query_one(Form).choose(MASS)
        await keys.press("ctrl+c")
        assert keys.desk.clipboard == "2900 kg"
        plot = keys.desk.query_one("#view0", Plot)
        plot.focus()
        await keys.press("right", "Y")
        assert keys.desk.clipboard.startswith("line\tf [Hz]\te₁ [mm²/Hz]\n")


async def test_quitting_while_a_loop_runs_asks_first(sit: Sitting) -> None:
    async with sit(REPOSITORY / "designs/campaigns/worn_axle_box") as keys:
        await keys.pilot.press("s")
        panel = keys.desk.query_one(CampaignPanel)
        await keys.until(lambda: panel.progress.turn is not None)
        await keys.pilot.press("ctrl+q")
        await keys.pilot.pause(0.3)
        assert isinstance(keys.desk.screen, Ask)
        await keys.pilot.press("c", "k")
        await keys.until(lambda: panel.study is None)


async def test_a_fault_of_a_worker_is_told_and_the_desk_goes_on(
    sit: Sitting, bogie: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)

        def fails(*_: object) -> None:
            raise KeyError("on purpose")

        monkeypatch.setattr("railui.desk.panels.design.look", fails)
        panel.set(MASS, 3000.0)
        await keys.settle()
        assert "on purpose" in panel.side.trouble and panel.looks is not None  # the last pictures stay
        assert "on purpose" in (tmp_path / "state/railui/desk.log").read_text()


async def test_a_rig_rides_no_track_and_is_told_so(sit: Sitting, tmp_path: Path) -> None:
    rig = tmp_path / "rig.yaml"
    rig.write_text("vehicle: {rig: {mass: 95 kg, stiffness: 4 kN/m}}\n")
    async with sit(rig) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert "rides no track" in panel.side.trouble
        await keys.press("f4", "f5", "f2")
