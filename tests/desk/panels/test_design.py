"""A day's work: a design is opened, changed, compared, undone, saved; with keys alone."""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from railui.contact import contact_points
from railui.desk.messages import DesignsEvaluated
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.profile_changes import ContactComputed
from railui.desk.widgets.dialogs import DifferenceDialog, ProblemsDialog, QuestionDialog
from railui.desk.widgets.form import Form, Heading
from railui.desk.widgets.plot import Plot
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY, OpenDesk

pytestmark = pytest.mark.asyncio
STIFFNESS = "vehicle.primary.lateral_stiffness"


async def test_a_design_is_edited_and_saved_within_thirteen_keys(open_desk: OpenDesk, bogie: Path) -> None:
    text = bogie.read_text()
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.results is not None
        before = panel.results[0].quality["score"]
        await keys.press("slash")
        await keys.type("pri")
        await keys.press("enter")
        assert panel.query_one(Form).field is not None
        assert panel.query_one(Form).field.path == STIFFNESS
        await keys.type("5 MN/m")
        await keys.press("enter")
        assert panel.draft is not None and panel.draft.design.value(STIFFNESS) == 5e6
        assert panel.results[0].quality["score"] != before  # the design was evaluated again
        assert panel.results[1].quality["score"] == before  # the base was not changed
        await keys.press("ctrl+s")
        assert keys.count <= 13
    assert load_design(bogie).value(STIFFNESS) == 5e6
    # only one number has changed
    assert bogie.read_text() == text.replace("lateral_stiffness: 3.0 MN/m, longi", "lateral_stiffness: 5 MN/m, longi")


