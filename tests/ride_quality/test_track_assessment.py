"""Track assessment: statistics of sections, and ranks by ride and by geometry."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import signal, stats

from railui.cli import cli
from railui.ride_quality.evaluation import excitation_of, ride, simulate
from railui.ride_quality.guiding_forces import characteristic_values
from railui.ride_quality.running_safety import running_safety
from railui.ride_quality.safety_limits import force_limit
from railui.ride_quality.track_assessment import assess, band_pass, rank_correlation, ranks, severity
from railui.track import Track, band_sd, synthetic_track
from railui.track.reader import save_track
from railui.vehicle.design_reader import load_design
from railui.vehicle.resolve import resolve_model

HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"


def faulty_line(*faults: tuple[float, float, float, float]) -> Track:
    """A good line with waves of a length and an amplitude between two places."""
    good = synthetic_track("erri_b176_low", length=2000.0, seed=1)
    yw = good.yw.copy()
    for begin, end, wave, amplitude in faults:
        inside = np.clip(np.minimum(good.s - begin, end - good.s) / 20.0, 0.0, 1.0)
        yw += amplitude * inside * np.sin(2 * np.pi * good.s / wave)
    return Track(good.s, yw, good.phiw, good.gauge)


@pytest.mark.parametrize("design", [BOGIE, HOME / "designs/manchester_coach.yaml"])
def test_guiding_forces_of_sections_are_those_of_the_ride(design: Path) -> None:
    line = synthetic_track("erri_b176_high", length=1000.0, seed=3)
    result = assess(line, design, 40.0, section_length=250.0)
    safety = running_safety(resolve_model(design), excitation_of(line, 40.0))
    assert safety is not None
    whole = safety.as_dict()
    sums = [one["sum_of_guiding_forces"] for one in result["stretches"]]
    of_wheelsets = max(one["sum_of_guiding_forces"] for one in whole["wheelsets"])
    # a percentile of the whole lies between those of its parts
    assert min(sums) < of_wheelsets <= max(sums)
    assert min(sums) > 0 and result["sum_of_guiding_forces_limit"] == whole["wheelsets"][0]["limit"]
    quotients = [one["derailment_quotient"] for one in result["stretches"]]
    assert min(quotients) < whole["derailment_quotient"] <= max(quotients)
    assert any("planar" in note for note in result["notes"]) == (design == BOGIE)
    assert any("fixed transfer" in note for note in result["notes"]) == (design == BOGIE)


def test_a_section_has_the_statistics_of_the_whole_ride_in_it() -> None:
    line = synthetic_track("erri_b176_high", length=1000.0, seed=3)
    result = assess(line, BOGIE, 40.0, section_length=250.0)
    e = np.array([simulate(BOGIE, line, 40.0, [c])[c] for c in ("e1", "e2")])
    for one in result["stretches"]:
        a, b = np.searchsorted(line.s, [one["from"] - 0.01, one["to"] + 0.01])
        assert one["largest_e"] == pytest.approx(np.abs(e[:, a:b]).max(), rel=1e-9)
        assert one["flange_fractions"] == pytest.approx((np.abs(e[:, a:b]) >= 7e-3).mean(axis=1), abs=1e-12)
    # mean squares of equal stretches add up to that of the ride
    rms = [one["weighted_acceleration"] for one in result["stretches"]]
    assert np.sqrt(np.mean(np.square(rms))) == pytest.approx(ride(BOGIE, line, 40.0)["weighted_acceleration"], rel=1e-3)


def test_gauge_widens_the_clearance_of_a_section_under_each_wheelset() -> None:
    """The margin is (c + mean g/2 - abs(mean e))/sd, sd^2 = var e + var g/2, the trailing wheelset 2a behind."""
    design = load_design(BOGIE).with_values({"contact.gauge_widens_clearance": True, "contact.flange_clearance": 2e-3})
    line = synthetic_track("fra_3", length=1000.0, seed=3)
    behind = 2.0 * design.value("vehicle.geometry.half_wheelbase")
    half_gauges = [0.5 * np.interp(line.s - back, line.s, line.gauge) for back in (0.0, behind)]
    ridden = simulate(design, line, 40.0, ["e1", "e2"])
    wheels = list(zip((ridden["e1"], ridden["e2"]), half_gauges, strict=True))
    for one in assess(line, design, 40.0, section_length=250.0)["stretches"]:
        a, b = np.searchsorted(line.s, [one["from"] - 0.01, one["to"] + 0.01])
        shares = [float((np.abs(e[a:b]) >= 2e-3 + half[a:b]).mean()) for e, half in wheels]
        assert one["flange_fractions"] == pytest.approx(shares, abs=2e-3) and max(shares) > 0.01
        room = 2e-3 + np.mean([half[a:b] for _, half in wheels])
        margins = [(room - abs(e[a:b].mean())) / np.hypot(e[a:b].std(), half[a:b].std()) for e, half in wheels]
        assert one["flange_margin"] == pytest.approx(min(margins), rel=1e-3)


def test_flange_contact_ranks_sections_of_equal_class_and_score() -> None:
    more, less, none = ({"class": "dangerous", "score": 0.0, "flange_fraction": x} for x in (0.8, 0.6, None))
    assert severity(more) > severity(less) > severity(none)
    assert severity(less) > severity(more | {"score": 10.0}) > severity(more | {"class": "good"})


def test_the_worst_geometry_is_not_the_worst_ride() -> None:
    # short waves that the vehicle does not follow, and smaller ones as long as it hunts
    line = faulty_line((400.0, 600.0, 4.0, 2.5e-3), (1200.0, 1400.0, 11.1, 1.2e-3))
    result = assess(line, BOGIE, 40.0)["stretches"]
    assert (result[0]["from"], result[0]["rank_geometry"]) == (pytest.approx(1200.0), 2)
    worst = next(one for one in result if one["rank_geometry"] == 1)
    assert worst["from"] == pytest.approx(400.0)
    assert worst["sd_yw"] > 1.5 * result[0]["sd_yw"] and worst["score"] > result[0]["score"] + 3


def test_sections_cover_the_track_once_worst_first() -> None:
    result = assess(synthetic_track("fra_4", length=930.0, seed=2), BOGIE, 40.0, section_length=200.0)["stretches"]
    along = sorted((one["from"], one["to"]) for one in result)
    assert [round(a) for a, _ in along] == [0, 200, 400, 600, 800]
    assert all(b + 0.1 == pytest.approx(a) for (_, b), (a, _) in pairwise(along))
    assert along[-1][1] == pytest.approx(930.0, abs=0.2)
    scores = [one["score"] for one in result if one["class"] == result[-1]["class"]]
    assert scores == sorted(scores)


@pytest.mark.parametrize("stretch", [1.0, 2.0, 3.9, float("nan"), 400.0])
def test_a_section_too_short_or_too_long_is_rejected_with_its_range(stretch: float) -> None:
    with pytest.raises(ValueError, match=r"section of .* cannot be assessed: give a length between 4 m and the length"):
        assess("erri_b176_low length=400", BOGIE, 60.0, section_length=stretch)
    done = CliRunner().invoke(
        cli, ["assess", "erri_b176_low length=400", str(BOGIE), "--speed", "60", "--stretch", "2"]
    )
    assert done.exit_code == 2 and "between 4 m" in done.output


def test_the_shortest_sections_are_assessed_with_any_last_piece() -> None:
    for length in np.arange(40.0, 44.0, 0.5):
        result = assess(f"erri_b176_low length={length}", BOGIE, 60.0, section_length=4.0)
        assert all(np.isfinite(one["sum_of_guiding_forces"]) for one in result["stretches"])


def test_the_percentile_of_a_single_mean_is_that_mean() -> None:
    assert characteristic_values(np.array([[3.0], [4.0]])).tolist() == [3.0, 4.0]


def test_waves_of_a_band_have_its_standard_deviation() -> None:
    line = synthetic_track("erri_b176_high", length=3000.0, seed=1)
    assert band_pass(line, 3.0, 25.0).std() == pytest.approx(band_sd(line, [(3.0, 25.0)])[0], rel=0.02)


def test_a_vehicle_that_leaves_the_track_is_dangerous_from_there_on() -> None:
    result = assess("erri_b176_high length=2000", HOME / "designs/check_bogie.yaml", 80.0)
    assert result["stretches"][0]["class"] == "dangerous" and result["stretches"][0]["largest_e"] is None
    assert "left the track" in " ".join(result["notes"])


def test_the_command_prints_sections_draws_and_rejects_faulty_input(tmp_path: Path) -> None:
    line = synthetic_track("fra_1", length=1000.0, seed=1)
    save_track(tmp_path / "line.csv", line.s, line.yw, line.phiw, line.gauge, conventions=line.conventions)
    words = ["assess", str(tmp_path / "line.csv"), str(BOGIE), "--speed", "60", "--json", str(tmp_path / "a.json")]
    done = CliRunner().invoke(cli, [*words, "--figure", str(tmp_path / "a.svg"), "--strict"])
    assert done.exit_code == 4, done.output
    result = json.loads((tmp_path / "a.json").read_text())
    assert {"from", "to", "score", "flange_fraction"} <= set(result["stretches"][0])
    assert len(result["inputs"]) == 2 and (tmp_path / "a.svg").read_text().count("<svg") == 1
    assert CliRunner().invoke(cli, [*words, "--stretch", "3 km"]).exit_code == 2
    assert CliRunner().invoke(cli, ["assess", "fra_9", str(BOGIE), "--speed", "40"]).exit_code == 2


def test_ranks_and_rank_correlation_agree_with_scipy() -> None:
    sd = np.array([0.3, 0.1, 0.3, 0.7, 0.2, 0.1, 0.1])
    severities = [(-1.0, -float(score), 0.0) for score in (40, 60, 40, 20, 50, 55, 70)]
    assert [first for first, _ in ranks(-sd)] == stats.rankdata(-sd, method="min").tolist()
    order = [sorted(severities).index(s) for s in severities]
    assert rank_correlation(sd, severities) == pytest.approx(stats.spearmanr(sd, order).statistic, rel=1e-12)


def test_a_band_passed_track_is_detrended_as_by_scipy() -> None:
    track = Track(0.1 * np.arange(997), 0.01 + 1e-5 * np.arange(997) + faulty_line().yw[:997])
    line = np.fft.rfft(signal.detrend(track.yw))
    wavelength = 99.7 / np.maximum(np.arange(len(line)), 1e-9)
    line[(wavelength < 3.0) | (wavelength >= 25.0)] = 0.0
    assert band_pass(track, 3.0, 25.0) == pytest.approx(np.fft.irfft(line, 997), abs=1e-15)


def test_flange_contact_in_a_curve_does_not_lower_the_class_of_a_section() -> None:
    """All of the curve with the flange at the rail: comfort and running safety remain; straights count as before."""
    design, line = HOME / "designs/manchester_coach.yaml", HOME / "designs/lines/reverse_curves.yaml"
    tight = load_design(design).with_values({"contact.flange_clearance": 6e-3})
    result = assess(line, tight, 25.0)
    sections = {round(one["from"]): one for one in result["stretches"]}
    e = simulate(tight, line, 25.0, ["e1"])["e1"]
    assert np.mean(np.abs(e[3000:5000]) > 6e-3) > 0.9
    for start in (200, 400, 800, 1000):  # mainly in curves and transitions
        one = sections[start]
        assert one["flange_fraction"] is None and one["class"] in ("good", "very good")
        assert "comfort alone, flanges guide in the curve" in one["decided_by"]
    assert sections[0]["flange_fractions"][0] == pytest.approx(np.mean(np.abs(e[:2000]) >= 6e-3), abs=1e-3)
    assert "guidance" in sections[0]["decided_by"]
    assert any(note.startswith("curves: flanges guide there") for note in result["notes"])


def test_sections_are_scored_by_guiding_forces_where_the_design_asks_for_it() -> None:
    design = load_design(BOGIE).with_values({"riding.guidance": "lateral_force"})
    line = synthetic_track("erri_b176_high", length=1000.0, seed=1)
    result = assess(line, design, 45.0, section_length=500.0)
    Y = np.array(list(simulate(design, line, 45.0, ["Y1", "Y2"]).values())[2:])
    limit = float(force_limit(np.array([55e3]), design.riding.use)[0])
    for one in result["stretches"]:
        a, b = np.searchsorted(line.s, [one["from"] - 0.01, one["to"] + 0.01])
        assert one["flange_fractions"] == pytest.approx((np.abs(Y[:, a:b]) >= limit).mean(axis=1), abs=1e-12)
        margins = (limit - np.abs(Y[:, a:b].mean(axis=1))) / Y[:, a:b].std(axis=1)
        assert one["flange_margin"] == pytest.approx(margins.min(), rel=1e-9)
        assert one["largest_e"] < 0.1  # m, not N
    assert any("sum of guiding forces against" in note for note in result["notes"])
    curved = assess(HOME / "designs/lines/reverse_curves.yaml", design, 25.0)
    assert all(one["flange_fraction"] is not None for one in curved["stretches"])
    assert not any(note.startswith("curves:") for note in curved["notes"])


def test_what_the_forces_of_a_linear_design_cannot_show_is_noted() -> None:
    notes = " ".join(assess("erri_b176_low length=400", HOME / "designs/check_bogie.yaml", 40.0)["notes"])
    assert "no flange_contact" in notes and "no creep law" in notes


def test_a_section_with_a_kink_is_dangerous_and_stands_first() -> None:
    line = synthetic_track("erri_b176_low", length=1000.0, seed=1)
    x = (line.s - 650.0) / 10.0
    kink = np.where(np.abs(x) < 0.5, 0.02 * (1 + np.cos(2 * np.pi * x)), 0.0)
    result = assess(Track(line.s, line.yw + kink), HOME / "designs/bogie_under_coach.yaml", 45.0)
    worst, *others = result["stretches"]
    assert worst["from"] == pytest.approx(600.0) and worst["class"] == "dangerous"
    at = {each["criterion"]: each["at"] for each in worst["criteria"]}
    assert worst["decided_by"].startswith("Y/Q") and 645.0 < at["derailment_quotient"] < 660.0
    assert all(one["class"] != "dangerous" and one["safety_share"] < 1.0 for one in others)
