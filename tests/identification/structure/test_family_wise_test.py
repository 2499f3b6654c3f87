"""Scores of candidates and the test of the best against noise, by hand calculation and draw by draw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from railui.arrays import FloatArray
from railui.campaign.settings.detection import ScoreTestSettings
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.family_wise_test import SIX_POINTS, family_wise_p, family_wise_test
from railui.identification.structure.score_result import BlockScore, ScoreResult
from railui.identification.structure.student import as_normal, from_normal, noncentrality

CUBIC = Candidate("cubic_stiffness", "primary_lateral", None)
FRICTION = Candidate("dry_friction", "primary_lateral", None)
RUN_OUT = Candidate("run_out", "contact", 1)
SCORES = np.array([3.0, -1.0, 4.0, 1.0, 5.0])
NORMS = np.array([1.0, 2.0, 3.0, 2.0, 2.0])
FEW_DRAWS = replace(ScoreTestSettings(), bootstrap_draws=100)


def result(scores: FloatArray, norms: FloatArray | None = None, candidate: Candidate = CUBIC) -> ScoreResult:
    block_norms = np.zeros(0) if norms is None else norms
    return ScoreResult(candidate, 0, rho=0.5, amount=1.2, scores=scores, norm=10.0, block_norms=block_norms)


def test_a_result_is_printed_without_its_arrays_of_blocks():
    text = repr(result(SCORES, NORMS))
    assert "norm=10.0" in text
    assert not any(name in text for name in ("absorbed=", "block_norms", "quadrature_scores", "segment_of_block"))


def test_a_result_of_the_score_alone_has_no_phases_and_nothing_absorbed():
    plain = ScoreResult(CUBIC, 0, rho=0.5, amount=1.2, scores=SCORES, norm=10.0)
    arrays = (plain.absorbed, plain.block_norms, plain.quadrature_scores, plain.segment_of_block)
    assert [x.size for x in arrays] == [0, 0, 0, 0]
    assert [x.dtype.kind for x in arrays] == ["f", "f", "f", "i"]
    assert plain.unabsorbed_share == 1.0 and plain.phases == {}


def student_to_normal(t: float, n: float) -> float:
    """Wallace's approximation."""
    return float(np.sign(t) * (8 * n + 1) / (8 * n + 3) * np.sqrt(n * np.log(1 + t * t / n)))


def test_blocks_have_the_weight_of_their_squared_length():
    assert result(SCORES).leverage.tolist() == [0.2] * 5
    assert result(SCORES, NORMS).leverage.tolist() == pytest.approx([0.1, 0.2, 0.3, 0.2, 0.2])
    assert result(SCORES, np.zeros(5)).leverage.tolist() == [0.0] * 5
    assert result(SCORES, np.full(5, 1e-20)).leverage.tolist() == pytest.approx([0.2] * 5)


def test_residual_scores_are_those_of_an_amount_from_the_other_blocks():
    by_hand = [s - n * (12.0 - s) / (10.0 - n) for s, n in zip(SCORES, NORMS, strict=True)]
    assert result(SCORES, NORMS).residual_scores.tolist() == pytest.approx(by_hand)
    assert result(SCORES, NORMS).standard_deviation == pytest.approx(np.sqrt(np.square(by_hand).sum()))


def test_a_block_that_alone_determines_the_amount_has_a_bounded_residual():
    lonely = result(np.array([2.0, 1.0]), np.array([1.0, 0.0]))
    assert lonely.residual_scores.tolist() == pytest.approx([-1e6, 1.0])
    assert lonely.degrees_of_freedom == 1.0


