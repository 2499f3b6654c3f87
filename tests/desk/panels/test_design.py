"""A day's work: a design is opened, changed, compared, undone, saved; with keys alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.desk.panels.design import DesignPanel
from railui.desk.widgets.dialogs import Ask, Faults
from railui.desk.widgets.form import Form, Head
from railui.desk.widgets.plot import Plot
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY, Sitting

pytestmark = pytest.mark.asyncio
STIFFNESS = "vehicle.primary.lateral_stiffness"


async def test_a_design_is_opened_changed_and_saved_within_thirteen_keys(sit: Sitting, bogie: Path) -> None:
    text = bogie.read_text()
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.looks is not None
        before = panel.looks[0].quality["score"]
        await keys.press("slash")
        await keys.type("pri")
        await keys.press("enter")
        assert panel.query_one(Form).field is not None
        assert panel.query_one(Form).field.path == STIFFNESS
        await keys.type("5 MN/m")
        await keys.press("enter")
        assert panel.draft is not None and panel.draft.design.value(STIFFNESS) == 5e6
        assert panel.looks[0].quality["score"] != before  # the design was ridden anew
        assert panel.looks[1].quality["score"] == before  # beside its base
        await keys.press("ctrl+s")
        assert keys.count <= 13
    assert load_design(bogie).value(STIFFNESS) == 5e6
    # one number is another, the rest is as somebody wrote it
    assert bogie.read_text() == text.replace("lateral_stiffness: 3.0 MN/m, longi", "lateral_stiffness: 5 MN/m, longi")


async def test_a_slide_is_one_step_to_undo(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None
        panel.query_one(Form).choose(STIFFNESS)
        await keys.press("right", "right", "right")
        assert panel.draft.design.value(STIFFNESS) > 3e6 and panel.draft.dirty
        await keys.press("ctrl+z")
        assert panel.draft.design.value(STIFFNESS) == 3e6 and not panel.draft.dirty
        await keys.press("ctrl+y")
        assert panel.draft.design.value(STIFFNESS) > 3e6


async def test_a_and_b_change_places(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None
        panel.query_one(Form).choose(STIFFNESS)
        await keys.press("right", "x")
        assert panel.draft.design.value(STIFFNESS) == 3e6 and panel.draft.base.value(STIFFNESS) > 3e6
        await keys.press("x")
        assert panel.draft.design.value(STIFFNESS) > 3e6 and panel.draft.base.value(STIFFNESS) == 3e6


async def test_a_wrong_number_is_told_with_its_remedy_and_changes_nothing(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None
        panel.query_one(Form).choose(STIFFNESS)
        await keys.type("5 kg")
        await keys.press("enter")
        assert "N/m" in panel.side.trouble and not panel.draft.dirty
        assert panel.side.entry.has_focus  # what was typed is still there to mend
        await keys.press("escape")
        assert panel.query_one(Form).has_focus


async def test_an_effect_of_the_catalogue_is_added_and_saved(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        await keys.press("a")
        await keys.type("free play primary lateral")
        await keys.press("enter")
        panel = keys.desk.query_one(DesignPanel)
        assert panel.query_one(Form).field is not None
        assert panel.query_one(Form).field.path == "effects.0.half_width"
        await keys.type("0.4 mm")
        await keys.press("enter", "ctrl+s")
    (effect,) = load_design(bogie).effects
    assert (effect.kind, effect.at, effect.parameters["half_width"]) == ("free_play", "primary_lateral", 0.4e-3)


async def test_a_vehicle_that_leaves_the_track_is_told_and_drawn(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.set("case.speed", "90 m/s")
        await keys.settle()
        assert panel.looks is not None and panel.looks[0].quality["class"] == "dangerous"
        assert "DANGEROUS" in "".join(strip.text for strip in keys.desk.screen._compositor.render_strips())
        assert all(plot.picture.lines for plot in panel.query(Plot) if plot.display)


async def test_a_faulty_file_shows_its_faults_where_they_stand(sit: Sitting, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("vehicle:\n  frame: {mass: 2900 N, yaw_inertia: 3300}\n")
    async with sit(wrong) as keys:
        assert isinstance(keys.desk.screen, Faults)
        assert "wrong.yaml:2:" in str(keys.desk.screen._text())
        await keys.press("escape")
        assert not isinstance(keys.desk.screen, Faults)


async def test_a_file_that_somebody_else_changed_is_not_overwritten(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.set(STIFFNESS, 4e6)
        theirs = bogie.read_text() + "# theirs\n"
        bogie.write_text(theirs)
        await keys.press("ctrl+s")
        assert bogie.read_text() == theirs
        assert panel.draft is not None and panel.draft.dirty


async def test_quitting_asks_where_something_would_be_lost(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        keys.desk.query_one(DesignPanel).set(STIFFNESS, 4e6)
        await keys.press("ctrl+q")
        assert isinstance(keys.desk.screen, Ask)
        await keys.press("c")
        assert not isinstance(keys.desk.screen, Ask) and keys.desk.is_running


@pytest.mark.parametrize("size", [(160, 48), (120, 40), (80, 24), (60, 18), (40, 12), (10, 4), (1, 1)])
async def test_no_size_is_too_small_or_too_large(sit: Sitting, bogie: Path, size: tuple[int, int]) -> None:
    async with sit(bogie, size=size) as keys:
        assert keys.desk.query_one("#small").display == (size[0] < 60 or size[1] < 18)
        await keys.pilot.resize_terminal(10, 4)
        await keys.pilot.resize_terminal(*size)
        await keys.settle()
        shown = [plot for plot in keys.desk.query_one(DesignPanel).query(Plot) if plot.display]
        assert 1 <= len(shown) <= 6


async def test_a_contact_of_measured_profiles_says_what_it_comes_from(sit: Sitting) -> None:
    async with sit(REPOSITORY / "designs/profiled_bogie.yaml") as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None and panel.looks is not None
        heads = [row.text for row in panel._rows(panel.draft) if isinstance(row, Head)]
        assert "contact: s1002 on 60e1, table" in heads
        sources = {field.path: field.source for field in panel.draft.fields()}
        assert sources["contact.leading.conicity"] == "s1002 on 60e1, sd 2 mm"
        panel.set("contact.leading.conicity", "0.3")
        sources = {field.path: field.source for field in panel.draft.fields()}
        assert sources["contact.leading.conicity"] == "typed: the table of the profiles is scaled to it"


async def test_a_vehicle_of_bodies_rides_on_the_desk(sit: Sitting) -> None:
    async with sit(REPOSITORY / "designs/bogie_under_coach.yaml") as keys:
        panel = keys.desk.query_one(DesignPanel)
        assert panel.draft is not None and panel.looks is not None
        heads = [row.text for row in panel._rows(panel.draft) if isinstance(row, Head)]
        assert {"body", "frame", "primary", "anti roll bar"} <= set(heads)
        before = panel.looks[0].quality["score"]
        panel.set("vehicle.elements.secondary.lateral_stiffness", "0.4 MN/m")
        await keys.settle()
        assert panel.looks[0].quality["score"] != before == panel.looks[1].quality["score"]


async def test_no_letter_of_a_quick_hand_is_lost(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.side.form.choose("vehicle.wheel_load")
        await keys.settle()
        for key in ("7", "0", "space", "k", "N", "enter"):  # at once, as a paste or a slow line delivers them
            keys.desk.simulate_key(key)
        await keys.settle()
        assert panel.draft is not None and panel.draft.design.value("vehicle.wheel_load") == 70e3
        assert not panel.side.entry.display


async def test_a_dialog_is_answered_once_however_often_enter_is_pressed(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        await keys.press("slash")
        for _ in range(3):
            keys.desk.simulate_key("enter")
        await keys.settle()
        assert len(keys.desk.screen_stack) == 1
