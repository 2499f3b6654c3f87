"""Score test: planted effects, noise, and the list of candidates."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui.campaign.settings.detection import RefitSettings, ScoreTestSettings
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.problem import truncate
from railui.identification.structure.candidate_scores import (
    NO_SCORE_TEST,
    has_structure,
    run_score_test,
    score_test,
    scored_part,
    structured_candidate,
)
from railui.identification.structure.candidates import Candidate, batch_candidates, list_candidates
from railui.identification.structure.family_wise_test import family_wise_test
from railui.identification.structure.refit import select_candidates
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTestResult
from tests.blind.simulated import Request, calibrated, simulate_together, simulated_campaign
from tests.truth.campaign import noisy
from tests.truth.effects import effect, sense

BRIEF = (25.0, 12.0)  # s; only the first run is scored
PLANTED = {
    "free_play": "free_play at=primary_lateral half_width=4e-4",
    "dry_friction": "dry_friction at=secondary_lateral force=1500 slip_speed=5e-3",
    "gauge_conicity": "gauge_conicity at=contact per_gauge=-40",
}
DAMPER = "viscous_damper at=wheelset_yaw wheelset=2 damping=2e5"
MINUTE = (60.0, 12.0)  # s; the speed varies by several per cent
SETTINGS = ScoreTestSettings()


@pytest.fixture(scope="module", autouse=True)
def _simulated_together() -> None:
    planted = [Request((text,), **options_of(kind)) for kind, text in PLANTED.items()]
    simulate_together(Request(), *planted, Request((DAMPER,), seconds=MINUTE))


def options_of(kind: str) -> dict[str, Any]:
    """Options of the campaign with a planted effect."""
    return {} if kind == "free_play" else {"seconds": BRIEF}


def score_all(fit, context: Context) -> ScoreTestResult:
    return score_test(context, fit, list_candidates(fit.model, context.dataset.estimation))


def test_without_an_unmodelled_effect_no_candidate_explains_two_percent():
    assert score_all(calibrated(), simulated_campaign().context).rho2 < 0.02


@pytest.mark.parametrize("kind", PLANTED)
def test_a_planted_effect_has_the_best_score(kind: str):
    options = options_of(kind)
    case, fit = simulated_campaign(PLANTED[kind], **options), calibrated(PLANTED[kind], **options)
    result = score_all(fit, case.context)
    first = result.best[0].candidate
    assert (first.kind, first.at, first.wheelset) == (kind, case.truth.order.effects[0].at, None)
    assert result.rho2 > 0.05
    assert result.p < 0.01


def yaw_damper(model, segments) -> Candidate:
    """Find the candidate that is planted."""
    found = list_candidates(model, segments)
    return next(c for c in found if (c.kind, c.at, c.wheelset) == ("viscous_damper", "wheelset_yaw", 2))


def test_creep_absorbs_a_damper_of_wheelset_yaw_at_constant_speed():
    # M_psi = -2 b^2 N kappa_x (psi' / V + lambda e / (b r)): kappa_x + V c / (2 b^2 N), lambda kappa_x unchanged
    fit, segments = calibrated(), simulated_campaign().dataset.estimation
    candidate = yaw_damper(fit.model, segments)
    [result] = score_test(simulated_campaign().context, fit, [candidate]).results
    absorbed = dict(zip(fit.free.paths, result.absorbed, strict=True))
    c = candidate.shapes[0]["damping"]
    geometry, load = "vehicle.geometry.half_gauge", "vehicle.wheel_load"
    b, n = (fit.model.design.values[path] for path in (geometry, load))
    creep = segments[0].mean_speed * c / (2 * b**2 * n)
    kappa, conicity = (fit.model.value(f"contact.trailing.{key}") for key in ("longitudinal_creep", "conicity"))
    assert absorbed["contact.trailing.longitudinal_creep"] == pytest.approx(creep, rel=0.03)
    assert absorbed["contact.trailing.conicity"] == pytest.approx(-conicity * creep / kappa, rel=0.03)
    assert result.unabsorbed_share < 1e-3


def test_a_varying_speed_distinguishes_a_yaw_damper_from_creep():
    case, fit = simulated_campaign(DAMPER, seconds=MINUTE), calibrated(DAMPER, seconds=MINUTE)
    first = truncate(case.context, fit.segments, 12.0)  # practically one speed
    result = score_test(case.context, fit, list_candidates(fit.model, case.dataset.estimation), first=first)
    best = result.best[0]
    assert (best.candidate.kind, best.candidate.at, best.candidate.wheelset) == ("viscous_damper", "wheelset_yaw", 2)
    assert best.amount * best.candidate.shapes[best.shape]["damping"] == pytest.approx(2e5, rel=0.3)
    assert result.rho2 > 0.05
    assert result.p < 0.01


def test_a_late_sensor_has_the_best_score():
    case = simulated_campaign()
    order, clean = case.truth.order, case.truth.clean["a"]
    late = sense(clean, clean["t"], [effect("sensor_delay", "ay1", delay=0.01)])
    columns = noisy(late, order, np.random.default_rng(8))
    segment = replace(case.dataset.estimation[0], columns={**case.dataset.estimation[0].columns, **columns}, tables={})
    dataset = replace(case.dataset, segments=(segment, *case.dataset.validation))
    context = create_context(dataset, jobs=2)
    first = score_all(calibrate(context), context).best[0]
    assert (first.candidate.kind, first.candidate.at) == ("sensor_delay", "ay1")
    # the amount is relative to the delay of the candidate's shape
    assert first.amount * first.candidate.shapes[first.shape]["delay"] == pytest.approx(0.01, rel=0.5)


def noise_results(rng: np.random.Generator, kinds: list[Candidate], blocks: int = 40) -> list[ScoreResult]:
    """Score results of pure noise, a third of it common to all."""
    common = rng.standard_normal(blocks)
    scores = [rng.standard_normal(blocks) + 0.6 * common for _ in kinds]
    return [
        ScoreResult(c, 0, rho=float(s.sum()), amount=1.0, scores=s, norm=1.0)
        for c, s in zip(kinds, scores, strict=True)
    ]


TWO_SIDED = [Candidate("cubic_stiffness", "primary_lateral", w) for w in (None, 1, 2)] * 4
ONE_SIDED = [Candidate("dry_friction", "primary_lateral", w) for w in (None, 1, 2)] * 4


@pytest.mark.parametrize("blocks", [12, 40])
def test_the_family_wise_p_of_noise_is_uniform(blocks: int):
    rng = np.random.default_rng(1)
    p = np.array(
        [
            family_wise_test(noise_results(rng, [*TWO_SIDED, *ONE_SIDED], blocks), SETTINGS, seed)[0]
            for seed in range(200)
        ]
    )
    assert 0.35 < np.median(p) < 0.65
    for level in (0.01, 0.05, 0.2, 0.8):
        # four binomial deviations
        assert np.mean(p <= level) == pytest.approx(level, abs=4.0 * np.sqrt(level * (1.0 - level) / len(p)))


def test_noise_exceeds_the_critical_score_in_one_library_of_a_hundred():
    rng = np.random.default_rng(2)
    exceeded = 0
    for seed in range(100):
        result = noise_results(rng, TWO_SIDED, 20)
        exceeded += max(abs(s.z) for s in result) > family_wise_test(result, SETTINGS, seed)[1]
    assert exceeded <= 4


def test_a_negative_rho_does_not_support_a_one_sided_candidate():
    scores = np.random.default_rng(3).standard_normal(40) - 3.0
    friction, cubic = (
        ScoreResult(c[0], 0, rho=-0.6, amount=-1.0, scores=scores, norm=1.0) for c in (ONE_SIDED, TWO_SIDED)
    )
    assert friction.admissible_rho == 0.0
    assert cubic.admissible_rho == pytest.approx(0.6)
    assert family_wise_test([friction], SETTINGS, 0)[0] > 0.99
    assert family_wise_test([cubic], SETTINGS, 0)[0] < 0.01


def test_without_results_nothing_is_significant():
    assert family_wise_test([], SETTINGS, 0)[0] == 1.0


def library(**options) -> list[Candidate]:
    return list_candidates(calibrated().model, simulated_campaign().dataset.estimation, **options)


def test_batches_contain_every_shape_of_every_candidate_once():
    candidates = library()
    counts = Counter(
        (batch.members[member], shape) for batch in batch_candidates(candidates) for member, shape in batch.lanes
    )
    assert counts == Counter((c, shape) for c in candidates for shape in range(len(c.shapes)))


def test_each_lane_of_a_batch_has_an_amount_of_one_effect_only():
    for batch in batch_candidates(library()):
        amounts = batch.amount_rows(0.05)
        assert np.all((amounts > 0).sum(axis=1) == 1)
        assert [int(row.argmax()) for row in amounts] == [member for member, _ in batch.lanes]
        assert len(batch.parameter_rows()) == len(batch.lanes)


def test_candidates_have_shapes_and_are_listed_once():
    candidates = library()
    assert len(candidates) == len(set(candidates)) > 80
    assert all(c.shapes for c in candidates)
    assert {(c.at, c.wheelset) for c in candidates if c.kind == "free_play"} >= {
        ("primary_lateral", w) for w in (None, 1, 2)
    }


@pytest.mark.parametrize(
    ("kind", "ratio"), [("maxwell_damper", ("damping", "stiffness")), ("hysteresis", ("yield", "stiffness"))]
)
def test_scaling_keeps_the_time_constant_or_slip_length_of_an_effect(kind: str, ratio: tuple[str, str]):
    candidate = next(c for c in library() if (c.kind, c.at) == (kind, "secondary_lateral"))
    shape, scaled = candidate.shapes[1], candidate.scale_force(candidate.shapes[1], 0.3)
    over, under = ratio
    assert scaled[over] / scaled[under] == pytest.approx(shape[over] / shape[under])
    assert scaled["stiffness"] == pytest.approx(0.3 * shape["stiffness"])


def test_scaling_keeps_the_slip_speed_of_friction():
    candidate = next(c for c in library() if (c.kind, c.at) == ("dry_friction", "secondary_lateral"))
    scaled = candidate.scale_force(candidate.shapes[0], 0.3)
    assert scaled == pytest.approx({**candidate.shapes[0], "force": 0.3 * candidate.shapes[0]["force"]})


def test_excluded_kinds_are_no_candidates():
    excluded = {"free_play", "bump_stop"}
    assert {c.kind for c in library()} - {c.kind for c in library(without=excluded)} == excluded


def test_a_track_measured_under_load_excludes_rail_flexibility():
    assert {c.kind for c in library()} - {c.kind for c in library(loaded=True)} == {"rail_flexibility"}


def test_gauge_conicity_requires_a_measured_gauge():
    segment = simulated_campaign().dataset.estimation[0]
    bare = replace(segment, columns={k: x for k, x in segment.columns.items() if k != "gauge"}, tables={})
    kinds = {c.kind for c in list_candidates(calibrated().model, [bare])}
    assert {c.kind for c in library()} - kinds == {"gauge_conicity"}


def test_a_measured_force_of_the_carbody_excludes_candidates_there():
    segment = simulated_campaign().dataset.estimation[0]
    with_force = replace(segment, columns={**segment.columns, "Qy": np.zeros(segment.samples)}, tables={})
    locations = {c.at for c in list_candidates(calibrated().model, [with_force])}
    assert "secondary_lateral" not in locations
    assert "secondary_yaw" in locations


def test_an_effect_of_the_model_is_no_candidate():
    candidate = next(c for c in library() if (c.kind, c.at, c.wheelset) == ("free_play", "primary_lateral", None))
    model = calibrated().model.with_effect(candidate.effect_with(candidate.shapes[3]))
    assert candidate not in list_candidates(model, simulated_campaign().dataset.estimation)


def test_only_measured_channels_have_sensor_candidates():
    segment = simulated_campaign().dataset.estimation[0]
    fewer = replace(segment, columns={k: x for k, x in segment.columns.items() if k != "d1"}, tables={})
    at = {c.at for c in list_candidates(calibrated().model, [fewer]) if c.kind == "sensor_delay"}
    assert at == {"e1", "e2", "ay1", "ay2", "ayf", "rf", "d2"}


def test_an_effect_that_acts_in_few_blocks_is_significant():
    rng = np.random.default_rng(4)
    norms = np.where(np.arange(36) % 12 == 5, 10.0, 0.1)  # three active blocks of 36
    scores = 3.0 * norms + np.sqrt(norms) * rng.standard_normal(36)
    rare = ScoreResult(TWO_SIDED[0], 0, rho=0.9, amount=3.0, scores=scores, norm=float(norms.sum()), block_norms=norms)
    by_hand = [s - n * (scores.sum() - s) / (norms.sum() - n) for s, n in zip(scores, norms, strict=True)]
    np.testing.assert_allclose(rare.residual_scores, by_hand)
    assert family_wise_test([rare], SETTINGS, 0)[0] < 0.01
    assert (
        family_wise_test([replace(rare, block_norms=np.zeros(0))], SETTINGS, 0)[0] > 0.05
    )  # as if its inactive blocks were noise


@pytest.mark.parametrize("active", [1, 8])
def test_noise_in_few_blocks_raises_no_false_alarm(active: int):
    rng, p = np.random.default_rng(5), []
    for seed in range(300):
        norms = [np.where(rng.permutation(36) < active, 10.0, 0.1) for _ in TWO_SIDED]
        result = [
            ScoreResult(
                c,
                0,
                rho=0.0,
                amount=0.0,
                scores=np.sqrt(n) * rng.standard_normal(36),
                norm=float(n.sum()),
                block_norms=n,
            )
            for c, n in zip(TWO_SIDED, norms, strict=True)
        ]
        p.append(family_wise_test(result, SETTINGS, seed)[0])
    for level in (0.01, 0.05, 0.2):
        assert np.mean(np.array(p) <= level) < level + 4.0 * np.sqrt(level * (1.0 - level) / len(p))


def test_a_related_law_at_the_location_of_the_best_is_always_fitted():
    others = [c for c in library() if c.at == "secondary_lateral" and c.kind not in ("hysteresis", "dry_friction")]
    kinds = ("hysteresis", "dry_friction")
    best, related = (next(c for c in library() if (c.kind, c.at, c.wheelset) == (k, "primary_yaw", 2)) for k in kinds)
    far = next(c for c in library() if (c.kind, c.at) == ("dry_friction", "secondary_yaw"))
    rho = {best: 0.7} | dict.fromkeys(others, 0.4) | {related: 0.1, far: 0.1}
    result = tuple(ScoreResult(c, 0, rho=r, amount=r, scores=np.full(36, r), norm=1.0) for c, r in rho.items())
    fitted = {s.candidate for s in select_candidates(RefitSettings(), ScoreTestResult(result, result, 1e-3, 4.0, 1.0))}
    assert related in fitted and far not in fitted


def scored(rho2: float, *, is_significant: bool) -> ScoreResult:
    """A result that explains a share, its score above or below a critical one of 4."""
    noise = noise_results(np.random.default_rng(6), TWO_SIDED)[0]
    scores = noise.scores + 100.0 * np.abs(noise.scores).max() if is_significant else noise.scores
    found = replace(noise, rho=np.sqrt(rho2), scores=scores)
    assert (abs(found.z) >= 4.0) is is_significant
    return found


def test_a_residual_of_which_a_candidate_explains_a_fifth_needs_no_test():
    def result(rho2: float, *, is_significant: bool) -> ScoreTestResult:
        return ScoreTestResult((), (scored(rho2, is_significant=is_significant),), 0.5, 4.0, 1.0)

    obvious, structured = SETTINGS.obvious_rho2, SETTINGS.structured_rho2
    assert has_structure(SETTINGS, result(1.01 * obvious, is_significant=False))
    assert not has_structure(SETTINGS, result(0.99 * obvious, is_significant=False))
    assert has_structure(SETTINGS, result(1.01 * structured, is_significant=True))
    assert not has_structure(SETTINGS, result(0.99 * structured, is_significant=True))


def test_the_share_of_one_candidate_and_the_significance_of_another_are_no_structure():
    structured = SETTINGS.structured_rho2
    share, score = scored(2.0 * structured, is_significant=False), scored(0.5 * structured, is_significant=True)
    assert structured_candidate(SETTINGS, ScoreTestResult((), (share, score), 0.001, 4.0, 1.0)) is None
    second = scored(1.5 * structured, is_significant=True)
    assert structured_candidate(SETTINGS, ScoreTestResult((), (share, second), 0.001, 4.0, 1.0)) is second
    extrapolated = replace(scored(2.0 * SETTINGS.obvious_rho2, is_significant=True), is_extrapolated=True)
    assert structured_candidate(SETTINGS, ScoreTestResult((), (share, extrapolated), 0.001, 4.0, 1.0)) is None


def test_candidates_that_were_scored_on_the_whole_part_rank_before_all_others():
    context, fit = simulated_campaign().context, calibrated()
    part = scored_part(context, fit)
    first = truncate(context, part.segments, context.settings.score_test.preselection_duration)
    found = score_test(context, part, library(), first=first)
    again = score_test(context, part, [s.candidate for s in found.best[: SETTINGS.preselected_candidates]])
    assert [s.rho for s in found.best[:12]] == pytest.approx([s.rho for s in again.best[:12]], rel=1e-3)
    assert found.rho2 == pytest.approx(again.rho2, rel=1e-3)


def test_nothing_tested_is_no_evidence():
    rng = np.random.default_rng(1)
    assert family_wise_test(noise_results(rng, TWO_SIDED), SETTINGS, 0, ())[0] == 1.0


def test_nothing_is_scored_where_the_vehicle_diverges():
    fit = calibrated()
    context = simulated_campaign().context
    hunting = np.where(["conicity" in path for path in fit.free.paths], 1.0, fit.x)
    diverging = replace(fit, x=hunting, model=fit.model.with_path_values(fit.free.paths, hunting))
    assert run_score_test(context, diverging) is NO_SCORE_TEST
    assert run_score_test(context, fit).results
