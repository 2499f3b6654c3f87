"""Effects added one after another while the residual is structured, and dropped again where no longer needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.campaign.dataset import Dataset
from railui.identification.estimation.multiple_shooting import limits_hunting
from railui.identification.estimation.output_error import Fit, fit_output_error
from railui.identification.estimation.problem import reprepare_segments, truncate
from railui.identification.estimation.validation import Validation, estimate_noise_floor, validate
from railui.identification.events import ModelValidated
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.identification.structure.couplings import find_couplings
from railui.identification.structure.drift import find_drifts
from railui.identification.structure.refit import Refit, cross_validation_errors, named, refit_candidates
from railui.identification.structure.score_test import ScoreTestResult, score_test
from railui.parallel import run_both
from railui.progress import Report, Watch
from railui.vehicle.model import Model

SIGNIFICANT = 0.01  # family-wise p from which a residual is worth a fit
STRUCTURED = 0.01  # partial rho^2 from which a residual is worth a fit
OBVIOUS = 0.20  # and from which no test is asked: noise, whatever its colour, reaches a fiftieth
EFFECTS = 3
ADEQUATE = 1.10  # after over floor up to which nothing is left to find
UNEXPLAINED = 1.5  # after over floor from which something is missing, whatever it looks like
UNSETTLED = 1.3  # after over floor from which elements that adjusting has absorbed are tried too
SIMPLER = 1.02  # within so much of the best misfit the simpler law is taken
PROMISING = 0.05  # share of the adjusting runs' misfit that an effect must take to be tried with another
CLEARLY = 1.0  # standard errors of the gain on the validating runs that it must exceed
TRACED, GLIMPSED = 40.0, 12.0  # seconds of each stretch that the trace looks at, and those of its first look
ROUGH_FLOOR = 5  # draws of a floor that only steers
PLAIN = 0.10  # share that a change along the track must explain to expose an effect
EXPOSED = 1.05  # a change along the track that explains so much more than an effect exposes it


@dataclass(frozen=True, eq=False)
class SelectionStep:
    """One turn of the loop: what was seen, what was fitted, what was added."""

    trace: ScoreTestResult
    refits: tuple[Refit, ...]
    added: Refit | None


@dataclass(frozen=True, eq=False)
class Selection:
    """The vehicle with the effects that stand, how it was judged, every turn, and the trace of what it leaves."""

    fit: Fit
    judgement: Validation
    steps: tuple[SelectionStep, ...]
    last: ScoreTestResult

    @property
    def added(self) -> bool:
        """Does any effect stand?"""
        return any(s.added for s in self.steps)


def is_significant_gain(old: Validation, new: Validation, share: float) -> bool:
    """Is the error on the validating runs lower by a material share, and clearly so against its own scatter?"""
    if not np.isfinite(new.nrmse):
        return False
    gain, sd = old.error_reduction(new)
    return bool(gain >= 1.0 - (1.0 - share) ** 2 and gain > CLEARLY * sd)


def has_structure(seen: ScoreTestResult) -> bool:
    """Does what is left have a shape that noise does not have?"""
    return seen.rho2 >= STRUCTURED and (seen.p <= SIGNIFICANT or seen.rho2 >= OBVIOUS)


@dataclass(frozen=True, eq=False)
class StepwiseSelection:
    """The search for the effects that a measurement asks for."""

    measurement: Dataset
    declared: Model
    without: frozenset[str]
    seed: int
    jobs: int | None
    report: Report
    watch: Watch

    def traced(self, fit: Fit) -> ScoreTestResult:
        """What a little of every candidate says about the residual of a fit."""
        m = self.measurement
        loaded = m.campaign.track == "loaded"
        found = list_candidates(fit.model, m.estimation, without=self.without, loaded=loaded)
        part = replace(fit, segments=tuple(truncate(fit.segments, m, TRACED)))
        first = truncate(part.segments, m, GLIMPSED)
        seen = score_test(part, found, first=first, jobs=self.jobs, seed=self.seed, watch=self.watch)
        self.report(
            f"trace: {len(seen.best)} candidates, best partial rho^2 {seen.rho2:.3f}, family-wise p {seen.p:.4f}"
        )
        self.watch(seen)
        return seen

    def select_effects(self, before: Fit, judged: Validation, hunting: Fit | None = None) -> Selection:
        """Effects added to the adjusted vehicle, up to three, then those dropped that are no longer needed.

        hunting: the vehicle adjusted on windows, where one that is stable cannot follow; the search starts from it.

        An effect that lowers the misfit of the adjusting runs but not yet the error of the validating ones stays on
        trial while the next is looked for: of two that are missing, one alone may gain nothing.
        """
        now, steps = hunting or before, list[SelectionStep]()
        good, accepted, kept = before, judged, 0
        stages = [(before, judged)]  # the vehicle as it was before each step, and how it was judged
        noise = estimate_noise_floor(
            before.model, self.measurement, self.measurement.validation, ROUGH_FLOOR, self.jobs
        )
        self.report(f"adjusted, no effect: nrmse {judged.nrmse:.4f}, noise floor {noise.nrmse:.4f}")
        for _ in range(EFFECTS):
            seen = self.traced(now)
            quiet = not has_structure(seen)
            if quiet and not accepted.nrmse > UNEXPLAINED * noise.nrmse:
                steps.append(SelectionStep(seen, (), None))
                break
            refits, chosen, trial = self._best(now, seen, bool(accepted.nrmse > UNSETTLED * noise.nrmse))
            if chosen is None or trial is None:
                steps.append(SelectionStep(seen, refits, None))
                break
            result = validate(trial.model, self.measurement, self.measurement.validation)
            self.report(f"  with {_words(chosen)}: nrmse {result.nrmse:.4f}")
            gains = is_significant_gain(accepted, result, self.measurement.campaign.min_relative_gain)
            hopeful = chosen.rss <= (1.0 - PROMISING) * now.normal.rss and accepted.nrmse > ADEQUATE * noise.nrmse
            alone = len(steps) > kept  # one on trial already, and this one does not save it
            if not gains and (alone or not hopeful):
                steps.append(SelectionStep(seen, refits, None))
                break
            now = trial
            stages.append((trial, result))
            steps.append(
                SelectionStep(seen, refits, replace(chosen, fit=trial, held_out=cross_validation_errors(trial)))
            )
            if gains:
                good, accepted, kept = trial, result, len(steps)
                self.watch(ModelValidated("after", result))
                noise = estimate_noise_floor(
                    trial.model, self.measurement, self.measurement.validation, ROUGH_FLOOR, self.jobs
                )
                if result.nrmse <= (1.0 + 0.5 * (ADEQUATE - 1.0)) * noise.nrmse:
                    break
        steps = [s if i < kept else replace(s, added=None) for i, s in enumerate(steps)]
        fit, accepted, steps = self._without_idle(good, accepted, steps, stages[kept - 1] if kept else None)
        known = fit is good and kept < len(steps)
        last = steps[kept].trace if known else self.traced(fit)
        return Selection(fit, accepted, tuple(steps), last)

    def _best(
        self, fit: Fit, seen: ScoreTestResult, unsettled: bool
    ) -> tuple[tuple[Refit, ...], Refit | None, Fit | None]:
        """What the trace named, fitted; the one to add, and the vehicle with it adjusted once more."""
        m = self.measurement
        refits = tuple(
            refit_candidates(
                fit,
                seen,
                m,
                self.declared,
                m.campaign.estimated_parameters,
                unsettled=unsettled,
                jobs=self.jobs,
                report=self.report,
                watch=self.watch,
            )
        )
        chosen = select(refits)
        if chosen is None:
            return refits, None, None
        trial, strangers = run_both(lambda: self._final(chosen.fit), lambda: self._strangers(fit), self.jobs)
        share = 1.0 - chosen.rss / fit.normal.rss
        for words, explained in strangers:
            if explained >= max(EXPOSED * share, PLAIN):
                self.report(f"  {words} explains more: {explained:.2f}, not {share:.2f}")
                return refits, None, None
        return refits, chosen, trial

    def _strangers(self, fit: Fit) -> list[tuple[str, float]]:
        """What no entry of the catalogue does, and how much of the misfit it explains: these expose an effect."""
        along, coupled = find_drifts(fit, self.seed)[:1], find_couplings(fit)[:1]
        return [(f"{d.path} changing along the track", d.share) for d in along] + [
            (f"a coupling of {c.text}", c.share) for c in coupled
        ]

    def _final(self, fit: Fit) -> Fit:
        """Everything adjusted once more with weights and initial states of the model as found."""
        ready = reprepare_segments(fit.model, fit.segments, self.measurement)
        return fit_output_error(
            fit.model, self.measurement, fit.free.paths, self.declared, ready=ready, stable=not limits_hunting(fit.model),
            tolerance=1e-5, jobs=self.jobs, watch=self.watch,
        )  # fmt: skip

    def _without_idle(
        self, fit: Fit, judged: Validation, steps: list[SelectionStep], one_less: tuple[Fit, Validation] | None
    ) -> tuple[Fit, Validation, list[SelectionStep]]:
        """The backward pass: each effect taken out, all adjusted again; what is not missed stays out.

        one_less: the vehicle as it was before the last effect came in.
        """
        idle = True
        while idle:
            added = [i for i, s in enumerate(steps) if s.added]
            idle = False
            for i in added if len(added) > 1 else ():
                refit = steps[i].added
                if one_less is not None and i == added[-1]:
                    trial, result = one_less
                else:
                    taken = None if refit is None else self._without(fit, refit)
                    if taken is None:
                        continue
                    trial, result = taken, validate(taken.model, self.measurement, self.measurement.validation)
                self.report(f"  without {_words(refit)}: nrmse {result.nrmse:.4f}")
                if not is_significant_gain(result, judged, self.measurement.campaign.min_relative_gain):
                    fit, judged, idle, one_less = trial, result, True, None
                    steps[i] = replace(steps[i], added=None)
                    break
        return fit, judged, steps

    def _without(self, fit: Fit, refit: Refit) -> Fit | None:
        """The vehicle without one of its effects, all adjusted again; None where it cannot be fitted."""
        index = None if refit.candidate is None else index_of(fit.model, refit.candidate)
        if index is None:
            return None
        model = fit.model.without(index)
        try:
            return fit_output_error(
                model, self.measurement, [*self.measurement.campaign.estimated_parameters, *model.effect_paths()], self.declared,
                ready=fit.segments, stable=not limits_hunting(model), tolerance=1e-4, jobs=self.jobs,
            )  # fmt: skip
        except ValueError:
            return None


def index_of(model: Model, c: Candidate) -> int | None:
    """Where a candidate stands among the effects of a model."""
    same = [i for i, e in enumerate(model.effects) if (e.kind, e.at, e.wheelset) == (c.kind, c.at, c.wheelset)]
    return same[0] if same else None


def _words(refit: Refit | None) -> str:
    return "nothing" if refit is None or refit.candidate is None else named(refit.candidate)


def select(refits: Sequence[Refit]) -> Refit | None:
    """The best fit, or the one with fewest parameters among those that are as good."""
    if not refits:
        return None
    near = [r for r in refits if r.rss <= SIMPLER * refits[0].rss]
    return min(near, key=lambda r: (len(r.fit.x), _restricted(r.candidate), r.rss))


def _restricted(candidate: Candidate | None) -> int:
    """An effect on both wheelsets before one on a single wheelset."""
    return 0 if candidate is None or candidate.wheelset is None else 1
