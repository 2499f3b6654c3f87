"""Plausibility of a line with curves: steps of the cant, and a cant at the inner rail."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from railui.arrays import FloatArray

TWIST_BASE: Final = 3.0  # m, on which the twist of a track is usually measured
MAX_TWIST: Final = 10e-3  # m/m of the cant alone; transitions are designed with 1 to 2.5 mm/m
MIN_CURVATURE: Final = 1e-4  # 1/m, of a curve


class LineWarning(NamedTuple):
    """Implausible place of a line: sample, column, message and remedy."""

    sample: int
    column: str
    message: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.column}: {self.message}, {self.remedy}"


def twist_warnings(s: FloatArray, cant: FloatArray) -> list[LineWarning]:
    """Return a warning of the steepest change of the cant [sample] in m along s [m], if no track bears it.

    >>> s = 0.5 * np.arange(200)
    >>> [str(each) for each in twist_warnings(s, np.where(s < 50.0, 0.0, 0.15))]
    ['cant: changes by 150 mm over 3 m at 50 m, put a transition there: such a twist excites the vehicle violently']
    >>> twist_warnings(s, 0.002 * s)
    []
    """
    if s.size < 2 or not np.any(cant):
        return []
    n = int(np.clip(round(TWIST_BASE / float(s[1] - s[0])), 1, s.size - 1))
    base = float(s[n] - s[0])
    change = np.abs(cant[n:] - cant[:-n])
    i = int(np.argmax(change))
    if change[i] <= MAX_TWIST * base:
        return []
    step = i + 1 + int(np.argmax(np.abs(np.diff(cant[i : i + n + 1]))))
    message = f"changes by {1e3 * change[i]:.4g} mm over {base:.3g} m at {s[step]:.6g} m"
    return [LineWarning(step, "cant", message, "put a transition there: such a twist excites the vehicle violently")]


def sign_warnings(curvature: FloatArray, cant: FloatArray) -> list[LineWarning]:
    """Return a warning if the inner rail of the curves is the higher one as a whole: curvature and cant [sample].

    >>> sign_warnings(np.array([0.0, 0.002]), np.array([0.0, 0.1]))
    []
    >>> sign_warnings(np.array([0.0, 0.002]), np.array([0.0, -0.1]))[0].message
    'the inner rail of the curves is the higher one'
    """
    if float(curvature @ cant) >= 0.0:
        return []
    first = int(np.argmax((np.abs(curvature) > MIN_CURVATURE) & (curvature * cant < 0.0)))
    remedy = "check its sign: both are positive in a right-hand curve, where the left rail is higher"
    return [LineWarning(first, "cant", "the inner rail of the curves is the higher one", remedy)]
