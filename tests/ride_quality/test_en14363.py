"""Evaluation by the rules of EN 14363: made lines whose results follow by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from railui.documents.check import check
from railui.io.problems import FileProblems
from railui.io.series_file import write_series
from railui.io.units import read_speed
from railui.ride_quality.en14363.estimation import estimate_one_dimensional, estimate_two_dimensional
from railui.ride_quality.en14363.evaluation import evaluate_measured, evaluate_simulated
from railui.ride_quality.en14363.quantities import sliding_means
from railui.ride_quality.en14363.zones import ZONES, cut_sections, zone_numbers
from tests.cli.runner import document, run

HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"
V = 40.0  # m/s: sections of 100 m
STEP = 0.1  # m
QUASI_STATIC = "quasi-static acceleration of the carbody"
WAGON = """
name: wagon with two axles
vehicle:
  bodies:
    body: {mass: 16000, yaw_inertia: 90e3, roll_inertia: 20e3, height: 1.4}
  elements:
    wheelset:
      {kind: wheelset, under: body, half_wheelbase: 3, mass: 1400, yaw_inertia: 800, spin_inertia: 100,
       rolling_radius: 0.46, wheel_load: 46 kN}
    primary:
      {kind: spring, between: [wheelset, body], y: 1.0, height: 0.46, static_load: 39 kN,
       lateral_stiffness: 1 MN/m, longitudinal_stiffness: 1 MN/m, vertical_stiffness: 1 MN/m}
contact:
  leading:
    {conicity: 0.15, longitudinal_creep: 180, lateral_creep: 165, gravitational_stiffness: 6, contact_angle: 0.05,
     roll: 0.05}
  trailing:
    {conicity: 0.15, longitudinal_creep: 180, lateral_creep: 165, gravitational_stiffness: 6, contact_angle: 0.05,
     roll: 0.05}
  spin_creep: 0.25
  flange_clearance: 7 mm
