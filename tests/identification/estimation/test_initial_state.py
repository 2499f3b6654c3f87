"""What turns stands otherwise at the beginning of every run: phases of a run-out, one per stretch."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui.campaign.dataset import Dataset, simulate
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.loop import calibrate, close_loop, nominal_model
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.identification.structure.evidence import ScoreResult, family_wise_test
from railui.identification.structure.score_test import ScoreTestResult, score_test
from railui.report.loop.data import loop_report
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.made import SimulatedCampaign, calibrated, simulated_campaign
from tests.truth.files import paths

RUN_OUT = "run_out at=wheelset wheelset=1 force=2500 rolling_radius=0.4613"
OTHER = "run_out at=wheelset wheelset=2 force=2000 rolling_radius=0.4607"
THREE: dict[str, Any] = {"seconds": (25.0, 25.0, 20.0), "speeds": (40.0, 34.0, 31.0)}  # two adjust, one validates
TURN = 2.0 * np.pi


def true_model(one: SimulatedCampaign) -> Model:
    """The true vehicle with the effects that were planted, its phases unknown."""
    true = paths(one.truth.vehicle)
    free = one.dataset.campaign.estimated_parameters
    model = one.nominal.with_row(free, np.array([true[p] for p in free]))
    for e in one.truth.order.effects:
        model = model.with_effect(PlacedEffect(e.kind, e.at, e.wheelset, dict(e.parameters)))
    return model


def true_phases(one: SimulatedCampaign, run: str) -> list[float]:
    return [e.parameters["phase"] for e in one.truth.effects[run]]


def apart(a: float, b: float) -> float:
    """The angle between two angles [rad]."""
    return abs((a - b + np.pi) % TURN - np.pi)


def turning(declared: Model, **phases: float) -> Model:
    parameters = {"force": 2500.0, "rolling_radius": 0.46}
    return declared.with_effect(PlacedEffect("run_out", "wheelset", 1, parameters), phases)


def test_an_angle_in_the_middle_of_a_stretch_is_a_phase_at_its_odometer_s_zero():
    # s/r_e + phase = 1.5 rad at s = 800 m of a wheel of 0.46 m: phase = 1.5 - 800/0.46 = -1737.630435 rad, that is
    # 2.811895 rad beyond 277 whole turns back
    model = turning(simulated_campaign().nominal).with_row(["effects.0.phase@1.0"], [1.5])
    assert model.on("1.0", 800.0).value("effects.0.phase") == pytest.approx(2.811895, abs=1e-6)
    assert model.on("0.0", 800.0).value("effects.0.phase") == 0.0  # nothing is known of another run


def test_every_run_turns_by_its_own_phase_and_the_same_radius():
    one = simulated_campaign(**THREE)
    a, b = one.dataset.estimation
    model = turning(one.nominal, **{a.segment_key[0]: 0.4, b.segment_key[0]: 2.0})
    for stretch, angle in ((a, 0.4), (b, 2.0)):
        s = stretch.columns["s"]
        by_hand = model.with_row(["effects.0.phase"], [(angle - 0.5 * (s[0] + s[-1]) / 0.46) % TURN])
        by_hand = Model(by_hand.design)
        assert np.allclose(simulate(model, stretch, ["e1"])[0], simulate(by_hand, stretch, ["e1"])[0], atol=1e-9)


def test_a_window_turns_as_the_stretch_that_it_was_cut_from():
    (whole,) = simulated_campaign().dataset.estimation
    assert {w.segment_key for w in whole.windows(3.0)} == {whole.segment_key}
    assert whole.truncated(500).segment_key == whole.segment_key


def test_an_effect_taken_out_leaves_the_others_their_phases():
    first, second = ({"0.0": 0.1, "1.0": 0.2}, {"0.0": 0.3, "1.0": 0.4})
    model = turning(simulated_campaign().nominal, **first)
    model = model.with_effect(PlacedEffect("run_out", "wheelset", 2, {"force": 1e3, "rolling_radius": 0.46}), second)
    assert model.without(0).phases == {"effects.0.phase@0.0": 0.3, "effects.0.phase@1.0": 0.4}
    assert model.without(1).phases == {"effects.0.phase@0.0": 0.1, "effects.0.phase@1.0": 0.2}


@pytest.mark.parametrize("planted", [(RUN_OUT,), (RUN_OUT, OTHER)], ids=["one wheelset", "both, each its own"])
def test_four_seconds_tell_the_phases_of_a_run_that_no_fit_has_seen(planted: tuple[str, ...]):
    one = simulated_campaign(*planted, **THREE)
    (stretch,) = one.dataset.validation
    met = estimate_phases(true_model(one), stretch, one.dataset.noise).on(*stretch.segment_key)
    for i, phase in enumerate(true_phases(one, "c")):
        assert apart(met.value(f"effects.{i}.phase"), phase) < 0.05


def test_the_trace_sees_the_phase_of_every_run():
    one, fit = simulated_campaign(RUN_OUT, **THREE), calibrated(RUN_OUT, **THREE)
    seen = traced(fit, one.dataset)
    first = seen.best[0]
    assert (first.candidate.kind, first.candidate.at, first.candidate.wheelset) == ("run_out", "wheelset", 1)
    assert seen.rho2 > 0.8
    assert first.candidate.shapes[first.shape]["rolling_radius"] == pytest.approx(0.4613, rel=1.1e-3)
    assert first.amount * first.candidate.shapes[first.shape]["force"] == pytest.approx(2500.0, rel=0.1)
    for stretch, run in zip(one.dataset.estimation, "ab", strict=True):
        where, middle = stretch.segment_key
        assert apart(first.phases[where], middle / 0.4613 + true_phases(one, run)[0]) < 0.2


def traced(fit: Any, measurement: Dataset) -> ScoreTestResult:
    return score_test(
        fit, [c for c in list_candidates(fit.model, measurement.estimation) if c.kind == "run_out"], jobs=2
    )


def test_with_two_runs_and_nothing_missing_no_wheel_is_seen_to_run_out():
    assert traced(calibrated(**THREE), simulated_campaign(**THREE).dataset).rho2 < 0.01


def test_the_family_wise_p_of_noise_knows_that_phases_are_free():
    rng, where = np.random.default_rng(4), np.repeat([0, 1], 20)
    kinds = [Candidate("run_out", "wheelset", w) for w in (None, 1, 2)]
    p = np.array([family_wise_test([of_noise(rng, c, where) for c in kinds], seed)[0] for seed in range(200)])
    assert 0.35 < np.median(p) < 0.65
    for level in (0.05, 0.2, 0.8):
        assert np.mean(p <= level) == pytest.approx(level, abs=4.0 * np.sqrt(level * (1.0 - level) / len(p)))


def of_noise(rng: np.random.Generator, candidate: Candidate, where: np.ndarray) -> ScoreResult:
    """Noise in sine and cosine, seen with the phase of each stretch that suits it."""
    sine, cosine = rng.standard_normal((2, len(where)))
    angle = np.arctan2(*(np.bincount(where, x)[where] for x in (cosine, sine)))
    scores = np.cos(angle) * sine + np.sin(angle) * cosine
    beside = np.cos(angle) * cosine - np.sin(angle) * sine
    return ScoreResult(candidate, 0, float(scores.sum()), 1.0, scores, 1.0, beside=beside, where=where)


def test_a_declared_run_out_is_fitted_to_the_phase_of_every_run():
    one = simulated_campaign(RUN_OUT, **THREE)
    effect = PlacedEffect("run_out", "wheelset", 1, {"force": 2500.0, "rolling_radius": 0.4613})
    campaign = one.dataset.campaign
    measurement = replace(one.dataset, campaign=replace(campaign, design=campaign.design.with_effects([effect])))
    fit = calibrate(measurement, nominal_model(measurement), jobs=2)
    for stretch, run in zip(measurement.estimation, "ab", strict=True):
        met = fit.model.on(*stretch.segment_key)
        assert apart(met.value("effects.0.phase"), true_phases(one, run)[0]) < 0.05


@pytest.fixture(scope="module")
def report() -> dict[str, Any]:
    return loop_report(close_loop(simulated_campaign(RUN_OUT, **THREE).dataset, jobs=2))


def test_a_wheelset_that_runs_out_is_found_though_every_run_begins_with_another_phase(report: dict[str, Any]):
    assert report["verdict"] == "effect"
    (one,) = report["effects"]
    assert (one["kind"], one["at"], one["wheelset"]) == ("run_out", "wheelset", 1)
    assert one["parameters"]["force"]["value"] == pytest.approx(2500.0, rel=0.03)
    assert one["parameters"]["rolling_radius"]["value"] == pytest.approx(0.4613, rel=5e-5)
    assert report["after"]["nrmse"] <= 1.10 * report["floor"]["nrmse"]


def test_the_report_tells_the_phase_of_every_run(report: dict[str, Any]):
    rows = report["effects"][0]["phases"]
    assert [(r["file"], r["role"]) for r in rows] == [
        ("run_a.csv.gz", "adjust"),
        ("run_b.csv.gz", "adjust"),
        ("run_c.csv.gz", "validate"),
    ]
    one = simulated_campaign(RUN_OUT, **THREE)
    for row, run in zip(rows, "abc", strict=True):
        sd = 0.02 if row["sd"] is None else row["sd"]
        assert 0.0 < sd < 0.1
        assert apart(row["value"], true_phases(one, run)[0]) < 4.0 * sd


def test_where_no_wheelset_runs_out_several_runs_lack_nothing():
    found = close_loop(simulated_campaign(**THREE).dataset, jobs=2)
    assert found.verdict == "none"
    assert not found.after.model.effects
