"""Model adjustment: parameters from measured motions, by output error, with sixteen parallel models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset, Segment, simulate
from railui.identification.estimation.block_products import block_gram, block_length
from railui.identification.estimation.free_parameters import FreeParameters, free_parameters
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.estimation.problem import FitSegment, estimate_window_start, prepare_segments
from railui.identification.events import FitIteration
from railui.parallel import map_threads
from railui.progress import Watch, unwatched
from railui.vehicle.model import RADIUS, Model

DAMPINGS = (0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0)  # of Levenberg, tried side by side
TURNING = 1e-6  # relative step of a radius that something turns with
STIFFEST = 16  # RK4 steps per sample up to which a fit may go
LEAP = 1.5  # largest logarithm of the ratio in one step
STABLE = -0.02  # 1/s, the least damping of a linear vehicle that a fit may reach
INFORMED = 0.4  # share of the samples that is counted as independent against the priors
UNSEEN = 0.9  # share of the prior's standard deviation that remains: the data did not see the parameter
CORRELATED = 0.95


def residual_variance(rss: float, samples: float) -> float:
    """Misfit per independent sample: times it, a precision 1/sd^2 is in the measure of the inner products.

    Neighbouring samples of a signal do not all tell new things, so that a prior weighs more than they are many.
    """
    return rss / (INFORMED * samples)


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Inner products per block of time: gram [block, channel, 1 + p, 1 + p] of the residual and its p sensitivities."""

    gram: FloatArray
    samples: int

    @property
    def total(self) -> FloatArray:
        """Over all blocks and channels [1 + p, 1 + p]."""
        return np.asarray(self.gram.sum(axis=(0, 1)))

    @property
    def rss(self) -> float:
        """The misfit: sum of the squared weighted residuals."""
        return float(self.total[0, 0])

    @property
    def variance(self) -> float:
        """Misfit per independent sample."""
        return residual_variance(self.rss, self.samples)


