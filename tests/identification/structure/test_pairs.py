"""Pairs of effects: their scores against explicit projections, and their place in the selection."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.structure import pairs
from railui.identification.structure.candidate_scores import run_score_test
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.pairs import projected_gram, score_pairs, select_shapes
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTest, ScoreTestResult
from tests.blind.simulated import simulated_campaign
from tests.truth.effects import effect
from tests.truth.rig import Bench, write


@pytest.fixture(scope="module")
def scored(tmp_path_factory: pytest.TempPathFactory) -> tuple[Context, Fit, ScoreTestResult]:
    folder = tmp_path_factory.mktemp("rig")
    effects = [
        effect("dry_friction", "rig", force=10.0, slip_speed=0.05),
        effect("quadratic_stiffness", "rig", stiffness=2e6),
    ]
    write(Bench(seconds=(3.0, 2.0), rate=500.0, seed=1, effects=effects), folder)
    context = create_context(read_dataset(load_campaign(folder)), jobs=1, excluded=("free_play",))
    fit = calibrate(context)
    return context, fit, run_score_test(context, fit)


def test_extrapolated_shapes_are_behind_those_scored_on_the_whole_part():
    """A score of 0.1 from a third of the samples may be chance; one of 0.05 from all of them is worth more."""

    def results(at: str, rho: tuple[float, float]) -> list[ScoreResult]:
        candidate = Candidate("cubic_stiffness", at, None)
        return [
            ScoreResult(candidate, i, rho=r, amount=1.0, scores=np.full(12, r), norm=1.0) for i, r in enumerate(rho)
        ]

    whole = results("primary_lateral", (0.05, -0.02))
    part = [s.extrapolate(3.0, 36) for at in ("secondary_lateral", "wheelset_yaw") for s in results(at, (-0.1, 0.08))]
    shapes = select_shapes(ScoreTestResult((*part, *whole), (whole[0], *part[::2]), 1.0, 4.0, 1.0), 5, 2)
    assert [(s.candidate.at, s.rho) for s in shapes] == [
        ("primary_lateral", 0.05),
        ("secondary_lateral", -0.1),
        ("wheelset_yaw", -0.1),
        ("primary_lateral", -0.02),
        ("secondary_lateral", 0.08),
    ]


def test_the_diagonal_of_the_projected_gram_matrix_is_that_of_the_score_test(scored):
    context, fit, scores = scored
    test = ScoreTest(context, fit, fit.segments)
    shapes, gram, score = projected_gram(test, select_shapes(scores, 20, 3))
    assert len(shapes) > 10
    np.testing.assert_allclose(np.diag(gram), [s.norm for s in shapes], rtol=1e-3)
    np.testing.assert_allclose(score, [s.scores.sum() for s in shapes], rtol=1e-3, atol=1e-3 * np.abs(score).max())


def test_a_pair_explains_what_least_squares_with_both_differences_explains(scored):
    context, fit, scores = scored
    test = ScoreTest(context, fit, fit.segments)
    pair = score_pairs(test, scores)[0][0]
    shapes, gram, score = projected_gram(test, [pair.first, pair.second])
    best = max(score[i] ** 2 / gram[i, i] for i in range(2)) / test.projector.rss
    amounts = np.array([pair.first.amount, pair.second.amount])
    explained = (2.0 * amounts @ score - amounts @ gram @ amounts) / test.projector.rss
    assert [s.candidate for s in shapes] == list(pair.candidates)
    assert pair.rho2 == pytest.approx(explained, rel=1e-6) and pair.rho2 >= best
    shifted = amounts * np.array([1.01, 0.99])
    assert 2.0 * shifted @ score - shifted @ gram @ shifted < explained * test.projector.rss


def test_the_best_pair_is_that_of_the_truth(scored):
    context, fit, scores = scored
    found, count = score_pairs(ScoreTest(context, fit, fit.segments), scores)
    assert count > len(found) > 5
    assert {"quadratic_stiffness"} <= {c.kind for c in found[0].candidates}
    assert all(s.amount > 0 for p in found for s in (p.first, p.second) if s.candidate.is_one_sided)


def test_no_pair_has_two_alike_effects(scored):
    context, fit, scores = scored
    strict = replace(context.settings, selection=replace(context.settings.selection, min_pair_difference=0.5))
    some = score_pairs(ScoreTest(context, fit, fit.segments), scores)[0]
    fewer = score_pairs(ScoreTest(replace(context, settings=strict), fit, fit.segments), scores)[0]
    assert 0 < len(fewer) < len(some)
    assert all(p.first.candidate != p.second.candidate for p in some)


@pytest.mark.parametrize(("max_share", "continued"), [(np.inf, ["good", "bad"]), (0.48, ["good"]), (0.4, [])])
def test_pairs_that_leave_too_much_after_a_few_iterations_are_given_up(monkeypatch, max_share, continued):
    def fit(rss):
        return SimpleNamespace(normal=SimpleNamespace(rss=rss))

    def refit(context, fit, misfit_limit, item):
        refits.append(item[0].text)
        assert misfit_limit == 60.0
        return SimpleNamespace(rss=item[1].normal.rss)

    refits = []
    screened = {"good": fit(45.0), "bad": fit(50.0)}
    monkeypatch.setattr(pairs, "ScreeningFits", lambda context, fit: SimpleNamespace(rss_without_effect=100.0))
    monkeypatch.setattr(pairs, "_screen", lambda screening, pair: screened[pair.text])
    monkeypatch.setattr(pairs, "_refit", refit)
    scores = [SimpleNamespace(text=name, rho2=0.5) for name in screened]
    result = pairs.refit_pairs(replace(simulated_campaign().context, jobs=1), fit(1e6), scores, max_share, 60.0)
    assert refits == continued and len(result) == len(continued)
