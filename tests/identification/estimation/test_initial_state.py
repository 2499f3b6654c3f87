"""Phases of a run-out: one per run, estimated from its beginning and by the score test."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui.campaign.settings.detection import ScoreTestSettings
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate, with_phases
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.estimation.problem import _inverse_with_usual_motions
from railui.identification.loop import close_loop
from railui.identification.prediction import Predictor
from railui.identification.structure.candidate_scores import score_test
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.identification.structure.family_wise_test import family_wise_test
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTestResult
from railui.report.loop.data import loop_report
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.simulated import Request, SimulatedCampaign, calibrated, simulate_together, simulated_campaign
from tests.truth.files import paths

RUN_OUT = "run_out at=wheelset wheelset=1 force=2500 rolling_radius=0.4613"
OTHER = "run_out at=wheelset wheelset=2 force=2000 rolling_radius=0.4607"
THREE: dict[str, Any] = {
    "seconds": (25.0, 25.0, 20.0),
    "speeds": (40.0, 34.0, 31.0),
}  # the last validates
WIDE_CLEARANCES = (6e-4, 1.5e-3)  # m
TURN = 2.0 * np.pi


@pytest.fixture(scope="module", autouse=True)
def _simulated_together() -> None:
    clearances = [Request((clearance(width),)) for width in WIDE_CLEARANCES]
    run_outs = [Request(planted, **THREE) for planted in ((), (RUN_OUT,), (RUN_OUT, OTHER))]
    simulate_together(Request(), *clearances, *run_outs)


def clearance(half_width: float) -> str:
    """Return the text of a clearance of the axle boxes."""
    return f"free_play at=primary_lateral half_width={half_width}"


def true_model(case: SimulatedCampaign) -> Model:
    """Create the true vehicle with the planted effects, without their phases."""
    true = paths(case.truth.vehicle)
    free = case.dataset.campaign.estimated_parameters
    model = case.nominal.with_path_values(free, np.array([true[p] for p in free]))
    for e in case.truth.order.effects:
        model = model.with_effect(PlacedEffect(e.kind, e.at, e.wheelset, dict(e.parameters)))
    return model


def true_phases(case: SimulatedCampaign, run: str) -> list[float]:
    return [e.parameters["phase"] for e in case.truth.effects[run]]


def angle_between(a: float, b: float) -> float:
    """Compute the difference of two angles [rad]."""
    return abs((a - b + np.pi) % TURN - np.pi)


def with_run_out(nominal: Model, **phases: float) -> Model:
    parameters = {"force": 2500.0, "rolling_radius": 0.46}
    return nominal.with_effect(PlacedEffect("run_out", "wheelset", 1, parameters), phases)


def test_an_angle_in_the_middle_of_a_segment_is_a_phase_at_distance_zero():
    # s/r_e + phase = 1.5 rad at s = 800 m of a wheel of 0.46 m: phase = 1.5 - 800/0.46 = -1737.630435 rad, that is
    # 2.811895 rad beyond 277 whole turns back
    model = with_run_out(simulated_campaign().nominal).with_path_values(["effects.0.phase@1.0"], [1.5])
    assert model.on_segment("1.0", 800.0).value("effects.0.phase") == pytest.approx(2.811895, abs=1e-6)
    assert model.on_segment("0.0", 800.0).value("effects.0.phase") == 0.0  # another run has its own phase


def test_every_run_has_its_own_phase_and_the_same_radius():
    case = simulated_campaign(**THREE)
    a, b = case.dataset.estimation
    model = with_run_out(case.nominal, **{a.segment_key[0]: 0.4, b.segment_key[0]: 2.0})
    for segment, angle in ((a, 0.4), (b, 2.0)):
        s = segment.columns["s"]
        by_hand = model.with_path_values(["effects.0.phase"], [(angle - 0.5 * (s[0] + s[-1]) / 0.46) % TURN])
        by_hand = Model(by_hand.design)
        assert np.allclose(
            Predictor(model, segment).simulate(["e1"]).series,
            Predictor(by_hand, segment).simulate(["e1"]).series,
            atol=1e-9,
        )


def test_a_window_has_the_phase_of_its_segment():
    (whole,) = simulated_campaign().dataset.estimation
    assert {w.segment_key for w in whole.windows(3.0)} == {whole.segment_key}
    assert whole.truncated(500).segment_key == whole.segment_key


def test_removing_an_effect_keeps_the_phases_of_the_others():
    first, second = ({"0.0": 0.1, "1.0": 0.2}, {"0.0": 0.3, "1.0": 0.4})
    model = with_run_out(simulated_campaign().nominal, **first)
    model = model.with_effect(PlacedEffect("run_out", "wheelset", 2, {"force": 1e3, "rolling_radius": 0.46}), second)
    assert model.without_effect(0).phases == {"effects.0.phase@0.0": 0.3, "effects.0.phase@1.0": 0.4}
    assert model.without_effect(1).phases == {"effects.0.phase@0.0": 0.1, "effects.0.phase@1.0": 0.2}


@pytest.mark.parametrize("planted", [(RUN_OUT,), (RUN_OUT, OTHER)], ids=["one wheelset", "both, each its own"])
def test_four_seconds_determine_the_phases_of_a_validation_run(planted: tuple[str, ...]):
    case = simulated_campaign(*planted, **THREE)
    (segment,) = case.dataset.validation
    met = estimate_phases(case.context, true_model(case), segment).on_segment(*segment.segment_key)
    for i, phase in enumerate(true_phases(case, "c")):
        assert angle_between(met.value(f"effects.{i}.phase"), phase) < 0.05


def test_the_score_test_estimates_the_phase_of_every_run():
    case, fit = simulated_campaign(RUN_OUT, **THREE), calibrated(RUN_OUT, **THREE)
    seen = score_run_outs(fit, case.context)
    first = seen.best[0]
    assert (first.candidate.kind, first.candidate.at, first.candidate.wheelset) == ("run_out", "wheelset", 1)
    assert seen.rho2 > 0.8
    assert first.candidate.shapes[first.shape]["rolling_radius"] == pytest.approx(0.4613, rel=1.1e-3)
    assert first.amount * first.candidate.shapes[first.shape]["force"] == pytest.approx(2500.0, rel=0.1)
    for segment, run in zip(case.dataset.estimation, "ab", strict=True):
        where, middle, _ = segment.segment_key
        assert angle_between(first.phases[where], middle / 0.4613 + true_phases(case, run)[0]) < 0.2


def score_run_outs(fit: Fit, context: Context) -> ScoreTestResult:
    candidates = [c for c in list_candidates(fit.model, context.dataset.estimation) if c.kind == "run_out"]
    return score_test(context, fit, candidates)


def test_two_runs_without_run_out_show_none():
    assert score_run_outs(calibrated(**THREE), simulated_campaign(**THREE).context).rho2 < 0.01


def test_the_family_wise_p_accounts_for_free_phases():
    rng, where = np.random.default_rng(4), np.repeat([0, 1], 20)
    kinds = [Candidate("run_out", "wheelset", w) for w in (None, 1, 2)]
    p = np.array(
        [
            family_wise_test([noise_result(rng, c, where) for c in kinds], ScoreTestSettings(), seed)[0]
            for seed in range(200)
        ]
    )
    assert 0.35 < np.median(p) < 0.65
    for level in (0.05, 0.2, 0.8):
        assert np.mean(p <= level) == pytest.approx(level, abs=4.0 * np.sqrt(level * (1.0 - level) / len(p)))


def noise_result(rng: np.random.Generator, candidate: Candidate, where: np.ndarray) -> ScoreResult:
    """Score noise in sine and cosine at the phase of each segment that explains most."""
    sine, cosine = rng.standard_normal((2, len(where)))
    angle = np.arctan2(*(np.bincount(where, x)[where] for x in (cosine, sine)))
    scores = np.cos(angle) * sine + np.sin(angle) * cosine
    quadrature = np.cos(angle) * cosine - np.sin(angle) * sine
    return ScoreResult(
        candidate,
        0,
        rho=float(scores.sum()),
        amount=1.0,
        scores=scores,
        norm=1.0,
        quadrature_scores=quadrature,
        segment_of_block=where,
    )


def test_a_motion_of_a_rig_that_grows_leaves_an_inverse_in_rounding():
    rows = 1e20 * np.ones((2, 3))
    inverse = _inverse_with_usual_motions(rows @ rows.T, is_rig=True)
    np.testing.assert_allclose(inverse @ (rows @ rows.T) @ [1.0, 1.0], [1.0, 1.0], rtol=1e-9)


def test_a_nominal_run_out_is_fitted_with_a_phase_per_run():
    case = simulated_campaign(RUN_OUT, **THREE)
    effect = PlacedEffect("run_out", "wheelset", 1, {"force": 2500.0, "rolling_radius": 0.4613})
    campaign = case.dataset.campaign
    dataset = replace(case.dataset, campaign=replace(campaign, design=campaign.design.with_effects([effect])))
    fit = calibrate(with_phases(create_context(dataset, jobs=2)))
    for segment, run in zip(dataset.estimation, "ab", strict=True):
        met = fit.model.on_segment(*segment.segment_key)
        assert angle_between(met.value("effects.0.phase"), true_phases(case, run)[0]) < 0.05


@pytest.fixture(scope="module")
def report() -> dict[str, Any]:
    return loop_report(close_loop(simulated_campaign(RUN_OUT, **THREE).dataset, jobs=2))


def test_a_run_out_is_found_although_every_run_has_another_phase(report: dict[str, Any]):
    assert report["verdict"] == "effect"
    (one,) = report["effects"]
    assert (one["kind"], one["at"], one["wheelset"]) == ("run_out", "wheelset", 1)
    assert one["parameters"]["force"]["value"] == pytest.approx(2500.0, rel=0.03)
    assert one["parameters"]["rolling_radius"]["value"] == pytest.approx(0.4613, rel=5e-5)
    assert report["after"]["nrmse"] <= 1.10 * report["floor"]["nrmse"]


def test_the_report_contains_the_phase_of_every_run(report: dict[str, Any]):
    rows = report["effects"][0]["phases"]
    assert [(r["file"], r["role"]) for r in rows] == [
        ("run_a.csv.gz", "adjust"),
        ("run_b.csv.gz", "adjust"),
        ("run_c.csv.gz", "validate"),
    ]
    case = simulated_campaign(RUN_OUT, **THREE)
    for row, run in zip(rows, "abc", strict=True):
        sd = 0.02 if row["sd"] is None else row["sd"]
        assert 0.0 < sd < 0.1
        assert angle_between(row["value"], true_phases(case, run)[0]) < 4.0 * sd


def test_several_runs_without_run_out_need_no_effect():
    found = close_loop(simulated_campaign(**THREE).dataset, jobs=2)
    assert found.verdict == "none"
    assert not found.after.model.effects


@pytest.mark.parametrize("half_width", WIDE_CLEARANCES)
def test_the_start_of_a_vehicle_with_a_wide_clearance_fits_as_well_as_the_rest(half_width: float):
    # undamped steps of the linear estimate leave two to three times the error of the rest
    case = simulated_campaign(clearance(half_width))
    effect = case.truth.order.effects[0]
    model = case.true_model.with_effect(PlacedEffect(effect.kind, effect.at, None, dict(effect.parameters)))
    for segment in case.dataset.segments:
        start = estimate_initial_state(case.context, model, segment)
        measured, second = segment.measured(segment.channels), round(1.0 / segment.dt)
        simulated = Predictor(model, segment, initial_state=start).simulate().series[0]
        error = (measured - simulated) / measured.std(axis=1)[:, None]
        first, rest = error[:, second // 2 : 4 * second], error[:, 8 * second :]
        assert np.sqrt(np.mean(first**2)) < 1.5 * np.sqrt(np.mean(rest**2))
