"""Stepwise selection: effects are added while the residual has structure, then superfluous ones are removed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from railui.campaign.settings.detection import ScoreTestSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.multiple_shooting import limits_hunting
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import reprepare_segments, truncate
from railui.identification.estimation.validation import Validation, validate
from railui.identification.events import ModelValidated
from railui.identification.structure.candidates import Candidate, candidate_text, list_candidates
from railui.identification.structure.couplings import find_couplings
from railui.identification.structure.drift import find_drifts
from railui.identification.structure.refit import Refit, cross_validation_errors, refit_candidates
from railui.identification.structure.score_test import ScoreTestResult, score_test
from railui.parallel import run_both
from railui.vehicle.model import Model

FINAL_TOLERANCE = 1e-5
REMOVAL_TOLERANCE = 1e-4
NO_SCORE_TEST = ScoreTestResult((), (), 1.0, float("inf"), 0.0)


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """One step of the selection: the score test, the refits, and the effect added (None: none)."""

    score_test: ScoreTestResult
    refits: tuple[Refit, ...]
    added: Refit | None


@dataclass(frozen=True, eq=False)
class Selection:
    """The model with the selected effects, its validation, every step, and the score test of its residual."""

    fit: Fit
    validation: Validation
    steps: tuple[SelectionStep, ...]
    final_score_test: ScoreTestResult

    @property
    def has_effects(self) -> bool:
        """True where at least one effect is selected."""
        return any(s.added for s in self.steps)


class _Stage(NamedTuple):
    """A model during the selection and its validation."""

    fit: Fit
    validation: Validation


def is_significant_gain(context: Context, old: Validation, new: Validation) -> bool:
    """True where the validation error is lower by the campaign's minimum relative gain, and clear of its scatter."""
    if not np.isfinite(new.nrmse):
        return False
    gain, sd = old.error_reduction(new)
    least = 1.0 - (1.0 - context.campaign.min_relative_gain) ** 2
    return bool(gain >= least and gain > context.settings.selection.gain_standard_errors * sd)


def has_structure(settings: ScoreTestSettings, result: ScoreTestResult) -> bool:
    """True where the residual has a structure that noise does not have."""
    if result.rho2 < settings.structured_rho2:
        return False
    return result.p <= settings.significance_level or result.rho2 >= settings.obvious_rho2


