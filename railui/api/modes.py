"""Modes of a design over speed: followed by their shapes, or as damping ratios and frequencies alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode
    from railui.vehicle.resolve import ModelSource

MIN_OSCILLATION_FREQUENCY: Final = 0.5  # rad/s; slower modes count as no oscillation


def follow_modes(design: ModelSource, speeds: ArrayLike) -> list[TrackedMode]:
    """Follow the oscillating modes of a design over speed; parameters and exceptions as `Design.modes`."""
    from railui.running_stability.mode_tracking import track_modes
    from railui.vehicle.resolve import resolve_model

    return track_modes(resolve_model(design), np.asarray(speeds, dtype=np.float64))


def damping_over_speed(design: ModelSource, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return damping ratio and frequency [Hz] of the oscillating modes [speed, mode]; NaN for missing modes."""
    from railui.vehicle.linear import damping_ratio, eigenvalues
    from railui.vehicle.resolve import resolve_model

    model = resolve_model(design)
    roots = eigenvalues(model, np.repeat(model.row[None], len(speeds), axis=0), speeds)
    oscillates = roots.imag > MIN_OSCILLATION_FREQUENCY
    damping = np.where(oscillates, damping_ratio(roots), np.nan)
    frequency = np.where(oscillates, roots.imag / (2 * np.pi), np.nan)
    mode_count = max(1, int(oscillates.sum(axis=1).max(initial=1)))
    order = np.argsort(np.where(oscillates, frequency, np.inf), axis=1)[:, :mode_count]
    return np.take_along_axis(damping, order, axis=1), np.take_along_axis(frequency, order, axis=1)


def linear_critical_speed(design: ModelSource, highest: float) -> float | None:
    """Return the speed [m/s] at which the linear vehicle loses stability; None for one that is stable up to `highest`.

    Examples
    --------
    >>> round(linear_critical_speed("designs/check_bogie.yaml", 90.0), 5)
    61.64024
    """
    from railui.running_stability.critical_speed import critical_speeds
    from railui.vehicle.resolve import resolve_model

    model = resolve_model(design)
    found = critical_speeds(model, model.row[None], highest)[0]
    return None if found is None else found.speed
