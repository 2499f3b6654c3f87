"""Stepwise selection: refits next to which the vehicle diverges, and residuals in which no pair is sought."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from railui.identification.estimation.validation import ErrorReduction
from railui.identification.prediction import DivergedError
from railui.identification.structure import stepwise
from railui.identification.structure.refit import Refit
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.stage import SelectionStep
from railui.identification.structure.stepwise import StepwiseSelection, _Path
from tests.blind.simulated import simulated_campaign


def refit(rss: float) -> SimpleNamespace:
    return SimpleNamespace(rss=rss, candidate=None, fit=SimpleNamespace(x=np.zeros(3)))


@pytest.mark.parametrize(("diverging", "taken"), [(0, 0), (1, 1), (2, None)])
def test_the_best_refit_that_can_be_fitted_once_more_is_taken(monkeypatch, diverging, taken):
    refits = [refit(1.0), refit(1.001)]
    bad = [r.fit for r in refits[:diverging]]

    def final_fit(self, fit):
        if any(fit is one for one in bad):
            raise DivergedError("the vehicle diverges")
        return fit

    monkeypatch.setattr(StepwiseSelection, "_final_fit", final_fit)
    found = StepwiseSelection(simulated_campaign().context)._fitted_once_more(refits)
    assert (None if found is None else found[0]) is (None if taken is None else refits[taken])


def scores(rho2: float, *, is_significant: bool = True) -> ScoreTestResult:
    """A score test in which one candidate explains a share of the residual."""
    of_blocks = 1.0 + 0.1 * (-1.0) ** np.arange(36)
    candidate = SimpleNamespace(is_one_sided=False)
    found = ScoreResult(candidate, 0, rho=np.sqrt(rho2), amount=1.0, scores=of_blocks, norm=1.0)  # type: ignore[arg-type]
    return ScoreTestResult((found,), (found,), 0.0005, 4.0 if is_significant else np.inf, 1.0)


@pytest.mark.parametrize(
    ("accepted", "left", "nrmse", "is_track_noise", "ends"),
    [
        (1, 0.005, 0.12, False, True),  # 1.2 times the floor, without structure
        (1, 0.2, 0.12, True, False),  # with structure
        (1, 0.005, 0.16, False, False),  # too much is left
        (1, 0.005, 0.16, True, True),  # as noise of the track would leave it
        (0, 0.005, 0.12, True, False),  # no effect yet
    ],
)
def test_no_pair_is_sought_where_effects_leave_noise(monkeypatch, accepted, left, nrmse, is_track_noise, ends):
    found = object() if is_track_noise else None
    monkeypatch.setattr(stepwise, "with_track_noise", lambda context, model, validation, floor: found)
    steps = [SimpleNamespace(score_test=scores(0.8))] * accepted + [SimpleNamespace(score_test=scores(left))]
    fit = SimpleNamespace(model=SimpleNamespace(effects=("friction",)))
    stages = [SimpleNamespace(validation=SimpleNamespace(nrmse=nrmse), fit=fit)] * (accepted + 1)
    path = _Path(steps, stages, accepted, SimpleNamespace(nrmse=0.1), SimpleNamespace())
    assert StepwiseSelection(simulated_campaign().context)._leaves_noise(path) is ends


@pytest.mark.parametrize(("nrmse", "floor"), [(np.nan, 0.1), (0.9, np.nan)])
def test_a_model_that_diverges_on_the_validation_runs_leaves_no_noise(nrmse, floor):
    stage = SimpleNamespace(
        validation=SimpleNamespace(nrmse=nrmse), fit=SimpleNamespace(model=SimpleNamespace(effects=()))
    )
    selection = StepwiseSelection(simulated_campaign().context)
    assert not selection._is_noise(scores(0.0), stage, SimpleNamespace(nrmse=floor))


def test_a_model_without_effects_is_not_left_to_noise_of_the_track(monkeypatch):
    monkeypatch.setattr(stepwise, "with_track_noise", lambda context, model, validation, floor: object())
    fit = SimpleNamespace(model=SimpleNamespace(effects=()))
    stage = SimpleNamespace(validation=SimpleNamespace(nrmse=0.16), fit=fit)
    selection = StepwiseSelection(simulated_campaign().context)
    assert not selection._is_noise(scores(0.005), stage, SimpleNamespace(nrmse=0.1))


@pytest.mark.parametrize(("count", "jobs"), [(1, 4), (3, 1)])
def test_runners_up_that_are_fitted_at_once_have_one_thread_each(monkeypatch, count, jobs):
    used = []
    fitted = SimpleNamespace(model=SimpleNamespace(design=SimpleNamespace(form="bogie")))
    monkeypatch.setattr(stepwise, "map_threads", lambda function, items, jobs: map(function, items))
    monkeypatch.setattr(stepwise, "reprepare_segments", lambda context, model, segments: ())
    monkeypatch.setattr(stepwise, "fit_output_error", lambda context, *_, **__: used.append(context) or fitted)
    monkeypatch.setattr(stepwise, "validated_stage", lambda context, fit: used.append(context))
    one = SimpleNamespace(rss=0.5, fit=SimpleNamespace(model=None, segments=(), free=SimpleNamespace(paths=())))
    current = SimpleNamespace(normal=SimpleNamespace(rss=1.0))
    context = replace(simulated_campaign().context, jobs=4)
    StepwiseSelection(context)._runner_up(current, None, None, count * [one], None, ())
    assert [c.jobs for c in used] == 2 * count * [jobs]


@pytest.mark.parametrize(
    ("is_significant", "standard_errors", "gains"), [(True, 1.5, True), (False, 1.5, False), (False, 3.5, True)]
)
def test_without_a_significant_score_of_an_added_effect_a_gain_must_be_clear(
    monkeypatch, is_significant, standard_errors, gains
):
    monkeypatch.setattr(stepwise, "gains", lambda context, old, new: True)
    validation = SimpleNamespace(error_reduction=lambda other: ErrorReduction(0.1, 0.1 / standard_errors, 49))
    old, new = SimpleNamespace(validation=validation), SimpleNamespace(validation=None)
    selection = StepwiseSelection(simulated_campaign().context)
    test = scores(0.4, is_significant=is_significant)
    step = SelectionStep(test, (), Refit(test.best[0].candidate, None, np.zeros((1, 1)), test.best[0]))
    assert selection._gains([step], old, new) is gains
    other = SelectionStep(test, (), Refit(None, None, np.zeros((1, 1))))
    assert selection._gains([other], old, new) is (standard_errors > 3.0)


def effects_fit(rss: float, *effects: tuple[str, str, int | None]) -> SimpleNamespace:
    placed = tuple(SimpleNamespace(kind=kind, at=at, wheelset=number) for kind, at, number in effects)
    return SimpleNamespace(
        normal=SimpleNamespace(rss=rss, samples=10, misfit_per_sample=rss / 10),
        model=SimpleNamespace(effects=placed),
        x=np.ones(3),
    )


@pytest.mark.parametrize(("left", "is_selected"), [(39.0, True), (42.0, False)])
def test_pairs_that_were_fitted_are_not_refitted_and_none_of_larger_misfit_selected(monkeypatch, left, is_selected):
    known, delay, stop = ("spring", "primary_yaw", 2), ("sensor_delay", "d2", None), ("bump_stop", "primary_yaw", 2)
    found = [
        SimpleNamespace(text=text, candidates=tuple(SimpleNamespace(kind=k, at=a, wheelset=w) for k, a, w in some))
        for text, some in (("known", (delay, known)), ("other", (delay, stop)))
    ]

    def refit_pairs(context, fit, pairs, max_share, misfit_limit):
        limits.append(misfit_limit)
        refitted.extend(pair.text for pair in pairs)
        return [SimpleNamespace(fit=effects_fit(left), rss=left)]

    refitted: list[str] = []
    limits: list[float] = []
    monkeypatch.setattr(stepwise, "ScoreTest", lambda context, fit, segments: None)
    monkeypatch.setattr(stepwise, "scored_part", lambda context, fit: SimpleNamespace(segments=()))
    monkeypatch.setattr(stepwise, "score_pairs", lambda test, scores: (found, 2))
    monkeypatch.setattr(stepwise, "refit_pairs", refit_pairs)
    selection = StepwiseSelection(simulated_campaign().context)
    fit, accepted = (
        effects_fit(100.0, ("free_play", "rig", None)),
        effects_fit(40.0, known, delay, ("free_play", "rig", None)),
    )
    pair, search = selection._refit_best_pairs(fit, scores(0.5), accepted, {frozenset({known, delay})})
    ratio = simulated_campaign().context.settings.selection.simpler_misfit_ratio
    assert limits == [pytest.approx(40.0 * ratio)] and refitted == ["other"] and search.refitted == 1
    assert (pair is not None) is is_selected
