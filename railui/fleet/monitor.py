"""Monitor of a fleet: its runs block after block in the order of time, tested with what was known before each block.

A block is corrected for temperature and load, and for the mean of the sister vehicles on the same section in the same
block; what remains is compared with the level and the trend of the vehicle. The standardised innovations are
independent and standard normal for a vehicle that does not change, and are added up by CUSUM tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.settings.fleet import FleetSettings
from railui.fleet.cusum import DAYS_PER_MONTH, step, threshold_of_rate
from railui.fleet.level_filter import Levels
from railui.fleet.mixed_model import HUBER, MAD, MixedModel, fit_mixed_model
from railui.fleet.observations import Observations, is_reset
from railui.fleet.schema import EventModel

REFIT_GROWTH: Final = 1.3  # of the number of blocks, from one fit of the hierarchical model to the next
ITERATIONS: Final = {False: 12, True: 3}  # of the first fit, and of one that starts from the one before
CONTROL_ITERATIONS: Final = 8
MIN_SCALE: Final = 0.5  # of the scores, over the standard normal distribution
MEDIAN_VARIANCE: Final = 0.5 * np.pi  # of a median over that of a mean
MIN_SCORES: Final = 30  # from which their scale is estimated


@dataclass(frozen=True)
class Crossing:
    """A CUSUM that exceeded its threshold: vehicle or section, block, the quantities with their sums."""

    subject: int
    block: int
    quantities: tuple[int, ...]
    sums: tuple[float, ...]
    started: int


@dataclass(eq=False)
class Monitor:
    """History of the monitoring.

    Attributes
    ----------
    start
        First day of each block [block + 1].
    value, expected, spread
        Corrected means of the blocks, their predictions, and standard deviations of the difference
        [block, v, q]; NaN: no run.
    score
        Standardised innovations [block, v, q].
    upper, lower
        Sums of the CUSUM tests [block, v, q].
    levels
        Filters before each block.
    cell_mean
        Common deviation of the runs of a section in a block [block, section, q]; NaN: too few vehicles.
    section_score, section_upper, section_lower
        The same for sections [block, section, q].
    alarms, section_alarms
        Crossings of the thresholds in the order of time.
    models
        Hierarchical models after the last block, by quantity.
    control
        Deviation of the sisters that was subtracted from every run [n, q].
    tested_blocks
        Blocks of each vehicle that the tests used [v].
    """

    start: FloatArray
    value: FloatArray
    expected: FloatArray
    spread: FloatArray
    score: FloatArray
    upper: FloatArray
    lower: FloatArray
    cell_mean: FloatArray
    section_score: FloatArray
    section_upper: FloatArray
    section_lower: FloatArray
    control: FloatArray
    threshold: float
    section_threshold: float
    tested_blocks: NDArray[np.int64]
    levels: list[Levels] = field(default_factory=list)
    alarms: list[Crossing] = field(default_factory=list)
    section_alarms: list[Crossing] = field(default_factory=list)
    models: list[MixedModel] = field(default_factory=list)
    block_of_run: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


def monitor_fleet(
    data: Observations,
    settings: FleetSettings,
    events: Sequence[tuple[int, EventModel]] = (),
    renewed: Sequence[float] = (),
) -> Monitor:
    """Run the tests over the observations of a type.

    events: vehicle and maintenance. renewed: days at which the record of a section was renewed.
    """
    return _Replay(data, settings, events, renewed).run()


class _Replay:
    """The fleet up to a block."""

    def __init__(
        self,
        data: Observations,
        settings: FleetSettings,
        events: Sequence[tuple[int, EventModel]],
        renewed: Sequence[float],
    ) -> None:
        self.data, self.settings, self.events, self.renewed = data, settings, events, renewed
        first = data.time[0]
        self.block = np.floor((data.time - first) / settings.block_days).astype(np.int64)
        blocks, v, q, s = int(self.block[-1]) + 1, len(data.vehicles), len(data.quantities), len(data.sections)
        per_month = DAYS_PER_MONTH / settings.block_days
        arguments = (q, per_month, settings.reference_value)
        h = threshold_of_rate(settings.false_alarms, *arguments)
        nan = np.full((blocks, v, q), np.nan)
        of_sections = np.full((blocks, s, q), np.nan)
        self.out = Monitor(
            first + settings.block_days * np.arange(blocks + 1),
            nan,
            nan.copy(),
            nan.copy(),
            nan.copy(),
            np.zeros((blocks, v, q)),
            np.zeros((blocks, v, q)),
            of_sections,
            of_sections.copy(),
            np.zeros((blocks, s, q)),
            np.zeros((blocks, s, q)),
            np.zeros_like(data.y),
            h,
            h,
            np.zeros(v, dtype=np.int64),
            block_of_run=self.block,
        )
        self.shape = (v, q)
        self.seen = np.zeros((v, q), dtype=np.int64)  # blocks since the level is learnt
        self.needed = np.full((v, q), settings.baseline_blocks)
        self.cell = self.block * s + data.section
        self.next_fit = settings.baseline_blocks
        self.is_sound = np.ones(len(data.time), dtype=bool)  # runs that show what is usual in the fleet
        self.counts = np.ones(data.y.shape)  # 0: a run of a block before the maintenance in it
        self.scale = np.ones(q)
        self.scales: list[FloatArray] = []  # by block
        self.sections_since = 0  # block from which the records of the sections are the same
        self.section_spread = np.zeros(q)

    def run(self) -> Monitor:
        """Go through all blocks."""
        out, settings = self.out, self.settings
        blocks = len(out.start) - 1
        self._fit(min(settings.baseline_blocks, blocks))
        self.levels = self.prior
        up, down = np.zeros(self.shape), np.zeros(self.shape)
        section_up = section_down = np.zeros(out.section_upper.shape[1:])
        for b in range(blocks):
            if b >= self.next_fit:
                self.next_fit = max(b + 1, round(REFIT_GROWTH * b))
                self._fit(b)
                self._rescale(b)
            self._apply_events(b)
            self.scales.append(self.scale.copy())
            out.levels.append(self.levels)
            use, value, variance = self._block(b)
            expected = self.levels.predict(use)
            spread = np.sqrt(self.levels.variance(use) + variance)
            z = _normal_score((value - expected) / spread / self.scale, self.freedom)
            out.value[b], out.expected[b], out.spread[b] = value, expected, spread * self.scale
            tested = np.isfinite(value) & (self.seen >= self.needed) & (b >= settings.baseline_blocks)
            out.score[b] = z
            clipped = np.where(tested, np.clip(z, -settings.max_score, settings.max_score), np.nan)
            up, down = step(up, down, clipped, settings.reference_value)
            out.tested_blocks += tested.any(axis=1)
            self.levels = self.levels.update(use, value, variance * self.scale**2, settings.max_score)
            self.seen += np.isfinite(value)
            out.upper[b], out.lower[b] = up, down
            up, down = self._alarms(b, up, down)
            section_up, section_down = self._sections(b, section_up, section_down)
        return out

    def _fit(self, blocks: int) -> None:
        """Fit the hierarchical model of every quantity to the blocks before."""
        data = self.data
        before = (self.block < blocks) & self.is_sound
        if not before.any():
            before = self.block < blocks
        cells, cell = np.unique(self.cell[before], return_inverse=True)
        previous = self.out.models
        models = []
        for j in range(self.shape[1]):
            units, unit = np.unique(data.unit[before, j], return_inverse=True)
            models.append(
                fit_mixed_model(
                    data.y[before, j],
                    data.sd[before, j],
                    data.covariates[before],
                    data.use[before, j],
                    unit,
                    cell,
                    (len(units), len(cells)),
                    previous[j] if previous else None,
                    ITERATIONS[bool(previous)],
                )
            )
        self.out.models = models
        mean, slope = (np.array([m.fixed[i] for m in models]) for i in (0, 3))
        level, trend = (np.array([getattr(m, f"{name}_variance") for m in models]) for name in ("level", "slope"))
        ones = np.ones(self.shape)
        mean_sd, slope_sd = (np.array([m.fixed_sd[i] for m in models]) for i in (0, 3))
        self.mean_sd, self.slope_sd = mean_sd, slope_sd
        self.prior = Levels(
            mean * ones, slope * ones, (level + mean_sd**2) * ones, 0.0 * ones, (trend + slope_sd**2) * ones
        )
        self.covariate_slopes = np.array([m.fixed[1:3] for m in models]).T  # [2, q]
        self.run_variance = np.array([m.variance for m in models])
        self.covariate_sd = np.array([m.fixed_sd[1:3] for m in models]).T
        self.freedom = np.array([m.freedom for m in models])
        self.cell_variance = np.array([m.cell_variance for m in models])

    def _rescale(self, b: int) -> None:
        """Estimate the scale of the scores of all vehicles so far, robust against those that change."""
        first = min(2, b)
        scales = np.array(self.scales[first:b])[:, None, :]
        z = (self.out.score[first:b] * scales).reshape(-1, self.shape[1])
        for j in range(self.shape[1]):
            known = z[np.isfinite(z[:, j]), j]
            if len(known) >= MIN_SCORES:
                self.scale[j] = max(MAD * float(np.median(np.abs(known - np.median(known)))), MIN_SCALE)

    def _apply_events(self, b: int) -> None:
        """Learn levels anew after maintenance in this block or between it and the one before."""
        for v, event in self.events:
            if not self.out.start[b] <= event.time < self.out.start[b + 1]:
                continue
            which = np.zeros(self.shape, dtype=bool)
            which[v] = [is_reset(event, quantity) for quantity in self.data.quantities]
            self._relearn(which)
            early = (self.block == b) & (self.data.vehicle == v) & (self.data.time < event.time)
            self.counts[np.ix_(early, which[v])] = 0.0
            self.is_sound |= (self.data.vehicle == v) & (self.block >= b)

    def _relearn(self, which: NDArray[np.bool_]) -> None:
        self.levels = self.levels.reset(which, self.prior)
        self.seen = np.where(which, 0, self.seen)
        self.needed = np.where(which, self.settings.reset_blocks, self.needed)

    def _block(self, b: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Use, corrected mean and its variance [v, q] of the runs of a block; NaN where a vehicle has none."""
        data, runs = self.data, np.flatnonzero(self.block == b)
        of = data.vehicle[runs]
        corrected = data.y[runs] - data.covariates[runs] @ self.covariate_slopes
        variance = self.run_variance * data.sd[runs] ** 2
        use = data.use[runs]
        deviation = corrected - (self.levels.a[of] + self.levels.b[of] * use)
        total = variance + self.levels.variance(_scatter(of, use, self.shape))[of]
        control, doubt = self._control(b, runs, deviation, total)
        self.out.control[runs] = control
        variance = variance + doubt
        weight = self.counts[runs] / np.maximum(variance, 1e-300)
        sums, values, uses = np.zeros(self.shape), np.zeros(self.shape), np.zeros(self.shape)
        np.add.at(sums, of, weight)
        np.add.at(values, of, weight * (corrected - control))
        np.add.at(uses, of, weight * use)
        known = sums > 0.0
        safe = np.where(known, sums, 1.0)
        least = self.settings.least_spread**2
        return np.where(known, uses / safe, 0.0), np.where(known, values / safe, np.nan), 1.0 / safe + least

    def _control(
        self,
        b: int,
        runs: NDArray[np.int64],
        deviation: FloatArray,
        variance: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Deviation that the sisters of each run have in common [run, q], and the variance that it leaves.

        Its prior is the variance between sections and blocks, and what mean and slopes of the fleet leave open.
        """
        section, vehicle = self.data.section[runs], self.data.vehicle[runs]
        control = np.zeros_like(deviation)
        slopes = self.data.covariates[runs] ** 2 @ self.covariate_sd**2 + (self.data.use[runs] * self.slope_sd) ** 2
        common = self.cell_variance + self.mean_sd**2 + slopes
        doubt = common.copy()
        for s in np.unique(section):
            own = np.flatnonzero(section == s)
            if len(np.unique(vehicle[own[self.is_sound[runs[own]]]])) < self.settings.min_sisters:
                continue
            others = ((vehicle[own][:, None] != vehicle[own][None, :]) & self.is_sound[runs[own]]).astype(float)
            control[own], doubt[own] = common_deviation(deviation[own], variance[own], common[own], others)
            every = self.is_sound[runs[own]][None].astype(float)
            self.out.cell_mean[b, s] = common_deviation(deviation[own], variance[own], common[:1], every)[0][0]
        return control, doubt

    def _alarms(self, b: int, up: FloatArray, down: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Record vehicles over the threshold, and learn their levels anew."""
        highest = np.maximum(up, down)
        for v in np.flatnonzero((highest > self.out.threshold).any(axis=1)):
            over = np.flatnonzero(highest[v] > self.out.threshold)
            over = over[np.argsort(-highest[v, over], kind="stable")]
            first = int(over[0])
            sums = np.where(up[v] >= down[v], up[v], -down[v])
            series = self.out.upper[: b + 1, v, first] if sums[first] > 0 else self.out.lower[: b + 1, v, first]
            zeros = np.flatnonzero(series[:b] <= 0.0)
            started = int(zeros[-1]) if len(zeros) else 0
            self.out.alarms.append(Crossing(int(v), b, tuple(over.tolist()), tuple(sums[over].tolist()), started))
            which = np.zeros(self.shape, dtype=bool)
            which[v] = True
            self._relearn(which)
            self.is_sound &= (self.data.vehicle != v) | (self.block <= started)
            up, down = np.where(which, 0.0, up), np.where(which, 0.0, down)
        return up, down

    def _sections(self, b: int, up: FloatArray, down: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Test the common deviation of each section against those of the other sections and its own past."""
        out = self.out
        if len(self.data.sections) < 2:
            return up, down
        z = np.full(up.shape, np.nan)
        start, end = out.start[b], out.start[b + 1]
        if any(start <= day < end for day in self.renewed):
            self.sections_since = b + 1
            up, down = np.zeros_like(up), np.zeros_like(down)
        before = _against_others(out.cell_mean[self.sections_since : b + 1])
        least = self.settings.baseline_blocks if not self.sections_since else self.settings.reset_blocks
        if len(before) > least:
            now, before = before[-1], before[:-1]
            centre = np.nanmedian(before, axis=0)
            self.section_spread = np.fmax(MAD * np.nanmedian(np.abs(before - centre), axis=(0, 1)), self.section_spread)
            z = (now - centre) / np.maximum(self.section_spread * np.sqrt(1.0 + MEDIAN_VARIANCE / len(before)), 1e-300)
        out.section_score[b] = z
        limit = self.settings.max_score
        up, down = step(up, down, np.clip(z, -limit, limit), self.settings.reference_value)
        out.section_upper[b], out.section_lower[b] = up, down
        highest = np.maximum(up, down)
        for s in np.flatnonzero((highest > out.section_threshold).any(axis=1)):
            over = np.flatnonzero(highest[s] > out.section_threshold)
            over = over[np.argsort(-highest[s, over], kind="stable")]
            sums = np.where(up[s] >= down[s], up[s], -down[s])[over]
            out.section_alarms.append(Crossing(int(s), b, tuple(over.tolist()), tuple(sums.tolist()), b))
            which = np.zeros(up.shape, dtype=bool)
            which[s] = True
            up, down = np.where(which, 0.0, up), np.where(which, 0.0, down)
        return up, down


def common_deviation(
    deviation: FloatArray, variance: FloatArray, prior: FloatArray, others: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Estimate what runs have in common [m, q], and its variance, by Huber's M-estimator about a prior of mean zero.

    Parameters
    ----------
    deviation, variance : array [n, q]
        Of each run.
    prior : array [m, q]
        Variance of the common deviation.
    others : array [m, n]
        1 for the runs that count in each of m estimates.

    Notes
    -----
    Iteratively reweighted least squares from zero: P. J. Huber, Robust Statistics (Wiley 1981), ch. 7.
    """
    found = np.zeros((len(others), deviation.shape[1]))
    precision = 1.0 / np.maximum(prior, 1e-300)
    sd = np.sqrt(variance)
    for _ in range(CONTROL_ITERATIONS):
        distance = np.abs(deviation[None] - found[:, None]) / sd[None]
        weight = others[:, :, None] * np.minimum(1.0, HUBER / np.maximum(distance, 1e-12)) / variance[None]
        total = weight.sum(axis=1) + precision
        found = (weight * deviation[None]).sum(axis=1) / total
    return found, 1.0 / total


def _normal_score(t: FloatArray, freedom: FloatArray) -> FloatArray:
    """Standard normal variable of the same probability as Student's t with some degrees of freedom."""
    tail = special.stdtr(np.broadcast_to(np.maximum(freedom, 1.0), t.shape), -np.abs(t))
    return np.asarray(-np.sign(t) * special.ndtri(np.maximum(tail, 1e-300)))


def _against_others(means: FloatArray) -> FloatArray:
    """Deviations of sections from the mean of the other ones [block, section, q]."""
    known = np.isfinite(means)
    total, count = np.where(known, means, 0.0).sum(axis=1, keepdims=True), known.sum(axis=1, keepdims=True)
    others = (total - np.where(known, means, 0.0)) / np.maximum(count - known, 1)
    return np.where(known & (count > 1), means - others, np.nan)


def _scatter(of: NDArray[np.int64], use: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Use [v, q] of the runs [run, q] of vehicles, the last of each."""
    out = np.zeros(shape)
    out[of] = use
    return out
