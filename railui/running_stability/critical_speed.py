"""Linear critical speed, least damping and Klingel's wavelength of many vehicles at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.contact.conicity import klingel_wavelength
from railui.vehicle.linear import eigenvalues, least_damping
from railui.vehicle.model import Model
from railui.vehicle.parameter import split_path
from railui.vehicle.sampling import ParameterisedModel, draw_deviations

MIN_SPEED: Final = 1.0  # m/s from which every search begins
MAX_SPACING: Final = 1.0  # m/s between two speeds of the search
SPEED_TOLERANCE: Final = 1e-9  # m/s
MIN_GROWTH_RATE: Final = 1e-8  # 1/s above which a root counts as unstable; a rigid-body motion has 0 and rounding
SPEEDS_PER_CALL: Final = 16
COVARIANCE_DRAWS: Final = 200
COVARIANCE_SEED: Final = (1,)


@dataclass(frozen=True)
class CriticalSpeed:
    """Speed [m/s] at which a vehicle loses its stability, and the root [1/s] that crosses the imaginary axis."""

    speed: float
    root: complex

    @property
    def frequency(self) -> float:
        """Frequency [Hz] of the unstable motion; 0 without oscillation."""
        return abs(self.root.imag) / (2 * np.pi)


def critical_speeds(
    model: Model, rows: FloatArray, highest: float, *, at_rest: bool = False, spacing: float = MAX_SPACING
) -> list[CriticalSpeed | None]:
    """Compute the lowest speed at which each of n vehicles loses stability.

    The search runs from 1 m/s in steps of at most `spacing`, then bisects all vehicles at once.

    Parameters
    ----------
    model : Model
        Structure of the vehicles.
    rows : FloatArray
        Parameters [n, row].
    highest : float
        Highest speed of the search [m/s].
    at_rest : bool
        Linearise all effects about the state of rest; else only linear effects act.
    spacing : float
        Largest step of the search [m/s].

    Returns
    -------
    list of CriticalSpeed or None
        None for a vehicle that is stable up to `highest`; speed 0 for one that is unstable at 1 m/s. A vehicle without
        finite eigenvalues counts as unstable.

    Examples
    --------
    >>> from railui.vehicle.resolve import resolve_model
    >>> model = resolve_model("designs/check_bogie.yaml")
    >>> round(critical_speeds(model, model.row[None], 90.0)[0].speed, 5)
    61.64024
    """
    low, high = _bracket(model, rows, highest, at_rest, spacing)
    is_stable = np.isnan(high)
    open_ = np.flatnonzero(~is_stable & (low > 0))
    while open_.size and np.max(high[open_] - low[open_]) > SPEED_TOLERANCE:
        middle = 0.5 * (low[open_] + high[open_])
        grows = ~(_largest_roots(model, rows[open_], middle, at_rest).real <= MIN_GROWTH_RATE)
        high[open_], low[open_] = np.where(grows, middle, high[open_]), np.where(grows, low[open_], middle)
    roots = _largest_roots(model, rows, np.where(is_stable, highest, high), at_rest)
    speeds = np.where(low > 0, 0.5 * (low + high), 0.0)
    return [
        None if stable else CriticalSpeed(float(v), complex(root))
        for stable, v, root in zip(is_stable, speeds, roots, strict=True)
    ]


def critical_speed_sd(model: Model, highest: float, draws: int = COVARIANCE_DRAWS) -> float | None:
    """Standard deviation [m/s] of the linear critical speed from the covariance of estimated parameters.

    Parameters
    ----------
    model : Model
        Vehicle whose design names the covariance of its parameters.
    highest : float
        Highest speed of the search [m/s].
    draws : int
        Vehicles drawn from the covariance, by a fixed seed, of a design without samples of its own.

    Returns
    -------
    float or None
        None for a design without estimated parameters, or where a drawn vehicle is stable up to `highest`.
    """
    if model.design.adjustment is None:
        return None
    draws = len(model.design.adjustment.samples) or draws
    deviations = draw_deviations(model.design, draws, COVARIANCE_SEED)
    rows = np.concatenate([ParameterisedModel(model, (), d).rows(np.zeros((1, 0))) for d in deviations])
    speeds = [found.speed for found in critical_speeds(model, rows, highest) if found is not None]
    return float(np.std(speeds)) if len(speeds) == draws else None


def _bracket(
    model: Model, rows: FloatArray, highest: float, at_rest: bool, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Return a stable and an unstable speed [n] around each critical speed; NaN if stable, 0 if never stable."""
    count = max(2, int(np.ceil((highest - MIN_SPEED) / spacing)) + 1)
    grid = np.linspace(MIN_SPEED, max(highest, MIN_SPEED), count)
    low, high = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    for k in range(0, len(grid), SPEEDS_PER_CALL):
        open_, speeds = np.flatnonzero(np.isnan(high)), grid[k : k + SPEEDS_PER_CALL]
        if not open_.size:
            break
        all_rows = np.repeat(rows[open_], len(speeds), axis=0)
        roots = _largest_roots(model, all_rows, np.tile(speeds, open_.size), at_rest)
        grows = ~(roots.real.reshape(open_.size, len(speeds)) <= MIN_GROWTH_RATE)
        unstable, first = open_[grows.any(axis=1)], k + grows.argmax(axis=1)[grows.any(axis=1)]
        high[unstable], low[unstable] = grid[first], np.where(first, grid[first - 1], 0.0)
    return low, high


def _largest_roots(model: Model, rows: FloatArray, speeds: FloatArray, at_rest: bool) -> ComplexArray:
    """Return the eigenvalue with the largest real part of each vehicle at its speed."""
    return eigenvalues(model, rows, speeds, at_rest=at_rest)[:, 0]


def linear_stability_many(model: Model, rows: FloatArray, speeds: Sequence[float]) -> dict[str, FloatArray]:
    """Compute the linear keys of `railui stability` for n vehicles at once, as a search needs them.

    Parameters
    ----------
    model, rows
        As for `critical_speeds`.
    speeds : sequence of float
        Speeds [m/s].

    Returns
    -------
    dict of FloatArray
        Arrays [n]: linear_critical_speed [m/s] (infinite if stable up to the highest speed), linear_critical_frequency
        [Hz] (then NaN), linear_damping (least damping ratio over the speeds), klingel_wavelength [m] (NaN for a
        conicity that is not positive).

    Examples
    --------
    >>> from railui.vehicle.resolve import resolve_model
    >>> model = resolve_model("designs/check_bogie.yaml")
    >>> result = linear_stability_many(model, model.row[None], [20.0, 60.0])
    >>> round(float(result["linear_damping"][0]), 4)
    0.0115
    """
    critical = critical_speeds(model, rows, max(speeds))
    damping = [least_damping(eigenvalues(model, rows, np.full(len(rows), v))) for v in speeds]
    return {
        "linear_critical_speed": np.array([np.inf if c is None else c.speed for c in critical]),
        "linear_critical_frequency": np.array([np.nan if c is None else c.frequency for c in critical]),
        "linear_damping": np.min(damping, axis=0),
        "klingel_wavelength": np.array([klingel_wavelength_of(model, row) or np.nan for row in rows]),
    }


def klingel_wavelength_of(model: Model, row: FloatArray) -> float | None:
    """Return Klingel's wavelength [m] of one vehicle, with the mean conicity of its wheelsets."""

    def mean(key: str) -> float:
        return float(
            np.mean([row[i] for path, i in model.columns.items() if split_path(path)[1].partition(".")[0] == key])
        )

    return klingel_wavelength(mean("half_gauge"), mean("rolling_radius"), mean("conicity"))
