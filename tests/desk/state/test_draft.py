"""Drafts and plans: undo and redo, differences from the file, saving, bounds."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from railui.desk.state.draft import Draft, FileChanged
from railui.desk.state.plan import Plan, default_bounds
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import load_design
from railui.vehicle.effects import PlacedEffect
from tests.desk.conftest import REPOSITORY

PLAY = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4})


def test_a_new_revision_discards_undone_ones(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    draft.undo()
    draft.set("vehicle.frame.mass", 3100.0)
    assert draft.redo() is None and draft.design.value("vehicle.frame.mass") == 3100.0


def test_fields_name_the_source_of_their_values(bogie: Path) -> None:
    fields = {field.path: field for field in Draft.load(bogie).fields()}
    line = 1 + next(i for i, text in enumerate(bogie.read_text().splitlines()) if "wheel_load" in text)
    assert fields["vehicle.wheel_load"].source == f"test_bogie.yaml:{line}"
    assert fields["contact.gauge_widens_clearance"].choices == (False, True)
    assert fields["riding.cushion_frequency"].value is None


def test_a_slider_of_a_wide_range_is_logarithmic(bogie: Path) -> None:
    field = next(f for f in Draft.load(bogie).fields() if f.path == "vehicle.primary.lateral_stiffness")
    assert field.is_logarithmic and field.value_at(0.0) == 1e5 and field.value_at(1.0) == 1e8
    assert field.value_at(0.5) == pytest.approx(3.16e6)  # sqrt(1e5 x 1e8), three digits
    assert field.position(field.value_at(0.3)) == pytest.approx(0.3, abs=0.01)


def test_adding_and_removing_an_effect_leaves_the_file_unchanged(bogie: Path) -> None:
    draft, text = Draft.load(bogie), bogie.read_text()
    draft.add_effect(PLAY)
    draft.save()
    assert [e.kind for e in load_design(bogie).effects] == ["free_play"]
    draft.set("effects.0.half_width", "0.5 mm")
    draft.save()
    assert load_design(bogie).value("effects.0.half_width") == 5e-4
    draft.remove_effect(0)
    draft.save()
    assert not load_design(bogie).effects and bogie.read_text().startswith(text.rstrip("\n"))


def test_saving_under_another_name_preserves_comments(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    other = draft.save_as(bogie.with_name("other.yaml"))
    assert "# m_b, I_zb" in other.read_text() and load_design(bogie).value("vehicle.frame.mass") == 2900.0
    assert not draft.is_modified and draft.name == "other.yaml"


def test_a_deleted_file_is_reported(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    bogie.unlink()
    with pytest.raises(FileChanged, match="no longer there"):
        draft.save()


def test_a_rejected_value_changes_nothing(bogie: Path) -> None:
    draft = Draft.load(bogie)
    with pytest.raises(FileProblems):
        draft.set("vehicle.frame.mass", "-1 kg")
    assert not draft.is_modified and len(draft.states.revisions) == 1


def test_default_bounds_are_a_quarter_and_four_times_the_value(bogie: Path) -> None:
    design = load_design(bogie)
    assert default_bounds(design, "vehicle.primary.lateral_stiffness") == (7.5e5, 1.2e7)


def test_a_plan_rejects_bounds_in_the_wrong_order(bogie: Path) -> None:
    plan = Plan.for_design(load_design(bogie), "erri_b176_low", 40.0)
    with pytest.raises(ValueError, match="not below"):
        plan.with_value("bounds.vehicle.primary.lateral_stiffness.lowest", "20 MN/m")


def test_saving_a_design_with_profiles_computes_no_contact_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(REPOSITORY / "designs/profiles", tmp_path / "profiles")
    draft = Draft.load(Path(shutil.copy(REPOSITORY / "designs/profiled_bogie.yaml", tmp_path)))
    draft.set("vehicle.primary.lateral_stiffness", "5 MN/m")
    draft.set("vehicle.wheel_load", "70 kN")
    draft.set("contact.profiles.gauge", "1437 mm")

    def computed(*_: object) -> None:
        raise AssertionError("the contact geometry takes 0.4 s to seconds: the interface would stop")

    monkeypatch.setattr("railui.contact.contact_points.find_contacts", computed)
    draft.save()
    assert not draft.is_modified
    (tmp_path / "other").mkdir()
    draft.save_as(tmp_path / "other/bogie.yaml")
    assert draft.path == tmp_path / "other/bogie.yaml" and not draft.is_modified
