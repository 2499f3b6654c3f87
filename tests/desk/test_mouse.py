"""Everything by mouse: files, sliders, footer, tabs, lists, headings and dialogs."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.command import CommandPalette
from textual.widgets import OptionList
from textual.widgets._footer import FooterKey

from railui.desk.panels.common import PanelTabs
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.widgets.dialogs import ChoiceDialog, DialogKeys, HelpDialog, InputDialog
from railui.desk.widgets.form import Form
from railui.desk.widgets.table import Table
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio
MASS = "vehicle.frame.mass"


async def click_footer(keys: Keyboard, name: str) -> None:
    """Click on a command of the footer."""
    await keys.pilot.click(next(key for key in keys.desk.query(FooterKey) if key.description == name))
    await keys.wait_until_idle()


async def click_text(keys: Keyboard, text: str) -> None:
    """Click where a text stands on the screen."""
    strips = keys.desk.screen._compositor.render_strips()
    x, y = next((strip.text.index(text), y) for y, strip in enumerate(strips) if text in strip.text)
    await keys.pilot.click(offset=(x + 1, y))
    await keys.wait_until_idle()


async def open_by_mouse(keys: Keyboard, name: str) -> None:
    """Choose a file in the dialog that is open."""
    assert isinstance(keys.desk.screen, ChoiceDialog)
    options = keys.desk.screen.query_one(OptionList)
    row = next(i for i in range(options.option_count) if name in str(options.get_option_at_index(i).prompt))
    await keys.pilot.click(OptionList, offset=(3, row))
    await keys.wait_until_idle()


async def test_a_design_is_changed_searched_taken_and_saved_by_mouse_only(
    open_desk: OpenDesk, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(study.parent)
    bogie = study.with_name("test_bogie.yaml")
    async with open_desk(size=(160, 48)) as keys:
        await open_by_mouse(keys, "test_bogie.yaml")
        panel, form = keys.desk.query_one(DesignPanel), keys.desk.query_one(Form)
        assert panel.draft is not None
        row = next(i for i, r in enumerate(form.rows) if getattr(r, "path", "") == MASS)
        begin, wide = form.slider_position(form.rows[row])  # type: ignore[arg-type]
        await keys.pilot.mouse_down(Form, offset=(begin + wide - 1, row))
        await keys.pilot.mouse_up(Form, offset=(begin + wide - 1, row))
        await keys.wait_until_idle()
        assert panel.draft.design.value(MASS) == 20_000.0  # the end of the range
        await click_footer(keys, "Save")
        assert load_design(bogie).value(MASS) == 20_000.0
        await click_text(keys, "Stability")
        assert panel.page.id == "stability"
        await click_text(keys, "Overview")
        await click_footer(keys, "Open")
        await open_by_mouse(keys, study.name)
        await search_and_take(keys)
        await click_footer(keys, "Save")
        assert isinstance(keys.desk.screen, InputDialog)
        await click_text(keys, "enter accept")
        saved = load_design(bogie.with_name(panel.draft.name))
        assert panel.draft.path is not None and saved.content() == panel.draft.design.content()


async def search_and_take(keys: Keyboard) -> None:
    """Search the plan that is open and take the design whose row is clicked."""
    panel, table = keys.desk.query_one(OptimisePanel), keys.desk.query_one("#designs", Table)
    form = keys.desk.query_one("#plan Form", Form)
    form.select("objectives.0.over")
    await keys.wait_until_idle()
    y = form.index - int(form.scroll_offset.y)
    await keys.pilot.click(form, offset=(form.render_line(y).text.index("›"), y))
    await keys.wait_until_idle()
    assert panel.plan is not None and panel.plan.objectives[0][1] == "worst"
    await click_footer(keys, "Start")
    await keys.wait_until(lambda: panel.result is not None)
    await keys.wait_until_idle()
    await click_footer(keys, "Front")
    assert panel.search_view.is_front_page
    first = table.head_count
    await keys.pilot.click(table, offset=(8, 1 + first))
    await keys.wait_until_idle()
    assert table.line == 0
    order = list(table.order)
    await keys.pilot.click(table, offset=(8, 1))  # a heading orders the rows, and again in the other direction
    await keys.pilot.click(table, offset=(8, 1))
    assert table.order == order[::-1] or len(order) == 1
    await click_footer(keys, "Take")
    assert keys.desk.panel.id == "design"


async def test_help_palette_and_dialogs_close_by_mouse(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(100, 30)) as keys:
        await click_footer(keys, "Help")
        assert isinstance(keys.desk.screen, HelpDialog)
        await click_text(keys, "esc back")
        assert len(keys.desk.screen_stack) == 1
        await click_footer(keys, "Effect")
        assert keys.desk.screen.query_one(DialogKeys).display
        await keys.pilot.click(offset=(0, 0))  # outside of the dialog
        await keys.wait_until_idle()
        assert len(keys.desk.screen_stack) == 1
        await click_footer(keys, "All")
        assert isinstance(keys.desk.screen, CommandPalette)
        await keys.press("escape")
        await keys.pilot.click(PanelTabs, offset=(len(" F2 Design ") + 3, 0))
        await keys.wait_until_idle()
        assert keys.desk.panel.id == "campaign"
