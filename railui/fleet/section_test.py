"""Test of track sections: what the runs on a section have in common, against the other sections and its own past."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.fleet import FleetSettings
from railui.dsp.robust import MAD_TO_SD
from railui.fleet.cusum import step
from railui.fleet.fleet_prior import MEDIAN_VARIANCE
from railui.fleet.history import Crossing, Monitor


class SectionTest:
    """CUSUM tests of the sections of a fleet.

    renewed: days at which the record of a section was renewed, after which the deviations are learnt anew.
    """

    def __init__(self, out: Monitor, settings: FleetSettings, renewed: Sequence[float]) -> None:
        self.out, self.settings, self.renewed = out, settings, renewed
        self.up = self.down = np.zeros(out.section_upper.shape[1:])
        self.since = 0  # block from which the records are the same
        self.spread = np.zeros(out.section_upper.shape[2])

    def add(self, b: int) -> None:
        """Add a block."""
        out, settings = self.out, self.settings
        if len(self.up) < 2:
            return
        if any(out.start[b] <= day < out.start[b + 1] for day in self.renewed):
            self.since = b + 1
            self.up, self.down = np.zeros_like(self.up), np.zeros_like(self.down)
        z = self._scores(b)
        out.section_score[b] = z
        limit = settings.max_score
        self.up, self.down = step(self.up, self.down, np.clip(z, -limit, limit), settings.reference_value)
        out.section_upper[b], out.section_lower[b] = self.up, self.down
        for s in np.flatnonzero((np.maximum(self.up, self.down) > out.section_threshold).any(axis=1)):
            out.section_alarms.append(Crossing.of(int(s), b, self.up[s], self.down[s], out.section_threshold, b))
            self.up[s] = self.down[s] = 0.0

    def _scores(self, b: int) -> FloatArray:
        """Deviations of a block [section, q] from the median of those before, over their spread."""
        before = _against_others(self.out.cell_mean[self.since : b + 1])
        least = self.settings.reset_blocks if self.since else self.settings.baseline_blocks
        if len(before) <= least:
            return np.full(self.up.shape, np.nan)
        now, before = before[-1], before[:-1]
        centre = np.nanmedian(before, axis=0)
        self.spread = np.fmax(MAD_TO_SD * np.nanmedian(np.abs(before - centre), axis=(0, 1)), self.spread)
        return np.asarray(
            (now - centre) / np.maximum(self.spread * np.sqrt(1.0 + MEDIAN_VARIANCE / len(before)), 1e-300)
        )


def _against_others(means: FloatArray) -> FloatArray:
    """Deviations of sections from the mean of the other ones [block, section, q]."""
    known = np.isfinite(means)
    total, count = np.where(known, means, 0.0).sum(axis=1, keepdims=True), known.sum(axis=1, keepdims=True)
    others = (total - np.where(known, means, 0.0)) / np.maximum(count - known, 1)
    return np.where(known & (count > 1), means - others, np.nan)
