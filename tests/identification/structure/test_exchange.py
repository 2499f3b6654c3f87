"""Exchange of effects: a spring taken for a stop with a gap gives way to it once another effect is in the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import prepare_segments
from railui.identification.structure.candidate_scores import NO_SCORE_TEST
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.exchange import alternatives, exchange_effects
from railui.identification.structure.refit import Refit
from railui.identification.structure.stage import SelectionStep, validated_stage
from railui.identification.structure.substitution import fit_in_place
from railui.vehicle.effects import PlacedEffect
from tests.identification.structure.test_limiting_laws import DAMPING, simulated, with_effects

LATERAL, YAW = "secondary_lateral", "secondary_yaw"
STOP = PlacedEffect("bump_stop", LATERAL, None, {"gap": 2e-3, "stiffness": 2e6})
FRICTION = PlacedEffect("dry_friction", YAW, None, {"force": 2e3, "slip_speed": 2e-3})
SPRING = PlacedEffect("spring", LATERAL, None, {"stiffness": 3e5})


def fitted(context: Context, *effects: PlacedEffect) -> Fit:
    model = with_effects(context.nominal, effects)
    segments = prepare_segments(context, model, context.dataset.estimation)
    return fit_output_error(context, model, [DAMPING, *model.effect_paths()], segments=segments, tolerance=1e-5)


def refit(fit: Fit, effect: PlacedEffect) -> Refit:
    return Refit(Candidate(effect.kind, effect.at, effect.wheelset), fit, np.zeros((1, 3)))


def steps_of(context: Context, first: PlacedEffect, other: PlacedEffect) -> tuple[Fit, list[SelectionStep]]:
    """Return the fit with `first` and friction, and the steps in which `other` was tried after `first`."""
    alone, both, tried = fitted(context, first), fitted(context, first, FRICTION), fitted(context, first, other)
    first_step = SelectionStep(NO_SCORE_TEST, (refit(alone, first),), refit(alone, first))
    last = SelectionStep(NO_SCORE_TEST, (refit(both, FRICTION), refit(tried, other)), refit(both, FRICTION))
    return both, [first_step, last]


@pytest.fixture(scope="module")
def context(tmp_path_factory: pytest.TempPathFactory) -> Context:
    return simulated(tmp_path_factory.mktemp("exchange"), STOP, FRICTION)


def test_a_law_that_two_steps_tried_is_compared_once(context: Context) -> None:
    _, steps = steps_of(context, SPRING, STOP)
    of_stop = steps[1].refits[1]
    steps[0] = replace(steps[0], refits=(*steps[0].refits, replace(of_stop)))
    assert [r.candidate for r in alternatives(context, steps, 0)] == [of_stop.candidate]


def test_a_spring_gives_way_to_the_stop_that_a_later_step_tried_at_its_place(context: Context) -> None:
    fit, steps = steps_of(context, SPRING, STOP)
    alone = steps[0].refits
    before = validated_stage(context, fit)
    after = exchange_effects(context, before, steps, lambda f: f)
    laws = {e.kind: e for e in after.fit.model.effects if e.at in (LATERAL, YAW)}
    stop = laws["bump_stop"]
    assert set(laws) == {"bump_stop", "dry_friction"}
    assert stop.parameters["gap"] == pytest.approx(2e-3, rel=0.05)
    assert after.validation.nrmse < 0.5 * before.validation.nrmse
    assert steps[0].added is not None and steps[0].added.candidate == Candidate("bump_stop", LATERAL, None)
    assert steps[0].refits is alone  # of one effect, which no fit with friction joins
    assert [{e.kind for e in r.fit.model.effects if e.at in (LATERAL, YAW)} for r in steps[0].alternatives] == [
        {"spring", "dry_friction"},
        {"bump_stop", "dry_friction"},
    ]
    errors = [r.block_errors.sum() for r in steps[0].alternatives]
    assert errors[1] < 0.5 * errors[0]


def test_the_law_that_fits_best_stays(context: Context) -> None:
    fit, steps = steps_of(context, STOP, SPRING)
    before = validated_stage(context, fit)
    assert exchange_effects(context, before, steps, lambda f: f) is before


def test_a_single_effect_is_not_compared_again(context: Context) -> None:
    fit, steps = steps_of(context, SPRING, STOP)
    before = validated_stage(context, fit)
    assert exchange_effects(context, before, steps[:1], lambda f: f) is before


def test_laws_at_the_place_come_before_those_of_the_same_step(context: Context) -> None:
    _, steps = steps_of(context, SPRING, STOP)
    near = refit(fitted(context, STOP), PlacedEffect("cubic_stiffness", LATERAL))
    steps[0] = SelectionStep(NO_SCORE_TEST, (*steps[0].refits, near), steps[0].added)
    kinds = [r.candidate.kind for r in alternatives(context, steps, 0) if r.candidate is not None]
    assert kinds == ["bump_stop", "cubic_stiffness"]


def test_the_refits_that_both_steps_of_a_pair_have_are_compared_once(context: Context) -> None:
    _, steps = steps_of(context, SPRING, STOP)
    steps = [replace(s, refits=steps[1].refits, in_pair=True) for s in steps]
    steps[0] = replace(steps[0], added=refit(steps[1].refits[1].fit, STOP))
    tried = alternatives(context, steps, 0)
    assert len(tried) == len({r.candidate for r in tried})


def test_no_law_is_fitted_that_supersedes_the_same_term_as_another_effect(context: Context) -> None:
    fit = fitted(context, FRICTION)
    kinds = [e.kind for e in fit.model.effects]
    assert "creep_saturation" in kinds
    law = PlacedEffect("vermeulen_johnson", "contact", None, {"friction": 0.3})
    assert fit_in_place(context, fit, kinds.index("dry_friction"), law, 1.0) is None
