"""Noise of single channels: the quiet band, which is its white part, and the incoherent part, which bounds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.noise.record import Record, band_limits
from railui.dsp.spectra import detrend, hann, multiple_coherence, welch
from railui.runs.columns import RIG_FORMS, column_names
from railui.vehicle.track_geometry import TrackGeometry

QUIET_SAMPLES = 1024  # of a window, at most
QUIET_WINDOWS = 8  # in a record, without overlap, where it is long enough for
MIN_QUIET_SAMPLES = 16  # of a window
QUIET_SHARES = (0.8, 0.9, 1.0)  # of half the sampling rate: two bands, which white noise fills alike
VARIANCE_OVER_DENSITY = 0.5  # of white noise: the one-sided density of unit variance is 2 per cycle and sample
WINDOW_SECONDS = 2.56
RIG_WINDOWS = 60
WINDOWS_PER_INPUT = 4
RIG_INPUTS = {"rig": ("u",), "bench": ("z", "vz")}
TRACK = column_names("bogie", "track")


class Level(NamedTuple):
    """Natural logarithm of a level and its standard deviation."""

    log: float
    sd: float

    def combine(self, other: Level | None) -> Level:
        """Combine with an independent estimate, weighted by precision."""
        if other is None:
            return self
        p, q = self.sd**-2, other.sd**-2
        return Level((p * self.log + q * other.log) / (p + q), float((p + q) ** -0.5))


def quiet_level(
    records: Sequence[Record], channel: str, least_sd: float, min_coherent_share: float | None = None
) -> Level | None:
    """White noise of a channel from the top of its spectrum; uncertain by as much as that is not flat.

    Parameters
    ----------
    min_coherent_share
        Share of the top of a rig's spectrum, coherent with its input, from which that part counts as motion: the
        acceleration of a mass follows a broadband force up to any frequency. None: all of it counts as noise.
    """
    present = [r for r in records if channel in r.columns and np.ptp(r.columns[channel]) > 0.0]
    logs, steps = [], []
    for record in present:
        lower, upper = _top_bands(record, channel, min_coherent_share)
        logs.append(0.5 * np.log(VARIANCE_OVER_DENSITY * upper))
        steps.append(0.5 * abs(np.log(upper / lower)))
    if not logs:
        return None
    return Level(float(np.median(logs)), float(np.hypot(least_sd, max(np.median(steps) - least_sd, 0.0))))


def _top_bands(record: Record, channel: str, min_coherent_share: float | None = None) -> tuple[float, float]:
    """Median densities, per cycle and sample, of two bands at the top of a channel's spectrum."""
    x = record.columns[channel]
    length = _quiet_window(len(x))
    _, density = welch(x, 1.0, length)
    if min_coherent_share is not None and record.kind in RIG_FORMS:
        density = density * _incoherent_shares(record, channel, length, min_coherent_share)
    windows = max(2 * len(x) // length - 1, 1)
    density = density / (1.0 - 1.0 / (9.0 * windows)) ** 3  # median over mean of chi-square, Wilson and Hilferty 1931
    edges = [min(round(share * len(density)), len(density) - 1) for share in QUIET_SHARES]
    lower, upper = (float(np.median(density[a : max(b, a + 1)])) + 1e-300 for a, b in pairwise(edges))
    return lower, upper


def _incoherent_shares(record: Record, channel: str, length: int, min_coherent_share: float) -> FloatArray:
    """Share [line] of a channel that is incoherent with the input of a rig; 1 where little at the top is coherent."""
    inputs = RIG_INPUTS[str(record.kind)]
    moving = [x for x in (record.columns[c] for c in inputs if c in record.columns) if np.ptp(x) > 0.0]
    if channel in inputs or not moving:
        return np.ones(length // 2 + 1)
    _, coherent = multiple_coherence(np.stack(moving), record.columns[channel], 1.0, length)
    top = coherent[min(round(QUIET_SHARES[0] * len(coherent)), len(coherent) - 2) : -1]
    is_motion = float(np.mean(top)) >= min_coherent_share  # false where there are too few windows
    return np.asarray(1.0 - coherent) if is_motion else np.ones(len(coherent))


def _quiet_window(samples: int) -> int:
    return min(QUIET_SAMPLES, max(samples // QUIET_WINDOWS, MIN_QUIET_SAMPLES))


def is_flat(record: Record, channel: str, tolerance: float) -> bool:
    """True where the amplitudes of both top bands differ by less than a factor, of which the logarithm is given."""
    lower, upper = _top_bands(record, channel)
    return bool(0.5 * abs(np.log(upper / lower)) < tolerance)


def quiet_band(record: Record, channel: str) -> tuple[FloatArray, FloatArray]:
    """Mean frequency [Hz] and density [1/Hz] of the top band of a channel, as series of one."""
    x = record.columns[channel]
    f, density = welch(x, 1.0 / record.dt, _quiet_window(len(x)))
    top = slice(round(QUIET_SHARES[0] * len(f)), len(f) - 1)
    return np.array([f[top].mean()]), np.array([density[top].mean()])


def incoherent_level(
    record: Record, channel: str, geometry: TrackGeometry, band: tuple[float, float] | None
) -> float | None:
    """White-noise level of the part of a channel that is incoherent with the track and with all other channels.

    Unmodelled motion that no other channel contains is part of it, so that it bounds the noise from above. The chance
    level p/K of p inputs and K windows is corrected. None: no input, or a record too short.
    """
    others = [record.columns[c] for c in record.channels if c != channel]
    powers = incoherent_power(record, record.columns[channel], others + track_inputs(record, geometry), band)
    return None if powers is None else float(np.sqrt(powers[0]))


def incoherent_power(
    record: Record, series: FloatArray, inputs: Sequence[FloatArray], band: tuple[float, float] | None
) -> tuple[float, float] | None:
    """Power of the part of a series [n] in a band that is incoherent with inputs, and its power there.

    Both as the variance of white noise with that power; None: no input, or a record too short.
    """
    moving = [x for x in inputs if np.ptp(x) > 0.0]
    length = _window_length(record, len(series), len(moving))
    f = np.fft.rfftfreq(length, record.dt)
    low, high = band_limits(band, record.dt)
    used = (f > 0.0) & (f >= low) & (f <= high)
    windows = len(range(0, len(series) - length + 1, length // 2))
    if not moving or windows <= 2 * len(moving) or not np.any(used):
        return None
    y = _transforms(series, length)[:, used]
    x = np.stack([_transforms(column, length)[:, used] for column in moving], axis=2).transpose(1, 0, 2)
    scale = np.sqrt(np.sum(np.abs(x) ** 2, axis=1, keepdims=True)) + 1e-300
    basis, _, _ = np.linalg.svd(x / scale, full_matrices=False)
    explained = np.sum(np.abs(np.einsum("fkp,kf->fp", basis.conj(), y)) ** 2, axis=1)
    total = np.sum(np.abs(y) ** 2, axis=0)
    incoherent = np.maximum(total - explained, 0.0) / (windows - len(moving))
    window = hann(length)
    both = float(np.mean(incoherent)), float(np.mean(total)) / windows
    return both[0] / float(window @ window), both[1] / float(window @ window)


def track_inputs(record: Record, geometry: TrackGeometry) -> list[FloatArray]:
    """Track columns under all wheelsets; the input of a rig."""
    columns: Mapping[str, FloatArray] = record.columns
    if record.kind in RIG_FORMS:
        return [columns[c] for c in RIG_INPUTS[str(record.kind)] if c in columns]
    return geometry.under_wheelsets(columns["s"], [columns[c] for c in TRACK if c in columns])


def _window_length(record: Record, samples: int, inputs: int) -> int:
    enough = 2 * samples // (WINDOWS_PER_INPUT * max(inputs, 1) + 1)
    longest = 2 * samples // RIG_WINDOWS if record.kind in RIG_FORMS else round(WINDOW_SECONDS / record.dt)
    return max(min(longest, enough), 8)


def _transforms(x: FloatArray, length: int) -> ComplexArray:
    """Transforms [window, frequency] of half-overlapping Hann windows."""
    windows = np.lib.stride_tricks.sliding_window_view(x, length)[:: length // 2]
    return np.asarray(np.fft.rfft(detrend(windows) * hann(length), axis=-1))
