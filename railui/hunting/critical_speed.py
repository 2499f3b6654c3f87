"""Where linear vehicles lose their stability, many at once: critical speed, least damping, Klingel's wavelength."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.contact.conicity import klingel_wavelength
from railui.vehicle.linear import damping_ratio, eigenvalues
from railui.vehicle.model import Model

SLOWEST: Final = 1.0  # m/s from which a vehicle is looked at, whatever the range
SPACING: Final = 1.0  # m/s between two looks for a crossing, at most
CLOSE: Final = 1e-9  # m/s of a crossing
GROWS: Final = 1e-8  # 1/s, above which a root grows; a free co-ordinate has 0 and rounding
TOGETHER: Final = 16  # speeds looked at in one call


@dataclass(frozen=True)
class Critical:
    """Where a vehicle loses its stability: speed [m/s] and the root [1/s] that crosses."""

    speed: float
    root: complex

    @property
    def frequency(self) -> float:
        """Frequency [Hz] of what grows there; 0 where it does not oscillate."""
        return abs(self.root.imag) / (2 * np.pi)


def critical_speeds(
    model: Model, rows: FloatArray, highest: float, *, at_rest: bool = False, spacing: float = SPACING
) -> list[Critical | None]:
    """The lowest speed at which each of n vehicles [n, row] loses stability, None up to `highest` [m/s].

    Looked for from 1 m/s in steps of at most `spacing`, then by bisection of all at once. A vehicle that is
    unstable at 1 m/s has the speed 0; one without finite eigenvalues counts as unstable.

    >>> from railui.ride_quality.evaluation import model_of
    >>> model = model_of("designs/check_bogie.yaml")
    >>> round(critical_speeds(model, model.row[None], 90.0)[0].speed, 5)
    61.64024
    """
    grid = np.linspace(SLOWEST, max(highest, SLOWEST), max(2, int(np.ceil((highest - SLOWEST) / spacing)) + 1))
    low, high = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    open_ = np.ones(len(rows), dtype=bool)
    for k in range(0, len(grid), TOGETHER):
        here, near = np.flatnonzero(open_), grid[k : k + TOGETHER]
        if not here.size:
            break
        each = _largest(model, np.repeat(rows[here], len(near), axis=0), np.tile(near, here.size), at_rest)
        grows = ~(each.real.reshape(here.size, len(near)) <= GROWS)
        found, first = here[grows.any(axis=1)], k + grows.argmax(axis=1)[grows.any(axis=1)]
        high[found], low[found], open_[found] = grid[first], np.where(first, grid[first - 1], 0.0), False
    some = np.flatnonzero(~open_ & (low > 0))
    while some.size and np.max(high[some] - low[some]) > CLOSE:
        middle = 0.5 * (low[some] + high[some])
        grows = ~(_largest(model, rows[some], middle, at_rest).real <= GROWS)
        high[some], low[some] = np.where(grows, middle, high[some]), np.where(grows, low[some], middle)
    at = np.where(np.isfinite(high), high, highest)
    roots = _largest(model, rows, at, at_rest)
    speeds = np.where(low > 0, 0.5 * (low + high), 0.0)
    return [None if o else Critical(float(v), complex(s)) for o, v, s in zip(open_, speeds, roots, strict=True)]


def _largest(model: Model, rows: FloatArray, speeds: FloatArray, at_rest: bool) -> ComplexArray:
    return eigenvalues(model, rows, speeds, at_rest=at_rest)[:, 0]


def linear_many(model: Model, rows: FloatArray, speeds: Sequence[float]) -> dict[str, FloatArray]:
    """What a search asks of n vehicles [n, row] at once: the linear keys of `railui stability`, arrays [n].

    linear_critical_speed [m/s] (infinite where none up to the highest speed), linear_critical_frequency
    [Hz] (then NaN), linear_damping (least damping ratio over the speeds), klingel_wavelength [m] (NaN where the
    conicity is not positive).

    >>> from railui.ride_quality.evaluation import model_of
    >>> model = model_of("designs/check_bogie.yaml")
    >>> found = linear_many(model, model.row[None], [20.0, 60.0])
    >>> round(float(found["linear_damping"][0]), 4)
    0.0115
    """
    critical = critical_speeds(model, rows, max(speeds))
    each = [damping_ratio(eigenvalues(model, rows, np.full(len(rows), v))) for v in speeds]
    return {
        "linear_critical_speed": np.array([np.inf if c is None else c.speed for c in critical]),
        "linear_critical_frequency": np.array([np.nan if c is None else c.frequency for c in critical]),
        "linear_damping": np.min(each, axis=(0, 2)),
        "klingel_wavelength": np.array([klingel_of(model, row) or np.nan for row in rows]),
    }


def klingel_of(model: Model, row: FloatArray) -> float | None:
    """Klingel's wavelength [m] of one vehicle, with the mean conicity of its wheelsets."""

    def mean(key: str) -> float:
        return float(np.mean([row[i] for path, i in model.columns.items() if path.rpartition(".")[2] == key]))

    return klingel_wavelength(mean("half_gauge"), mean("rolling_radius"), mean("conicity"))
