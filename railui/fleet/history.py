"""History of the monitoring of a fleet: scores, sums of the tests, levels and crossings, block after block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.fleet.level_filter import Levels
from railui.fleet.mixed_model import MixedModel


@dataclass(frozen=True)
class Crossing:
    """A CUSUM that exceeded its threshold: vehicle or section, block, the quantities with their sums."""

    subject: int
    block: int
    quantities: tuple[int, ...]
    sums: tuple[float, ...]
    started: int

    @classmethod
    def of(cls, subject: int, block: int, up: FloatArray, down: FloatArray, limit: float, started: int) -> Crossing:
        """Return the crossing of sums [q], the largest first; those of falls are negative."""
        highest = np.maximum(up, down)
        over = np.flatnonzero(highest > limit)
        over = over[np.argsort(-highest[over], kind="stable")]
        sums = np.where(up >= down, up, -down)[over]
        return cls(subject, block, tuple(over.tolist()), tuple(sums.tolist()), started)


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
    models: Sequence[MixedModel] = ()
    block_of_run: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @classmethod
    def empty(
        cls, start: FloatArray, vehicles: int, quantities: int, sections: int, runs: int, threshold: float
    ) -> Monitor:
        """Return the history before the first block."""
        blocks = len(start) - 1

        def unknown(count: int) -> FloatArray:
            return np.full((blocks, count, quantities), np.nan)

        def zeros(count: int) -> FloatArray:
            return np.zeros((blocks, count, quantities))

        return cls(
            start,
            unknown(vehicles),
            unknown(vehicles),
            unknown(vehicles),
            unknown(vehicles),
            zeros(vehicles),
            zeros(vehicles),
            unknown(sections),
            unknown(sections),
            zeros(sections),
            zeros(sections),
            np.zeros((runs, quantities)),
            threshold,
            threshold,
            np.zeros(vehicles, dtype=np.int64),
        )

    def largest_sums(self) -> FloatArray:
        """Return the largest sum of every test over the threshold [v, q]; that of a fall is negative."""
        sums = np.where(self.upper >= self.lower, self.upper, -self.lower)
        largest = np.take_along_axis(sums, np.abs(sums).argmax(axis=0)[None], axis=0)[0]
        return np.asarray(largest / self.threshold)
