"""Stages of a selection: a model and its validation, and the effects that were added step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.validation import Validation, is_significant_gain, validate
from railui.identification.structure.pairs import PairRefit, PairSearch
from railui.identification.structure.refit import Refit, cross_validation_errors
from railui.identification.structure.score_test import ScoreTestResult


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """One step of the selection: the score test, the refits, and the effect added (None: none).

    Attributes
    ----------
    pairs
        Pairs that were looked at from the model of this step; None: none.
    in_pair
        True where the effect was added together with that of the step before or after.
    """

    score_test: ScoreTestResult
    refits: tuple[Refit, ...]
    added: Refit | None
    pairs: PairSearch | None = None
    in_pair: bool = False


class Stage(NamedTuple):
    """A model during the selection and its validation."""

    fit: Fit
    validation: Validation


def validated_stage(context: Context, fit: Fit) -> Stage:
    """Validate a fit on the validation runs."""
    return Stage(fit, validate(context, fit.model, context.dataset.selection))


def gains(context: Context, old: Stage, new: Stage) -> bool:
    """True where a stage has a significantly lower validation error than another."""
    return is_significant_gain(context, old.validation, new.validation)


def pair_steps(context: Context, step: SelectionStep, pair: PairRefit) -> list[SelectionStep]:
    """Return the two steps of a pair, in place of the step from whose model it was added."""
    errors = cross_validation_errors(context.settings.refit, pair.fit)
    first, second = (Refit(s.candidate, pair.fit, errors, s) for s in (pair.score.first, pair.score.second))
    return [
        replace(step, refits=(first, *step.refits), added=first, in_pair=True),
        SelectionStep(step.score_test, (second,), second, in_pair=True),
    ]
