"""Backward elimination of effects, with and without states of their own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.validation import Validation
from railui.identification.prediction import DivergedError
from railui.identification.structure import elimination
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.identification.structure.elimination import (
    _is_needed,
    _least_needed,
    _without_effect,
    remove_superfluous,
    remove_undetermined,
)
from railui.identification.structure.refit import Refit
from railui.identification.structure.stage import SelectionStep, Stage, validated_stage
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.simulated import simulated_campaign

HYSTERESIS = {"stiffness": 4e5, "yield": 160.0}  # c [N/m], F_y [N]


def hysteretic(nominal: Model) -> Model:
    return nominal.with_effect(PlacedEffect("hysteresis", "primary_lateral", None, HYSTERESIS))


def candidate_of(context: Context) -> Candidate:
    found = list_candidates(context.nominal, context.dataset.estimation)
    return next(c for c in found if (c.kind, c.at, c.wheelset) == ("hysteresis", "primary_lateral", None))


def test_an_effect_with_own_states_is_removed_for_a_trial() -> None:
    context = simulated_campaign().context
    model = hysteretic(context.nominal)
    segments = prepare_segments(context, model, context.dataset.estimation)
    fit = fit_output_error(context, model, model.effect_paths(), segments=segments, max_iterations=1)
    assert len(fit.segments[0].initial_state) > context.nominal.vehicles().state_count(context.nominal.single_batch())
    refit = Refit(candidate_of(context), fit, None, None)  # type: ignore[arg-type]
    stage = _without_effect(context, fit, refit)
    assert stage is not None and not stage.fit.model.effects
    assert np.isfinite(stage.validation.nrmse)


def stage_of(rss: float, nrmse: float) -> Stage:
    fit = SimpleNamespace(normal=SimpleNamespace(misfit_per_sample=rss / 100))
    return Stage(cast(Fit, fit), Validation({}, nrmse, (), ()))


@pytest.mark.parametrize(
    ("rss", "nrmse", "needed"),
    [
        (79.0, 0.99, True),  # a fifth of the misfit is obvious
        (81.0, 0.99, False),
        (79.0, 1.01, False),  # but not where the validation error is lower without it
    ],
)
def test_an_obvious_misfit_keeps_an_effect(
    monkeypatch: pytest.MonkeyPatch, rss: float, nrmse: float, needed: bool
) -> None:
    monkeypatch.setattr(elimination, "gains", lambda *_: False)
    context = simulated_campaign().context
    assert _is_needed(context, stage_of(100.0, 1.0), stage_of(rss, nrmse)) is needed


def test_an_effect_without_which_the_vehicle_diverges_is_needed() -> None:
    """However little the error with it is below that of no motion."""
    context = simulated_campaign().context
    assert _is_needed(context, stage_of(100.0, np.nan), stage_of(99.0, 0.95))


PLAY = "free_play at=primary_lateral half_width=4e-4"
COLLINEAR = PlacedEffect("viscous_damper", "secondary_lateral", None, {"damping": 1e3})


def selected(context: Context, model: Model) -> tuple[Stage, list[SelectionStep]]:
    """Fit a model with effects to the end; return it with a step for each effect."""
    segments = prepare_segments(context, model, context.dataset.estimation)
    paths = [*context.campaign.estimated_parameters, *model.effect_paths()]
    fit = fit_output_error(context, model, paths, segments=segments, tolerance=1e-4)
    found = [Candidate(e.kind, e.at, e.wheelset) for e in model.effects]
    return validated_stage(context, fit), [
        SelectionStep(NO_SCORE_TEST, (), Refit(c, fit, np.zeros((1, 1)))) for c in found
    ]


def test_an_effect_of_which_no_number_is_determined_is_removed() -> None:
    """A damper and the estimated damping of its joint: the data determine their sum alone."""
    context = simulated_campaign(PLAY).context
    play = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 4e-4})
    final, steps = selected(context, context.nominal.with_effect(play).with_effect(COLLINEAR))
    finished: list[Fit] = []

    def finish(fit: Fit) -> Fit:
        finished.append(fit)
        return fit

    left = remove_undetermined(context, final, steps, finish)
    assert [e.kind for e in left.fit.model.effects] == ["free_play"] and left.fit in finished
    assert [s.added is not None for s in steps] == [True, False]
    assert left.validation.nrmse == pytest.approx(final.validation.nrmse, rel=0.01)
    assert remove_undetermined(context, left, steps, finish) is left


@pytest.fixture(scope="module")
def with_superfluous_damper() -> tuple[Context, Stage, list[SelectionStep]]:
    """The true clearance and a small damper that the vehicle does not have, fitted to the end."""
    context = simulated_campaign(PLAY).context
    play = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 4e-4})
    return context, *selected(context, context.nominal.with_effect(play).with_effect(COLLINEAR))


def test_the_model_without_a_superfluous_effect_is_fitted_to_the_end(
    with_superfluous_damper: tuple[Context, Stage, list[SelectionStep]],
) -> None:
    context, final, steps = with_superfluous_damper
    steps, finished = list(steps), list[Fit]()

    def finish(fit: Fit) -> Fit:
        finished.append(fit_output_error(context, fit.model, fit.free.paths, segments=fit.segments))
        return finished[-1]

    left = remove_superfluous(context, final, steps, None, finish)
    assert [e.kind for e in left.fit.model.effects] == ["free_play"] and left.fit is finished[-1]
    assert [s.added is not None for s in steps] == [True, False]


def test_an_effect_stays_without_which_no_fit_ends(
    with_superfluous_damper: tuple[Context, Stage, list[SelectionStep]],
) -> None:
    context, final, steps = with_superfluous_damper
    steps = list(steps)

    def finish(fit: Fit) -> Fit:
        raise DivergedError("the vehicle diverges")

    assert remove_superfluous(context, final, steps, None, finish) is final
    assert all(s.added is not None for s in steps)


@pytest.mark.parametrize(
    ("finished_errors", "removed"),
    [
        ({1: 0.99}, 1),  # the better one of the coarse fits
        ({1: 1.5, 2: 1.0}, 2),  # it is needed once fitted to the end: the next one
        ({1: 1.5, 2: np.nan}, None),
        ({1: None, 2: 1.5}, None),  # no fit ends
    ],
)
def test_the_least_needed_effect_is_not_needed_once_the_others_are_fitted_to_the_end(
    monkeypatch: pytest.MonkeyPatch, finished_errors: dict[int, float | None], removed: int | None
) -> None:
    coarse = {2: stage_of(100.0, 1.02), 1: stage_of(100.0, 1.01)}
    of_fit = {id(stage.fit): finished_errors.get(i) for i, stage in coarse.items()}

    def finished(context: Context, fit: Fit, finish: object) -> Stage | None:
        error = of_fit[id(fit)]
        return None if error is None else stage_of(80.0, error)

    monkeypatch.setattr(elimination, "_finished", finished)
    monkeypatch.setattr(elimination, "is_significant_gain", lambda context, old, new: old.nrmse > 1.1 * new.nrmse)
    context = simulated_campaign().context
    found = _least_needed(context, stage_of(100.0, 1.0), list(coarse.items()), None, lambda fit: fit)
    assert (None if found is None else found[0]) == removed


def test_the_model_before_the_last_effect_is_not_fitted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(elimination, "_finished", None)
    previous = stage_of(100.0, 1.0)
    found = _least_needed(simulated_campaign().context, stage_of(99.0, 1.0), [(3, previous)], previous, lambda fit: fit)
    assert found == (3, previous)
