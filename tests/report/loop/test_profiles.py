"""Contact parameters of measured profiles, for comparison with calibrated ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.contact.linearisation import linearise
from railui.report.loop.page_tables import parameter_rows, profiles_text
from railui.report.loop.profiles import profile_parameters
from railui.vehicle.design_reader import Design, load_design
from tests.contact.shapes import round_rail, worn_wheel
from tests.contact.test_design import HOME, PAIR, design, write

PATHS = ("contact.leading.conicity", "contact.trailing.conicity", "contact.spin_creep", "vehicle.frame.mass")
MEASURED = {"sd_e1": 2e-3, "sd_e2": 1e-3}


@pytest.fixture
def vehicle(tmp_path: Path) -> Design:
    write(tmp_path / "wheel.txt", worn_wheel())
    write(tmp_path / "rail.txt", round_rail())
    return load_design(design(tmp_path, f"{PAIR}, use: linearised}}"))


def test_the_parameters_of_a_wheelset_are_linearised_over_its_measured_motion(vehicle: Design) -> None:
    result = profile_parameters(vehicle, PATHS, MEASURED)
    assert result is not None and result["deviation"] == [2e-3, 1e-3]
    for where, sd in (("leading", 2e-3), ("trailing", 1e-3)):
        assert vehicle.profiles is not None
        expected = linearise(vehicle.profiles.geometry(vehicle.values), sd).conicity
        assert result["parameters"][f"contact.{where}.conicity"] == pytest.approx(expected, rel=1e-9)
    assert result["parameters"]["contact.leading.conicity"] < 0.95 * result["parameters"]["contact.trailing.conicity"]
    assert 0.0 < result["parameters"]["contact.spin_creep"] < 1.0
    assert "vehicle.frame.mass" not in result["parameters"]


def test_a_design_without_profiles_has_no_parameters_of_them() -> None:
    assert profile_parameters(load_design(HOME / "designs/test_bogie.yaml"), PATHS, MEASURED) is None
    assert profiles_text({}) is None


def test_missing_profile_files_are_noted_without_parameters(vehicle: Design) -> None:
    assert vehicle.profiles is not None
    vehicle.profiles.wheel.unlink()
    result = profile_parameters(vehicle, PATHS, {})
    assert result is not None and "wheel.txt" in result["note"] and result["parameters"] == {}


def test_the_page_shows_them_in_the_unit_of_the_parameter(vehicle: Design) -> None:
    row = {"declared": 0.15, "before": 0.2, "value": 0.21, "sd": 0.002, "unit": "1", "flag": None}
    report = {
        "parameters": {PATHS[0]: row, PATHS[3]: {**row, "unit": "kg"}},
        "profiles": profile_parameters(vehicle, PATHS, MEASURED),
        "identifiability": {"parameters": {}},
    }
    first, other = parameter_rows(report)
    assert float(first["profiles"]) == pytest.approx(0.206, abs=0.003)
    assert other["profiles"] in ("", "–")
    head = profiles_text(report)
    assert head is not None and (head["e1"], head["e2"]) == ("2", "1")