class StepwiseSelection:
    """Stepwise selection of the effects that a dataset supports."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.settings = context.settings.selection

    def run_score_test(self, fit: Fit) -> ScoreTestResult:
        """Score every candidate against the residual of a fit."""
        context, settings = self.context, self.context.settings.score_test
        if context.is_out_of_time:
            return NO_SCORE_TEST
        loaded = context.campaign.track == "loaded"
        candidates = list_candidates(fit.model, context.dataset.estimation, without=context.excluded, loaded=loaded)
        part = replace(fit, segments=tuple(truncate(context, fit.segments, settings.score_duration)))
        first = truncate(context, part.segments, settings.preselection_duration)
        result = score_test(context, part, candidates, first=first)
        context.progress.message(
            f"score test: {len(result.best)} candidates, best partial rho^2 {result.rho2:.3f}, "
            f"family-wise p {result.p:.4f}"
        )
        context.progress.event(result)
        return result

    def select_effects(self, before: Fit, validation: Validation, windowed: Fit | None = None) -> Selection:
        """Add effects to the calibrated model, then remove those that are no longer needed.

        An effect that lowers the misfit on the estimation runs but not yet the error on the validation runs stays on
        trial while the next is sought: of two missing effects, either one alone may gain nothing.

        Parameters
        ----------
        windowed
            The model fitted on windows, where a stable one cannot follow; the selection starts from it.
        """
        current = windowed or before
        steps: list[SelectionStep] = []
        stages = [_Stage(before, validation)]  # the model before each step
        accepted, accepted_steps = stages[0], 0
        floor = self._preliminary_floor(before)
        self.context.progress.message(
            f"calibrated, no effect added: NRMSE {validation.nrmse:.4f}, noise floor {floor.nrmse:.4f}"
        )
        for _ in range(self.settings.max_effects):
            step, stage = self._step(current, accepted, floor, on_trial=len(steps) > accepted_steps)
            steps.append(step)
            if stage is None:
                break
            current = stage.fit
            stages.append(stage)
            if self._gains(accepted, stage):
                accepted, accepted_steps = stage, len(steps)
                self.context.progress.event(ModelValidated("after", stage.validation))
                floor = self._preliminary_floor(stage.fit)
                if stage.validation.nrmse <= (1.0 + 0.5 * (self.settings.adequate_ratio - 1.0)) * floor.nrmse:
                    break
        steps = [s if i < accepted_steps else replace(s, added=None) for i, s in enumerate(steps)]
        previous = stages[accepted_steps - 1] if accepted_steps else None
        final = self._remove_superfluous(accepted, steps, previous)
        is_known = final.fit is accepted.fit and accepted_steps < len(steps)
        last = steps[accepted_steps].score_test if is_known else self.run_score_test(final.fit)
        return Selection(final.fit, final.validation, tuple(steps), last)

    def _preliminary_floor(self, fit: Fit) -> NoiseFloor:
        draws = self.context.settings.validation.preliminary_floor_draws
        return estimate_noise_floor(self.context, fit.model, self.context.dataset.selection, draws)

    def _gains(self, old: _Stage, new: _Stage) -> bool:
        return is_significant_gain(self.context, old.validation, new.validation)

    def _validated(self, fit: Fit) -> _Stage:
        return _Stage(fit, validate(self.context, fit.model, self.context.dataset.selection))

    def _step(
        self, current: Fit, accepted: _Stage, floor: NoiseFloor, *, on_trial: bool
    ) -> tuple[SelectionStep, _Stage | None]:
        """Look for one more effect; None: the forward selection ends.

        on_trial: an effect without a gain has been added before, and is retained only if this one gains.
        """
        settings, nrmse = self.settings, accepted.validation.nrmse
        scores = self.run_score_test(current)
        if self.context.is_out_of_time:
            return SelectionStep(scores, (), None), None
        unstructured = not has_structure(self.context.settings.score_test, scores)
        if unstructured and not nrmse > settings.unexplained_ratio * floor.nrmse:
            return SelectionStep(scores, (), None), None
        with_absorbed = bool(nrmse > settings.absorbed_ratio * floor.nrmse)
        refits, chosen, fit = self._best_candidate(current, scores, with_absorbed)
        if chosen is None or fit is None:
            return SelectionStep(scores, refits, None), None
        stage = self._validated(fit)
        self.context.progress.message(f"  with {_refit_text(chosen)}: NRMSE {stage.validation.nrmse:.4f}")
        is_promising = (
            chosen.rss <= (1.0 - settings.trial_misfit_share) * current.normal.rss
            and nrmse > settings.adequate_ratio * floor.nrmse
        )
        if not self._gains(accepted, stage) and (on_trial or not is_promising):
            return SelectionStep(scores, refits, None), None
        errors = cross_validation_errors(self.context.settings.refit, fit)
        return SelectionStep(scores, refits, replace(chosen, fit=fit, block_errors=errors)), stage

    def _best_candidate(
        self, fit: Fit, scores: ScoreTestResult, with_absorbed: bool
    ) -> tuple[tuple[Refit, ...], Refit | None, Fit | None]:
        """Refit the candidates; return also the one to add and its final fit, unless something else explains more."""
        refits = tuple(refit_candidates(self.context, fit, scores, with_absorbed=with_absorbed))
        chosen = simplest_refit(refits, self.settings.simpler_misfit_ratio)
        if chosen is None:
            return refits, None, None
        final, rivals = run_both(
            lambda: self._final_fit(chosen.fit), lambda: self._rival_explanations(fit), self.context.jobs
        )
        share = 1.0 - chosen.rss / fit.normal.rss
        for text, explained in rivals:
            if explained >= max(self.settings.rival_ratio * share, self.settings.rival_share):
                self.context.progress.message(f"  {text} explains more: {explained:.2f}, not {share:.2f}")
                return refits, None, None
        return refits, chosen, final

    def _rival_explanations(self, fit: Fit) -> list[tuple[str, float]]:
        """Best explanations outside the library, a drift and a coupling, with their share of the misfit."""
        drifts, couplings = find_drifts(self.context, fit)[:1], find_couplings(self.context, fit)[:1]
        return [
            *((f"{d.path} varying along the track", d.share) for d in drifts),
            *((f"a coupling of {c.text}", c.share) for c in couplings),
        ]

    def _final_fit(self, fit: Fit) -> Fit:
        """Fit all parameters once more with weights and initial states of the model with the effect."""
        return fit_output_error(
            self.context,
            fit.model,
            fit.free.paths,
            segments=reprepare_segments(self.context, fit.model, fit.segments),
            stable=not limits_hunting(fit.model),
            tolerance=FINAL_TOLERANCE,
        )

    def _remove_superfluous(self, final: _Stage, steps: list[SelectionStep], previous: _Stage | None) -> _Stage:
        """Backward pass: remove each effect without which the validation error is not significantly higher.

        Updates `steps`. previous: the model before the last effect was added.
        """
        removed = not self.context.is_out_of_time
        while removed:
            removed = False
            added = [i for i, s in enumerate(steps) if s.added]
            for i in added if len(added) > 1 else ():
                refit = steps[i].added
                is_last = previous is not None and i == added[-1]
                stage = previous if is_last else self._without_effect(final.fit, refit)
                if stage is None:
                    continue
                self.context.progress.message(f"  without {_refit_text(refit)}: NRMSE {stage.validation.nrmse:.4f}")
                if not self._gains(stage, final):
                    final, previous, removed = stage, None, True
                    steps[i] = replace(steps[i], added=None)
                    break
        return final

    def _without_effect(self, fit: Fit, refit: Refit | None) -> _Stage | None:
        """Fit and validate the model without one of its effects; None where it cannot be fitted."""
        candidate = None if refit is None else refit.candidate
        index = None if candidate is None else effect_index(fit.model, candidate)
        if index is None:
            return None
        model = fit.model.without_effect(index)
        try:
            without = fit_output_error(
                self.context.in_background(self.context.jobs),
                model,
                [*self.context.campaign.estimated_parameters, *model.effect_paths()],
                segments=fit.segments,
                stable=not limits_hunting(model),
                tolerance=REMOVAL_TOLERANCE,
            )
        except ValueError:
            return None
        return self._validated(without)


def effect_index(model: Model, c: Candidate) -> int | None:
    """Index of a candidate among the effects of a model; None where it has none such."""
    same = [i for i, e in enumerate(model.effects) if (e.kind, e.at, e.wheelset) == (c.kind, c.at, c.wheelset)]
    return same[0] if same else None


def _refit_text(refit: Refit | None) -> str:
    return "nothing" if refit is None or refit.candidate is None else candidate_text(refit.candidate)


def simplest_refit(refits: Sequence[Refit], misfit_ratio: float) -> Refit | None:
    """Select the refit with fewest parameters among those whose misfit is within a ratio of the best."""
    if not refits:
        return None
    near = [r for r in refits if r.rss <= misfit_ratio * refits[0].rss]
    return min(near, key=lambda r: (len(r.fit.x), _is_on_one_wheelset(r.candidate), r.rss))


def _is_on_one_wheelset(candidate: Candidate | None) -> bool:
    """True for an effect on a single wheelset: one on both comes first."""
    return candidate is not None and candidate.wheelset is not None
