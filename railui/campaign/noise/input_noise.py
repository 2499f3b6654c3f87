"""White noise of the recorded input of a rig, from a part of its spectrum that nothing answers.

A drive may fill its whole spectrum. What is noise of the record is white, weak against the drive, and no channel
follows it: a force that acts moves the mass.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.noise.bounds import VARIANCE_OVER_DENSITY, Level
from railui.campaign.noise.record import Record
from railui.campaign.settings.noise import NoiseSettings
from railui.dsp.spectra import coherence, welch

PLATEAU = (0.5, 0.7, 0.9)  # of half the sampling rate: two bands, below the edge of an anti-aliasing filter
WINDOWS = 40  # in a record, without overlap
MIN_SAMPLES = 64  # of a window
QUIET_RATIO = 3.0  # of a density to that of the noise, up to which the drive is no more than noise
MARGIN = 4  # frequencies from those of the drive, into which a window spreads it
CHANCE = 0.01  # that a channel seems to follow noise at a frequency


def input_noise_level(records: Sequence[Record], column: str, settings: NoiseSettings) -> Level | None:
    """Estimate the white noise of an input; None where its spectrum does not show it.

    Parameters
    ----------
    records
        Of one rig, whose input one sensor measures.
    column
        The input.
    """
    present = [r for r in records if column in r.columns and np.ptp(r.columns[column]) > 0.0]
    spectra = [_Spectrum(r, column) for r in present]
    samples = sum(s.samples for s in spectra)
    if samples < settings.min_input_samples:
        return None
    slope = sum(s.slope * s.samples for s in spectra) / samples
    level = Level(float(np.median([s.log_sd for s in spectra])), float(np.log(settings.quiet_noise_factor)))
    is_white = abs(slope) < settings.max_input_slope
    is_weak = all(s.log_sd - s.log_drive < np.log(settings.max_input_noise) for s in spectra)
    return level if is_white and is_weak and not _is_followed(spectra, settings) else None


class _Spectrum:
    """Spectrum of the input of a record, with its plateau."""

    def __init__(self, record: Record, column: str) -> None:
        self.record = record
        self.x = record.columns[column]
        self.samples = len(self.x)
        self.window = max(self.samples // WINDOWS, MIN_SAMPLES)
        f, density = welch(self.x, 1.0, self.window)
        self.frequencies, self.density = f, density
        low, middle, high = (share * 0.5 for share in PLATEAU)
        lower = float(density[(f >= low) & (f < middle)].mean()) + 1e-300
        upper = float(density[(f >= middle) & (f < high)].mean()) + 1e-300
        self.slope = float(np.log(upper / lower))
        self.plateau = 0.5 * (lower + upper)
        self.log_sd = 0.5 * float(np.log(VARIANCE_OVER_DENSITY * self.plateau))
        self.log_drive = float(np.log(max(float(np.std(self.x)), 1e-300)))

    @property
    def quiet(self) -> NDArray[np.bool_]:
        """Frequencies at which the input is no more than its plateau, clear of those of the drive."""
        driven = self.density > QUIET_RATIO * self.plateau
        driven[0] = True
        near = np.convolve(driven, np.ones(2 * MARGIN + 1), "same") > 0.0
        return np.asarray(~near)

    def significant_share(self, channel: FloatArray) -> float:
        """Share of the quiet frequencies at which a channel seems to follow the input."""
        quiet = self.quiet
        if not np.any(quiet):
            return 1.0
        windows = max(2 * self.samples // self.window - 1, 2)
        effective = max(0.5 * (windows + 1), 2.0) * 18.0 / 11.0  # Hann windows that overlap by half, Welch 1967
        _, shares = coherence(self.x, channel, 1.0, self.window)
        return float(np.mean(shares[quiet] > 1.0 - CHANCE ** (1.0 / (effective - 1.0))))


def _is_followed(spectra: Sequence[_Spectrum], settings: NoiseSettings) -> bool:
    """True where a channel follows the input at the frequencies of its plateau."""
    shares: dict[str, list[float]] = {}
    for s in spectra:
        for name in s.record.channels:
            if np.ptp(s.record.columns[name]) > 0.0:
                shares.setdefault(name, []).append(s.significant_share(s.record.columns[name]))
    return any(float(np.mean(found)) > settings.max_followed_share for found in shares.values())
