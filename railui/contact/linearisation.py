"""Statistical and harmonic linearisation of contact geometry: contact parameters of the linear model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import ndtr

from railui.arrays import FloatArray
from railui.contact.geometry import ContactGeometry

MAX_SHARE_BEYOND = 0.02  # of a normal distribution beyond the contact geometry
QUADRATURE_ANGLES = 720  # over one period
UNDEFINED = (float("nan"),) * 4


@dataclass(frozen=True)
class LinearContact:
    """Contact parameters lambda, epsilon, delta, sigma of (3.8) for a motion; NaN beyond the contact geometry.

    `motion`: standard deviation or amplitude [m]; `beyond`: share of the motion beyond the treads.
    """

    motion: float
    conicity: float
    gravitational_stiffness: float
    contact_angle: float
    roll: float
    beyond: float = 0.0


@dataclass(frozen=True)
class FittedForms:
    """Two forms of (r_1 - r_2)/2 over e, fitted with the weight of a normal distribution of e.

    Polynomial: lambda e (1 + l3 e^2) (the effect nonlinear_conicity); broken line: slope lambda within +/- knee and
    another slope beyond. The errors are standard errors of fit over the standard deviation of the curve.
    """

    polynomial_conicity: float
    cubic: float
    polynomial_error: float
    inner_conicity: float
    outer_conicity: float
    knee: float
    broken_line_error: float


def linearise(contacts: ContactGeometry, deviation: float, mean: float = 0.0) -> LinearContact:
    """Linearise statistically over a normal distribution of e with a standard deviation [m] about a mean [m].

    The slope of a curve f is E[(e - mean) f]/E[(e - mean)^2], delta is E[(tan gamma_1 + tan gamma_2)/2]; forces follow
    the tangent of the contact angle. The distribution is cut where a flange begins to touch, which the effect
    flange_contact models, and where the geometry ends: NaN if more than 2 % lies beyond. Source: Stassen; Broersen
    1976, 5.5.
    """
    e = contacts.displacement
    step = e[1] - e[0]
    (first, last), flanges = contacts.tread_range, contacts.flange_displacements
    reach = [(first - 0.5 * step - mean) / deviation, (last + 0.5 * step - mean) / deviation]
    beyond = [float(ndtr(reach[0])), float(ndtr(-reach[1]))]
    beyond_geometry = sum(share for share, flange in zip(beyond, flanges, strict=True) if flange is None)
    if not deviation > 2.0 * step or beyond_geometry > MAX_SHARE_BEYOND:
        return LinearContact(deviation, *UNDEFINED, sum(beyond))
    weight = np.where((e >= first) & (e <= last), np.exp(-0.5 * ((e - mean) / deviation) ** 2), 0.0)
    return _slopes(contacts, e - mean, weight / weight.sum(), deviation, sum(beyond))


def linearise_harmonically(contacts: ContactGeometry, amplitude: float, mean: float = 0.0) -> LinearContact:
    """Linearise by the describing function over e = mean + amplitude cos(theta) [m]; NaN beyond the treads."""
    e = contacts.displacement
    first, last = contacts.tread_range
    if mean + amplitude > last or mean - amplitude < first:
        return LinearContact(amplitude, *UNDEFINED, 1.0)
    offset = amplitude * np.cos(2.0 * np.pi * (np.arange(QUADRATURE_ANGLES) + 0.5) / QUADRATURE_ANGLES)
    # the weight of each angle is shared by the two neighbouring points of the geometry
    step = e[1] - e[0]
    position = (mean + offset - e[0]) / step
    k = np.clip(position.astype(int), 0, len(e) - 2)
    weight = np.zeros(len(e))
    np.add.at(weight, k, (1.0 - (position - k)) / QUADRATURE_ANGLES)
    np.add.at(weight, k + 1, (position - k) / QUADRATURE_ANGLES)
    return _slopes(contacts, e - mean, weight, amplitude)


def _slopes(
    contacts: ContactGeometry, d: FloatArray, weight: FloatArray, motion: float, beyond: float = 0.0
) -> LinearContact:
    """Return the contact parameters as weighted slopes over the deviation d [n] in m."""
    b = contacts.pair.half_distance
    steep = np.tan(contacts.angle)
    d = d - weight @ d
    variance = weight @ (d * d)

    def slope(curve: FloatArray) -> float:
        return float(weight @ (d * curve) / variance)

    return LinearContact(
        motion,
        slope(0.5 * contacts.delta_r),
        b * slope(0.5 * (steep[0] - steep[1])),
        float(weight @ (0.5 * (steep[0] + steep[1]))),
        -b * slope(contacts.roll),
        beyond,
    )


def fit_forms(contacts: ContactGeometry, deviation: float) -> FittedForms:
    """Fit polynomial and broken line to (r_1 - r_2)/2 on the treads within three standard deviations [m].

    Source: Broersen 1976, 5.5.
    """
    first, last = (np.clip(end, -3.0 * deviation, 3.0 * deviation) for end in contacts.tread_range)
    near = (contacts.displacement >= first) & (contacts.displacement <= last)
    e, f = contacts.displacement[near], 0.5 * contacts.delta_r[near]
    weight = np.exp(-0.5 * (e / deviation) ** 2)

    def fit(columns: list[FloatArray]) -> tuple[FloatArray, float]:
        root = np.sqrt(weight)
        coefficients = np.linalg.lstsq(np.stack(columns, 1) * root[:, None], f * root, rcond=None)[0]
        residual = f - np.stack(columns, 1) @ coefficients
        return np.asarray(coefficients, dtype=np.float64), float(np.sqrt((weight @ residual**2) / (weight @ f**2)))

    def fit_broken_line(knee: float) -> tuple[FloatArray, float]:
        return fit([np.clip(e, -knee, knee), e - np.clip(e, -knee, knee)])

    (c1, c3), cubic_error = fit([e, e**3])
    # the best knee of a coarse grid, then refined
    knees = np.linspace(0.3, 2.5, 45) * deviation
    best = int(np.argmin([fit_broken_line(k)[1] for k in knees]))
    ends = knees[max(best - 1, 0)], knees[min(best + 1, len(knees) - 1)]
    knee = float(minimize_scalar(lambda k: fit_broken_line(k)[1], bounds=ends, method="bounded").x)
    (inner, outer), error = fit_broken_line(knee)
    return FittedForms(float(c1), float(c3 / c1), cubic_error, float(inner), float(outer), knee, error)