@dataclass(frozen=True, eq=False)
class Fit:
    """An adjusted model: values [p] of the free paths with covariance [p, p], and how the fit went."""

    model: Model
    free: FreeParameters
    x: FloatArray
    covariance: FloatArray
    normal: NormalEquations
    cost: float
    iterations: int
    simulations: int
    status: str
    constrained: bool = False
    segments: tuple[FitSegment, ...] = field(default=(), repr=False)
    block: float = 1.0  # seconds of a block of the inner products

    def block_samples(self, target: FitSegment) -> int:
        """Compared samples per block of the inner products."""
        return block_length(self.block, target)

    @property
    def error_to_noise(self) -> float:
        """What is left on the adjusting runs over what noise would leave there."""
        return float(np.sqrt(self.normal.rss / self.normal.samples))

    @property
    def sd(self) -> FloatArray:
        """Standard deviations of the values [p]."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def flags(self) -> list[str | None]:
        """bound, unseen, correlated or None of each free path."""
        sd = self.sd
        scaled = self.covariance / np.outer(np.maximum(sd, 1e-300), np.maximum(sd, 1e-300))
        off = np.abs(scaled - np.diag(np.diag(scaled)))
        out: list[str | None] = []
        for i in range(len(self.x)):
            width = 1e-6 * self.free.size[i]
            if self.x[i] <= self.free.low[i] + width or self.x[i] >= self.free.high[i] - width:
                out.append("bound")
            elif np.isfinite(self.free.prior_sd[i]) and sd[i] > UNSEEN * self.free.prior_sd[i]:
                out.append("unseen")
            elif off.size and off[i].max() > CORRELATED:
                out.append("correlated")
            else:
                out.append(None)
        return out


class GaussNewton:
    """Output-error least squares of one structure over prepared stretches."""

    def __init__(
        self, model: Model, free: FreeParameters, ready: Sequence[FitSegment], *, block: float, stable: bool, jobs: int | None,
        watch: Watch = unwatched,
    ) -> None:  # fmt: skip
        self.model, self.free, self.segments, self.watch = model, free, list(ready), watch
        self.block, self.stable, self.jobs = block, stable, jobs
        self.shared = [j for j, p in enumerate(free.paths) if "@" not in p]  # by all stretches
        self.columns = [model.columns[free.paths[j]] for j in self.shared]
        self.turning = {f"{p.rpartition('.')[0]}.{RADIUS}" for p in model.run_paths()}
        self.simulations = 0
        self.constrained = False
        self.ringing: Mapping[str, float] | None = None  # noise, where initial states are estimated at every step
        self.independent_samples = INFORMED * sum(t.measured.size for t in ready)

    def rows(self, x: FloatArray, stretch: Segment | None = None) -> FloatArray:
        """Rows [n, row] of the vehicle with the free numbers x [n, p], and the phases of a stretch."""
        rows = np.tile(self.model.row, (len(x), 1))
        rows[:, self.columns] = x[:, self.shared]
        if stretch is not None:
            self.model.turn(rows, *stretch.segment_key, {p: x[:, j] for j, p in enumerate(self.free.paths) if "@" in p})
        return rows

    def simulate(self, target: FitSegment, x: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        """Compared series [n, channel, kept] of the vehicles with x [n, p] on a stretch, and where each diverged."""
        self.simulations += len(x)
        return simulate(
            self.model,
            target.segment,
            target.segment.channels,
            batch=self.model.batch(self.rows(x, target.segment)),
            vehicles=self.model.vehicles(target.segment.coach_forces),
            steps=target.steps,
            filter=target.filter,
            initial=target.initial_state,
            jobs=self.jobs,
        )

    def misfit(self, x: FloatArray) -> FloatArray:
        """Sum of weighted squares of each row of x [n, p]; infinite where a vehicle diverges or may not go."""
        allowed = np.array([self._allowed(row) for row in x])
        out = np.where(allowed, 0.0, np.inf)
        if not allowed.any():
            return out
        for target in self.segments:
            series, lost = self.simulate(target, x[allowed])
            squares = np.sum(target.without_initial_state(series - target.measured) ** 2, axis=(1, 2))
            out[allowed] += np.where((lost < 0) & np.isfinite(squares), squares, np.inf)
        return out

    def _allowed(self, x: FloatArray) -> bool:
        """May a vehicle be tried? Not where it is too stiff for the samples, or unstable over a whole run."""
        if self.model.effects and not self._steps_fit(x):
            return False
        if not self.stable or self.model.design.kind != "bogie":
            return True
        rows = self.rows(x[None])
        speeds = {v for t in self.segments if t.segment.window_of is None for v in t.segment.speeds}
        worst = max((self.model.growth(v, rows) for v in speeds), default=-np.inf)
        if worst > STABLE:
            self.constrained = True
        return worst <= STABLE

    def _steps_fit(self, x: FloatArray) -> bool:
        batch = self.model.batch(self.rows(x[None]))
        try:
            return all(
                self.model.vehicles(t.segment.coach_forces).steps(batch, *t.segment.speeds, t.segment.dt)[0]
                <= max(STIFFEST, t.steps, t.required_steps)
                for t in self.segments
            )
        except ValueError:
            return False

    def difference_steps(self, x: FloatArray) -> FloatArray:
        """Steps of the forward differences, 1e-5 relative, 1e-4 where effects stand; inwards at an upper bound.

        Over a run of a thousand turns a relative change of a radius is six thousand times as large an angle.
        """
        relative = np.full(len(x), 1e-4 if self.model.effects else 1e-5)
        relative[[j for j, p in enumerate(self.free.paths) if p in self.turning]] = TURNING
        delta = relative * np.maximum(np.abs(x), 0.1 * self.free.size)
        return np.where(x + delta > self.free.high, -delta, delta)

    def sensitivities(self, target: FitSegment, x: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        """The residual, then the sensitivity of each number [1 + p, channel, n], and where vehicles diverged."""
        delta = self.difference_steps(x)
        here = [
            j for j, p in enumerate(self.free.paths) if "@" not in p or p.endswith(f"@{target.segment.segment_key[0]}")
        ]
        series, lost = self.simulate(target, np.vstack([x, x + np.diag(delta)[here]]))
        series[1:] -= series[0]
        series[1:] /= delta[here, None, None]
        series[0] = target.measured - series[0]
        return _spread(target.without_initial_state(series), here, len(x)), lost

    def linearise(self, x: FloatArray) -> NormalEquations:
        """Residual and sensitivities at x as inner products per block."""
        grams, count = [], 0
        self.restart_windows(x)
        for target in self.segments:
            series, lost = self.sensitivities(target, x)
            if np.any(lost >= 0):
                raise ValueError(f"the vehicle diverges on {target.segment.file} at a point of the fit")
            grams.append(block_gram(series, self.block_samples(target)))
            count += target.measured.size
        return NormalEquations(np.concatenate(grams), count)

    def restart_windows(self, x: FloatArray) -> None:
        """Windows begun anew with the vehicle at x; twice, so that what a beginning can do is that of the one kept."""
        if any(t.segment.window_of is not None for t in self.segments):
            model = self.model.with_row(self.free.paths, x)

            def anew(t: FitSegment) -> FitSegment:
                return t if t.segment.window_of is None else estimate_window_start(model, estimate_window_start(model, t))

            self.segments = list(map_threads(anew, self.segments, self.jobs))

    def block_samples(self, target: FitSegment) -> int:
        """Compared samples per block of the inner products."""
        return block_length(self.block, target)

    def cost(self, rss: FloatArray, x: FloatArray) -> FloatArray:
        """Deviance [n]: informed samples times the logarithm of the misfit, plus the priors."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(
                self.independent_samples * np.log(rss) + np.sum(((x - self.free.prior) / self.free.prior_sd) ** 2, axis=-1)
            )

    def fit(self, x: FloatArray, *, tolerance: float, most: int = 30) -> Fit:
        """Gauss-Newton with Levenberg's damping from x [p]; the dampings are tried side by side in lanes."""
        free, status = self.free, "iterations"
        x = np.clip(x, free.low, free.high)
        normal = self.linearise(x)
        cost = float(self.cost(np.array([normal.rss]), x[None])[0])
        self.watch(self._turn(0, x, normal))
        iteration, calm = 0, 0
        for iteration in range(1, most + 1):
            a, g = self.equations(normal, x)
            tried = np.array([self._step(a, g, x, damping) for damping in DAMPINGS])
            tried = np.vstack([tried, x + 0.3 * (tried[0] - x), x + 0.5 * (tried[2] - x)])
            costs = self.cost(self.misfit(tried), tried)
            best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
            if not costs[best] < cost:
                status = "converged"
                break
            gain = (cost - float(costs[best])) / self.independent_samples
            x, cost = tried[best], float(costs[best])
            if self.ringing is not None:
                cost = self._begun_anew(x, cost)
            normal = self.linearise(x)
            self.watch(self._turn(iteration, x, normal))
            calm = calm + 1 if gain < tolerance else 0
            if calm >= (1 if gain < 0.1 * tolerance else 2):
                status = "converged"
                break
        return Fit(
            self.model.with_row(free.paths, x),
            free,
            x,
            self._covariance(normal, x),
            normal,
            cost,
            iteration,
            self.simulations,
            status,
            self.constrained,
            tuple(self.segments),
            self.block,
        )

    def _turn(self, iteration: int, x: FloatArray, normal: NormalEquations) -> FitIteration:
        """What a watcher sees of a step."""
        total = normal.total
        power = np.sum([np.sum(t.measured**2, axis=1) for t in self.segments], axis=0)
        error = np.sqrt(normal.gram[:, :, 0, 0].sum(axis=0) / np.maximum(power, 1e-300))
        rho = total[1:, 0] / np.sqrt(np.maximum(total[0, 0] * np.diag(total)[1:], 1e-300))
        channels = dict(zip(self.segments[0].segment.channels, error.tolist(), strict=True))
        return FitIteration(iteration, self.free.paths, x.copy(), channels, np.asarray(rho), self.simulations)

    def _begun_anew(self, x: FloatArray, cost: float) -> float:
        """Initial states estimated once more for a rig as it is now; the cost with them, kept where it is lower."""
        before, model = self.segments, self.model.with_row(self.free.paths, x)
        self.segments = [
            replace(t, initial_state=estimate_initial_state(model, t.segment, self.ringing or {})) for t in self.segments
        ]
        anew = float(self.cost(self.misfit(x[None]), x[None])[0])
        if not anew < cost:
            self.segments = before
        return min(anew, cost)

    def equations(self, normal: NormalEquations, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The normal equations [p, p], [p] at x, priors included."""
        total = normal.total
        precision = 1.0 / self.free.prior_sd**2
        a = total[1:, 1:] / normal.variance + np.diag(precision)
        g = total[1:, 0] / normal.variance + precision * (self.free.prior - x)
        return a, g

    def _step(self, a: FloatArray, g: FloatArray, x: FloatArray, damping: float) -> FloatArray:
        """One damped step within the bounds; numbers of unknown size move by ratios."""
        free = self.free
        unit = np.where(free.ratio, x, 1.0)
        a, g = a * np.outer(unit, unit), g * unit
        scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-30 * np.max(np.diag(a)) + 1e-300))
        scaled = a * np.outer(scale, scale) + (damping + 1e-12) * np.eye(len(a))
        try:
            root = linalg.cholesky(scaled)
        except linalg.LinAlgError:
            root = linalg.cholesky(scaled + 1e-6 * np.eye(len(a)))
        right = linalg.solve_triangular(root, g * scale, trans="T")
        with np.errstate(divide="ignore", invalid="ignore"):
            low = np.where(free.ratio, np.maximum(np.log(free.low / x), -LEAP), free.low - x) / scale
            high = np.where(free.ratio, np.minimum(np.log(free.high / x), LEAP), free.high - x) / scale
        # a whisker of width where a bound is met, as the solver wants it
        bounds = (np.minimum(low, -1e-12), np.maximum(high, 1e-12))
        step = scale * optimize.lsq_linear(root, right, bounds, method="bvls").x
        return np.clip(np.where(free.ratio, x * np.exp(step * free.ratio), x + step), free.low, free.high)

    def _covariance(self, normal: NormalEquations, x: FloatArray) -> FloatArray:
        """Covariance [p, p] by the scores of the blocks, which keep what is correlated in time together (HAC)."""
        precision = 1.0 / self.free.prior_sd**2
        total, blocks = normal.total, normal.gram.sum(axis=1)
        a = total[1:, 1:] + np.diag(precision) * normal.variance
        scores = blocks[:, 1:, 0]
        scores = scores - scores.mean(axis=0)
        middle = scores.T @ scores + np.diag(precision) * normal.variance**2
        scale = 1.0 / np.sqrt(np.maximum(np.diag(a), 1e-300))
        inverse = linalg.pinvh(a * np.outer(scale, scale)) * np.outer(scale, scale)
        return np.asarray(inverse @ middle @ inverse)


def _spread(series: FloatArray, here: Sequence[int], count: int) -> FloatArray:
    """Residual and sensitivities [1 + here, ...] as [1 + count, ...]: zero for the numbers of other stretches."""
    if len(here) == count:
        return series
    out = np.zeros((1 + count, *series.shape[1:]))
    out[[0, *(1 + j for j in here)]] = series
    return out


def block_seconds(model: Model, stretches: Sequence[Segment]) -> float:
    """Three hunting periods of the model [s], at least one second; a fiftieth of a rig's record."""
    if model.design.kind != "bogie":
        return max(s.samples * s.dt for s in stretches) / 50.0
    values = [model.eigenvalues(s.mean_speed)[0] for s in stretches]
    hunting = min((abs(z[np.argmax(np.where(z.imag > 1.0, z.real, -np.inf))].imag) for z in values), default=6.0)
    return max(1.0, 3.0 * 2.0 * np.pi / max(hunting, 3.0))


def fit_output_error(
    model: Model,
    measurement: Dataset,
    paths: Sequence[str],
    declared: Model,
    *,
    ready: Sequence[FitSegment] | None = None,
    start: FloatArray | None = None,
    stable: bool = True,
    tolerance: float = 1e-6,
    most: int = 30,
    jobs: int | None = None,
    watch: Watch = unwatched,
) -> Fit:
    """Adjust the numbers at `paths` of a model to the adjusting runs of a measurement, and the phases of each stretch.

    start: other values than the model's to begin with, [p] of `Model.freed` paths.
    """
    if ready is None:
        ready = prepare_segments(model, measurement, measurement.estimation)
    free = free_parameters(model, paths, declared)
    seconds = block_seconds(declared, [t.segment for t in ready])
    adjuster = GaussNewton(model, free, ready, block=seconds, stable=stable, jobs=jobs, watch=watch)
    if model.design.kind == "rig":
        adjuster.ringing = measurement.noise
    x = np.array([model.value(p) for p in free.paths]) if start is None else start
    return adjuster.fit(x, tolerance=tolerance, most=most)


def block_distances(fit: Fit) -> FloatArray:
    """Distance [m] in the middle of every block of the fit's inner products, stretch after stretch."""
    middles = []
    for target in fit.segments:
        s = target.trim(target.segment.columns["s"])
        length = fit.block_samples(target)
        middles += [float(np.mean(s[k : k + length])) for k in range(0, len(s), length)]
    return np.array(middles)
