"""Start values of a rig by modulating functions: linear least squares without initial states or local minima.

The equation of motion m z'' + c z' + k z = g u is multiplied by a smooth function chi that vanishes, as its derivatives
do, at both ends of a window, and integrated by parts until no derivative of a measured channel is left (Shinbrot,
Trans. ASME 79 (1957) 579). With a measured y, the d-th derivative of z,

    m int y chi'' - c int y chi' + k int y chi = (-1)^d g int u chi^(d).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.polynomial import Polynomial

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.dsp.spectra import hann
from railui.vehicle.model import Model

EXPONENT = 4  # of 1 - x^2, which vanishes at both ends with three derivatives
WINDOW_PERIODS = 2.0  # length of a window
MIN_WINDOW_SAMPLES = 12
MAX_WINDOWS = 400  # of a segment
MIN_SHARE = 1e-3  # of its nominal value, of a parameter whose estimate is negative
QUIET_SHARE = 0.3  # of the windows: those with the smallest motion
DERIVATIVES = {"z": 0, "vz": 1, "az": 2}
TERMS = ("mass", "damping", "stiffness", "gain")


def dominant_period(segment: Segment) -> float:
    """Period [s] at which the first measured channel has most power."""
    x = segment.columns[segment.channels[0]]
    power = np.abs(np.fft.rfft((x - x.mean()) * hann(len(x)))) ** 2
    return len(x) * segment.dt / max(int(np.argmax(power)), 1)


def modulating_starts(model: Model, segments: Sequence[Segment], free: Sequence[str]) -> list[FloatArray]:
    """Estimate a linear rig's parameters: from all windows, and from those with the smallest motion.

    Parameters
    ----------
    free
        Paths of the parameters to estimate; the others have the values of the model.

    Returns
    -------
    list of array
        Values [p] of `free`; none where this method determines none.
    """
    names = [p.rpartition(".")[2] for p in free if p.startswith("vehicle.rig.")]
    if model.design.kind != "rig" or model.design.rig_input == "motion" or {"mass", "gain"} <= set(names):
        return []
    values = {name: model.value(f"vehicle.rig.{name}") for name in TERMS}
    equations = [window_equations(s, model.design.rig_input, values) for s in segments]
    if not any(len(e) for e in equations):
        return []
    table = np.vstack([e for e in equations if len(e)])
    quiet = table[np.argsort(table[:, -1])[: max(2 * len(TERMS), int(QUIET_SHARE * len(table)))]]
    starts = []
    for part in (table, quiet):
        estimate = _solve(part, values, [n for n in names if n in TERMS])
        starts.append(np.array([estimate.get(p.rpartition(".")[2], model.value(p)) for p in free]))
    return starts


def window_equations(
    segment: Segment,
    rig_input: str,
    values: Mapping[str, float],
    forces: Sequence[FloatArray] = (),
    *,
    periods: float = WINDOW_PERIODS,
    margin: int = 0,
) -> FloatArray:
    """Coefficients of the terms, a constant and some forces in the equation of every window, and its rms motion.

    Parameters
    ----------
    values
        Of the terms: the gain of a base displacement is not estimated.
    forces
        Series [n] that resist the motion as the spring does.
    periods
        Length of a window in dominant periods.
    margin
        Samples that are left out at both ends.

    Returns
    -------
    array [window, len(TERMS) + 1 + len(forces) + 1]
        No window where the equations cannot be formed.
    """
    channel = next((c for c in DERIVATIVES if c in segment.columns), None)
    u = segment.columns.get("u")
    on_base = u is not None and rig_input == "base_displacement"
    length = max(MIN_WINDOW_SAMPLES, round(periods * dominant_period(segment) / segment.dt))
    last = segment.samples - length - margin
    if channel is None or last < margin or (on_base and channel != "z"):
        return np.zeros((0, len(TERMS) + len(forces) + 2))
    y, d = segment.columns[channel], DERIVATIVES[channel]
    stretch = y - values["gain"] * u if on_base and u is not None else y
    chi = _modulating_functions(length, segment.dt)
    force = -values["mass"] if rig_input == "base_acceleration" else 1.0
    count = min(MAX_WINDOWS, 2 * segment.samples // length)
    rows = []
    for a in np.unique(np.linspace(margin, last, count).astype(int)):
        at = slice(a, a + length)
        driven = 0.0 if u is None or on_base else float(force * (-1) ** d * (chi[d] @ u[at]))
        terms = [chi[2] @ y[at], -(chi[1] @ stretch[at]), chi[0] @ stretch[at], -driven]
        added = [(-1) ** d * (chi[d] @ f[at]) for f in forces]
        rows.append([*terms, chi[0].sum() if d == 0 else 0.0, *added, y[at].std()])
    return np.array(rows)


def _modulating_functions(length: int, dt: float) -> FloatArray:
    """The function (1 - x^2)^4 and its first two derivatives with respect to time [3, sample]."""
    x = np.linspace(-1.0, 1.0, length)
    chi = Polynomial([1.0, 0.0, -1.0]) ** EXPONENT
    rate = 2.0 / ((length - 1) * dt)  # dx/dt
    return np.stack([chi(x), rate * chi.deriv(1)(x), rate**2 * chi.deriv(2)(x)])


def _solve(table: FloatArray, values: Mapping[str, float], names: Sequence[str]) -> dict[str, float]:
    """Solve the equations for the terms of some names; the others have their values."""
    columns = [TERMS.index(n) for n in names if np.any(table[:, TERMS.index(n)])]
    known = [j for j in range(len(TERMS)) if j not in columns]
    right = -table[:, known] @ np.array([values[TERMS[j]] for j in known])
    a = table[:, [*columns, len(TERMS)]]
    size = np.maximum(np.linalg.norm(a, axis=0), 1e-300)
    solution = np.linalg.lstsq(a / size, right, rcond=None)[0] / size
    found = dict(zip((TERMS[j] for j in columns), solution.tolist(), strict=False))
    return {n: x if n == "gain" or x > 0 else MIN_SHARE * abs(values[n]) for n, x in found.items()}