async def test_a_rejected_value_shows_the_remedy_and_changes_nothing(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None
        panel.query_one(Form).select(STIFFNESS)
        await keys.type("5 kg")
        await keys.press("enter")
        assert "N/m" in panel.pane.error and not panel.draft.is_modified
        assert panel.pane.entry.has_focus  # the typed text stays for correction
        await keys.press("escape")
        assert panel.query_one(Form).has_focus
        panel.set(STIFFNESS, 4e6)
        await keys.press("ctrl+q")
        assert isinstance(keys.desk.screen, QuestionDialog)  # the design has unsaved changes
        await keys.press("c")
        assert not isinstance(keys.desk.screen, QuestionDialog) and keys.desk.is_running


async def test_an_effect_of_the_catalogue_is_added_and_saved(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        await keys.press("a")
        await keys.type("clearance primary lateral")
        await keys.press("enter")
        panel = keys.desk.query_one(DesignPanel)
        assert panel.query_one(Form).field is not None
        assert panel.query_one(Form).field.path == "effects.0.half_width"
        await keys.type("0.4 mm")
        await keys.press("enter", "ctrl+s")
    (effect,) = load_design(bogie).effects
    assert (effect.kind, effect.at, effect.parameters["half_width"]) == ("free_play", "primary_lateral", 0.4e-3)


async def test_problems_of_a_file_are_shown_with_their_lines(open_desk: OpenDesk, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("vehicle:\n  frame: {mass: 2900 N, yaw_inertia: 3300}\n")
    async with open_desk(wrong) as keys:
        assert isinstance(keys.desk.screen, ProblemsDialog)
        assert "wrong.yaml:2:" in str(keys.desk.screen.text())
        await keys.press("escape")
        assert not isinstance(keys.desk.screen, ProblemsDialog)


async def test_a_file_changed_by_another_program_is_not_overwritten(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.set(STIFFNESS, 4e6)
        changed_text = bogie.read_text() + "# changed_text\n"
        bogie.write_text(changed_text)
        await keys.press("ctrl+s")
        assert isinstance(keys.desk.screen, DifferenceDialog)
        assert f"{STIFFNESS}: 3 MN/m → 4 MN/m" in keys.desk.screen.lines
        await keys.press("enter")  # cancel
        assert bogie.read_text() == changed_text
        assert panel.draft is not None and panel.draft.is_modified
        await keys.press("ctrl+s", "n", "enter")  # another name, and the proposed one is the same: it asks again
        assert isinstance(keys.desk.screen, DifferenceDialog) and bogie.read_text() == changed_text
        await keys.press("w")  # the number of the form; the comment of the other program stays
        assert "# changed_text" in bogie.read_text() and load_design(bogie).value(STIFFNESS) == 4e6
        assert not panel.draft.is_modified


async def test_the_desk_accepts_every_terminal_size(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(160, 48)) as keys:
        for size in ((120, 40), (80, 24), (60, 18), (40, 12), (10, 4), (1, 1), (160, 48)):
            await keys.pilot.resize_terminal(*size)
            await keys.wait_until_idle()
            assert keys.desk.query_one("#too-small").display == (size[0] < 60 or size[1] < 18)
            shown = [plot for plot in keys.desk.query_one(DesignPanel).page.query(Plot) if plot.display]
            assert 1 <= len(shown) <= 6


async def test_contact_parameters_from_profiles_name_their_source(open_desk: OpenDesk) -> None:
    async with open_desk(REPOSITORY / "designs/profiled_bogie.yaml") as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None and panel.results is not None
        headings = [row.text for row in panel.pane.form.rows if isinstance(row, Heading)]
        assert "contact: s1002 on 60e1, table" in headings
        sources = {field.path: field.source for field in panel.draft.fields()}
        assert sources["contact.leading.conicity"] == "s1002 on 60e1, sd 2 mm"
        panel.set("contact.leading.conicity", "0.3")
        sources = {field.path: field.source for field in panel.draft.fields()}
        assert sources["contact.leading.conicity"] == "typed: scales the table of the profiles"


async def test_a_vehicle_of_bodies_and_elements_is_evaluated(open_desk: OpenDesk) -> None:
    async with open_desk(REPOSITORY / "designs/bogie_under_coach.yaml") as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None and panel.results is not None
        headings = [row.text for row in panel.pane.form.rows if isinstance(row, Heading)]
        assert {"body", "frame", "primary", "anti roll bar"} <= set(headings)
        before = panel.results[0].quality["score"]
        panel.set("vehicle.elements.secondary.lateral_stiffness", "0.4 MN/m")
        await keys.wait_until_idle()
        assert panel.results[0].quality["score"] != before == panel.results[1].quality["score"]


async def test_no_key_of_fast_typing_is_lost_and_a_dialog_is_answered_once(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.pane.form.select("vehicle.wheel_load")
        await keys.wait_until_idle()
        for key in ("7", "0", "space", "k", "N", "enter"):  # at once, as pasting or a slow connection delivers them
            keys.desk.simulate_key(key)
        await keys.wait_until_idle()
        assert panel.draft is not None and panel.draft.design.value("vehicle.wheel_load") == 70e3
        assert not panel.pane.entry.display
        await keys.press("slash")
        for _ in range(3):
            keys.desk.simulate_key("enter")
        await keys.wait_until_idle()
        assert len(keys.desk.screen_stack) == 1


async def test_late_curving_of_an_earlier_design_does_not_replace_the_results(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        earlier = panel.results
        panel.set(STIFFNESS, "5 MN/m")
        await keys.wait_until_idle()
        assert earlier is not None and panel.results is not None and panel.draft is not None
        score = panel.results[0].quality["score"]
        panel.post_message(DesignsEvaluated(*earlier, is_addition=True))  # computed while the design was changed
        await keys.wait_until_idle()
        assert panel.results[0].quality["score"] == score != earlier[0].quality["score"]
        assert panel.results[0].design.content() == panel.draft.design.content()
        assert panel.results[0].guiding_force is not None
        panel.set("case.speed", "90 m/s")
        await keys.wait_until_idle()
        assert panel.results[0].quality["class"] == "dangerous"
        assert "DANGEROUS" in "".join(strip.text for strip in keys.desk.screen._compositor.render_strips())
        assert all(plot.data.lines for plot in panel.page.query(Plot) if plot.display)


async def test_steps_of_the_gauge_of_profiles_count_and_do_not_stop_the_interface(
    open_desk: OpenDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads = []
    real = contact_points.find_contacts

    def find_contacts(*arguments: Any) -> Any:
        threads.append(threading.current_thread())
        return real(*arguments)

    monkeypatch.setattr(contact_points, "find_contacts", find_contacts)
    async with open_desk(REPOSITORY / "designs/profiled_bogie.yaml") as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None
        threads.clear()
        panel.pane.form.select("contact.profiles.gauge")
        field = panel.pane.form.field
        assert field is not None and isinstance(field.value, float)
        wanted = field.value
        for _ in range(3):  # at once, while the contact is computed
            wanted = replace(field, value=wanted).stepped(1)
            keys.desk.simulate_key("right")
        await keys.wait_until_idle()
        assert panel.draft.design.value("contact.profiles.gauge") == wanted
        assert threads and threading.main_thread() not in threads
        assert panel.results is not None and panel.results[0].design.content() == panel.draft.design.content()


async def test_a_pending_contact_is_dropped_where_the_design_changes(open_desk: OpenDesk) -> None:
    path = "contact.profiles.gauge"
    async with open_desk(REPOSITORY / "designs/profiled_bogie.yaml") as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None
        request = ContactComputed(path, panel.draft.design.value(path), "")
        reset, other = Form.ResetRequested(path), Form.ResetRequested(STIFFNESS)
        for action in (panel.action_redo, panel.action_swap, partial(panel._on_reset_requested, reset)):
            panel.profile_changes.pending = request
            action()
            assert panel.profile_changes.pending is None
        panel.profile_changes.pending = request
        panel._on_reset_requested(other)
        assert panel.profile_changes.pending is request
        await keys.wait_until_idle()
