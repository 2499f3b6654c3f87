"""Gauss-Newton iteration of the output-error method, with Levenberg damping and batches of sixteen vehicles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.block_products import block_gram, block_length
from railui.identification.estimation.fit import Fit, NormalEquations
from railui.identification.estimation.free_parameters import FreeParameters
from railui.identification.estimation.problem import (
    FitSegment,
    channel_power,
    estimate_window_start,
    improve_start,
    settle_start,
)
from railui.identification.events import FitIteration
from railui.identification.prediction import DivergedError, Simulation, required_steps_each
from railui.parallel import map_threads
from railui.vehicle.model import RADIUS, Model

DAMPINGS = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)  # of Levenberg, tried in one batch
FINE_DAMPINGS = (0.0, 1e-5, 1e-4, 1e-3, 1e-2, 1.0)  # along directions that the data hardly determine
STEP_SHARES = ((0, 0.3), (2, 0.5))  # further trial points: damping by its index, share of its step
RELATIVE_STEP = 1e-5  # of the forward differences
RELATIVE_STEP_WITH_EFFECTS = 1e-4
ROLLING_RADIUS_STEP = 1e-6  # over a thousand turns a relative change of a radius is 6000 times as large an angle
MIN_STEP_SIZE_SHARE = 0.1  # of the usual size of a parameter near zero
MAX_LOG_RATIO_STEP = 1.5  # of a parameter that moves by ratios, per iteration
# of the gain that the normal equations predict: the usual bound of a trust region below which it shrinks (Nocedal and
# Wright, Numerical Optimization, 2nd ed. 2006, algorithm 4.1)
MIN_ACHIEVED_SHARE = 0.25
MAX_ITERATIONS = 30
MAX_RETAINED = 1 << 25  # numbers of the simulations of trial points that are kept for the residual of the best


class GaussNewton:
    """Output-error least squares of one model structure over prepared segments.

    Parameters
    ----------
    block
        Duration [s] of a block of the normal equations.
    stable
        Reject linear vehicles that are unstable over a whole run.
    """

    def __init__(
        self,
        context: Context,
        model: Model,
        free: FreeParameters,
        segments: Sequence[FitSegment],
        *,
        block: float = 1.0,
        stable: bool = False,
    ) -> None:
        self.context = context
        self.settings = context.settings.calibration
        self.model = model
        self.free = free
        self.segments = list(segments)
        self.block = block
        self.stable = stable
        self.shared = [j for j, p in enumerate(free.paths) if "@" not in p]  # by all segments
        self.columns = [model.columns[free.paths[j]] for j in self.shared]
        self.rolling_radii = {f"{p.rpartition('.')[0]}.{RADIUS}" for p in model.run_dependent_paths()}
        self.dampings = DAMPINGS
        self.simulations = 0
        self.constrained = False
        self._tried = np.zeros((0, 0))  # points [n, p] of the last misfits, and the simulation of each segment there
        self._simulated: dict[FitSegment, Simulation] = {}
        share = self.settings.independent_sample_share
        self.independent_samples = share * sum(t.measured.size for t in segments)

    @classmethod
    def of_fit(
        cls, context: Context, fit: Fit, segments: Sequence[FitSegment] | None = None, *, stable: bool = False
    ) -> GaussNewton:
        """Optimiser of the model and the parameters of a fit, on its segments or on others."""
        chosen = fit.segments if segments is None else segments
        return cls(context, fit.model, fit.free, chosen, block=fit.block, stable=stable)

    def rows(self, x: FloatArray, segment: Segment | None = None) -> FloatArray:
        """Rows [n, row] of vehicles with the free parameters x [n, p], and their phases on a segment."""
        rows = np.tile(self.model.row, (len(x), 1))
        rows[:, self.columns] = x[:, self.shared]
        if segment is not None:
            angles = {p: x[:, j] for j, p in enumerate(self.free.paths) if "@" in p}
            self.model.set_on_segment(rows, *segment.segment_key, angles)
        return rows

    def simulate(self, target: FitSegment, x: FloatArray, table: FloatArray | None = None) -> Simulation:
        """Simulate the compared channels [n, channel, sample] of vehicles with x [n, p] on a segment.

        table: input table in the place of the measured one.
        """
        batch = self.model.batch(self.rows(x, target.segment))
        return target.predictor(self.model).simulate(batch=batch, table=table, jobs=self.context.jobs)

    def misfit(self, x: FloatArray) -> FloatArray:
        """Sum of weighted squared residuals of each row of x [n, p]; infinite where diverged or not admissible."""
        admissible = self._are_admissible(x)
        out = np.where(admissible, 0.0, np.inf)
        if not admissible.any():
            return out

        self._tried, self._simulated = x[admissible], {}
        size = len(self._tried) * sum(t.measured.size for t in self.segments)
        is_retained = size <= MAX_RETAINED and any(t.sensitivity_steps != t.steps for t in self.segments)

        def sum_of_squares(target: FitSegment) -> FloatArray:
            series, diverged = simulation = self.simulate(target, x[admissible])
            if is_retained:
                self._simulated[target] = simulation
            squares = np.sum(target.without_initial_state(series - target.measured) ** 2, axis=(1, 2))
            return np.where((diverged < 0) & np.isfinite(squares), squares, np.inf)

        self.simulations += len(self.segments) * int(admissible.sum())
        out[admissible] = sum(map_threads(sum_of_squares, self.segments, self.context.jobs))
        return out

    def _are_admissible(self, x: FloatArray) -> NDArray[np.bool_]:
        """True for each row of x [n, p] unless its vehicle is too stiff, or unstable over a whole run."""
        self.constrained = False  # unless the last points tried meet the limit
        admissible = self._steps_suffice(x) if self.model.effects else np.ones(len(x), dtype=bool)
        if not self.stable or not self.model.design.is_on_track or not admissible.any():
            return admissible
        whole = [t.segment for t in self.segments if not t.is_window]
        cases = {(v, s.load): s for s in whole for v in s.speeds}
        growth = np.full(int(admissible.sum()), -np.inf)
        for (v, _), segment in cases.items():
            growth = np.maximum(growth, self.model.growth_rates(v, self.rows(x[admissible], segment)))
        is_stable = growth <= self.settings.max_growth_rate
        self.constrained = not is_stable.all()
        admissible[admissible] = is_stable
        return admissible

    def _steps_suffice(self, x: FloatArray) -> NDArray[np.bool_]:
        """True for each row of x [n, p] whose vehicle needs no more integration steps than a fit may take."""
        suffice = np.ones(len(x), dtype=bool)
        needed: dict[tuple[object, ...], NDArray[np.int64]] = {}
        for t in self.segments:
            s = t.segment
            case = (tuple(s.coach_forces), *s.speeds, s.dt, s.load)  # windows of a run have the same
            if case not in needed:
                batch = self.model.batch(self.rows(x, s))
                needed[case] = required_steps_each(self.model.vehicles(s.coach_forces), batch, s)
            limit = max(self.settings.max_steps_per_sample, t.steps, t.required_steps)
            suffice &= (needed[case] >= 0) & (needed[case] <= limit)
        return suffice

    def difference_steps(self, x: FloatArray) -> FloatArray:
        """Steps [p] of the forward differences, inwards at an upper bound."""
        relative = np.full(len(x), RELATIVE_STEP_WITH_EFFECTS if self.model.effects else RELATIVE_STEP)
        relative[[j for j, p in enumerate(self.free.paths) if p in self.rolling_radii]] = ROLLING_RADIUS_STEP
        delta = relative * np.maximum(np.abs(x), MIN_STEP_SIZE_SHARE * self.free.size)
        return np.where(x + delta > self.free.high, -delta, delta)

    def sensitivities(self, target: FitSegment, x: FloatArray, table: FloatArray | None = None) -> Simulation:
        """Compute the residual, then the sensitivity to each parameter [1 + p, channel, n], on a segment.

        table: input table in the place of the measured one, for the steps of the segment's differences.
        """
        delta = self.difference_steps(x)
        active = self.active_parameters(target)
        lanes = np.vstack([x, x + np.diag(delta)[active]])
        series, diverged = self.simulate(target.for_differences, lanes, table)
        series[1:] -= series[0]
        series[1:] /= delta[active, None, None]
        if table is None and target.sensitivity_steps != target.steps:
            series[0], diverged[0] = self._simulate_at(target, x)
        series[0] = target.measured - series[0]
        return Simulation(_expand(target.without_initial_state(series), active, len(x)), diverged)

    def _simulate_at(self, target: FitSegment, x: FloatArray) -> tuple[FloatArray, int]:
        """Return the compared channels [channel, n] at x [p] and the sample of divergence, as the misfits left them."""
        known = self._simulated.get(target)
        if known is not None and len(same := np.flatnonzero((self._tried == x).all(axis=1))):
            return known.series[same[0]], int(known.diverged[same[0]])
        series, diverged = self.simulate(target, x[None])
        return series[0], int(diverged[0])

    def active_parameters(self, target: FitSegment) -> list[int]:
        """Indices of the free parameters that act on a segment; those of other segments do not."""
        key = target.segment.segment_key[0]
        return [j for j, p in enumerate(self.free.paths) if "@" not in p or p.endswith(f"@{key}")]

    def linearise(self, x: FloatArray) -> NormalEquations:
        """Compute the normal equations at x [p]."""

        def gram(target: FitSegment) -> FloatArray:
            series, diverged = self.sensitivities(target, x)
            if np.any(diverged >= 0):
                raise DivergedError(f"the vehicle diverges on {target.segment.file} at a point of the fit")
            return self._on_all_channels(target, block_gram(series, self.block_samples(target)))

        self.restart_windows(x)
        grams = list(map_threads(gram, self.segments, self.context.jobs))
        self.simulations += sum(1 + len(self.active_parameters(t)) for t in self.segments)
        count = sum(t.measured.size for t in self.segments)
        return NormalEquations(np.concatenate(grams), count, self.settings.independent_sample_share)

    @property
    def channels(self) -> list[str]:
        """Names of the channels of all segments: runs may lack some."""
        return list(dict.fromkeys(c for t in self.segments for c in t.segment.channels))

    def _on_all_channels(self, target: FitSegment, gram: FloatArray) -> FloatArray:
        """Products [block, channel, row, row] of a segment among those of all channels, zero for those it lacks."""
        own, names = target.segment.channels, self.channels
        if own == names:
            return gram
        out = np.zeros((len(gram), len(names), *gram.shape[2:]))
        out[:, [names.index(c) for c in own]] = gram
        return out

    def _best_linearised(self, tried: FloatArray, costs: FloatArray, cost: float) -> tuple[int, NormalEquations] | None:
        """Return the number of the best point [k, p] that lowers the cost, and its normal equations; None: no point.

        A point has no sensitivities where the vehicle diverges next to it, and counts as diverged then.
        """
        segments = self.segments
        finite = np.where(np.isfinite(costs), costs, np.inf)
        for best in np.argsort(finite, kind="stable"):
            if not finite[best] < cost:
                return None
            try:
                return int(best), self.linearise(tried[best])
            except DivergedError:
                self.segments = segments
        return None

    def restart_windows(self, x: FloatArray) -> None:
        """Estimate the initial states of windows and rigs at x, with the sensitivity of the final state."""
        if not any(t.has_free_start for t in self.segments):
            return
        context, model = self.context, self.model.with_path_values(self.free.paths, x)

        def restart(t: FitSegment) -> FitSegment:
            if not t.has_free_start:
                return t
            if t.is_window and model.design.structure is not None and model.limits_hunting:
                return settle_start(context, model, t)
            if not t.is_window:
                return improve_start(context, model, t)
            return estimate_window_start(context, model, t, corrections=2)

        self.segments = list(map_threads(restart, self.segments, context.jobs))

    def block_samples(self, target: FitSegment) -> int:
        """Compared samples per block of the normal equations."""
        return block_length(self.block, target)

    def cost(self, rss: FloatArray, x: FloatArray) -> FloatArray:
        """Deviance [n]: independent samples times the logarithm of the misfit, plus the priors."""
        with np.errstate(divide="ignore", invalid="ignore"):
            priors = np.sum(((x - self.free.prior) / self.free.prior_sd) ** 2, axis=-1)
            return np.asarray(self.independent_samples * np.log(rss) + priors)

    def fit(
        self,
        x: FloatArray,
        *,
        tolerance: float,
        max_iterations: int = MAX_ITERATIONS,
        normal: NormalEquations | None = None,
        misfit_limit: float = np.inf,
    ) -> Fit:
        """Iterate from x [p] until two iterations, or one by far, gain less than `tolerance` of the misfit.

        normal: the normal equations at x where they are known.
        misfit_limit: the fit ends early once many gains as the last would leave it above this misfit.
        """
        status = "iterations"
        x = np.clip(x, self.free.low, self.free.high)
        normal = self.linearise(x) if normal is None else normal
        cost = float(self.cost(np.array([normal.rss]), x[None])[0])
        self._report(0, x, normal)
        iteration, small_gains = 0, 0
        for iteration in range(1, max_iterations + 1):
            if self.context.is_out_of_time:
                status = "out of time"
                break
            tried = self._trial_points(normal, x)
            costs = self.cost(self.misfit(tried), tried)
            is_misled = self._is_misled(normal, x, tried[0], cost - float(costs.min()), tolerance)
            is_refined_now = is_misled and self._refine()
            taken = self._best_linearised(tried, costs, cost)
            if taken is None and is_refined_now:
                renewed = self._best_linearised(x[None], np.array([cost]), np.inf)
                if renewed is not None:
                    normal = renewed[1]
                    continue
            if taken is None:
                if np.any(costs < cost):
                    status = "diverges next to every better point"
                else:
                    status = "converged" if np.isfinite(costs).any() else "no admissible step"
                break
            former_rss = normal.rss
            best, normal = taken
            gain = (cost - float(costs[best])) / self.independent_samples
            x, cost = tried[best], float(costs[best])
            if any(t.has_free_start for t in self.segments):  # initial states have moved with the parameters
                cost = float(self.cost(np.array([normal.rss]), x[None])[0])
            self._report(iteration, x, normal)
            small_gains = small_gains + 1 if gain < tolerance else 0
            if small_gains >= (1 if gain < 0.1 * tolerance else 2):
                status = "converged"
                break
            if normal.rss - self.settings.given_up_gains * max(former_rss - normal.rss, 0.0) > misfit_limit:
                status = "above the limit"
                break
        return Fit(
            self.model.with_path_values(self.free.paths, x),
            self.free,
            x,
            normal,
            cost,
            iteration,
            self.simulations,
            status,
            self.constrained,
            tuple(self.segments),
            self.block,
        )

    def _is_misled(
        self, normal: NormalEquations, x: FloatArray, undamped: FloatArray, gain: float, tolerance: float
    ) -> bool:
        """True where the undamped step promises far more than the best trial point gains, and enough to go on."""
        a, g = self.equations(normal, x)
        step = undamped - x
        predicted = float(step @ (2.0 * g - a @ step))
        return predicted > max(gain / MIN_ACHIEVED_SHARE, tolerance * self.independent_samples)

    def _refine(self) -> bool:
        """Take sensitivities with the steps of the residual, and finer dampings, from now on; False if taken before.

        Directions that the data hardly determine are differences of nearly equal sensitivities: errors that are small
        in these may be as large as the differences, and the steps lead astray.
        """
        if all(t.sensitivity_steps == t.steps for t in self.segments):
            return False
        self.segments = [replace(t, sensitivity_steps=t.steps) for t in self.segments]
        self.dampings = FINE_DAMPINGS
        return True

    def _trial_points(self, normal: NormalEquations, x: FloatArray) -> FloatArray:
        """Points [n, p] of the damped steps, and shares of some of them."""
        steps = self._damped_steps(*self.equations(normal, x), x)
        return np.vstack([steps, *(x + share * (steps[i] - x) for i, share in STEP_SHARES)])

    def _report(self, iteration: int, x: FloatArray, normal: NormalEquations) -> None:
        total = normal.total
        power = channel_power(self.segments)
        error = np.sqrt(normal.gram[:, :, 0, 0].sum(axis=0) / np.maximum(list(power.values()), 1e-300))
        rho = total[1:, 0] / np.sqrt(np.maximum(total[0, 0] * np.diag(total)[1:], 1e-300))
        channels = dict(zip(power, error.tolist(), strict=True))
        event = FitIteration(iteration, self.free.paths, x.copy(), channels, np.asarray(rho), self.simulations)
        self.context.progress.event(event)

    def equations(self, normal: NormalEquations, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Matrix [p, p] and right-hand side [p] of the normal equations at x, priors included."""
        total = normal.total
        precision = 1.0 / self.free.prior_sd**2
        a = total[1:, 1:] / normal.variance + np.diag(precision)
        g = total[1:, 0] / normal.variance + precision * (self.free.prior - x)
        return a, g

    def _damped_steps(self, a: FloatArray, g: FloatArray, x: FloatArray) -> FloatArray:
        """Take the steps [n, p] of all dampings within the bounds; parameters of unknown size move by ratios."""
        free = self.free
        unit = np.where(free.ratio, x, 1.0)
        a, g = a * np.outer(unit, unit), g * unit
        scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-30 * np.max(np.diag(a)) + 1e-300))
        scaled, one = a * np.outer(scale, scale), np.eye(len(a))
        leap = MAX_LOG_RATIO_STEP
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.where(free.ratio, np.maximum(np.log(free.low / x), -leap), free.low - x) / scale
            high = np.where(free.ratio, np.minimum(np.log(free.high / x), leap), free.high - x) / scale
        steps = scale * np.array(
            [_damped_step(scaled + (d + 1e-12) * one, g * scale, low, high) for d in self.dampings]
        )
        points = np.where(free.ratio, x * np.exp(steps * free.ratio), x + steps)
        return np.asarray(np.clip(points, free.low, free.high))


def _damped_step(a: FloatArray, g: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Solve a step = g, a positive definite, between bounds [p] where the solution is outside."""
    try:
        root = linalg.cholesky(a, check_finite=False)
    except linalg.LinAlgError:
        root = linalg.cholesky(a + 1e-6 * np.eye(len(a)), check_finite=False)
    right = linalg.solve_triangular(root, g, trans="T", check_finite=False)
    step = np.asarray(linalg.solve_triangular(root, right, check_finite=False))
    return step if np.all((step >= low) & (step <= high)) else _bounded_step(root, right, low, high)


def _bounded_step(root: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Minimise |root step - right| between bounds [p]."""
    # the solver needs an interval of some width where a bound is met
    bounds = (np.minimum(low, -1e-12), np.maximum(high, 1e-12))
    return np.asarray(optimize.lsq_linear(root, right, bounds, method="bvls").x)


def _expand(series: FloatArray, active: Sequence[int], count: int) -> FloatArray:
    """Residual and sensitivities [1 + active, ...] as [1 + count, ...]: zero for the parameters of other segments."""
    if len(active) == count:
        return series
    out = np.zeros((1 + count, *series.shape[1:]))
    out[[0, *(1 + j for j in active)]] = series
    return out
