"""Monitor of a fleet: its runs block after block in the order of time, tested with what was known before each block.

A block is corrected for temperature and load, and for the mean of the sister vehicles on the same section in the same
block; what remains is compared with the level and the trend of the vehicle. The standardised innovations are
independent and standard normal for a vehicle that does not change, and are added up by CUSUM tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.settings.fleet import FleetSettings
from railui.dsp.robust import MAD_TO_SD
from railui.fleet.control import common_deviation
from railui.fleet.cusum import DAYS_PER_MONTH, step, threshold_of_rate
from railui.fleet.fleet_prior import FleetPrior, fit_fleet_prior
from railui.fleet.history import Crossing, Monitor
from railui.fleet.level_filter import Levels
from railui.fleet.level_wander import FilteredBlocks, choose_wander
from railui.fleet.observations import Observations, is_reset
from railui.fleet.schema import EventModel
from railui.fleet.section_test import SectionTest

REFIT_GROWTH: Final = 1.3  # of the number of blocks, from one fit of the hierarchical model to the next


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

    prior: FleetPrior

    def __init__(
        self,
        data: Observations,
        settings: FleetSettings,
        events: Sequence[tuple[int, EventModel]],
        renewed: Sequence[float],
    ) -> None:
        self.data, self.settings = data, settings
        first = data.time[0]
        self.block = np.floor((data.time - first) / settings.block_days).astype(np.int64)
        blocks, v, q, s = int(self.block[-1]) + 1, len(data.vehicles), len(data.quantities), len(data.sections)
        per_month = DAYS_PER_MONTH / settings.block_days
        h = threshold_of_rate(settings.false_alarms, q, per_month, settings.reference_value)
        start = first + settings.block_days * np.arange(blocks + 1)
        self.out = Monitor.empty(start, v, q, s, len(data.time), h)
        self.out.block_of_run = self.block
        self.events = self._events_by_block(events)
        self.sections = SectionTest(self.out, settings, renewed)
        self.shape = (v, q)
        self.count = np.zeros((v, q), dtype=np.int64)  # blocks since the level is learnt
        self.needed = np.full((v, q), settings.baseline_blocks)
        self.use = np.zeros((v, q))  # of the last run
        self.cell = self.block * s + data.section
        self.next_fit = settings.baseline_blocks
        self.is_sound = np.ones(len(data.time), dtype=bool)  # runs that show what is usual in the fleet
        self.counts = np.ones(data.y.shape)  # 0: a run of a block before the maintenance in it
        self.scale = np.ones(q)
        self.raw = np.full((blocks, v, q), np.nan)  # scores before their scale is taken out
        self.alarmed: list[list[int]] = [[] for _ in range(blocks)]  # vehicles
        self.up, self.down = np.zeros(self.shape), np.zeros(self.shape)
        self.wander = np.zeros(q)  # variance by which a level changes from a block to the next
        self.uses, self.variances = np.zeros((blocks, v, q)), np.zeros((blocks, v, q))  # of the values of the blocks
        self.relearned: list[list[tuple[NDArray[np.bool_], Levels]]] = [[] for _ in range(blocks + 1)]

    def run(self) -> Monitor:
        """Go through all blocks."""
        out, settings = self.out, self.settings
        blocks = len(out.start) - 1
        out.levels = [None] * blocks  # type: ignore[list-item]
        self._fit(min(settings.baseline_blocks, blocks))
        self._filter_again(0)
        for b in range(blocks):
            if b >= self.next_fit:
                self.next_fit = max(b + 1, round(REFIT_GROWTH * b))
                self._fit(b)
                self._filter_again(b)
                self._learn_wander(b)
                self._rescale(b)
            renewed = self._maintained(b)
            self.up[renewed] = self.down[renewed] = 0.0  # what was changed before maintenance is so no longer
            self._mark_sound(b)
            tested = self._advance(b)
            self._test(b, tested)
            self._mark_sound(b)
            self._learn_alarmed(b)
            self.sections.add(b)
        return out

    def _filter_again(self, b: int) -> None:
        """Filter all blocks before a block, without tests, from the levels that follow from the present prior.

        Levels, control and slopes belong together, so that this follows every fit.
        """
        self.levels = self.prior.levels(self.shape[0])
        self.count[:] = 0
        self.needed[:] = self.settings.baseline_blocks
        self.counts[:] = 1.0
        self.use[:] = 0.0
        for relearned in self.relearned:
            relearned.clear()
        for past in range(b):
            self._advance(past)
            self._learn_alarmed(past)

    def _advance(self, b: int) -> NDArray[np.bool_]:
        """Predict a block and learn from it; return what the tests may use [v, q]."""
        out, settings = self.out, self.settings
        self._apply_events(b)
        self.levels = self.levels.wandered(self.wander)
        out.levels[b] = self.levels
        use, value, variance = self._block(b)
        self.uses[b], self.variances[b] = use, variance
        expected = self.levels.predict(use)
        spread = np.sqrt(self.levels.variance(use) + variance)
        self.raw[b] = (value - expected) / spread
        out.value[b], out.expected[b], out.spread[b] = value, expected, spread * self.scale
        tested = np.isfinite(value) & (self.count >= self.needed) & (b >= settings.baseline_blocks)
        self.levels = self.levels.update(use, value, variance * self.scale**2, settings.max_score)
        self.count += np.isfinite(value)
        return tested

    def _test(self, b: int, tested: NDArray[np.bool_]) -> None:
        """Add the scores of a block to the sums and record the vehicles over the threshold."""
        out, limit = self.out, self.settings.max_score
        out.score[b] = _normal_score(self.raw[b] / self.scale, self.prior.freedom)
        clipped = np.where(tested, np.clip(out.score[b], -limit, limit), np.nan)
        self.up, self.down = step(self.up, self.down, clipped, self.settings.reference_value)
        out.tested_blocks += tested.any(axis=1)
        out.upper[b], out.lower[b] = self.up, self.down
        for v in np.flatnonzero((np.maximum(self.up, self.down) > out.threshold).any(axis=1)):
            self._alarm(b, int(v))
            self.up[v] = self.down[v] = 0.0

    def _fit(self, blocks: int) -> None:
        """Fit the hierarchical model of every quantity to the blocks before."""
        before = (self.block < blocks) & self.is_sound
        if not before.any():
            before = self.block < blocks
        self.prior = fit_fleet_prior(self.data, before, self.cell, getattr(self, "prior", None))
        self.out.models = self.prior.models

    def _learn_wander(self, b: int) -> None:
        """Choose how far the levels of sound vehicles wander, and filter again if that has changed."""
        known = np.isfinite(self.out.value[:b]) & self._sound_blocks(b)[:, :, None]
        known[: self.settings.baseline_blocks] = False
        start, variance = self.prior.levels(self.shape[0]), self.variances[:b] * self.scale**2
        blocks = FilteredBlocks(start, self.uses[:b], self.out.value[:b], variance, self.relearned, known)
        wander = choose_wander(blocks, self.settings)
        if wander is None or np.array_equal(wander, self.wander):
            return
        self.wander = wander
        self._filter_again(b)

    def _sound_blocks(self, b: int) -> NDArray[np.bool_]:
        """Blocks [b, v] with runs that show what is usual."""
        sound = np.zeros((b, self.shape[0]), dtype=bool)
        runs = np.flatnonzero(self.is_sound & (self.block < b))
        sound[self.block[runs], self.data.vehicle[runs]] = True
        return sound

    def _rescale(self, b: int) -> None:
        """Estimate the scale of the scores of all vehicles so far, robust against those that change."""
        z = self.raw[min(2, b) : b].reshape(-1, self.shape[1])
        for j in range(self.shape[1]):
            known = z[np.isfinite(z[:, j]), j]
            if len(known) >= self.settings.min_scores:
                scatter = MAD_TO_SD * float(np.median(np.abs(known - np.median(known))))
                self.scale[j] = max(scatter, self.settings.least_scale)

    def _maintained(self, b: int) -> NDArray[np.bool_]:
        """Quantities [v, q] that maintenance has changed in this block or between it and the one before."""
        which = np.zeros(self.shape, dtype=bool)
        for v, event in self.events[b]:
            which[v] |= self._resets(event)
        return which

    def _events_by_block(self, events: Sequence[tuple[int, EventModel]]) -> list[list[tuple[int, EventModel]]]:
        found: list[list[tuple[int, EventModel]]] = [[] for _ in range(len(self.out.start) - 1)]
        for v, event in events:
            b = int(np.searchsorted(self.out.start, event.time, "right")) - 1
            if 0 <= b < len(found):
                found[b].append((v, event))
        return found

    def _resets(self, event: EventModel) -> NDArray[np.bool_]:
        """Quantities [q] that maintenance changes."""
        return np.array([is_reset(event, quantity) for quantity in self.data.quantities])

    def _apply_events(self, b: int) -> None:
        """Learn levels anew after maintenance; runs of this block before it do not count."""
        self._relearn(self._maintained(b), b)
        for v, event in self.events[b]:
            early = (self.block == b) & (self.data.vehicle == v) & (self.data.time < event.time)
            self.counts[np.ix_(early, self._resets(event))] = 0.0

    def _mark_sound(self, last: int) -> None:
        """Mark the runs that show what is usual: not those since a change began, until maintenance."""
        vehicle, block = self.data.vehicle, self.block
        changes = [(x.block, 1, x.subject, x.started + 1) for x in self.out.alarms]
        changes += [(b, 0, v, b) for b in range(last + 1) for v, _ in self.events[b]]
        self.is_sound[:] = True
        for _, is_alarm, v, first in sorted(changes):
            self.is_sound[(vehicle == v) & (block >= first)] = not is_alarm

    def _relearn(self, which: NDArray[np.bool_], b: int) -> None:
        """Learn some levels [v, q] anew from a block on, expected among those of the other vehicles."""
        if not which.any():
            return
        taught = (self.count >= self.needed) & ~which
        expected = self.prior.levels_among(self.levels, self.use, taught)
        self.levels = self.levels.reset(which, expected)
        self.relearned[b].append((which, expected))
        self.count = np.where(which, 0, self.count)
        self.needed = np.where(which, self.settings.reset_blocks, self.needed)

    def _block(self, b: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Use, corrected mean and its variance [v, q] of the runs of a block; NaN where a vehicle has none."""
        data, runs = self.data, np.flatnonzero(self.block == b)
        of = data.vehicle[runs]
        corrected = data.y[runs] - data.covariates[runs] @ self.prior.covariate_slopes * self.prior.share[of]
        variance = self.prior.run_variance * data.sd[runs] ** 2
        use = data.use[runs]
        self.use[of] = use
        deviation = corrected - (self.levels.a[of] + self.levels.b[of] * use)
        total = variance + self.levels.variance(self.use)[of]
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

        Its prior is the variance between sections and blocks, and what mean and slopes of the fleet leave open; where
        there are sisters it is at least as wide as the scatter of one run, so that they outweigh it: levels have been
        learnt with slopes that a later fit has changed, and such a difference is common to all vehicles.
        """
        prior = self.prior
        section, vehicle = self.data.section[runs], self.data.vehicle[runs]
        control = np.zeros_like(deviation)
        slopes = self.data.covariates[runs] ** 2 @ prior.covariate_sd**2 + (self.data.use[runs] * prior.slope_sd) ** 2
        common = prior.cell_variance + prior.mean_sd**2 + slopes
        doubt = common.copy()
        for s in np.unique(section):
            own = np.flatnonzero(section == s)
            if len(np.unique(vehicle[own[self.is_sound[runs[own]]]])) < self.settings.min_sisters:
                continue
            others = ((vehicle[own][:, None] != vehicle[own][None, :]) & self.is_sound[runs[own]]).astype(float)
            wide = common[own] + np.median(variance[own], axis=0)
            control[own], doubt[own] = common_deviation(deviation[own], variance[own], wide, others)
            every = self.is_sound[runs[own]][None].astype(float)
            self.out.cell_mean[b, s] = common_deviation(deviation[own], variance[own], wide[:1], every)[0][0]
        return control, doubt

    def _alarm(self, b: int, v: int) -> None:
        """Record a vehicle over the threshold."""
        out, up, down = self.out, self.up[v], self.down[v]
        crossing = Crossing.of(v, b, up, down, out.threshold, 0)
        first = crossing.quantities[0]
        series = (out.upper if crossing.sums[0] > 0 else out.lower)[:b, v, first]
        zeros = np.flatnonzero(series <= 0.0)
        started = int(zeros[-1]) if len(zeros) else 0
        out.alarms.append(replace(crossing, started=started))
        self.alarmed[b].append(v)

    def _learn_alarmed(self, b: int) -> None:
        """Learn the levels of the vehicles with an alarm in this block anew."""
        which = np.zeros(self.shape, dtype=bool)
        which[self.alarmed[b]] = True
        self._relearn(which, b + 1)


def _normal_score(t: FloatArray, freedom: FloatArray) -> FloatArray:
    """Standard normal variable of the same probability as Student's t with some degrees of freedom."""
    tail = special.stdtr(np.broadcast_to(np.maximum(freedom, 1.0), t.shape), -np.abs(t))
    return np.asarray(-np.sign(t) * special.ndtri(np.maximum(tail, 1e-300)))
