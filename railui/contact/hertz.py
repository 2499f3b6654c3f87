"""Hertz's contact ellipse from curvatures and load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

YOUNG_STEEL = 210e9  # N/m^2, Young's modulus
POISSON_STEEL = 0.28
THINNEST = 1e-3  # ratio of the axes at which the search ends


@dataclass(frozen=True)
class ContactEllipse:
    """Semi-axes a along the rail and b across it [m], greatest pressure [N/m^2], approach of the bodies [m]."""

    a: float
    b: float
    pressure: float
    approach: float


def hertz(load: float, along: float, across: float, young: float = YOUNG_STEEL, poisson: float = POISSON_STEEL) -> ContactEllipse:
    """The ellipse under a load [N] of two bodies of one material with relative curvatures along and across [1/m].

    `along` is 1/R of the wheel, `across` the sum of the curvatures of wheel and rail across the rail (convex positive).
    ValueError where a curvature is not positive: conforming contact, of which Hertz knows nothing.
    Source: Johnson, Contact Mechanics (1985), (4.24)-(4.32).

    >>> ball = hertz(1e3, 10.0, 10.0)
    >>> abs(ball.a - (3 * 1e3 * 0.1 * (1 - 0.28**2) * 2 / (4 * 210e9)) ** (1 / 3)) < 1e-12
    True
    """
    if not (load > 0.0 and along > 0.0 and across > 0.0):
        what = f"load {load:.4g} N, curvatures {along:.4g} and {across:.4g} 1/m"
        raise ValueError(f"Hertz needs a load and convex contact: {what} (conforming profiles are no point contact)")
    flat, sharp = 0.5 * min(along, across), 0.5 * max(along, across)
    ratio = _axes(sharp / flat)
    k2 = 1.0 - ratio * ratio
    thin = k2 > 1e-8
    shape = (ellipk(k2) - ellipe(k2)) / k2 if thin else 0.25 * np.pi
    modulus = young / (2.0 * (1.0 - poisson * poisson))
    major = float((3.0 * load * shape / (2.0 * np.pi * flat * modulus)) ** (1.0 / 3.0))
    minor = ratio * major
    pressure = 3.0 * load / (2.0 * np.pi * major * minor)
    approach = 3.0 * load * float(ellipk(k2)) / (2.0 * np.pi * major * modulus)
    # the longer axis lies where the curvature is less
    a, b = (major, minor) if along <= across else (minor, major)
    return ContactEllipse(a, b, pressure, approach)


def _axes(curvatures: float) -> float:
    """Minor over major axis for a ratio of the curvatures, at least 1."""
    if curvatures < 1.0 + 1e-9:
        return 1.0

    def excess(ratio: float) -> float:
        k2 = 1.0 - ratio * ratio
        k, e = float(ellipk(k2)), float(ellipe(k2))
        return (e / (ratio * ratio) - k) / (k - e) - curvatures

    if excess(THINNEST) < 0.0:
        raise ValueError(f"the curvatures differ by a factor of {curvatures:.3g}: a line contact, not an ellipse")
    return float(brentq(excess, THINNEST, 1.0 - 1e-9))
