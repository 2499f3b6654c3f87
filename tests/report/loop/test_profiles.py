"""Contact parameters of measured profiles beside those that a loop found."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.contact.linearisation import linearise
from railui.report.loop.page import parameters, profiled
from railui.report.loop.profiles import profile_parameters
from railui.vehicle.contact_profiles import ContactProfiles
from railui.vehicle.design_reader import load_design
from tests.contact.shapes import round_rail, worn_wheel
from tests.contact.test_design import PAIR, design, write

PATHS = ("contact.leading.conicity", "contact.trailing.conicity", "contact.spin_creep", "vehicle.frame.mass")
MEASURED = {"sd_e1": 2e-3, "sd_e2": 1e-3}


@pytest.fixture
def profiles(tmp_path: Path) -> ContactProfiles:
    write(tmp_path / "wheel.txt", worn_wheel())
    write(tmp_path / "rail.txt", round_rail())
    found = load_design(design(tmp_path, f"{PAIR}, use: linearised}}")).profiles
    assert found is not None
    return found


def test_each_wheelset_s_parameters_are_linearised_over_its_own_measured_motion(profiles: ContactProfiles) -> None:
    told = profile_parameters(profiles, PATHS, MEASURED)
    assert told is not None and told["deviation"] == [2e-3, 1e-3]
    for where, sd in (("leading", 2e-3), ("trailing", 1e-3)):
        expected = linearise(profiles.geometry(), sd).conicity
        assert told["parameters"][f"contact.{where}.conicity"] == pytest.approx(expected, rel=1e-9)
    assert told["parameters"]["contact.leading.conicity"] < 0.95 * told["parameters"]["contact.trailing.conicity"]
    assert 0.0 < told["parameters"]["contact.spin_creep"] < 1.0
    assert "vehicle.frame.mass" not in told["parameters"]


def test_a_design_without_profiles_has_none_beside() -> None:
    assert profile_parameters(None, PATHS, MEASURED) is None
    assert profiled({}) is None


def test_profiles_that_are_gone_are_told_and_nothing_is_made_up(profiles: ContactProfiles) -> None:
    profiles.wheel.unlink()
    told = profile_parameters(profiles, PATHS, {})
    assert told is not None and "wheel.txt" in told["note"] and told["parameters"] == {}


def test_the_page_shows_them_in_the_unit_of_the_row(profiles: ContactProfiles) -> None:
    row = {"declared": 0.15, "before": 0.2, "value": 0.21, "sd": 0.002, "unit": "1", "flag": None}
    report = {"parameters": {PATHS[0]: row, PATHS[3]: {**row, "unit": "kg"}},
              "profiles": profile_parameters(profiles, PATHS, MEASURED)}  # fmt: skip
    first, other = parameters(report)
    assert float(first["profiles"]) == pytest.approx(0.206, abs=0.003)
    assert other["profiles"] in ("", "–")
    head = profiled(report)
    assert head is not None and (head["e1"], head["e2"]) == ("2", "1")
