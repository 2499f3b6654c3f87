"""Sensitivity of a design: derivatives of known formulas, spread over seeds, agreement with a study."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from railui import ride, stability
from railui.optimisation.design_sensitivity import design_sensitivity
from railui.optimisation.response_map import case_of
from railui.track.excitation import resolve_track
from railui.vehicle.design_reader import load_design
from tests.cli.runner import BOGIE, ROOT, document, run

CHECK_BOGIE = ROOT / "designs/check_bogie.yaml"
TRACK = "erri_b176_low length=300"


def test_the_relative_derivatives_of_klingels_wavelength_are_its_exponents() -> None:
    """L = 2 pi sqrt(b r/lambda), lambda the mean of two conicities; central differences of 5 % err by 0.04 %."""
    found = document(run("sensitivity", str(CHECK_BOGIE), "--of", "klingel_wavelength", "--json", "-", "-q"))
    relative = {one["path"]: one["relative"]["klingel_wavelength"] for one in found["parameters"]}
    expected = {
        "vehicle.geometry.half_gauge": 0.5,
        "vehicle.geometry.rolling_radius": 0.5,
        "contact.leading.conicity": -0.25,
        "contact.trailing.conicity": -0.25,
        "vehicle.frame.mass": 0.0,
    }
    assert {path: relative[path] for path in expected} == pytest.approx(expected, rel=1e-3, abs=1e-12)
    length = found["responses"]["klingel_wavelength"]
    assert length["unit"] == "m" and length["value"] == pytest.approx(
        2 * math.pi * math.sqrt(0.75 * 0.46 / 0.18), rel=1e-12
    )
    gauge = next(one for one in found["parameters"] if one["path"] == "vehicle.geometry.half_gauge")
    assert gauge["derivative"]["klingel_wavelength"] == pytest.approx(0.5 * length["value"] / 0.75, rel=1e-3)


def test_a_change_is_the_difference_of_two_designs_averaged_over_the_seeds() -> None:
    design, path = load_design(BOGIE), "vehicle.secondary.lateral_damping"
    sources = [resolve_track(TRACK, seed) for seed in (1, 2)]
    cases = [case_of(design, (), source, 40.0) for source in sources]
    found = design_sensitivity(cases, ["weighted_acceleration", "linear_damping"])
    one = next(each for each in found["parameters"] if each["path"] == path)
    ends = [design.with_values({path: factor * 30e3}) for factor in (0.95, 1.05)]
    changes = []
    for source in sources:
        low, high = (ride(end, source, 40.0)["weighted_acceleration"] for end in ends)
        changes.append(high - low)
    assert one["change"]["weighted_acceleration"] == pytest.approx(sum(changes) / 2, rel=1e-9)
    assert one["change_sd"]["weighted_acceleration"] == pytest.approx(abs(changes[1] - changes[0]) / 2**0.5, rel=1e-9)
    damping = [stability(end, [40.0])["linear_damping"] for end in ends]
    assert one["change"]["linear_damping"] == pytest.approx(damping[1] - damping[0], rel=1e-6)
    assert one["derivative"]["linear_damping"] == pytest.approx((damping[1] - damping[0]) / 3e3, rel=1e-6)


def test_parameters_that_are_zero_are_named_as_left_out(tmp_path: Path) -> None:
    figure = tmp_path / "s.svg"
    words = ("sensitivity", str(CHECK_BOGIE), "--track", TRACK, "--speed", "40", "--seeds", "1,2")
    found = document(run(*words, "--figure", str(figure), "--json", "-", "-q"))
    assert "vehicle.secondary.lateral_stiffness" in found["skipped"]
    assert set(found["responses"]) >= {"score", "weighted_acceleration", "flange_margin", "linear_damping"}
    assert found["responses"]["weighted_acceleration"]["sd"] > 0 and found["seeds"] == [1, 2]
    assert "change of weighted acceleration as a parameter rises by 10 % [m/s²]" in figure.read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--of", "scor"), "'scor' is no result of ride, stability or curve, did you mean 'score'?"),
        (("--of", "score"), "--of: score needs a track: give --track"),
        (("--of", "score", "--track", TRACK), "--of: score needs a speed: give --speed"),
        (("--seeds", "1,2"), "--seeds needs a track"),
    ],
)
def test_a_usage_error_names_its_remedy(words: tuple[str, ...], message: str) -> None:
    result = run("sensitivity", BOGIE, *words)
    assert result.exit_code == 2 and result.stdout == ""
    assert message in " ".join(result.stderr.split())
