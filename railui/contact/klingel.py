"""Klingel's kinematic wavelength."""

from __future__ import annotations

import numpy as np


def klingel_wavelength(half_gauge: float, rolling_radius: float, conicity: float) -> float | None:
    """L = 2 pi sqrt(b r/lambda) [m] of a free wheelset's kinematic motion; None where the conicity is not positive.

    >>> round(klingel_wavelength(0.75, 0.46, 0.1), 3)
    11.67
    """
    return float(2 * np.pi * np.sqrt(half_gauge * rolling_radius / conicity)) if conicity > 0 else None
