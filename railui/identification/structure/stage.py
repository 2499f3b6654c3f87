"""Stages of a selection: a model and its validation, and the effects that were added step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from railui.campaign.settings.detection import SelectionSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.noise_floor import sensor_noise_error
from railui.identification.estimation.validation import ErrorReduction, Validation, is_significant_gain, validate
from railui.identification.structure.pairs import PairRefit, PairSearch
from railui.identification.structure.refit import Refit, cross_validation_errors
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.student import from_normal


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """One step of the selection: the score test, the refits, and the effect added (None: none).

    Attributes
    ----------
    refits
        Candidates fitted with the effects of the model before this step, each alone; those of the first step are
        compared with the model without effects.
    pairs
        Pairs that were scored from the model of this step; None: none.
    in_pair
        True where the effect was added together with that of the step before or after.
    alternatives
        The effect and others in its place, fitted together with the other effects that the model had then; empty: none
        fitted.
    """

    score_test: ScoreTestResult
    refits: tuple[Refit, ...]
    added: Refit | None
    pairs: PairSearch | None = None
    in_pair: bool = False
    alternatives: tuple[Refit, ...] = ()

    @property
    def is_significant(self) -> bool:
        """True where the added effect has a significant score of its own."""
        score = None if self.added is None else self.added.score_result
        return score is not None and self.score_test.is_significant(score)

    @property
    def comparable_refits(self) -> tuple[Refit, ...]:
        """Refits that have the same other effects as that of the added effect; none of a pair without alternatives."""
        return self.alternatives or (() if self.in_pair else self.refits)


class Stage(NamedTuple):
    """A model during the selection and its validation."""

    fit: Fit
    validation: Validation


def validated_stage(context: Context, fit: Fit) -> Stage:
    """Validate a fit on the validation runs."""
    return Stage(fit, validate(context, fit.model, context.dataset.selection))


def gains(context: Context, old: Stage, new: Stage) -> bool:
    """True where a stage has a significantly lower validation error than another, or one but for noise of the sensors.

    Where noise of some channels dominates the error, the largest effect lowers it by little. An effect that takes most
    of the misfit, in which every channel counts by its noise, has to lower what is not noise of the sensors.
    """
    if is_significant_gain(context, old.validation, new.validation):
        return True
    settings = context.settings.selection
    before, after = (stage.fit.normal.misfit_per_sample for stage in (old, new))
    if after > settings.decisive_misfit_ratio * before:
        return False
    gain = old.validation.error_reduction(new.validation)
    noise = sensor_noise_error(context, context.dataset.selection) / old.validation.nrmse
    return gain.share >= context.campaign.min_gain * (1.0 - noise**2) and is_decisive(settings, gain)


def is_decisive(settings: SelectionSettings, gain: ErrorReduction) -> bool:
    """True where a gain differs from zero by the decisive standard errors, by Student's t of the same probability."""
    if gain.degrees_of_freedom < 1:  # a single block, or a model that diverges
        return gain.share > 0.0 and gain.standard_error == 0.0
    least = from_normal(settings.decisive_standard_errors, gain.degrees_of_freedom)
    return gain.share > least * gain.standard_error


def pair_steps(context: Context, step: SelectionStep, pair: PairRefit) -> list[SelectionStep]:
    """Return the two steps of a pair, in place of the step from whose model it was added."""
    errors = cross_validation_errors(context.settings.refit, pair.fit)
    first, second = (Refit(s.candidate, pair.fit, errors, s) for s in (pair.score.first, pair.score.second))
    return [
        replace(step, added=first, in_pair=True),
        SelectionStep(step.score_test, step.refits, second, in_pair=True),
    ]


def indistinguishable_kinds(context: Context, step: SelectionStep) -> list[str]:
    """List the kinds that fit at the location of the added effect as well as it does, with the same other effects."""
    if step.added is None or step.added.candidate is None:
        return []
    added, refits = step.added.candidate, step.comparable_refits
    ratio = context.settings.selection.indistinguishable_ratio
    limit = ratio**2 * max((float(r.block_errors.sum()) for r in refits if r.candidate == added), default=0.0)
    similar = [
        r.candidate.kind
        for r in refits
        if r.candidate is not None and r.candidate.at == added.at and r.block_errors.sum() <= limit
    ]
    return list(dict.fromkeys([added.kind, *similar]))