"""


def write_run(path: Path, s: np.ndarray, columns: dict[str, np.ndarray]) -> Path:
    """A run at 40 m/s with a row every 0.1 m."""
    table = {"t [s]": s / V, "s [m]": s, "v [m/s]": np.full(s.size, V)} | columns
    header = ",".join(table)
    np.savetxt(path, np.column_stack(list(table.values())), delimiter=",", header=header, comments="", fmt="%.12g")
    return path


def waves(s: np.ndarray, amplitudes: list[float]) -> np.ndarray:
    """One sine of 100 m in each section of 100 m, each with its own amplitude."""
    return np.array(amplitudes)[(s // 100.0).astype(int)] * np.sin(2 * np.pi * s / 100.0)


def of(result: dict, quantity: str, place: str, zone: int = 1) -> dict:
    found = [
        q for q in result["zones"][zone - 1]["quantities"] if q["quantity"] == quantity and q["place"].startswith(place)
    ]
    assert len(found) == 1, [q["place"] for q in found]
    return found[0]


def test_the_sum_of_guiding_forces_of_a_made_line_is_that_by_hand(tmp_path: Path) -> None:
    """Sections of amplitude 10, 12, 14, 16, 18 kN: each enters twice, mean 14, s = sqrt(2 (16 + 4 + 4 + 16)/9) kN.

    A 2 m mean leaves sin(pi 2/100)/(pi 2/100) = 0.99934 of a wave of 100 m, the 99.85th percentile 0.99999 of its
    amplitude. Estimated: 14 + 3 x 2.9814 = 22.944 kN; limit 10 + 2 x 55/3 = 46.667 kN.
    """
    s = np.arange(0.0, 500.0, STEP)
    Y = waves(s, [10e3, 12e3, 14e3, 16e3, 18e3])
    path = write_run(tmp_path / "run.csv", s, {"Y1.right [N]": 0.5 * Y, "Y1.left [N]": 0.5 * Y})
    result = evaluate_measured(path, BOGIE)
    found = of(result, "sum of guiding forces", "wheelset 1")
    assert found["values"] == 10 and found["rule"] == "mean + 3 s"
    assert found["mean"] == pytest.approx(0.99933 * 14e3, rel=1e-3)
    assert found["sd"] == pytest.approx(0.99933 * 2981.4, rel=2e-3)
    assert found["estimated"] == pytest.approx(0.99933 * 22944.0, rel=1e-3)
    assert found["limit"] == pytest.approx(46666.67) and not found["exceeded"]
    assert result["verdict"] == "incomplete" and "zone 1: 5 of 25 sections" in result["missing"]
    assert "lateral acceleration of the carbody: no signal" in result["missing"]
    assert not any("bogie frame" in text for text in result["missing"])  # forces were measured


def test_an_estimate_over_its_limit_fails_though_no_section_reaches_it(tmp_path: Path) -> None:
    """10 and 40 kN alternate: largest 40 of 46.7 kN, mean 25, s 15.4, estimated 71 kN."""
    s = np.arange(0.0, 2600.0, STEP)
    Y = waves(s, [10e3, 40e3] * 13)
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, {"Y1 [kN]": Y / 1e3}), BOGIE)
    found = of(result, "sum of guiding forces", "wheelset 1")
    sd = np.sqrt(52 * 15e3**2 / 51)
    assert found["estimated"] == pytest.approx(0.99933 * (25e3 + 3 * sd), rel=1e-3) and found["exceeded"]
    assert result["verdict"] == "limit exceeded" and result["exceeded"][0].startswith("zone 1: sum of guiding forces")


def test_curves_take_the_outer_wheel_and_the_outward_force(tmp_path: Path) -> None:
    """R 500 to the right, then to the left: outward 20 kN at the outer wheel of 50 kN, inner wheel 5 kN inward."""
    s = np.arange(0.0, 400.0, STEP)
    side = np.where(s < 200.0, 1.0, -1.0)
    outer, inner = 20e3, -5e3
    right = np.where(side > 0, inner, outer)  # to the right at the right wheel is outward
    left = -np.where(side > 0, outer, inner)
    ones = np.ones(s.size)
    columns = {"Y1.right [N]": right, "Y1.left [N]": left, "Q1.right [kN]": 50 * ones, "Q1.left [kN]": 50 * ones}
    columns |= {"curvature [1/m]": side / 500.0, "cant_deficiency [mm]": 100.0 * ones}
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, columns), BOGIE)
    zone = result["zones"][2]
    assert zone["sections"] == 4 and zone["mean_radius"] == pytest.approx(500.0)
    steady = of(result, "quasi-static guiding force", "wheelset 1, outer", 3)
    assert steady["estimated"] == pytest.approx(20e3, rel=1e-6) and steady["values"] == 4 and steady["limit"] == 60e3
    quotient = of(result, "Y/Q", "wheelset 1, outer", 3)
    assert quotient["mean"] == pytest.approx(0.4, rel=0.05) and quotient["values"] == 4
    total = of(result, "sum of guiding forces", "wheelset 1", 3)
    assert total["mean"] == pytest.approx(25e3, rel=0.05) and total["values"] == 4


def test_accelerations_of_the_carbody_are_taken_from_half_a_hertz_to_ten(tmp_path: Path) -> None:
    """0.8 m/s^2 at 2 Hz passes, a drift of 3 m/s^2 at 0.02 Hz and 2 m/s^2 at 40 Hz do not: rms 0.566 of 0.5 m/s^2."""
    s = np.arange(0.0, 1000.0, STEP)
    t = s / V
    x = sum(a * np.sin(2 * np.pi * f * t) for a, f in ((0.8, 2.0), (3.0, 0.02), (2.0, 40.0)))
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, {"ay_body.front [m/s^2]": x}), BOGIE)
    rms = of(result, "rms acceleration of the carbody", "ay_body.front")
    assert rms["mean"] == pytest.approx(0.8 / np.sqrt(2.0), rel=0.03) and rms["limit"] == 0.5 and rms["exceeded"]
    assert of(result, "acceleration of the carbody", "ay_body")["mean"] == pytest.approx(0.8, rel=0.05)
    assert any("simplified method" in text for text in result["missing"])
    assert "lateral acceleration of the bogie frame: no signal" in result["missing"]
    assert not any("carbody" in text for text in result["missing"])


def test_the_simplified_method_has_the_limit_of_the_bogie_mass(tmp_path: Path) -> None:
    """2.9 t + 2 x 1.85 t = 6.6 t: 12 - 6.6/5 = 10.68 m/s^2, half of it for the rms over 100 m."""
    s = np.arange(0.0, 1000.0, STEP)
    x = 9.0 * np.sin(2 * np.pi * 5.0 * s / V)
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, {"ayf [m/s^2]": x}), BOGIE)
    peak = of(result, "acceleration of the bogie frame", "ayf")
    assert peak["limit"] == pytest.approx(10.68) and peak["mean"] == pytest.approx(9.0, rel=0.02)
    rms = of(result, "rms acceleration of the bogie frame", "ayf")
    assert rms["estimated"] == pytest.approx(9.0 / np.sqrt(2.0), rel=0.02) and rms["limit"] == pytest.approx(5.34)
    assert rms["exceeded"]


@pytest.mark.parametrize(
    ("name", "tonnes"), [("bogie_under_coach", 2.9 + 2 * 1.85), ("manchester_coach", 2.615 + 2 * 1.813)]
)
def test_the_mass_of_a_bogie_of_bodies_is_that_of_frame_and_wheelsets(tmp_path: Path, name: str, tonnes: float) -> None:
    s = np.arange(0.0, 1000.0, STEP)
    path = write_run(tmp_path / "run.csv", s, {"ayf [m/s^2]": 9.0 * np.sin(2 * np.pi * 5.0 * s / V)})
    result = evaluate_measured(path, HOME / f"designs/{name}.yaml")
    assert of(result, "acceleration of the bogie frame", "ayf")["limit"] == pytest.approx(12 - tonnes / 5)
    assert not any("bogie frame" in text for text in result["missing"])


def test_a_vehicle_without_bogies_has_no_limit_of_its_frame_and_this_is_reported(tmp_path: Path) -> None:
    s = np.arange(0.0, 1000.0, STEP)
    path = write_run(tmp_path / "run.csv", s, {"ayf [m/s^2]": 9.0 * np.sin(2 * np.pi * 5.0 * s / V)})
    (tmp_path / "wagon.yaml").write_text(WAGON)
    missing = evaluate_measured(path, tmp_path / "wagon.yaml")["missing"]
    assert any("acceleration of the bogie frame: the design has no bogie" in each for each in missing)


def test_estimates_by_hand() -> None:
    """Values 1, 2, 3, 6: mean 3, s = sqrt((4 + 1 + 0 + 9)/3) = 2.1602."""
    found = estimate_one_dimensional(np.array([1.0, 2.0, 3.0, 6.0]), 2.2)
    assert found.value == pytest.approx(3.0 + 2.2 * 2.16025, rel=1e-5)
    assert estimate_one_dimensional(np.array([4.0]), 3.0).value is None
    assert estimate_one_dimensional(np.array([4.0, 6.0]), 0.0).value == 5.0


def test_the_regression_has_the_prediction_limit_of_the_textbook() -> None:
    rng = np.random.default_rng(1)
    I = rng.uniform(0.07, 0.15, 30)  # noqa: E741
    x = 5e3 + 2e5 * I + 800.0 * rng.normal(size=30)
    line = stats.linregress(I, x)
    s_e = np.sqrt(np.sum((x - line.intercept - line.slope * I) ** 2) / 28)
    root = np.sqrt(1 + 1 / 30 + (0.165 - I.mean()) ** 2 / np.sum((I - I.mean()) ** 2))
    expected = line.intercept + line.slope * 0.165 + stats.t.ppf(0.995, 28) * s_e * root
    found = estimate_two_dimensional(x, I, 0.165, 0.99)
    assert found is not None and found.value == pytest.approx(expected, rel=1e-9)
    on_line = estimate_two_dimensional(x, I, 0.165, None)
    assert on_line is not None and on_line.value == pytest.approx(line.intercept + line.slope * 0.165, rel=1e-9)
    assert estimate_two_dimensional(x, np.full(30, 0.1), 0.165, 0.99) is None


@pytest.mark.parametrize(("confidence", "factor"), [(0.99, 3.0), (0.95, 2.2)])
def test_both_methods_agree_where_nothing_depends_on_the_cant_deficiency(confidence: float, factor: float) -> None:
    """At the 25 sections of a zone; one-sided quantiles would give 85 and 80 % of the factors."""
    I = np.linspace(0.1, 0.15, 25)  # noqa: E741
    x = np.random.default_rng(3).normal(size=25)
    x -= (x - x.mean()) @ (I - I.mean()) / ((I - I.mean()) @ (I - I.mean())) * (I - I.mean())
    found = estimate_two_dimensional(x, I, float(I.mean()), confidence)
    assert found is not None and found.value is not None
    assert (found.value - x.mean()) / x.std(ddof=1) == pytest.approx(factor, rel=0.06)


def test_a_target_of_the_cant_deficiency_extrapolates_curves(tmp_path: Path) -> None:
    """R 1000; outward force 100 kN/m x I on steps of I from 60 to 120 mm: at 150 mm the line gives 15 kN."""
    s = np.arange(0.0, 700.0, STEP)
    I = 0.06 + 0.01 * (s // 100.0)  # noqa: E741
    ones = np.ones(s.size)
    columns = {"Y1.right [N]": 0 * s, "Y1.left [N]": -100e3 * I, "Q1.left [kN]": 50 * ones, "Q1.right [kN]": 50 * ones}
    columns |= {"radius [m]": 1000.0 * ones, "cant_deficiency [m]": I}
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, columns), BOGIE, cant_deficiency=0.15)
    steady = of(result, "quasi-static guiding force", "wheelset 1, outer", 2)
    assert steady["method"] == "two-dimensional" and steady["estimated"] == pytest.approx(15e3, rel=1e-3)


@pytest.mark.parametrize("constant", [0.0, 20e3])
def test_cant_excess_is_no_deficiency_of_the_regression(tmp_path: Path, constant: float) -> None:
    """R 500, left and right; outward force 0 or 20 kN + 100 kN/m x I on I from -90 to 90 mm: 15 kN more at 150 mm."""
    s = np.arange(0.0, 700.0, STEP)
    I = -0.09 + 0.03 * (s // 100.0)  # noqa: E741
    side = np.where(s < 300.0, 1.0, -1.0)
    outward, ones = constant + 100e3 * I, np.ones(s.size)
    right, left = np.where(side > 0, 0.0, outward), -np.where(side > 0, outward, 0.0)
    columns = {"Y1.right [N]": right, "Y1.left [N]": left, "Q1.left [kN]": 50 * ones, "Q1.right [kN]": 50 * ones}
    columns |= {"radius [m]": side * 500.0, "cant_deficiency [m]": I}
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, columns), BOGIE, cant_deficiency=0.15)
    steady = of(result, "quasi-static guiding force", "wheelset 1, outer", 3)
    assert steady["method"] == "two-dimensional"
    assert steady["estimated"] == pytest.approx(constant + 15e3, rel=1e-3)


@pytest.mark.parametrize(("use", "limit"), [("long_distance", 1.5), ("goods", 1.3)])
def test_the_quasi_static_acceleration_of_goods_has_a_lower_limit(tmp_path: Path, use: str, limit: float) -> None:
    s = np.arange(0.0, 600.0, STEP)
    design = tmp_path / "design.yaml"
    more = "rms_limit: 2.5 m/s^2, peak_limit: 9 m/s^2" if use == "goods" else "journey: 4 h"
    design.write_text(
        BOGIE.read_text().replace("use: long_distance, journey: 4 h, comfort_weight: 0.6", f"use: {use}, {more}")
    )
    columns = {
        "ay_body [m/s^2]": 1.4 + 0.01 * np.sin(s),
        "radius [m]": 1000 + 0 * s,
        "cant_deficiency [m]": 0.1 + 0 * s,
    }
    found = of(evaluate_measured(write_run(tmp_path / "run.csv", s, columns), design), QUASI_STATIC, "ay_body", 2)
    assert found["limit"] == limit and found["exceeded"] == (limit < 1.4)


@pytest.mark.parametrize(
    ("radius", "zone", "text"),
    [
        (580.0, 3, "zone 3: mean radius 580 m, not 450 to 550 m"),
        (520.0, 3, ""),
        (260.0, 4, "zone 4: mean radius 260 m, not 280 to 350 m"),
        (340.0, 4, ""),
    ],
)
def test_a_mean_radius_outside_that_of_its_zone_is_missing(tmp_path: Path, radius: float, zone: int, text: str) -> None:
    s = np.arange(0.0, 600.0, STEP)
    columns = {"Y1 [N]": 1e3 * np.sin(s), "radius [m]": radius + 0 * s, "cant_deficiency [m]": 0.1 + 0 * s}
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, columns), BOGIE)
    assert result["zones"][zone - 1]["mean_radius"] == pytest.approx(radius)
    assert [each for each in result["missing"] if "mean radius" in each] == ([text] if text else [])


def test_zones_and_sections_leave_transitions_out() -> None:
    s = np.arange(0.0, 1000.0, 1.0)
    curvature = np.interp(s, [0, 300, 400, 700, 800, 1000], [0, 0, 1 / 300, 1 / 300, 0, 0])
    sections = cut_sections(s, curvature, np.where(curvature > 0, 0.1, 0.0), V)
    assert next(x.start for x in sections if x.zone.number == 4) >= 390.0
    assert sum(x.zone.number == 4 for x in sections) == 4  # 4 x 70 m in a full curve of some 320 m
    assert all(x.end <= 710.0 for x in sections if x.zone.number == 4)
    assert sum(x.zone.number == 1 for x in sections) == 5
    assert zone_numbers(np.array([1 / 200.0]), np.array([0.1])).tolist() == [0]
    assert [x.end - x.start for x in cut_sections(s, 0 * s, 0 * s, 50.0)] == [250.0] * 4


def test_transitions_of_tangent_track_and_of_very_large_radii_are_in_no_section_of_zone_one() -> None:
    """500 m tangent, a transition of 300 m, 300 m of R 2000 at 30 mm, all of zone 1: 5 + 3 sections of 100 m."""
    s = np.arange(0.0, 1100.0, 1.0)
    curve = np.interp(s, [0, 500, 800, 1100], [0.0, 0.0, 1 / 2000, 1 / 2000])
    rng = np.random.default_rng(1)
    for noise in (0.0, 1e-4):  # 1/m: that of a recording
        sections = cut_sections(s, curve + noise * rng.normal(size=s.size), 60.0 * curve, V)
        assert [x.zone.number for x in sections] == [1] * 8
        assert all(x.end <= 520.0 or x.start >= 700.0 for x in sections)


def test_no_section_crosses_the_inner_part_of_a_compound_curve() -> None:
    """300 m of R 500, a transition of 40 m, 140 m of R 430, another, 320 m of R 500: 3 + 3 sections of R 500."""
    s = np.arange(0.0, 840.0, 0.1)
    curvature = np.interp(s, [0, 300, 340, 480, 520, 840], [1 / 500, 1 / 500, 1 / 430, 1 / 430, 1 / 500, 1 / 500])
    sections = cut_sections(s, curvature, 0.1 + 0 * s, V)
    assert len(sections) == 6 and all(x.end <= 330.0 or x.start >= 490.0 for x in sections)
    assert [x.curvature for x in sections] == pytest.approx([1 / 500] * 6, rel=0.05)


@pytest.mark.parametrize(("speed", "length"), [("219 km/h", 250.0), ("220 km/h", 250.0), ("160 km/h", 100.0)])
def test_the_length_of_a_section_is_that_up_to_and_including_the_speed(speed: str, length: float) -> None:
    assert ZONES[0].section_length(read_speed(speed)) == length
    assert ZONES[0].section_length(1.001 * 220.0 / 3.6) == 500.0


def test_one_sample_of_the_speed_does_not_change_the_sections(tmp_path: Path) -> None:
    s = np.arange(0.0, 2000.0, STEP)
    speed = np.full(s.size, V)
    speed[s.size // 2] = 44.6
    table = np.column_stack([s / V, s, speed, np.sin(0.1 * s)])
    path = tmp_path / "run.csv"
    np.savetxt(path, table, delimiter=",", header="t [s],s [m],v [m/s],ayf [m/s^2]", comments="", fmt="%.12g")
    assert evaluate_measured(path, BOGIE)["zones"][0]["sections"] == 20


@pytest.mark.parametrize("hand", [1.0, -1.0])
@pytest.mark.parametrize("deficiency", [0.13, -0.13])
def test_a_low_passed_acceleration_counts_in_curves_on_the_side_of_its_quasi_static_part(
    tmp_path: Path, hand: float, deficiency: float
) -> None:
    """0.85 m/s^2 to the centre, or from it with a cant excess, and sines of 0.5: 1.35 in every section, not -0.35."""
    s = np.arange(0.0, 1000.0, STEP)
    x = np.sign(deficiency) * hand * 0.85 + 0.5 * np.sin(2 * np.pi * s / V)
    columns = {"ay_body [m/s^2]": x, "ayf [m/s^2]": x, "curvature [1/m]": hand / 500 + 0 * s}
    columns |= {"cant_deficiency [m]": deficiency + 0 * s}
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, columns), BOGIE)
    for quantity, place in (
        ("acceleration of the carbody, to 6 Hz", "ay_body"),
        ("acceleration of the bogie frame", "ayf"),
    ):
        found = of(result, quantity, place, 3)
        assert found["values"] == 10 and found["estimated"] == pytest.approx(1.35, rel=0.02)
    both = of(result, "acceleration of the carbody", "ay_body", 3)
    assert both["values"] == 20 and both["mean"] == pytest.approx(0.5, rel=0.05)


def test_sliding_means_bear_a_varying_spacing() -> None:
    rng = np.random.default_rng(2)
    s = np.cumsum(rng.uniform(0.05, 0.15, 400))
    at, mean = sliding_means(s, 3.0 + 2.0 * s)
    assert mean == pytest.approx(3.0 + 2.0 * at, rel=1e-9)


def test_a_gap_and_standstill_are_in_no_section(tmp_path: Path) -> None:
    s = np.arange(0.0, 1000.0, STEP)
    Y = waves(s, [10e3] * 10)
    Y[4520:4530] = np.nan
    result = evaluate_measured(write_run(tmp_path / "run.csv", s, {"Y1 [N]": Y}), BOGIE)
    assert result["zones"][0]["sections"] == 9 and any("2 unbroken pieces" in note for note in result["notes"])


def test_a_simulated_ride_has_zone_one_only_and_its_limits() -> None:
    result = evaluate_simulated("erri_b176_high length=3000 seed=1", BOGIE, 60.0)
    assert result["verdict"] == "limit exceeded" and [z["sections"] for z in result["zones"]] == [12, 0, 0, 0]
    assert any("planar" in note for note in result["notes"])
    assert not any(q["quantity"] == "wheel unloading" for q in result["zones"][0]["quantities"])


def test_a_vehicle_that_leaves_the_track_fails() -> None:
    result = evaluate_simulated("erri_b176_high length=2000", HOME / "designs/check_bogie.yaml", 80.0)
    assert result["verdict"] == "limit exceeded" and "left the track" in result["exceeded"][0]


def test_the_command_evaluates_simulated_and_measured_runs(tmp_path: Path) -> None:
    s = np.arange(0.0, 2600.0, STEP)
    path = write_run(tmp_path / "run.csv", s, {"Y1 [N]": waves(s, [10e3, 40e3] * 13)})
    words = ("assess", str(path), str(BOGIE), "--method", "en14363", "--measured")
    done = run(*words, "--json", "-")
    assert done.exit_code == 0 and document(done)["verdict"] == "limit exceeded"
    assert run(*words, "--strict").exit_code == 4
    assert run(*words, "--speed", "40").exit_code == 2
    assert run("assess", str(path), str(BOGIE)).exit_code == 2
    assert run("assess", str(path), str(BOGIE), "--speed", "40", "--measured").exit_code == 2
    simulated = run("assess", "fra_6 length=1500", str(BOGIE), "--speed", "40", "--method", "en14363", "--json", "-")
    assert simulated.exit_code == 0 and document(simulated)["source"] == "simulated"


def test_a_run_without_any_quantity_of_the_method_is_refused(tmp_path: Path) -> None:
    s = np.arange(0.0, 300.0, STEP)
    path = write_run(tmp_path / "run.csv", s, {"e1 [m]": 0.001 * np.sin(s)})
    with pytest.raises(FileProblems, match="no column that EN 14363 evaluates"):
        evaluate_measured(path, BOGIE)


def test_forces_beyond_any_vehicle_or_of_no_wheelset_are_refused(tmp_path: Path) -> None:
    s = np.arange(0.0, 300.0, STEP)
    for header, message in (("Y1 [MN]", "more than any vehicle"), ("Y3 [N]", "the design has 2 wheelsets")):
        path = write_run(tmp_path / "run.csv", s, {header: 20.0 * np.sin(s)})
        with pytest.raises(FileProblems, match=message):
            evaluate_measured(path, BOGIE)


def test_numbers_in_another_unit_than_their_header_are_refused(tmp_path: Path) -> None:
    """km/h under m/s, alone or against s; wheel loads and guiding forces in kN under N."""
    s = np.arange(0.0, 600.0, STEP)
    Y, Q = 10e3 * np.sin(s), 55e3 + 5e3 * np.sin(s)
    clock = {"t [s]": s / V, "s [m]": s}
    for columns, message in (
        ({"v [m/s]": 162 + 0 * s, "Y1 [N]": Y}, r"run.csv:1:\d+: v: is 162 m/s \(583.2 km/h\) .*write `v \[km/h\]`"),
        ({"v [m/s]": 3.6 * V + 0 * s, "Y1 [N]": Y}, "write `v .km/h.`"),
        ({"v [m/s]": 3.6 * 30.0 + 0 * s, "t [s]": s / 30.0, "Y1 [N]": Y}, r"v: covers 3.6 times the distance s"),
        ({"v [km/h]": V + 0 * s, "Y1 [N]": Y}, r"covers 0.278 times the distance s, write `v \[m/s\]`"),
        ({"Y1 [N]": Y / 1e3}, r"Y1: has an rms of 0.00707 kN, .*write `Y1 \[kN\]`"),
        ({"Y1 [kN]": Y}, "Y1: has an rms of 7.07e.03 kN"),
        (
            {"Y1 [N]": Y, "Q1.left [N]": Q / 1e3},
            r"Q1.left: is 0.055 kN .*static wheel load .* 55 kN, write `Q1.left .kN",
        ),
        ({"Y1 [N]": Y, "Q1.left [kN]": Q}, r"write `Q1.left \[N\]`"),
    ):
        speed = {} if any(name.startswith("v") for name in columns) else {"v [m/s]": V + 0 * s}
        path = write_series(tmp_path / "run.csv", clock | speed | columns)
        with pytest.raises(FileProblems, match=message):
            evaluate_measured(path, BOGIE)


def test_the_check_accepts_a_run_for_the_method_and_reports_its_faults(tmp_path: Path) -> None:
    s = np.arange(0.0, 600.0, STEP)
    Y = 10e3 * np.sin(s)
    good = write_run(tmp_path / "good.csv", s, {"Y1.right [N]": Y, "Q1.right [kN]": 55 + Y / 1e4})
    assert check([good]) == [] and check([write_run(tmp_path / "frame.csv", s, {"ayf [m/s^2]": Y / 1e4})]) == []
    bad = write_run(tmp_path / "bad.csv", s, {"Y1.right [m]": Y, "floor.front [m/s^2]": Y})
    assert [(p.key, p.line) for p in check([bad])] == [("Y1.right", 1)]
    without_track = check([write_run(tmp_path / "e.csv", s, {"e1 [m]": Y / 1e7, "ayf [m/s^2]": Y / 1e4})])
    assert [p.key for p in without_track] == ["yw"]


def test_another_load_state_and_unused_columns_are_noted(tmp_path: Path) -> None:
    s = np.arange(0.0, 600.0, STEP)
    Q = 40e3 + 5e3 * np.sin(s)
    path = write_run(tmp_path / "run.csv", s, {"Y1 [N]": 1e3 * np.sin(s), "Q1.left [N]": Q, "ay_car [m/s^2]": 0 * s})
    notes = evaluate_measured(path, BOGIE)["notes"]
    assert any(note.startswith("Q1 is 40 kN in the mean") and "load state" in note for note in notes)
    assert any(note.startswith("columns not used: ay_car; evaluated are") for note in notes)


def test_a_measured_wheel_without_load_fails(tmp_path: Path) -> None:
    s = np.arange(0.0, 1000.0, STEP)
    Q = np.where((s > 300.0) & (s < 310.0), -100.0, 50e3)
    path = write_run(tmp_path / "run.csv", s, {"Y1.right [N]": 1e3 * np.sin(s), "Q1.right [N]": Q})
    result = evaluate_measured(path, BOGIE)
    assert of(result, "wheel unloading", "wheelset 1, right")["exceeded"] and result["verdict"] == "limit exceeded"
    assert of(result, "Y/Q", "wheelset 1, right")["values"] == 9  # of ten sections: one has none
