"""A draft: steps forward and back, what differs from its file, and the file edited at its marks."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.desk.state.draft import Draft, Moved
from railui.desk.state.plan import Plan, first_bounds
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect

PLAY = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4})


def test_a_new_step_forgets_what_was_undone(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    draft.undo()
    draft.set("vehicle.frame.mass", 3100.0)
    assert draft.redo() is None and draft.design.value("vehicle.frame.mass") == 3100.0


def test_the_fields_say_where_every_number_comes_from(bogie: Path) -> None:
    fields = {field.path: field for field in Draft.load(bogie).fields()}
    line = 1 + next(i for i, text in enumerate(bogie.read_text().splitlines()) if "wheel_load" in text)
    assert fields["vehicle.wheel_load"].source == f"test_bogie.yaml:{line}"
    assert fields["contact.gauge_widens_clearance"].choices == (False, True)
    assert fields["riding.cushion_frequency"].value is None


def test_a_slider_walks_wide_ranges_by_decades(bogie: Path) -> None:
    field = next(f for f in Draft.load(bogie).fields() if f.path == "vehicle.primary.lateral_stiffness")
    assert field.log and field.at(0.0) == 1e5 and field.at(1.0) == 1e8
    assert field.at(0.5) == pytest.approx(3.16e6)  # sqrt(1e5 x 1e8), three digits
    assert field.place(field.at(0.3)) == pytest.approx(0.3, abs=0.01)


def test_an_effect_added_and_removed_leaves_the_file_as_it_was(bogie: Path) -> None:
    draft, text = Draft.load(bogie), bogie.read_text()
    draft.with_effect(PLAY)
    draft.save()
    assert [e.kind for e in load_design(bogie).effects] == ["free_play"]
    draft.set("effects.0.half_width", "0.5 mm")
    draft.save()
    assert load_design(bogie).value("effects.0.half_width") == 5e-4
    draft.without_effect(0)
    draft.save()
    assert not load_design(bogie).effects and bogie.read_text().startswith(text.rstrip("\n"))


def test_saving_under_a_name_keeps_the_comments(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    other = draft.save_as(bogie.with_name("other.yaml"))
    assert "# m_b, I_zb" in other.read_text() and load_design(bogie).value("vehicle.frame.mass") == 2900.0
    assert not draft.dirty and draft.name == "other.yaml"


def test_a_file_that_is_gone_is_told(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    bogie.unlink()
    with pytest.raises(Moved, match="no longer there"):
        draft.save()


def test_a_value_that_does_not_fit_changes_nothing(bogie: Path) -> None:
    draft = Draft.load(bogie)
    with pytest.raises(FileProblems):
        draft.set("vehicle.frame.mass", "-1 kg")
    assert not draft.dirty and len(draft.steps) == 1


def test_a_variable_first_goes_to_four_times_its_value_either_way(bogie: Path) -> None:
    design = load_design(bogie)
    assert first_bounds(design, "vehicle.primary.lateral_stiffness") == (7.5e5, 1.2e7)


def test_a_plan_refuses_bounds_that_run_backwards(bogie: Path) -> None:
    plan = Plan.of(load_design(bogie), "erri_b176_low", 40.0)
    with pytest.raises(ValueError, match="not below"):
        plan.changed("bounds.vehicle.primary.lateral_stiffness.lowest", "20 MN/m")
