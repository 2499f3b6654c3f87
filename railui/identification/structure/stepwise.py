"""Stepwise selection: effects are added while the residual has structure, then superfluous ones are removed."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

from railui.identification.context import Context, OutOfTimeError
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import MAX_ITERATIONS
from railui.identification.estimation.growing_windows import follow_motion, follows
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import FitSegment, reprepare_segments
from railui.identification.estimation.validation import Validation
from railui.identification.events import ModelValidated
from railui.identification.prediction import DivergedError
from railui.identification.residual.track_noise import with_track_noise
from railui.identification.structure.candidate_scores import has_structure, run_score_test, scored_part
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.elimination import refit_text, remove_superfluous, remove_undetermined
from railui.identification.structure.exchange import exchange_effects
from railui.identification.structure.freed_groups import FreedGroups
from railui.identification.structure.limiting_laws import replace_by_limits
from railui.identification.structure.pairs import (
    PairRefit,
    PairSearch,
    refit_pairs,
    score_pairs,
    simplest_pair,
)
from railui.identification.structure.refit import Refit, cross_validation_errors, refit_candidates, simplest_refit
from railui.identification.structure.rivals import RivalExplanations
from railui.identification.structure.score_test import ScoreTest, ScoreTestResult
from railui.identification.structure.stage import (
    SelectionStep,
    Stage,
    gains,
    is_decisive,
    pair_steps,
    validated_stage,
)
from railui.parallel import map_threads, run_both
from railui.vehicle.effects import PlacedEffect

FINAL_TOLERANCE = 1e-5
BENCH_TOLERANCE = 1e-6
BENCH_ITERATIONS = 150  # relaxations on several time scales converge slowly, and a bench is simulated quickly

Effects = frozenset[tuple[str, str, int | None]]  # by kind, location and wheelset


@dataclass(frozen=True, eq=False)
class Selection:
    """The model with the selected effects, its validation, every step, and the tests of its residual."""

    fit: Fit
    validation: Validation
    steps: tuple[SelectionStep, ...]
    final_score_test: ScoreTestResult
    freed: FreedGroups

    @property
    def has_effects(self) -> bool:
        """True where at least one effect is selected."""
        return any(s.added for s in self.steps)


class _Path(NamedTuple):
    """Steps of a forward selection, the model before each and after the last, and how many steps are accepted.

    start: the fit from which the first effect is sought, on windows where no fit over whole runs will do.
    """

    steps: list[SelectionStep]
    stages: list[Stage]
    accepted: int
    floor: NoiseFloor
    start: Fit


class StepwiseSelection:
    """Stepwise selection of the effects that a dataset supports."""

    def __init__(self, context: Context) -> None:
        self.context = context
        self.settings = context.settings.selection
        self.whole_runs: tuple[FitSegment, ...] = ()  # where the model without effects is out of step with the motion
        self.rivals = RivalExplanations(context)

    def select_effects(self, before: Fit, validation: Validation, windowed: Fit | None = None) -> Selection:
        """Add effects to the calibrated model, then remove those that are no longer needed.

        An effect that lowers the misfit on the estimation runs but not yet the error on the validation runs stays on
        trial while the next is sought: of two missing effects, either one alone may gain nothing.

        Parameters
        ----------
        windowed
            The model fitted on windows, where a stable one cannot follow; the selection starts from it.
        """
        start = windowed or before
        self.whole_runs = before.segments if start.slips else ()
        floor = self._preliminary_floor(before)
        self.context.progress.message(
            f"calibrated, no effect added: NRMSE {validation.nrmse:.4f}, noise floor {floor.nrmse:.4f}"
        )
        path = self._forward(_Path([], [Stage(before, validation)], 0, floor, start))
        for _ in range(self.settings.max_effects):
            better = self._with_pair(path)
            if better is None:
                break
            path = self._forward(better)
        accepted, count = path.stages[path.accepted], path.accepted
        steps = [s if i < count else replace(s, added=None) for i, s in enumerate(path.steps)]
        previous = path.stages[count - 1] if count and not steps[count - 1].in_pair else None
        final = remove_superfluous(self.context, accepted, steps, previous, self._final_fit)
        final = exchange_effects(self.context, final, steps, self._final_fit)
        final = replace_by_limits(self.context, final, steps, self._final_fit)
        final = remove_undetermined(self.context, final, steps, self._final_fit)
        is_known = final.fit is accepted.fit and count < len(steps)
        last = steps[count].score_test if is_known else run_score_test(self.context, final.fit)
        return Selection(final.fit, final.validation, tuple(steps), last, self.rivals.freed_groups(final.fit))

    def _forward(self, path: _Path) -> _Path:
        """Add one effect after the other to the last model of a path, as long as they gain or are on trial."""
        steps, stages, accepted, floor = list(path.steps), list(path.stages), path.accepted, path.floor
        while len(steps) < self.settings.max_effects and not (accepted and self._is_adequate(stages[accepted], floor)):
            current = stages[-1].fit if steps else path.start
            step, stage = self._step(current, stages[accepted], floor, on_trial=steps[accepted:])
            steps.append(step)
            if stage is None:
                break
            stages.append(stage)
            if self._gains(steps[accepted:], stages[accepted], stage):
                accepted = len(steps)
                self.context.progress.event(ModelValidated("after", stage.validation))
                floor = self._preliminary_floor(stage.fit)
        return _Path(steps, stages, accepted, floor, path.start)

    def _is_adequate(self, stage: Stage, floor: NoiseFloor) -> bool:
        """True where so little is left beyond noise that no further effect can gain enough."""
        return stage.validation.nrmse <= self.settings.adequate_ratio * floor.nrmse

    def _leaves_noise(self, path: _Path) -> bool:
        """True where accepted effects leave a residual that is noise."""
        further = path.steps[path.accepted :]
        if not path.accepted or not further:
            return False
        return self._is_noise(further[0].score_test, path.stages[path.accepted], path.floor)

    def _is_noise(self, scores: ScoreTestResult, stage: Stage, floor: NoiseFloor) -> bool:
        """True for a residual without structure that is small or, with effects in the model, may be track noise."""
        if has_structure(self.context.settings.score_test, scores):
            return False
        if stage.validation.nrmse <= self.settings.unexplained_ratio * floor.nrmse:
            return True
        if not stage.fit.model.effects:
            return False
        return with_track_noise(self.context, stage.fit.model, stage.validation, floor) is not None

    def _with_pair(self, path: _Path) -> _Path | None:
        """Look for a pair of effects where single ones leave a structure; None where none gains, or nothing is left.

        A pair is added to the last model, or to the one before in place of its last effect. The pairs that were scored
        are noted in the steps.
        """
        accepted = path.stages[path.accepted]
        if self._is_adequate(accepted, path.floor) or self.context.is_out_of_time or self._leaves_noise(path):
            return None
        freed = self.rivals.freed_groups(accepted.fit).validation
        if freed is not None and freed.nrmse <= self.settings.adequate_ratio * path.floor.nrmse:
            return None
        last = min(path.accepted, self.settings.max_effects - 2)
        for base in range(last, max(last - 2, -1), -1):
            step = path.steps[base]
            is_done = step.pairs is not None or step.in_pair
            if is_done or not has_structure(self.context.settings.score_test, step.score_test):
                continue
            fit = path.stages[base].fit if base else path.start
            try:
                fitted = _fitted_pairs(path.steps[base:]) | {_added_to(fit, accepted.fit)}
                pairs, search = self._refit_best_pairs(fit, step.score_test, accepted.fit, fitted)
            except OutOfTimeError:
                return None
            path.steps[base] = replace(step, pairs=search)
            stage = None if pairs is None else self._pair_stage(fit, pairs)
            if pairs is None or stage is None:
                continue
            added = pair_steps(self.context, path.steps[base], pairs)
            if not self._gains(added, accepted, stage):
                continue
            self.context.progress.event(ModelValidated("after", stage.validation))
            steps = [*path.steps[:base], *added]
            stages = [*path.stages[: base + 1], stage, stage]
            return _Path(steps, stages, base + 2, self._preliminary_floor(stage.fit), path.start)
        return None

    def _refit_best_pairs(
        self, fit: Fit, scores: ScoreTestResult, accepted: Fit, fitted: Collection[Effects]
    ) -> tuple[PairRefit | None, PairSearch]:
        """Score all pairs against the residual of a fit, refit the best, and select one.

        None is selected whose misfit is larger than that of the accepted model.

        fitted: pairs that have been fitted to the same model.
        """
        part = scored_part(self.context, fit)
        test = ScoreTest(self.context, part, part.segments)
        pairs, scored = score_pairs(test, scores)
        others = [p for p in pairs if frozenset(map(_identity, p.candidates)) not in fitted]
        best = others[: self.settings.refitted_pairs]
        self.context.progress.message(f"{scored} pairs of effects scored, {len(best)} refitted")
        accepted_share = accepted.normal.misfit_per_sample / fit.normal.misfit_per_sample
        ratio = self.settings.simpler_misfit_ratio
        limit = ratio * accepted.normal.misfit_per_sample * fit.normal.samples
        refits = refit_pairs(self.context, fit, best, self.settings.hopeless_pair_ratio * accepted_share, limit)
        pair = simplest_pair(refits, ratio)
        return None if pair is None or pair.rss > limit else pair, PairSearch(scored, len(best))

    def _pair_stage(self, fit: Fit, pair: PairRefit) -> Stage | None:
        """Fit a pair to the end and validate it; None where it diverges, or something else explains more."""
        if self.rivals.explain_more(self.rivals.outside_library(fit), 1.0 - pair.rss / fit.normal.rss):
            return None
        if self.rivals.members_explain_as_much(fit, pair.rss, len(pair.fit.x)):
            return None
        try:
            stage = self._validated(self._final_fit(pair.fit))
        except DivergedError as error:
            self.context.progress.message(f"  without {pair.score.text}: {error}")
            return None
        self.context.progress.message(f"  with {pair.score.text}: NRMSE {stage.validation.nrmse:.4f}")
        return stage

    def _preliminary_floor(self, fit: Fit) -> NoiseFloor:
        draws = self.context.settings.validation.preliminary_floor_draws
        return estimate_noise_floor(self.context, fit.model, self.context.dataset.selection, draws)

    def _gains(self, steps: Sequence[SelectionStep], old: Stage, new: Stage) -> bool:
        """True where a stage gains on the validation runs, clearly so unless an added effect has a significant score.

        Without it an effect is the best of many on the validation runs.

        steps: those from the old stage to the new one.
        """
        if not gains(self.context, old, new):
            return False
        if any(step.is_significant for step in steps):
            return True
        return is_decisive(self.settings, old.validation.error_reduction(new.validation))

    def _validated(self, fit: Fit) -> Stage:
        return validated_stage(self.context, fit)

    def _step(
        self, current: Fit, accepted: Stage, floor: NoiseFloor, *, on_trial: Sequence[SelectionStep]
    ) -> tuple[SelectionStep, Stage | None]:
        """Look for one more effect; None: the forward selection ends.

        on_trial: steps that have added an effect without a gain, which is retained only if this one gains.
        """
        settings, nrmse = self.settings, accepted.validation.nrmse
        scores = run_score_test(self.context, current)
        if self.context.is_out_of_time:
            return SelectionStep(scores, (), None), None
        if self._is_noise(scores, accepted, floor):
            return SelectionStep(scores, (), None), None
        with_absorbed = bool(nrmse > settings.absorbed_ratio * floor.nrmse)
        try:
            refits, chosen, fit = self._best_candidate(current, scores, with_absorbed)
        except OutOfTimeError:
            return SelectionStep(scores, (), None), None
        if chosen is None or fit is None:
            return SelectionStep(scores, refits, None), None
        stage = self._validated(fit)
        self.context.progress.message(f"  with {refit_text(chosen)}: NRMSE {stage.validation.nrmse:.4f}")
        can_gain = not self._is_adequate(accepted, floor)
        is_promising = can_gain and chosen.rss <= (1.0 - settings.trial_misfit_share) * current.normal.rss
        if not self._gains([*on_trial, SelectionStep(scores, refits, chosen)], accepted, stage):
            runner_up = self._runner_up(current, scores, accepted, refits, chosen, on_trial) if can_gain else None
            if runner_up is not None:
                chosen, stage = runner_up
            elif on_trial or not is_promising:
                return SelectionStep(scores, refits, None), None
        errors = cross_validation_errors(self.context.settings.refit, stage.fit)
        return SelectionStep(scores, refits, replace(chosen, fit=stage.fit, block_errors=errors)), stage

    def _runner_up(
        self,
        current: Fit,
        scores: ScoreTestResult,
        accepted: Stage,
        refits: Sequence[Refit],
        chosen: Refit,
        on_trial: Sequence[SelectionStep],
    ) -> tuple[Refit, Stage] | None:
        """Find the best of the next candidates that gains on the validation runs, where the first does not."""
        limit = (1.0 - self.context.settings.score_test.structured_rho2) * current.normal.rss
        next_best = [r for r in refits if r is not chosen and r.rss <= limit][: self.settings.runners_up]
        best: tuple[Refit, Stage] | None = None
        background = self.context.in_background(1 if len(next_best) > 1 else self.context.jobs)
        validated = map_threads(partial(self._runner_up_stage, background), next_best, self.context.jobs)
        for refit, stage in zip(next_best, validated, strict=True):
            if stage is None:
                continue
            self.context.progress.message(f"  with {refit_text(refit)}: NRMSE {stage.validation.nrmse:.4f}")
            is_lower = best is None or stage.validation.nrmse < best[1].validation.nrmse
            if is_lower and self._gains([*on_trial, SelectionStep(scores, (), refit)], accepted, stage):
                best = refit, stage
        return best

    def _runner_up_stage(self, background: Context, refit: Refit) -> Stage | None:
        """Fit a runner-up to the end and validate it; None where it diverges, or the time budget has ended."""
        if self.context.is_out_of_time:
            return None
        try:
            fit = self._final_fit(refit.fit, background)
            if fit.model.design.form == "rig":  # it was given up early; laws of one damping converge slowly
                fit = self._final_fit(fit, background)
        except DivergedError:
            return None
        return validated_stage(background, fit)

    def _best_candidate(
        self, fit: Fit, scores: ScoreTestResult, with_absorbed: bool
    ) -> tuple[tuple[Refit, ...], Refit | None, Fit | None]:
        """Refit the candidates; return also the one to add and its final fit, unless something else explains more."""
        refits = tuple(refit_candidates(self.context, fit, scores, with_absorbed=with_absorbed))
        chosen = simplest_refit(refits, self.settings.simpler_misfit_ratio)
        if chosen is None:
            return refits, None, None
        if self.rivals.members_explain_as_much(fit, chosen.rss, len(chosen.fit.x)):
            return refits, None, None
        share = 1.0 - chosen.rss / fit.normal.rss
        final, rivals = run_both(
            lambda: self._fitted_once_more(refits), lambda: self.rivals.outside_library(fit, share), self.context.jobs
        )
        if final is None or self.rivals.explain_more(rivals, 1.0 - final[0].rss / fit.normal.rss):
            return refits, None, None
        return refits, *final

    def _fitted_once_more(self, refits: Sequence[Refit]) -> tuple[Refit, Fit] | None:
        """Return the simplest refit with its final fit; None: the vehicle diverges next to every estimate."""
        left = list(refits)
        while (chosen := simplest_refit(left, self.settings.simpler_misfit_ratio)) is not None:
            try:
                return chosen, self._final_fit(chosen.fit)
            except DivergedError as error:
                self.context.progress.message(f"  without {refit_text(chosen)}: {error}")
                left = [refit for refit in left if refit is not chosen]
        return None

    def _final_fit(self, fit: Fit, background: Context | None = None) -> Fit:
        """Fit all parameters once more with weights and initial states of the model with the effect.

        Where the model fell out of step with the motion over whole runs, the windows are lengthened again: with the
        effect it may follow them. Raises DivergedError where the vehicle diverges next to the estimate.

        background: context of a fit whose iterations are not reported.
        """
        context = background or self.context
        if self.whole_runs and any(t.is_window for t in fit.segments):
            return self._lengthened_fit(context, fit)
        is_bench = context.campaign.design.form == "bench"
        return fit_output_error(
            context,
            fit.model,
            fit.free.paths,
            segments=reprepare_segments(context, fit.model, fit.segments),
            tolerance=BENCH_TOLERANCE if is_bench else FINAL_TOLERANCE,
            max_iterations=BENCH_ITERATIONS if is_bench else MAX_ITERATIONS,
        )

    def _lengthened_fit(self, context: Context, fit: Fit) -> Fit:
        """Fit on windows as long as the model follows the motion, whole runs at last."""
        quiet = context.in_background(context.jobs)
        followed = follow_motion(quiet, fit.model, fit.free.paths, self.whole_runs, shortest=fit)
        if followed is None:
            return fit
        if followed.whole is not None and follows(self.context, followed.whole):
            return followed.whole
        return followed.windowed


def _fitted_pairs(steps: Sequence[SelectionStep]) -> set[Effects]:
    """Pairs that two steps have fitted: what the first added, and each candidate that could be fitted to it."""
    if len(steps) < 2 or steps[0].added is None or steps[0].added.candidate is None:
        return set()
    first = _identity(steps[0].added.candidate)
    return {frozenset({first, _identity(r.candidate)}) for r in steps[1].refits if r.candidate is not None}


def _added_to(fit: Fit, other: Fit) -> Effects:
    """Effects that another model has in addition to those of a fit."""
    return frozenset(map(_identity, other.model.effects)) - frozenset(map(_identity, fit.model.effects))


def _identity(effect: Candidate | PlacedEffect) -> tuple[str, str, int | None]:
    return effect.kind, effect.at, effect.wheelset
