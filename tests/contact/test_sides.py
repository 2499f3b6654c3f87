"""Different profiles on both sides: mirror symmetry, cones of two slopes in closed form, the YAML form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator

import railui
from railui.contact.contact_points import find_contacts
from railui.contact.wheelset_on_track import WheelRailPair
from railui.documents.check import check
from railui.documents.saving import save_design
from railui.documents.schema import json_schema
from railui.io.problems import FileProblems
from railui.track.excitation import resolve_track
from railui.track.line import Track
from railui.vehicle.design_reader import load_design
from tests.contact.shapes import coned_wheel, round_rail, worn_wheel
from tests.contact.test_design import TRACK, design, write


@pytest.fixture
def home(tmp_path: Path) -> Path:
    for name, profile in (("a", coned_wheel(0.05)), ("b", worn_wheel()), ("r", round_rail()), ("s", round_rail(0.25))):
        write(tmp_path / f"{name}.txt", profile)
    return tmp_path


def sides(right: str, left: str, rails: tuple[str, str] = ("r", "s")) -> str:
    wheel, rail = (f"{{right: {x}.txt, left: {y}.txt}}" for x, y in ((right, left), rails))
    return f"  profiles: {{wheel: {wheel}, rail: {rail}, gauge: 1435 mm, sd: 1.5 mm, use: table}}"


def test_swapping_left_and_right_mirrors_the_contact() -> None:
    one = WheelRailPair(coned_wheel(0.05), round_rail(), left_wheel=worn_wheel(), left_rail=round_rail(0.25))
    other = WheelRailPair(worn_wheel(), round_rail(0.25), left_wheel=coned_wheel(0.05), left_rail=round_rail())
    a, b = find_contacts(one), find_contacts(other)
    assert a.displacement == pytest.approx(-b.displacement[::-1], abs=1e-12)
    assert a.delta_r == pytest.approx(-b.delta_r[::-1], abs=1e-8)
    assert a.roll == pytest.approx(-b.roll[::-1], abs=1e-8)
    assert a.angle[0] == pytest.approx(b.angle[1, ::-1], abs=1e-5)
    assert np.abs(a.delta_r + a.delta_r[::-1]).max() > 1e-5
    assert a.centre == pytest.approx(-b.centre, abs=1e-7)


def test_equal_sides_given_twice_are_one_pair() -> None:
    pair = WheelRailPair(worn_wheel(), round_rail())
    a, b = find_contacts(pair), find_contacts(replace(pair, left_wheel=worn_wheel(), left_rail=round_rail()))
    assert np.array_equal(a.delta_r, b.delta_r) and np.array_equal(a.roll, b.roll)


def test_cones_of_two_slopes_roll_by_the_mean_slope() -> None:
    # without roll r_1 - r_2 = (gamma_1 + gamma_2) e, and the contact angles are the slopes
    contacts = find_contacts(WheelRailPair(coned_wheel(0.03), round_rail(), left_wheel=coned_wheel(0.07)))
    n = np.abs(contacts.displacement) < 3e-3
    assert np.polyfit(contacts.displacement[n], contacts.delta_r[n], 1)[0] == pytest.approx(0.1, rel=0.06)
    # the wheelset leans, and its contact angles with it
    lean = contacts.roll[n]
    assert np.tan(contacts.angle[0, n] + lean) == pytest.approx(0.03, abs=2e-4)
    assert np.tan(contacts.angle[1, n] - lean) == pytest.approx(0.07, abs=2e-4)


def test_a_vehicle_with_swapped_sides_rides_the_mirrored_track(home: Path) -> None:
    both = [load_design(design(home, sides(*names), f"{names[0]}.yaml")) for names in ("ab",)]
    both += [load_design(design(home, sides("b", "a", ("s", "r")), "swapped.yaml"))]
    numbers = ("conicity", "gravitational_stiffness", "lateral_creep", "roll")
    for key in numbers:
        a, b = (each.values[f"contact.leading.{key}"] for each in both)
        assert a == pytest.approx(b, rel=1e-6)
    first = railui.simulate(both[0], TRACK, 40.0, ["e1", "e2"])
    line = resolve_track(TRACK).track
    mirrored = Track(line.s, -line.yw, -line.phiw, line.gauge)
    second = railui.simulate(both[1], mirrored, 40.0, ["e1", "e2"])
    for e in ("e1", "e2"):
        assert second[e] == pytest.approx(-first[e], abs=1e-7)
        assert np.abs(first[e]).max() > 5e-4


def test_sides_are_valid_in_the_schema_and_survive_saving(home: Path) -> None:
    path = design(home, sides("a", "b"))
    assert list(Draft202012Validator(json_schema("design")).iter_errors(yaml.safe_load(path.read_text()))) == []
    first = load_design(path)
    again = load_design(save_design(first, home / "saved.yaml"))
    assert again.values == first.values and again.effects == first.effects
    assert yaml.safe_load((home / "saved.yaml").read_text())["contact"]["profiles"]["wheel"] == {
        "left": "b.txt",
        "right": "a.txt",
    }


def test_one_side_alone_is_refused(home: Path) -> None:
    text = "  profiles: {wheel: {left: a.txt}, rail: r.txt}"
    with pytest.raises(FileProblems, match=r"write \{left: FILE, right: FILE\}"):
        load_design(design(home, text))


def test_the_check_warns_of_tread_and_flange_touching_at_once(home: Path) -> None:
    (warning,) = check([design(home, "  profiles: {wheel: a.txt, rail: r.txt, gauge: 1435 mm}")])
    assert "tread and flange touch at once at e = 5." in warning.message and warning.key == "contact.profiles"
    contacts = find_contacts(WheelRailPair(coned_wheel(0.05), round_rail()))
    flange = [jump for jump in contacts.jumps if jump.is_at_flange]
    assert {jump.wheel for jump in flange} == {1, 2}
    assert all(jump.separation > 5e-3 and min(jump.angle) < np.pi / 4 < max(jump.angle) for jump in flange)
