"""Contact parameters of the linear model from nonlinear contact geometry: statistical and harmonic linearisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import ndtr

from railui.arrays import FloatArray
from railui.contact.geometry import ContactGeometry

BEYOND = 0.02  # share of a normal distribution that may lie beyond the table
ANGLES = 720
NOTHING = (float("nan"),) * 4


@dataclass(frozen=True)
class LinearContact:
    """lambda, epsilon, delta, sigma of (3.8) for a motion; NaN where the contact geometry does not reach so far.

    `motion` is the standard deviation or the amplitude [m], `beyond` the share of the motion beyond the treads.
    """

    motion: float
    conicity: float
    gravitational_stiffness: float
    contact_angle: float
    roll: float
    beyond: float = 0.0


@dataclass(frozen=True)
class FittedForms:
    """Two forms of (r_1 - r_2)/2 against e, fitted with the weight of a normal distribution of e.

    polynomial: lambda e (1 + l3 e^2) (the effect nonlinear_conicity); broken line: slope lambda within +/- knee and
    another beyond. Each with its standard error of fit over the standard deviation of the curve.
    """

    polynomial_conicity: float
    cubic: float
    polynomial_error: float
    inner_conicity: float
    outer_conicity: float
    knee: float
    broken_line_error: float


def linearise(contacts: ContactGeometry, deviation: float, mean: float = 0.0) -> LinearContact:
    """Statistical linearisation over a normal distribution of e of a standard deviation [m] about a mean [m].

    The slope of a curve f is E[(e - mean) f]/E[(e - mean)^2], delta is E[(tan gamma_1 + tan gamma_2)/2]; forces follow
    the tangent of the contact angle. The distribution is cut where a flange begins to touch, which is a law of its own
    (flange_contact), and where the geometry ends: NaN where more than 2 % would be lost there. Source: Stassen; thesis
    5.5.
    """
    e = contacts.displacement
    step = e[1] - e[0]
    (first, last), free = contacts.tread_range, contacts.flange_displacements
    reach = [(first - 0.5 * step - mean) / deviation, (last + 0.5 * step - mean) / deviation]
    lost = [float(ndtr(reach[0])), float(ndtr(-reach[1]))]
    made_up = sum(share for share, flange in zip(lost, free, strict=True) if flange is None)
    if not deviation > 2.0 * step or made_up > BEYOND:
        return LinearContact(deviation, *NOTHING, sum(lost))
    weight = np.where((e >= first) & (e <= last), np.exp(-0.5 * ((e - mean) / deviation) ** 2), 0.0)
    return _slopes(contacts, e - mean, weight / weight.sum(), deviation, sum(lost))


def linearise_harmonically(contacts: ContactGeometry, amplitude: float, mean: float = 0.0) -> LinearContact:
    """Harmonic linearisation: the describing function over e = mean + amplitude cos(theta). NaN beyond the treads."""
    e = contacts.displacement
    first, last = contacts.tread_range
    if mean + amplitude > last or mean - amplitude < first:
        return LinearContact(amplitude, *NOTHING, 1.0)
    swing = amplitude * np.cos(2.0 * np.pi * (np.arange(ANGLES) + 0.5) / ANGLES)
    # each angle's weight shared by the two points of the geometry around it
    step = e[1] - e[0]
    place = (mean + swing - e[0]) / step
    k = np.clip(place.astype(int), 0, len(e) - 2)
    weight = np.zeros(len(e))
    np.add.at(weight, k, (1.0 - (place - k)) / ANGLES)
    np.add.at(weight, k + 1, (place - k) / ANGLES)
    return _slopes(contacts, e - mean, weight, amplitude)


def _slopes(contacts: ContactGeometry, d: FloatArray, weight: FloatArray, motion: float, beyond: float = 0.0) -> LinearContact:
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
    """Polynomial and broken-line form of (r_1 - r_2)/2 (thesis 5.5), on the treads within three standard deviations."""
    first, last = (np.clip(end, -3.0 * deviation, 3.0 * deviation) for end in contacts.tread_range)
    near = (contacts.displacement >= first) & (contacts.displacement <= last)
    e, f = contacts.displacement[near], 0.5 * contacts.delta_r[near]
    weight = np.exp(-0.5 * (e / deviation) ** 2)

    def fitted(columns: list[FloatArray]) -> tuple[FloatArray, float]:
        root = np.sqrt(weight)
        found = np.linalg.lstsq(np.stack(columns, 1) * root[:, None], f * root, rcond=None)[0]
        left = f - np.stack(columns, 1) @ found
        return np.asarray(found, dtype=np.float64), float(np.sqrt((weight @ left**2) / (weight @ f**2)))

    def broken(knee: float) -> tuple[FloatArray, float]:
        return fitted([np.clip(e, -knee, knee), e - np.clip(e, -knee, knee)])

    (c1, c3), rest = fitted([e, e**3])
    # the best knee of a coarse look, then finer
    knees = np.linspace(0.3, 2.5, 45) * deviation
    best = int(np.argmin([broken(k)[1] for k in knees]))
    ends = knees[max(best - 1, 0)], knees[min(best + 1, len(knees) - 1)]
    knee = float(minimize_scalar(lambda k: broken(k)[1], bounds=ends, method="bounded").x)
    (inner, outer), error = broken(knee)
    return FittedForms(float(c1), float(c3 / c1), rest, float(inner), float(outer), knee, error)
