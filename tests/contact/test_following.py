"""Contact parameters that follow their profiles: wheel load, load states, and the numbers of the profiles."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from railui.contact.contact_points import find_contacts
from railui.contact.creep import mean_creep_coefficients
from railui.contact.wheelset_on_track import WheelRailPair
from railui.io.problems import FileProblems
from railui.optimisation.evaluation import response_table
from railui.optimisation.response_map import case_of, paths_of
from railui.optimisation.sensitivity import perturbable_paths
from railui.track.excitation import resolve_track
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.model import Model
from railui.vehicle.sampling import ParameterisedModel
from tests.contact.shapes import coned_wheel, round_rail, worn_wheel
from tests.contact.test_design import HOME, PAIR, design, home

__all__ = ["home"]
GAUGE, LOAD = "contact.profiles.gauge", "vehicle.wheel_load"


def bundled(changes: dict[str, str]) -> Design:
    """Return the bundled bogie on profiles with texts of its file replaced."""
    text = (HOME / "designs/profiled_bogie.yaml").read_text("utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return load_design(re.sub("profiles/", f"{HOME}/designs/profiles/", text))


def same(a: Design, b: Design) -> bool:
    return a.values == b.values and a.effects == b.effects


@pytest.mark.parametrize(
    ("line", "path", "value"),
    [
        ("wheel_load: 55 kN", LOAD, "wheel_load: 110 kN"),
        ("rolling_radius: 0.46", "vehicle.geometry.rolling_radius", "rolling_radius: 0.42"),
        ("gauge: 1435 mm", GAUGE, "gauge: 1432 mm"),
        ("inclination: 1:40", "contact.profiles.inclination", "inclination: 1:20"),
        ("sd: 2 mm ", "contact.profiles.sd", "sd: 1.2 mm "),
        ("surface: 0.6 ", "contact.profiles.surface", "surface: 1 "),
        ("use: table ", "contact.profiles.use", "use: linearised "),
    ],
)
def test_an_override_equals_the_same_number_in_the_file(line: str, path: str, value: str) -> None:
    before = bundled({})
    changed, read = before.with_values({path: value.partition(": ")[2].strip()}), bundled({line: value})
    assert same(changed, read) and not same(changed, before)
    assert same(changed.with_values({path: line.partition(": ")[2].strip()}), before)


def test_the_creep_coefficients_of_an_override_are_those_of_the_load(home: Path) -> None:
    laden = load_design(design(home, f"{PAIR}}}")).with_values({LOAD: 110e3})
    pair = WheelRailPair(coned_wheel(0.05), round_rail(), back_to_back=1.360)
    contacts = find_contacts(pair)
    expected = mean_creep_coefficients(contacts, 110e3, 2e-3, contacts.centre, 0.6)
    assert laden.values["contact.leading.longitudinal_creep"] == pytest.approx(expected.longitudinal_creep, rel=1e-5)
    assert laden.values["contact.spin_creep"] == pytest.approx(expected.spin_creep, rel=1e-5)


def test_a_contact_jump_through_the_centre_changes_the_creep_coefficients_gradually() -> None:
    """S1002 on 60E1 jumps by 10 mm at e = 0.25 mm, at 1434 mm on the other side: at the centre kappa_x fell by 31 %."""
    wide, narrow = (bundled({}).with_values({GAUGE: gauge}) for gauge in (1.435, 1.434))
    for key, most in (("longitudinal_creep", 0.1), ("lateral_creep", 0.05)):
        x, y = (each.values[f"contact.leading.{key}"] for each in (wide, narrow))
        assert 0.0 < abs(x / y - 1.0) < most


def test_a_load_state_has_the_creep_coefficients_of_its_load() -> None:
    states = "load:\n  state: laden\n  laden: {vehicle.wheel_load: 110 kN}\n  worn: {contact.leading.conicity: 0.3}\n"
    laden = bundled({"riding: {": f"{states}riding: {{"})
    direct = bundled({"wheel_load: 55 kN": "wheel_load: 110 kN"})
    assert laden.values == direct.values
    worn = laden.with_values({"load.state": "worn"})
    assert worn.values == {**bundled({}).values, "contact.leading.conicity": 0.3}


def test_a_contact_parameter_that_is_given_follows_nothing() -> None:
    changed = bundled({}).with_values({"contact.leading.conicity": 0.3}).with_values({GAUGE: 1.432})
    direct = bundled({}).with_values({GAUGE: 1.432})
    assert changed.values == {**direct.values, "contact.leading.conicity": 0.3}
    assert changed.effects == direct.effects


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        (GAUGE, "1410 mm", "widen the gauge"),
        (GAUGE, "-1", "too small"),
        ("contact.profiles.sd", "2 m", "too large"),
        ("contact.profiles.inclination", "1:1", "write 1:40"),
        ("contact.profiles.use", "tabel", "did you mean 'table'"),
        ("contact.profiles.gage", "1.43", "no such parameter"),
        ("contact.profiles.leading.gauge", "1.43", "no such parameter"),
        ("contact.profiles.wheel", "worn.txt", "write it into the design, or into a copy of it"),
        ("contact.profiles.rail.left", "worn.txt", "write it into the design, or into a copy of it"),
        ("contact.profiles.trailing.wheel", "worn.txt", "write it into the design, or into a copy of it"),
    ],
)
def test_a_bad_number_of_the_profiles_is_refused_with_a_remedy(path: str, value: str, expected: str) -> None:
    with pytest.raises(FileProblems) as error:
        bundled({}).with_values({path: value})
    assert expected in str(error.value) and error.value.problems[0].key == path


def test_numbers_of_profiles_that_change_nothing_are_refused(home: Path) -> None:
    with pytest.raises(FileProblems, match="changes nothing"):
        bundled({}).detached().with_values({GAUGE: 1.43})


def test_rows_of_varied_profiles_are_those_of_the_changed_designs() -> None:
    path = "contact.profiles.leading.sd"
    varied = ParameterisedModel(Model(bundled({})), (GAUGE, path, LOAD))
    x = np.array([[1.435, 2e-3, 55e3], [1.432, 1.5e-3, 80e3], [1.437, 2e-3, 55e3]])
    for row, values in zip(varied.rows(x), x, strict=True):
        single = Model(bundled({}).with_values(dict(zip(varied.paths, map(float, values), strict=True))))
        speeds = (20.0, 60.0)
        for v in speeds:
            expected, found = single.eigenvalues(v), varied.model.eigenvalues(v, row[None])
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
        again = varied.model.with_row(row)
        assert again.row == pytest.approx(row, rel=1e-12)


def test_a_study_of_the_gauge_evaluates_the_designs_of_each_gauge() -> None:
    base = bundled({})
    track = resolve_track("erri_b176_low length=300 seed=1")
    assert paths_of(base, GAUGE) == [GAUGE]
    case = case_of(base, [GAUGE], track, 40.0)
    keys = ("weighted_acceleration", "linear_critical_speed", "safety_share")
    table = response_table([case], np.array([[1.433], [1.437]]), keys)
    for i, gauge in enumerate((1.433, 1.437)):
        direct = case_of(base.with_values({GAUGE: gauge}), [], track, 40.0)
        single = response_table([direct], np.zeros((1, 0)), keys)
        for key in keys:
            assert table.values[key][i, 0] == pytest.approx(single.values[key][0, 0], rel=1e-9)


def test_the_numbers_of_the_profiles_can_be_perturbed() -> None:
    paths = perturbable_paths(bundled({}))
    numbers = ("gauge", "back_to_back", "inclination", "sd", "surface")
    assert {f"contact.profiles.{key}" for key in numbers} <= set(paths)


def test_wheelsets_have_their_own_wheels_and_numbers(home: Path) -> None:
    from tests.contact.test_design import write

    write(home / "other.txt", worn_wheel())
    mixed = load_design(design(home, f"{PAIR}, leading: {{wheel: other.txt, sd: 1.2 mm}}}}"))
    alike = [load_design(design(home, f"{PAIR.replace('wheel.txt', w)}}}")) for w in ("other.txt", "wheel.txt")]
    assert [(e.kind, e.wheelset) for e in mixed.effects] == [("profile_shape", 1), ("profile_shape", 2)]
    assert mixed.values["contact.trailing.conicity"] == alike[1].values["contact.trailing.conicity"]
    leading = alike[0].with_values({"contact.profiles.sd": "1.2 mm"})
    assert mixed.values["contact.leading.conicity"] == leading.values["contact.leading.conicity"]
    assert mixed.effects[0].parameters == leading.effects[0].parameters
