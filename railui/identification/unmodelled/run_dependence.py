"""Run-to-run variation: test whether a parameter differs between estimation and validation runs.

A model that reaches its noise floor on the estimation runs but not on the validation runs describes another vehicle: a
damper fades as it heats, rubber stiffens when cold, rails are worn elsewhere. No fit uses the validation runs. The
result therefore never lowers the reported error; it locates an effect that the model lacks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_gram
from railui.identification.estimation.fit import Fit, residual_variance
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.estimation.multiple_shooting import unstable_segments
from railui.identification.estimation.problem import FitSegment, prepare_segments
from railui.identification.estimation.validation import Validation, validate_each
from railui.identification.prediction import DivergedError
from railui.identification.structure.drift import parameter_groups
from railui.identification.structure.family_wise_test import family_wise_test
from railui.identification.structure.projection import Projector
from railui.identification.structure.score_result import LONELY, BlockScore
from railui.parallel import map_threads

Ratios = tuple[tuple[str, float], ...]  # of parameters that vary in proportion, by path

REFINEMENT_GRID = np.linspace(0.2, 3.2, core.LANES)  # multiples of the linear estimate of a change
LARGE_CHANGES = np.delete(np.geomspace(0.4, 2.5, core.LANES + 1), core.LANES // 2) - 1.0  # shares of a value
REFINEMENTS = 2  # each narrows the interval of the best change by a factor of some eight
# parameters of the suspensions, tested whether they are estimated or not
SUSPENSIONS = tuple(
    f"vehicle.{name}"
    for name in (
        "primary.lateral_stiffness", "primary.longitudinal_stiffness", "secondary.lateral_stiffness",
        "secondary.yaw_stiffness", "secondary.lateral_damping", "secondary.yaw_damping",
    )
)  # fmt: skip


class Shift(NamedTuple):
    """Other values of parameters, in proportion, on one run."""

    ratios: Ratios
    run: int


@dataclass(frozen=True)
class RunEstimate:
    """Value of a parameter on one run.

    On estimation runs it is the calibrated value, on validation runs the estimate with all else as calibrated. speed:
    mean speed [m/s].
    """

    run: int
    file: str
    role: str
    speed: float
    value: float
    sd: float


@dataclass(frozen=True, eq=False)
class RunDependence:
    """A parameter that differs from run to run.

    ratios: ratio to the value by path, of the parameter itself (1) and of those that vary in proportion. p:
    family-wise, of the hypothesis that no parameter differs. validation: that of the model with the value of each
    validation run.
    """

    path: str
    ratios: Mapping[str, float]
    runs: tuple[RunEstimate, ...]
    p: float
    validation: Validation


def prepare_validation(context: Context, fit: Fit) -> Fit | None:
    """Prepare the validation runs for the model of a fit; None if it hunts there."""
    segments, model = context.dataset.selection, fit.model
    limit = context.settings.calibration.max_growth_rate
    if model.design.is_on_track and unstable_segments(model, segments, limit):
        return None
    for segment in segments:
        model = estimate_phases(context, model, segment)
    return replace(fit, model=model, segments=tuple(prepare_segments(context, model, segments)))


def detect_run_dependence(context: Context, fit: Fit, validation_fit: Fit) -> RunDependence | None:
    """Test whether a parameter differs between runs; return the one whose separate values leave the least misfit.

    The parameter may differ on each validation run. In the test, which is linear, the part that all others would
    absorb, had they been estimated on every run, is projected out; the parameter is the one whose estimates leave the
    least misfit, since a large difference is not linear. Returns None if chance explains the difference. Raises
    ValueError if a simulation diverges.

    Parameters
    ----------
    fit
        The calibrated model on the estimation runs.
    validation_fit
        The same model prepared on the validation runs.
    """
    if not fit.model.design.is_on_track or any(t.is_window for t in fit.segments):
        return None
    scores = _RunScores(context, fit, validation_fit)
    results = scores.score_shifts()
    explained = dict[Ratios, float]()
    for s, shift in results:
        explained[shift.ratios] = explained.get(shift.ratios, 0.0) + s.rho**2
    if not explained:
        return None
    ratios = max(explained, key=lambda r: explained[r])
    tested = [s for s, shift in results if shift.ratios == ratios]
    p, _ = family_wise_test([s for s, _ in results], context.settings.score_test, context.seed, tested)
    if p > context.settings.run_dependence.run_dependence_level:
        return None
    ratios, estimates = scores.best_estimates(list(explained))
    path, names, proportions = ratios[0][0], [p for p, _ in ratios], np.array([r for _, r in ratios])
    sd = dict(zip(fit.free.paths, fit.sd.tolist(), strict=True))
    calibrated = (fit.model.value(path), sd.get(path, 0.0))
    runs = []
    dataset = context.dataset
    compared = [*dataset.estimation, *dataset.selection]
    for run in dict.fromkeys(s.run_index for s in compared):
        same = [s for s in compared if s.run_index == run]
        speed = float(np.mean([s.mean_speed for s in same]))
        runs.append(RunEstimate(run, same[0].file, same[0].role, speed, *estimates.get(run, calibrated)))
    models = [fit.model.with_path_values(names, estimates[s.run_index][0] * proportions) for s in dataset.selection]
    validation = validate_each(context, list(zip(models, dataset.selection, strict=True)))
    return RunDependence(path, dict(ratios), tuple(runs), p, validation)


class _RunScores:
    """Inner products per block of residual and sensitivities on all runs, those of the validation runs by run."""

    def __init__(self, context: Context, fit: Fit, validation_fit: Fit) -> None:
        self.context = context
        self.fit = fit
        self.segments = validation_fit.segments
        estimated = [p for p in fit.free.paths if "@" not in p and not p.startswith("sensors.")]
        values = context.nominal.design.values
        self.paths = [*estimated, *(p for p in SUSPENSIONS if p not in estimated and values.get(p))]
        model = replace(validation_fit.model, phases={})  # phases belong to a run and are not shared
        free = free_parameters(context, model, self.paths)
        background = context.in_background(context.jobs)
        self.optimiser = GaussNewton(background, validation_fit.model, free, self.segments, block=fit.block)
        self.x = np.array([fit.model.value(p) for p in self.paths])
        self.grams = [self._gram(t) for t in self.segments]

    def _gram(self, target: FitSegment) -> FloatArray:
        """Inner products [block, 1 + path, 1 + path] of a segment."""
        series, diverged = self.optimiser.sensitivities(target, self.x)
        if np.any(diverged >= 0):
            raise DivergedError(f"the vehicle diverges on {target.segment.file}")
        return np.asarray(block_gram(series, self.optimiser.block_samples(target)).sum(axis=1))

    def score_shifts(self) -> list[tuple[BlockScore, Shift]]:
        """Score every parameter on every validation run, with the estimated parameters of all runs projected out."""
        fit, count = self.fit, len(self.fit.free.paths)
        into = np.zeros((1 + len(self.paths), 1 + count))  # from these rows to the rows of the fit
        into[0, 0] = 1.0
        for j, path in enumerate(fit.free.paths):
            if path in self.paths:
                into[1 + self.paths.index(path), 1 + j] = 1.0
        inner = np.concatenate([fit.normal.gram.sum(axis=1), *(into.T @ g @ into for g in self.grams)])
        samples = fit.normal.samples + sum(t.measured.size for t in self.segments)
        variance = residual_variance(inner.sum(axis=0)[0, 0], samples, fit.normal.independent_share)
        projector = Projector(inner, fit.free, fit.x, variance)
        shifts = [
            Shift(tuple(ratios.items()), run)
            for ratios in self._parameter_groups()
            for run in dict.fromkeys(t.segment.run_index for t in self.segments)
        ]
        directions = np.array([self._direction(dict(s.ratios)) for s in shifts])
        cross = np.zeros((len(inner), len(shifts), 1 + count))
        norms = np.zeros((len(inner), len(shifts)))
        first = len(fit.normal.gram)
        for t, gram in zip(self.segments, self.grams, strict=True):
            is_on_run = np.array([s.run == t.segment.run_index for s in shifts])
            part = slice(first, first + len(gram))
            cross[part] = np.where(is_on_run[:, None], directions @ gram @ into, 0.0)
            norms[part] = np.where(is_on_run, np.einsum("lp,bpq,lq->bl", directions, gram, directions), 0.0)
            first += len(gram)
        scores = projector.project(cross, norms, self.context.settings.score_test.min_remaining_share)
        return [(scores.block_score(lane), s) for lane, s in enumerate(shifts) if scores.is_distinguishable[lane]]

    def _parameter_groups(self) -> list[dict[str, float]]:
        """List every parameter alone, then those of both wheelsets and all creep in proportion."""
        return [*({p: 1.0} for p in self.paths), *(r for _, r in parameter_groups(self.fit) if len(r) > 1)]

    def _direction(self, ratios: Mapping[str, float]) -> FloatArray:
        """Direction [1 + path] of a change of parameters in proportion."""
        direction = np.zeros(1 + len(self.paths))
        for path, ratio in ratios.items():
            direction[1 + self.paths.index(path)] = ratio
        return direction

    def best_estimates(self, groups: Sequence[Ratios]) -> tuple[Ratios, dict[int, tuple[float, float]]]:
        """Return the group whose values, estimated for each validation run, leave the least misfit, and these.

        Of each value there is its standard deviation, with all other parameters as calibrated.
        """
        estimated = map_threads(self._estimate_values, groups, self.context.jobs)
        _, group, estimates = min(
            ((misfit, group, values) for group, (misfit, values) in zip(groups, estimated, strict=True)),
            key=lambda one: one[0],
        )
        return group, estimates

    def _estimate_values(self, group: Ratios) -> tuple[float, dict[int, tuple[float, float]]]:
        """Estimate the value of each validation run and its standard deviation; return the misfit with these first.

        The standard deviation is that of leave-one-out residuals of blocks; infinite with a single one, and on a run
        that the value does not influence, where the calibrated value is kept.
        """
        c = self._direction(dict(group))
        j = self.paths.index(group[0][0])
        misfit, estimates = 0.0, {}
        low, high = self.optimiser.free.low[j], self.optimiser.free.high[j]
        for run in dict.fromkeys(t.segment.run_index for t in self.segments):
            segments = [t for t in self.segments if t.segment.run_index == run]
            gram = np.concatenate(
                [g for t, g in zip(self.segments, self.grams, strict=True) if t.segment.run_index == run]
            )
            score, norm = gram[:, 0] @ c, np.einsum("p,bpq,q->b", c, gram, c)
            if not norm.sum() > 0.0:  # without influence on this run: it keeps the calibrated value
                estimates[run] = (float(self.x[j]), np.inf)
                misfit += float(self._misfits(segments, c[1:], np.zeros(1))[0])
                continue
            change, leverage = score.sum() / norm.sum(), norm / norm.sum()
            left_out = (score - change * norm) / np.maximum(1.0 - leverage, LONELY)  # HC3, as for a score
            sd = float(np.linalg.norm(left_out) / norm.sum()) if len(norm) > 1 else np.inf
            least, refined = self._refine_change(segments, c[1:], change, abs(self.x[j]))
            misfit += least
            estimates[run] = (float(np.clip(self.x[j] + refined, low, high)), sd)
        return misfit, estimates

    def _refine_change(
        self, segments: Sequence[FitSegment], direction: FloatArray, change: float, size: float
    ) -> tuple[float, float]:
        """Return the least misfit of a run over changes of a parameter, and the change.

        The first changes are multiples of the linear estimate, and shares of the size of the parameter, since the
        misfit of a large difference has other minima; the neighbourhood of the best is refined.
        """
        changes = np.unique(np.concatenate([change * REFINEMENT_GRID, size * LARGE_CHANGES, [0.0]]))
        best, least = 0.0, np.inf
        for _ in range(1 + REFINEMENTS):
            rss = self._misfits(segments, direction, changes)
            k = int(np.argmin(rss))
            best, least = float(changes[k]), float(rss[k])
            around = changes[max(k - 1, 0)], changes[min(k + 1, len(changes) - 1)]
            changes = np.unique([*np.linspace(*around, core.LANES), best])
        return least, best

    def _misfits(self, segments: Sequence[FitSegment], direction: FloatArray, changes: FloatArray) -> FloatArray:
        """Misfit of a run for each change of the parameters in a direction; infinite where the vehicle diverges."""
        x = np.clip(self.x + changes[:, None] * direction, self.optimiser.free.low, self.optimiser.free.high)
        rss = np.zeros(len(changes))
        for t in segments:
            series, diverged = self.optimiser.simulate(t, x)
            rss += np.where(diverged < 0, np.sum((series - t.measured) ** 2, axis=(1, 2)), np.inf)
        return rss
