"""Saturation before the converter: samples about an extreme that differ by noise, as an amplifier or a sensor leaves.

A signal enters and leaves its limit at speed. At a turning point, and where a mass sticks, its speed decreases to
nothing first, so that samples crowd below the extreme.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.faults import FaultSettings
from railui.dsp.intervals import true_intervals

WIDTHS = (2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # of a channel's range: of a plateau with its noise
LEAST_STEPS = 2.01  # of the resolution: a narrower plateau is of equal samples
DEPTHS = (0.05, 0.25)  # of the range, below a plateau
REST_SHARE = 0.5  # of the samples


def saturated_samples(x: FloatArray, settings: FaultSettings) -> NDArray[np.intp]:
    """Return the indices of samples [n] on a noisy plateau at an extreme of a series; none where it was not cut off.

    >>> t, noise = np.arange(4000) * 0.01, 1e-4 * np.random.default_rng(0).standard_normal(4000)
    >>> x = np.sin(3 * t) + np.sin(7.3 * t)
    >>> len(saturated_samples(x + noise, FaultSettings()))
    0
    >>> len(saturated_samples(np.clip(x, -9, 1.2) + noise, FaultSettings())), int(np.sum(x > 1.2))
    (566, 566)
    """
    levels = np.unique(x)
    if len(levels) < 4:
        return np.zeros(0, np.intp)
    least = LEAST_STEPS * float(np.min(np.diff(levels)))
    found = [_of_extreme(sign * x, least, settings) for sign in (1.0, -1.0)]
    return np.asarray(np.concatenate(found))


def _of_extreme(x: FloatArray, least: float, settings: FaultSettings) -> NDArray[np.intp]:
    """Return the indices on the narrowest plateau at the maximum of a series; none without one."""
    top, extent = float(x.max()), float(np.ptp(x))
    for width in (share * extent for share in WIDTHS if share * extent >= least):
        plateau = _without_single_gaps(x >= top - width)
        events = [(a, b) for a, b in true_intervals(plateau) if b - a >= settings.min_equal_samples]
        number = sum(b - a for a, b in events)
        side = top - width - max(settings.clipping_side_share * extent, 2.0 * width)
        near = int(np.sum((x < top - width) & (x >= side)))
        if number > REST_SHARE * len(x):
            break  # at rest between pulses
        if len(events) >= settings.min_fault_events and number > settings.clipping_pile_up * max(near, 1):
            is_cut_off = _is_cut_off(top - width - x, extent, settings)
            return np.concatenate([np.arange(a, b) for a, b in events]) if is_cut_off else np.zeros(0, np.intp)
    return np.zeros(0, np.intp)


def _without_single_gaps(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask that is true for single false samples between true ones, too."""
    closed = mask.copy()
    closed[1:-1] |= mask[:-2] & mask[2:]
    return closed


def _is_cut_off(depth: FloatArray, extent: float, settings: FaultSettings) -> bool:
    """True where the density of samples just below a plateau is little larger than further below.

    depth: of the samples below the plateau. About a turning point of amplitude A the density grows as 1/sqrt(d/A).
    """
    near, far = DEPTHS
    just_below = int(np.sum((depth > 0.0) & (depth <= near * extent))) / near
    further = int(np.sum((depth > near * extent) & (depth <= far * extent))) / (far - near)
    return just_below <= settings.max_approach_density * further and further > 0.0


def is_motion(columns: Mapping[str, FloatArray], indices: NDArray[np.intp], settings: FaultSettings) -> bool:
    """True where other columns share a plateau of the displacement: the mass is at rest, or so is the input."""
    drive, az = columns.get("u"), columns.get("az")
    if drive is not None:
        common = np.intersect1d(indices, saturated_samples(drive, settings))
        if 2 * len(common) > len(indices):
            return True
    if az is None or not np.ptp(az):
        return False
    deviation = az - az.mean()
    on_plateau = float(np.sqrt(np.mean(deviation[indices] ** 2)))
    return on_plateau < settings.max_resting_acceleration * float(np.std(az))
