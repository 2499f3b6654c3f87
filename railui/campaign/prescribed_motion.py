"""Bandwidth of a prescribed motion whose sensor is noisy.

Differentiation multiplies the noise of a displacement by its frequency: 0.06 mm of white noise at 500 samples/s become
50 mm/s. The motion of a press or a shaker is smooth, and its speed is that of the record below a low-pass.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from railui.campaign.noise.bounds import is_flat, quiet_level
from railui.campaign.segment import Segment, smooth_motion
from railui.campaign.settings.noise import NoiseSettings
from railui.dsp.spectra import hann, hann_periodogram

DIFFERENTIATED = {"base_displacement": ("u",), "motion": ("z", "vz")}  # inputs of a rig whose speed acts on it
SMOOTHED_LINES = 5  # of a periodogram, in a moving mean
CLEARANCE = 3.0  # of the low-pass from the motion: the amplitudes there are 1.5e-4 too small
MAX_RATE_SHARE = 0.45  # of the sampling rate
WHITE_SPEED = np.pi / np.sqrt(3.0)  # standard deviation of the derivative of unit white noise, times the interval


def with_motion_bandwidth(
    segments: Sequence[Segment], rig_input: str | None, settings: NoiseSettings
) -> tuple[Segment, ...]:
    """Return the segments with the bandwidth of those prescribed motions whose noise distorts the speed."""
    inputs = DIFFERENTIATED.get(rig_input or "", ())
    if not inputs:
        return tuple(segments)
    return tuple(replace(s, tables={}, motion_bandwidth=_noisy_columns(s, inputs, settings)) for s in segments)


def _noisy_columns(segment: Segment, inputs: Sequence[str], settings: NoiseSettings) -> Mapping[str, float]:
    found = {c: motion_bandwidth(segment, c, settings) for c in inputs if c in segment.columns}
    return {c: limit for c, limit in found.items() if limit is not None}


def motion_bandwidth(segment: Segment, column: str, settings: NoiseSettings) -> float | None:
    """Compute the edge [Hz] of the low-pass of a motion; None where noise is immaterial or the motion fills the band.

    The noise is white, from the top of the spectrum; the motion reaches up to the last frequency at which the power is
    well above it.
    """
    tolerance = float(np.log(settings.quiet_noise_factor))
    quiet = quiet_level([segment], column, tolerance)
    if quiet is None or not is_flat(segment, column, tolerance):
        return None
    x, rate, noise = segment.columns[column], 1.0 / segment.dt, float(np.exp(quiet.log))
    f, density = hann_periodogram(x, rate)
    white = 2.0 * segment.dt * noise**2 * float(np.mean(hann(len(x)) ** 2))
    smooth = np.convolve(density, np.full(SMOOTHED_LINES, 1.0 / SMOOTHED_LINES), "same")
    above = np.flatnonzero(smooth > settings.motion_noise_ratio * white)
    limit = CLEARANCE * float(f[above[-1]]) if len(above) else np.inf
    if limit >= MAX_RATE_SHARE * rate:
        return None
    share = _speed_noise_share(segment, column, limit, noise)
    return limit if share > settings.max_speed_noise_share else None


def _speed_noise_share(segment: Segment, column: str, limit: float, noise: float) -> float:
    """Noise of the speed over the speed below the low-pass, both as standard deviations."""
    motion = smooth_motion(segment.columns[column], limit, segment.dt)
    if column == "vz":
        return noise / max(float(motion.std()), 1e-300)
    speed = float(np.gradient(motion, segment.dt).std())
    return noise * float(WHITE_SPEED) / segment.dt / max(speed, 1e-300)
