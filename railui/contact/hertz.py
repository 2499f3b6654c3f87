"""Hertz's contact ellipse from curvatures and load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

YOUNG_STEEL = 210e9  # N/m^2, Young's modulus
POISSON_STEEL = 0.28
MIN_AXIS_RATIO = 1e-3  # minor over major axis, below which the contact counts as a line


@dataclass(frozen=True)
class ContactEllipse:
    """Semi-axes a along the rail and b across it [m], largest pressure [N/m^2], approach of the bodies [m]."""

    a: float
    b: float
    pressure: float
    approach: float


def hertz(
    load: float, along: float, across: float, young: float = YOUNG_STEEL, poisson: float = POISSON_STEEL
) -> ContactEllipse:
    """Compute the contact ellipse of two bodies of the same material.

    Parameters
    ----------
    load : float
        Normal load [N].
    along : float
        Relative curvature along the rail [1/m]: 1/R of the wheel.
    across : float
        Relative curvature across the rail [1/m]: the sum of those of wheel and rail, convex positive.
    young, poisson : float
        Young's modulus [N/m^2] and Poisson's ratio.

    Raises
    ------
    ValueError
        For a curvature that is not positive: conforming contact is outside Hertz's theory.

    References
    ----------
    Johnson, Contact Mechanics (1985), (4.24)-(4.32).

    Examples
    --------
    >>> ball = hertz(1e3, 10.0, 10.0)
    >>> abs(ball.a - (3 * 1e3 * 0.1 * (1 - 0.28**2) * 2 / (4 * 210e9)) ** (1 / 3)) < 1e-12
    True
    """
    if not (load > 0.0 and along > 0.0 and across > 0.0):
        values = f"load {load:.4g} N, curvatures {along:.4g} and {across:.4g} 1/m"
        raise ValueError(f"Hertz needs a load and convex contact: {values} (conforming profiles are no point contact)")
    smaller, larger = 0.5 * min(along, across), 0.5 * max(along, across)
    ratio = _axis_ratio(larger / smaller)
    k2 = 1.0 - ratio * ratio
    is_elongated = k2 > 1e-8
    shape = (ellipk(k2) - ellipe(k2)) / k2 if is_elongated else 0.25 * np.pi
    modulus = young / (2.0 * (1.0 - poisson * poisson))
    major = float((3.0 * load * shape / (2.0 * np.pi * smaller * modulus)) ** (1.0 / 3.0))
    minor = ratio * major
    pressure = 3.0 * load / (2.0 * np.pi * major * minor)
    approach = 3.0 * load * float(ellipk(k2)) / (2.0 * np.pi * major * modulus)
    # the longer axis has the smaller curvature
    a, b = (major, minor) if along <= across else (minor, major)
    return ContactEllipse(a, b, pressure, approach)


def _axis_ratio(curvatures: float) -> float:
    """Return minor over major axis for a ratio of the curvatures, at least 1."""
    if curvatures < 1.0 + 1e-9:
        return 1.0

    def excess(ratio: float) -> float:
        k2 = 1.0 - ratio * ratio
        k, e = float(ellipk(k2)), float(ellipe(k2))
        return (e / (ratio * ratio) - k) / (k - e) - curvatures

    if excess(MIN_AXIS_RATIO) < 0.0:
        raise ValueError(f"the curvatures differ by a factor of {curvatures:.3g}: a line contact, not an ellipse")
    return float(brentq(excess, MIN_AXIS_RATIO, 1.0 - 1e-9))
