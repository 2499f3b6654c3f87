"""Profiles in a design: supplied parameters, overrides, saving, faults."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator

import railui
from railui.contact.contact_points import find_contacts
from railui.contact.linearisation import linearise
from railui.contact.profile import Profile
from railui.desk.state.draft import Draft
from railui.documents.check import check
from railui.documents.saving import save_design
from railui.documents.schema import json_schema
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import Design, load_design
from tests.contact.shapes import coned_wheel, cones, round_rail, worn_wheel

HOME = Path(__file__).parents[2]
TRACK, ROUGH = "erri_b176_low length=600 seed=1", "erri_b176_high length=2000 seed=1"


def write(path: Path, profile: Profile) -> None:
    rows = [f"{y * 1e3:.9g}, {h * 1e3:.9g}" for y, h in zip(profile.y, profile.h, strict=True)]
    path.write_text("y [mm], z [mm]\n" + "\n".join(rows) + "\n")


@pytest.fixture
def home(tmp_path: Path) -> Path:
    write(tmp_path / "wheel.txt", coned_wheel(0.05))
    write(tmp_path / "worn.txt", worn_wheel())
    write(tmp_path / "rail.txt", round_rail())
    return tmp_path


def design(home: Path, contact: str, name: str = "design.yaml", bodies: bool = False) -> Path:
    """Return the check bogie with another contact."""
    text = (HOME / f"designs/{'bogie_under_coach' if bodies else 'test_bogie'}.yaml").read_text("utf-8")
    path = home / name
    path.write_text(re.sub(r"contact:\n(?:  .*\n)+", f"contact:\n{contact}\n", text), "utf-8")
    return path


PAIR = "  profiles: {wheel: wheel.txt, rail: rail.txt, gauge: 1435 mm, sd: 1.5 mm"


def test_profiles_supply_parameters_that_the_design_omits(home: Path) -> None:
    result = load_design(design(home, f"{PAIR}}}")).values
    expected = linearise(find_contacts(cones(0.05)), 1.5e-3)
    for where in ("leading", "trailing"):
        assert result[f"contact.{where}.conicity"] == pytest.approx(expected.conicity, rel=1e-6)
        assert result[f"contact.{where}.gravitational_stiffness"] == pytest.approx(
            expected.gravitational_stiffness, rel=1e-4
        )
        assert result[f"contact.{where}.roll"] == pytest.approx(expected.roll, rel=1e-6)
        assert 50 < result[f"contact.{where}.lateral_creep"] < result[f"contact.{where}.longitudinal_creep"] < 300
    assert result["contact.flange_clearance"] == pytest.approx(5.65e-3, abs=1e-4)


def test_parameters_of_the_design_override_its_profiles(home: Path) -> None:
    result = load_design(design(home, f"{PAIR}}}\n  leading: {{conicity: 0.3}}\n  flange_clearance: 8 mm")).values
    assert result["contact.leading.conicity"] == 0.3
    assert result["contact.trailing.conicity"] == pytest.approx(0.0527, abs=2e-4)
    assert result["contact.flange_clearance"] == 0.008


def test_the_table_of_a_cone_gives_the_ride_of_its_linear_model(home: Path) -> None:
    wheel = design(home, f"{PAIR}, use: table}}")
    straight = design(home, f"{PAIR}, use: linearised}}", "linear.yaml")
    table, linear = load_design(wheel), load_design(straight)
    assert [e.kind for e in table.effects] == ["profile_shape"] and linear.effects == ()
    radius, grid = (np.array(table.effects[0].parameters[key]) for key in ("radius", "displacement"))
    # away from the flanges, where a contact patch rounds off the jump
    inside = np.abs(grid) < 5e-3
    assert radius[inside] == pytest.approx(grid[inside], abs=2e-5)
    scores = [railui.ride(d, TRACK, 40.0)["weighted_acceleration"] for d in (table, linear)]
    assert scores[0] == pytest.approx(scores[1], rel=0.02)


def test_the_table_of_a_worn_wheel_is_nonlinear(home: Path) -> None:
    pair = PAIR.replace("wheel.txt", "worn.txt")
    rides = [
        railui.ride(load_design(design(home, f"{pair}, use: {use}}}")), ROUGH, 40.0)["weighted_acceleration"]
        for use in ("table", "linearised")
    ]
    assert abs(rides[0] / rides[1] - 1.0) > 0.01


def test_a_saved_design_refers_to_its_profiles_by_relative_path(home: Path) -> None:
    there = home / "elsewhere"
    there.mkdir()
    first = load_design(design(home, f"{PAIR}}}"))
    save_design(first.with_values({"contact.leading.conicity": 0.2}), there / "saved.yaml")
    again = load_design(there / "saved.yaml")
    assert again.values == {**first.values, "contact.leading.conicity": 0.2}
    assert again.effects == first.effects
    assert yaml.safe_load((there / "saved.yaml").read_text())["contact"]["profiles"]["wheel"] == "../wheel.txt"
    assert again.profiles is not None and again.profiles.sha256 is not None


def test_a_saved_design_without_its_profiles_loads_with_a_warning(home: Path) -> None:
    save_design(load_design(design(home, f"{PAIR}}}")), home / "saved.yaml")
    (home / "wheel.txt").unlink()
    again = load_design(home / "saved.yaml")
    assert any("cannot be read" in str(w) and "are used without it" in str(w) for w in again.warnings)
    with pytest.raises(FileProblems, match=r"contact\.profiles: .*wheel\.txt cannot be read"):
        load_design(home / "design.yaml")


@pytest.mark.parametrize("contact", ["", "\n  leading: {roll: 0.04}\n  trailing: {}", "\n  wheels: {conicity: 0.2}"])
def test_profiles_apply_to_all_wheelsets_of_a_multibody_vehicle(home: Path, contact: str) -> None:
    result: Design = load_design(design(home, f"{PAIR}}}{contact}", bodies=True))
    groups = {path.split(".")[1] for path in result.values if path.count(".") == 2 and path.startswith("contact.")}
    assert groups - {"profiles"} == ({"leading", "trailing"} if "leading" in contact else {"wheels"})
    assert [e.kind for e in result.effects][-1] == "profile_shape"
    ridden = railui.ride(result, TRACK, 40.0)
    assert ridden["score"] is not None


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("wheel: wheel.txt", "contact.profiles.rail: is missing"),
        ("wheel: wheel.txt, rail: nowhere.txt", "nowhere.txt cannot be read"),
        ("wheel: wheel.txt, rail: rail.txt, gage: 1435 mm", "unknown key, did you mean 'gauge'"),
        ("wheel: wheel.txt, rail: rail.txt, inclination: 1:0", "not an inclination"),
        ("wheel: wheel.txt, rail: rail.txt, use: tabel", "did you mean 'table'"),
        ("wheel: wheel.txt, rail: rail.txt, gauge: 1405 mm", "rests on its flange"),
        ("wheel: rail.txt, rail: wheel.txt", "that is a rail"),
    ],
)
def test_faults_are_reported_at_their_key(home: Path, words: str, expected: str) -> None:
    with pytest.raises(FileProblems) as error:
        load_design(design(home, f"  profiles: {{{words}}}"))
    assert expected in str(error.value)
    assert len(error.value.problems) <= 2 and "contact.leading" not in str(error.value)
    assert all(problem.line for problem in error.value.problems if problem.file.endswith(".yaml"))


def test_the_schema_allows_profiles_and_omitted_parameters(home: Path) -> None:
    known = Draft202012Validator(json_schema("design"))
    for bodies in (False, True):
        data = yaml.safe_load(design(home, f"{PAIR}}}\n  leading: {{roll: 0.04}}", bodies=bodies).read_text())
        assert list(known.iter_errors(data)) == []
        data["contact"]["profiles"]["gage"] = 1.435
        assert list(known.iter_errors(data))
    del data["contact"]["profiles"]
    assert list(known.iter_errors(data))


def test_profiles_can_be_checked(home: Path) -> None:
    (home / "bad.prr").write_text("spline.begin\npoint.begin\n 1.0 x\npoint.end\n")
    (problem,) = check([home / "bad.prr"])
    assert (problem.line, problem.message) == (3, "'x' is not a number")


def test_a_draft_saved_elsewhere_still_refers_to_its_profiles(home: Path) -> None:
    there = home / "elsewhere"
    there.mkdir()
    draft = Draft.load(design(home, f"{PAIR}}}"))
    draft.set("contact.leading.conicity", 0.1)
    again = load_design(draft.save_as(there / "other.yaml"))
    assert again.values == draft.design.values and again.effects == draft.design.effects
    assert again.profiles is not None and again.profiles.wheel == home / "wheel.txt"


def test_a_draft_without_its_table_is_linearised(home: Path) -> None:
    draft = Draft.load(design(home, f"{PAIR}}}"))
    draft.remove_effect(0)
    assert load_design(draft.save()).effects == ()
    again = save_design(draft.design, home / "again.yaml")
    assert load_design(again).effects == ()


def test_wheels_rails_and_radius_tables_are_recognised(home: Path) -> None:
    (home / "t.csv").write_text("y [mm],delta_r [mm]\n" + "\n".join(f"{y},{0.1 * y:.2f}" for y in range(-6, 7)))
    assert check([home / "wheel.txt", home / "rail.txt", home / "t.csv"]) == []
    (home / "t.csv").write_text("y [mm],delta_r [mm]\n1,1\n0,1\n2,1\n")
    (home / "wheel.txt").write_text("y [mm], z [mm]\n1, 2\n3, four\n")
    lines = {(Path(p.file).name, p.line) for p in check([home / "wheel.txt", home / "t.csv"])}
    assert lines >= {("wheel.txt", 3), ("t.csv", 3)}
