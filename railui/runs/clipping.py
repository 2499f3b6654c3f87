"""Clipping of a channel: samples in a row at its extreme, where the signal otherwise moves in large steps."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray

MIN_STEP_RATIO = 4.0  # mean step to the smallest: below, the peaks of a slow, coarse signal are flat by themselves
MIN_AT_EXTREME = 5  # samples
MIN_IN_A_ROW = 2  # of these that follow two others, as only clipping has them
MIN_ENTRY_RATIO = 0.3  # mean step into the extreme to the mean step: a smooth peak is reached in small ones


class ClippingWatch:
    """Clipping of the channels of a stream; the division of the stream into parts has no influence.

    Attributes
    ----------
    extremes
        Largest value of each channel, and of its negative, so far [2, channel].
    counts
        Samples at the extreme [2, channel].
    rows
        Samples that follow two others at the same extreme [2, channel].
    """

    def __init__(self, channels: int) -> None:
        self.extremes = np.full((2, channels), -np.inf)
        self.counts = np.zeros((2, channels), dtype=np.int64)
        self.rows = np.zeros((2, channels), dtype=np.int64)
        self._entries = np.zeros((2, channels))
        self._sum_of_entries = np.zeros((2, channels))
        self._last = np.full((2, channels), np.nan)
        self._smallest_step = np.full(channels, np.inf)
        self._sum_of_steps = np.zeros(channels)
        self._steps = np.zeros(channels)

    def add(self, values: FloatArray) -> None:
        """Add values [n, channel]; NaN interrupts a row of samples."""
        joined = np.concatenate([self._last, values])
        steps = np.abs(np.diff(joined[1:], axis=0))
        moves = np.where(steps > 0, steps, np.inf)
        self._smallest_step = np.minimum(self._smallest_step, np.min(moves, axis=0, initial=np.inf))
        self._sum_of_steps += np.nansum(steps, axis=0)
        self._steps += np.sum(np.isfinite(steps), axis=0)
        for side, signed in enumerate((joined, -joined)):
            highest = np.max(np.where(np.isfinite(signed), signed, -np.inf), axis=0)
            is_new = highest > self.extremes[side]
            for total in (self.counts, self.rows, self._entries, self._sum_of_entries):
                total[side, is_new] = 0
            self.extremes[side] = np.maximum(self.extremes[side], highest)
            is_extreme = signed == self.extremes[side]
            self.counts[side] += np.sum(is_extreme[2:], axis=0)
            self.rows[side] += np.sum(is_extreme[2:] & is_extreme[1:-1] & is_extreme[:-2], axis=0)
            is_entry = is_extreme[2:] & ~is_extreme[1:-1] & np.isfinite(steps)
            self._entries[side] += np.sum(is_entry, axis=0)
            self._sum_of_entries[side] += np.sum(steps, axis=0, where=is_entry)
        self._last = joined[-2:]

    def clipped(self) -> dict[int, tuple[int, float]]:
        """Return the number of clipped samples and the level by channel number, of those that are clipped."""
        found = {}
        with np.errstate(invalid="ignore", divide="ignore"):
            mean_step = self._sum_of_steps / self._steps
            is_steep = self._sum_of_entries / self._entries > MIN_ENTRY_RATIO * mean_step
        is_fast = mean_step > MIN_STEP_RATIO * self._smallest_step
        is_clipped = is_steep & (self.counts >= MIN_AT_EXTREME) & (self.rows >= MIN_IN_A_ROW)
        counts = np.where(is_clipped, self.counts, 0)
        for channel in np.flatnonzero(is_fast & is_clipped.any(axis=0)):
            side = int(np.argmax(counts[:, channel]))
            level = float(self.extremes[side, channel]) * (1 if side == 0 else -1)
            found[int(channel)] = (int(counts[:, channel].sum()), level)
        return found


def clipped_samples(x: FloatArray) -> tuple[int, float] | None:
    """Return the number of clipped samples of a channel [n] and the level, None if it is not clipped.

    >>> t = np.arange(4000) / 200
    >>> x = np.sin(9 * t) + 0.3 * np.sin(31 * t)
    >>> clipped_samples(x), clipped_samples(np.clip(x, -0.9, 2))
    (None, (526, -0.9))
    >>> clipped_samples(np.round(40 + np.sin(t)))  # a coarse speed
    """
    watch = ClippingWatch(1)
    watch.add(np.asarray(x, dtype=np.float64)[:, None])
    return watch.clipped().get(0)