def test_degrees_of_freedom_are_the_effective_blocks_less_one():
    assert result(SCORES).degrees_of_freedom == pytest.approx(4.0)
    assert result(SCORES, NORMS).degrees_of_freedom == pytest.approx(1 / (0.01 + 0.04 + 0.09 + 0.04 + 0.04) - 1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_z_is_the_score_over_its_deviation_as_a_normal_variable(sign: float):
    residuals = [s - n * (12.0 - s) / (10.0 - n) for s, n in zip(SCORES, NORMS, strict=True)]
    t = sign * 12.0 / np.sqrt(np.square(residuals).sum())
    assert result(sign * SCORES, NORMS).z == pytest.approx(student_to_normal(t, 1 / 0.22 - 1))


def test_z_has_no_scale():
    assert result(1e-4 * SCORES, NORMS).z == pytest.approx(result(SCORES, NORMS).z)


def test_z_of_a_candidate_without_any_score_is_zero():
    assert result(np.zeros(5)).z == 0.0


@pytest.mark.parametrize("n", [2.0, 5.0, 30.0])
@pytest.mark.parametrize("t", [-4.0, -1.0, 0.5, 2.0])
def test_student_s_t_becomes_the_normal_variable_of_the_same_probability(t: float, n: float):
    exact = stats.norm.ppf(stats.t.cdf(t, n))
    assert as_normal(t, n) == pytest.approx(exact, rel=0.02 if n == 2.0 else 0.005)
    assert as_normal(t, n) == pytest.approx(student_to_normal(t, n), rel=1e-12)


@pytest.mark.parametrize("freedom", [1.0, 2.0, 5.0, 20.0, 200.0])
@pytest.mark.parametrize("critical", [2.0, 4.0])
def test_a_detectable_amount_is_found_nine_times_in_ten(critical: float, freedom: float):
    t = from_normal(critical, freedom)
    delta = noncentrality(t, freedom, stats.norm.ppf(0.9))
    rng = np.random.default_rng(3)
    drawn = (rng.standard_normal(200_000) + delta) / np.sqrt(rng.chisquare(freedom, 200_000) / freedom)
    assert np.mean(drawn > t) == pytest.approx(0.9, abs=0.02)


def test_a_detectable_amount_is_the_noncentrality_in_standard_deviations():
    found = result(SCORES, NORMS)
    freedom = found.degrees_of_freedom
    delta = found.detectable_amount(3.0, 1.28) * found.norm / found.standard_deviation
    assert delta == pytest.approx(noncentrality(from_normal(3.0, freedom), freedom, 1.28), rel=1e-12)


def test_a_longer_run_repeats_the_blocks_and_scales_the_length():
    short = replace(
        result(SCORES, NORMS), quadrature_scores=SCORES + 1, segment_of_block=np.array([0, 0, 1, 1, 1]), rho=0.3
    )
    long = short.extrapolate(1.4, 7)
    assert long.norm == pytest.approx(14.0) and long.rho == 0.3 and long.candidate is CUBIC
    assert long.scores.tolist() == [3.0, -1.0, 4.0, 1.0, 5.0, 3.0, -1.0]
    assert long.block_norms.tolist() == [1.0, 2.0, 3.0, 2.0, 2.0, 1.0, 2.0]
    assert long.quadrature_scores.tolist() == [4.0, 0.0, 5.0, 2.0, 6.0, 4.0, 0.0]
    assert long.segment_of_block.tolist() == [0, 0, 1, 1, 1, 0, 0]
    assert result(SCORES).extrapolate(2.0, 10).block_norms.size == 0


def test_a_negative_correlation_counts_for_effects_of_both_signs_only():
    assert replace(result(SCORES), rho=-0.4).admissible_rho == 0.4
    assert replace(result(SCORES, candidate=FRICTION), rho=-0.4).admissible_rho == 0.0
    assert replace(result(SCORES, candidate=FRICTION), rho=0.4).admissible_rho == 0.4


def signs_of(draws: int, blocks: int, seed: int) -> FloatArray:
    """The signs that the test draws."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 11]))
    return rng.choice([-1.0, 1.0], size=(draws, blocks))


def size(s: ScoreResult) -> float:
    return s.z if s.candidate.is_one_sided else abs(s.z)


def library(seed: int) -> list[ScoreResult]:
    rng = np.random.default_rng(seed)
    norms = rng.uniform(0.2, 3.0, (2, 12))
    return [
        result(rng.standard_normal(12), norms[0]),
        result(rng.standard_normal(12), norms[1], FRICTION),
        result(rng.standard_normal(12)),
    ]


def highest_of_noise(results: list[ScoreResult], seed: int) -> list[float]:
    """The largest score of every draw: the residual scores with random signs are scored as data are."""
    return [
        max(size(replace(s, scores=signs * s.residual_scores)) for s in results)
        for signs in signs_of(FEW_DRAWS.bootstrap_draws, 12, seed)
    ]


@pytest.mark.parametrize("seed", [0, 7])
def test_the_best_score_is_compared_with_that_of_noise_of_random_sign(seed: int):
    results = library(seed)
    highest = np.array(highest_of_noise(results, seed))
    p, critical = family_wise_test(results, FEW_DRAWS, seed)
    assert p == pytest.approx((1 + (highest >= max(map(size, results))).sum()) / 101)
    assert critical == pytest.approx(np.quantile(highest, 1 - FEW_DRAWS.significance_level))


@pytest.mark.parametrize("scale", [1e-5, 1e5])
def test_scores_of_any_scale_are_compared_alike(scale: float):
    plain, other, third = library(4)
    scaled = [plain, replace(other, scores=scale * other.scores), third]
    assert family_wise_test(scaled, FEW_DRAWS, 4) == pytest.approx(
        family_wise_test([plain, other, third], FEW_DRAWS, 4)
    )
    every = [replace(s, scores=scale * s.scores) for s in (plain, other, third)]
    assert family_wise_test(every, FEW_DRAWS, 4) == pytest.approx(family_wise_test([plain, other, third], FEW_DRAWS, 4))


def test_phases_are_chosen_alike_at_any_scale():
    found = periodic(np.random.default_rng(6))
    small = replace(found, scores=1e-4 * found.scores, quadrature_scores=1e-4 * found.quadrature_scores)
    assert family_wise_test([small], FEW_DRAWS, 6) == pytest.approx(family_wise_test([found], FEW_DRAWS, 6))


def test_only_the_given_results_are_tested_against_the_whole_library():
    results = library(3)
    highest = np.array(highest_of_noise(results, 3))
    for tested in results:
        p, _ = family_wise_test(results, FEW_DRAWS, 3, [tested])
        assert p == pytest.approx((1 + (highest >= size(tested)).sum()) / 101)


@pytest.mark.parametrize("is_uneven", [False, True])
def test_few_blocks_of_noise_are_seldom_a_finding(is_uneven: bool):
    """With four blocks random signs have eight patterns: every twentieth library of noise would be found at 1 %."""
    rng = np.random.default_rng(8)
    p = []
    for seed in range(300):
        norms = rng.gamma(0.5, 1.0, (20, 4)) + 1e-3 if is_uneven else np.ones((20, 4))
        noise = [result(np.sqrt(n) * rng.standard_normal(4), n) for n in norms]
        p.append(family_wise_test(noise, replace(ScoreTestSettings(), bootstrap_draws=400), seed)[0])
    assert np.sum(np.array(p) <= 0.01) < 10  # 3 are expected
    assert 15 <= np.sum(np.array(p) <= 0.1) <= 45  # 30 are expected


def test_an_empty_library_never_exceeds_the_critical_score():
    assert family_wise_test([], FEW_DRAWS, 0) == (1.0, float("inf"))


def test_candidates_without_any_score_are_no_finding():
    p, critical = family_wise_test([result(np.zeros(12))], FEW_DRAWS, 0)
    assert p == 1.0 and critical == 0.0


def periodic(rng: np.random.Generator) -> ScoreResult:
    scores, quadrature = rng.standard_normal((2, 12))
    segments = np.repeat([0, 1, 2], [5, 3, 4])
    norms = rng.uniform(0.5, 2.0, 12)
    return replace(result(scores, norms, RUN_OUT), quadrature_scores=quadrature, segment_of_block=segments)


def z_at_best_phases(s: ScoreResult, signs: FloatArray) -> float:
    """Score of noise at the phase of each segment that explains most, by hand."""
    sine, in_phase, total = signs * s.residual_scores, np.zeros(12), 0.0
    for blocks in (range(0, 5), range(5, 8), range(8, 12)):
        of_segment = sum(s.block_norms[b] for b in blocks)
        cosine = {b: signs[b] * s.quadrature_scores[b] / (1 - s.block_norms[b] / of_segment) for b in blocks}
        a, b = sum(sine[k] for k in blocks), sum(cosine.values())
        length = np.hypot(a, b)
        for k in blocks:
            in_phase[k] = (a * sine[k] + b * cosine[k]) / length
        total += length
    h = s.block_norms / s.block_norms.sum()
    deviation = np.sqrt(np.sum(((in_phase - h * total) / (1 - h)) ** 2))
    return student_to_normal(total / deviation, 1 / np.sum(h**2) - 1)


def test_noise_may_choose_the_phases_of_a_periodic_effect():
    results = [periodic(np.random.default_rng(5)), library(5)[0]]
    highest = np.array(
        [
            max(abs(z_at_best_phases(results[0], signs)), size(replace(other, scores=signs * other.residual_scores)))
            for other in results[1:]
            for signs in signs_of(100, 12, 2)
        ]
    )
    p, critical = family_wise_test(results, FEW_DRAWS, 2)
    assert critical == pytest.approx(np.quantile(highest, 1 - FEW_DRAWS.significance_level))
    assert p == pytest.approx((1 + (highest >= max(map(size, results))).sum()) / 101)


def test_a_score_of_no_candidate_has_two_signs():
    score = BlockScore(rho=-0.5, amount=-1.2, scores=SCORES, norm=10.0)
    assert not score.is_one_sided
    assert family_wise_p(np.array([0.5, 1e9]), [replace(score, scores=-np.abs(SCORES))]) == pytest.approx(2 / 3)


def test_an_extrapolated_result_says_so():
    result = ScoreResult(CUBIC, 0, rho=0.5, amount=1.2, scores=SCORES, norm=10.0)
    assert result.is_extrapolated is False
    assert result.extrapolate(2.0, 2 * len(SCORES)).is_extrapolated is True


def test_the_six_points_have_the_moments_of_webb():
    points = np.concatenate([-SIX_POINTS, SIX_POINTS])
    assert [np.mean(points**k) for k in (1, 2, 3, 4)] == pytest.approx([0.0, 1.0, 0.0, 7.0 / 6.0])
