"""Keys of the desk: no step of a slider is lost, the cursor is visible, the focus is never empty, undo covers all."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import ContentSwitcher, Input, OptionList

from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.panels.vehicle_page import VehiclePage
from railui.desk.widgets.bars import Bar, Bars
from railui.desk.widgets.form import Form
from railui.desk.widgets.heat_map import HeatMap
from tests.desk.conftest import Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio
DAMPING = "vehicle.secondary.yaw_damping"


@pytest.fixture(autouse=True)
def short_track(tmp_path: Path) -> None:
    """Let the desk begin with a short track."""
    directory = tmp_path / "state/railui"
    directory.mkdir(parents=True)
    (directory / "desk.json").write_text(json.dumps({"track": "erri_b176_low length=200 seed=1"}))


def cursor_lines(widget: Widget) -> list[str]:
    """Return the lines of a widget whose every cell exchanges its colours."""
    strips: list[Strip] = [widget.render_line(y) for y in range(widget.scrollable_content_region.height)]
    reverse = [s.text for s in strips if s.text.strip() and all(seg.style and seg.style.reverse for seg in s)]
    return [text.strip() for text in reverse]


async def test_every_key_of_a_burst_moves_the_slider(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel, form = keys.desk.query_one(DesignPanel), keys.desk.query_one(Form)
        form.select(DAMPING)
        assert panel.draft is not None and form.field is not None
        slow = form.field
        for _ in range(10):  # at once, while the design is evaluated
            keys.desk.simulate_key("right")
        await keys.wait_until_idle()
        fast = panel.draft.design.value(DAMPING)
        assert fast == pytest.approx(slow.value_at(slow.position(30e3) + 10 * 0.02), rel=0.01)
        assert form.field.value == fast
        await keys.press("ctrl+z")  # one movement
        assert panel.draft.design.value(DAMPING) == 30e3
        await keys.type("80")
        assert "= 80 kN·m·s/rad" in str(panel.pane.query_one(".about").render())
        await keys.press("enter")
        assert panel.draft.design.value(DAMPING) == 80e3


async def test_undo_covers_speed_base_and_exchange(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel, form = keys.desk.query_one(DesignPanel), keys.desk.query_one(Form)
        assert panel.draft is not None
        start = panel.draft.states.current
        form.select("case.speed")
        await keys.press("right")
        form.select(DAMPING)
        await keys.press("right", "b", "right")
        changed, base = panel.draft.design, panel.draft.base
        await keys.press("x")
        assert panel.draft.design.content() == base.content() and panel.draft.base.content() == changed.content()
        assert panel.conditions.speed > 40 and panel.draft.base != start.base
        await keys.press(*["ctrl+z"] * 5)
        assert panel.draft.states.current == start and panel.conditions.speed == 40.0
        await keys.press(*["ctrl+y"] * 5)
        assert panel.conditions.speed > 40 and panel.draft.base != start.base


async def test_undo_covers_the_plan_and_backspace_restores_a_bound(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(OptimisePanel)
        await keys.press("f4")
        first = panel.plan
        assert first is not None
        await keys.press("right", "right")
        assert panel.plan is not None and panel.plan.bounds != first.bounds
        await keys.press("backspace")
        assert panel.plan.bounds == first.bounds  # the variable stays
        await keys.press("delete")
        assert len(panel.plan.bounds) == len(first.bounds) - 1
        await keys.press("g")
        assert len(panel.plan.objectives) == 3
        await keys.press(*["ctrl+z"] * 4)
        assert panel.plan == first


@pytest.mark.parametrize("themes", [["textual-dark", "textual-light", "ansi-dark"], ["plain"], ["no colour"]])
async def test_one_cursor_is_visible_in_every_theme(
    open_desk: OpenDesk, bogie: Path, themes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if themes == ["no colour"]:
        monkeypatch.setenv("NO_COLOR", "1")
    async with open_desk(bogie, plain=themes == ["plain"]) as keys:
        for theme in themes:
            if theme in keys.desk.available_themes:
                keys.desk.theme = theme
            await check_cursors(keys)


async def check_cursors(keys: Keyboard) -> None:
    """Check the cursor line of the form, of a dialog and of a list."""
    await keys.press("f2")
    form = keys.desk.query_one(Form)
    form.select("vehicle.frame.mass")
    form.focus()
    await keys.wait_until_idle()
    (line,) = cursor_lines(form)
    assert "mass" in line and line.startswith((">", "▸"))
    await keys.press("a")  # a dialog: its cursor, and that of the form is no longer marked as the active one
    (line,) = cursor_lines(keys.desk.screen.query_one(OptionList))
    assert line
    await keys.press("escape", "f6")
    bars = keys.desk.query_one("#channels", Bars)
    bars.show([Bar("1"), Bar("2")])
    bars.focus()
    await keys.press("up", "down")
    (line,) = cursor_lines(bars)
    assert line[1:].split()[0] == "2" and line.startswith((">", "▸"))


async def test_the_focus_is_never_empty(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(80, 24)) as keys:
        for key in ("f2", "f3", "f4", "f5", "f6"):
            await keys.press(key)
            assert keys.desk.focused is not None
            before = keys.desk.focused
            await keys.press(*(["v"] if key == "f6" else ["f", "v"]))  # `v` may hide the list that `f` focuses
            assert keys.desk.focused is not None and keys.desk.focused.is_on_screen
            before.focus()
            await keys.wait_until_idle()
            await keys.pilot.resize_terminal(40, 10)
            await keys.wait_until_idle()
            assert keys.desk.focused is not None
            await keys.pilot.resize_terminal(80, 24)
            await keys.wait_until_idle()
            assert keys.desk.focused is not None and keys.desk.panel in keys.desk.focused.ancestors


async def test_a_key_acts_while_the_pane_in_focus_is_being_hidden(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        page, pages = panel.query_one(VehiclePage), panel.query_one(ContentSwitcher)
        panel.show_page("map")
        keys.desk.query_one(HeatMap).focus()
        await keys.press("right_square_bracket")
        assert pages.current == "vehicle"
        page.is_playing = False
        keys.desk.screen.set_focus(None)
        keys.desk.simulate_key("p")  # before the next refresh
        await keys.wait_until(lambda: page.is_playing, 10.0)

        page.query_one("#schematic").focus()
        await keys.wait_until_idle()
        for _ in range(4):  # each hides the page of the key before
            keys.desk.simulate_key("right_square_bracket")
        await keys.wait_until(lambda: pages.current == "speed", 10.0)
        page.leave()


async def test_a_plot_is_exported_as_picture_and_table(
    open_desk: OpenDesk, bogie: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bogie.parent)
    async with open_desk(bogie) as keys:
        await keys.press("tab", "E", "enter")
        picture = bogie.with_name("displacement_spectrum.svg")
        root = ElementTree.parse(picture).getroot()
        texts = "".join(root.itertext())
        assert "e₁ [mm²/Hz]" in texts and "f [Hz]" in texts
        await keys.press("E")
        assert keys.desk.screen.query_one(Input).value == "displacement_spectrum_2.svg"
        keys.desk.screen.query_one(Input).value = "spectrum.csv"
        await keys.press("enter")
        head, *rows = bogie.with_name("spectrum.csv").read_text().splitlines()
        panel = keys.desk.query_one(DesignPanel)
        assert head == "line,f [Hz],e₁ [mm²/Hz]" and panel.results is not None
        assert len(rows) == len(panel.results[0].f)
