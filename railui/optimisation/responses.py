"""Responses of many vehicles in one case: the keys of ride, stability and curve that a study may use."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import NoResultError
from railui.curving.equilibrium import solve_equilibria
from railui.io.problems import FileProblems
from railui.memo import IdentityCache
from railui.optimisation.cases import Case
from railui.optimisation.response_keys import MAX_SPEED, RESPONSE_KEYS
from railui.ride_quality.comfort import n_mv, sperling_wz
from railui.ride_quality.running_safety import SAFETY_KEYS, running_safety_many
from railui.ride_quality.score import score_many
from railui.ride_quality.statistics import ride_statistics
from railui.running_stability.critical_speed import critical_speeds, linear_stability_many
from railui.running_stability.limit_cycles import nonlinear_critical_speeds
from railui.running_stability.summary import DEFAULT_SPEEDS, practical_critical_speed
from railui.track.excitation import Excitation
from railui.vehicle.linear import eigenvalues, least_damping
from railui.vehicle.model import Model

Analysis = Callable[[Case, FloatArray, Collection[str], int], "Responses"]
RowsAndSteps = tuple[NDArray[np.int64], NDArray[np.int64]]

# reasons of failure, which are keys of `failures` in the result
DIVERGED: Final = "left the track"
TOO_STIFF: Final = "too stiff to be stepped"
NO_EQUILIBRIUM: Final = "no equilibrium in the curve"

LINEAR_KEYS: Final = {"linear_critical_speed", "linear_critical_frequency", "klingel_wavelength"}
NONLINEAR_KEYS: Final = {"fold_speed", "practical_critical_speed"}
_STEPS = IdentityCache[RowsAndSteps](max_size=64)  # tracks and seeds of a study share them


@dataclass(frozen=True, eq=False)
class Responses:
    """Responses of n vehicles in one case.

    Attributes
    ----------
    values : dict of str to float [n]
        Values by key.
    distance_share : float [n]
        Completed share of the track; 1 unless the vehicle failed.
    reasons : list of str [n]
        Reason of failure; empty for a vehicle that did not fail.
    """

    values: dict[str, FloatArray]
    distance_share: FloatArray
    reasons: list[str]

    @classmethod
    def failed(cls, count: int, keys: Collection[str], reason: str) -> Responses:
        """Return the responses of vehicles that all failed for a reason."""
        return cls({key: np.full(count, np.nan) for key in keys}, np.zeros(count), [reason] * count)


def evaluate_case(case: Case, rows: FloatArray, keys: Collection[str], jobs: int = 1) -> Responses:
    """Evaluate keys for many vehicles in one case; each analysis runs once.

    The result of a vehicle does not depend on the other rows.

    Parameters
    ----------
    case : Case
    rows : float [n, row]
        Kernel rows of the vehicles.
    keys : collection of str
        Numeric keys of `RESPONSE_KEYS`.
    jobs : int
        Number of threads.

    Raises
    ------
    NoResultError
        For the numbers of a vehicle for which an analysis has no result.
    ValueError
        For a key that cannot be evaluated for any vehicle.
    """
    result = Responses({}, np.ones(len(rows)), [""] * len(rows))
    for analysis, evaluate in ANALYSES.items():
        own_keys = [key for key in keys if RESPONSE_KEYS[key].analysis == analysis]
        if own_keys:
            part = evaluate(case, rows, own_keys, jobs)
            result.values.update(part.values)
            np.minimum(result.distance_share, part.distance_share, out=result.distance_share)
            result.reasons[:] = [a or b for a, b in zip(result.reasons, part.reasons, strict=True)]
    return result


def ride_responses(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> Responses:
    """Evaluate keys of ride on the case's excitation."""
    model, excitation = case.vehicle.model, case.excitation
    result = Responses.failed(len(rows), keys, TOO_STIFF)
    integrable, steps = integrable_rows(model, rows, excitation)
    if not integrable.size:
        return result
    statistics = ride_statistics(model, rows[integrable], excitation, steps=steps, jobs=jobs)
    start, length = excitation.track.s[0], excitation.track.length
    diverged_at = statistics["lost_at"]
    has_diverged = np.isfinite(diverged_at)
    share = np.minimum((diverged_at - start) / length, 1 - 1e-9)
    result.distance_share[integrable] = np.where(has_diverged, share, 1.0)
    for i, failed in zip(integrable, has_diverged, strict=True):
        result.reasons[i] = DIVERGED if failed else ""
    for key, values in _ride_values(model, statistics, keys).items():
        result.values[key][integrable] = values
    if asked := set(keys) & set(SAFETY_KEYS):
        for key, values in _safety_values(model, rows[integrable], excitation, steps, asked, jobs).items():
            result.values[key][integrable] = values
    return result


def integrable_rows(model: Model, rows: FloatArray, excitation: Excitation) -> RowsAndSteps:
    """Return the indices of rows that can be integrated on a track, and their time steps per track sample.

    The other rows are too stiff for the greatest number of steps.
    """
    key = (excitation.speed, excitation.dt, rows.tobytes())
    return _STEPS.get(key, lambda: _count_steps(model, rows, excitation), owner=model)


def _count_steps(model: Model, rows: FloatArray, excitation: Excitation) -> RowsAndSteps:
    vehicles = model.vehicles()

    def steps(some: FloatArray) -> list[int]:
        try:
            return vehicles.required_steps(model.batch(some), excitation.speed, excitation.speed, excitation.dt)
        except NoResultError:
            return []

    if all_steps := steps(rows):
        return np.arange(len(rows)), np.array(all_steps)
    row_steps = [(i, *steps(rows[i : i + 1])) for i in range(len(rows))]
    integrable = np.array([pair for pair in row_steps if len(pair) == 2], dtype=np.int64).reshape(-1, 2)
    return integrable[:, 0], integrable[:, 1]


def _ride_values(model: Model, statistics: dict[str, FloatArray], keys: Collection[str]) -> dict[str, FloatArray]:
    """Return values [n] of ride keys from statistics, each vehicle scored with its own flange clearance."""
    clearances = statistics["clearance"]
    values: dict[str, FloatArray] = {}
    for clearance in np.unique(clearances):
        index = np.flatnonzero(clearances == clearance)
        part = {name: column[index] for name, column in statistics.items()}
        scores = score_many(part, model.design.riding, float(clearance))
        for key in set(keys) & set(scores):
            values.setdefault(key, np.zeros(len(clearances)))[index] = scores[key]
    if "flange_fractions" in keys:
        values["flange_fractions"] = statistics["flange_fractions"].max(axis=1)
    if "wz" in keys:
        values["wz"] = sperling_wz(statistics["wz"])
    if "n_mv" in keys:
        indices = (n_mv(blocks) for blocks in statistics["block_rms"])
        values["n_mv"] = np.array([np.nan if value is None else value for value in indices])
    return values


def _safety_values(
    model: Model,
    rows: FloatArray,
    excitation: Excitation,
    steps: NDArray[np.int64],
    keys: Collection[str],
    jobs: int,
) -> dict[str, FloatArray]:
    """Return measures of running safety [n]; inf for a vehicle that leaves the track, NaN where one is undefined."""
    vehicles = _vehicles(model, rows)
    measures = [
        dict.fromkeys(keys, np.inf) if safety is None else safety.measures()
        for safety in running_safety_many(vehicles, excitation, steps, jobs)
    ]
    return {key: np.array([np.nan if each[key] is None else each[key] for each in measures]) for key in keys}


def _vehicles(model: Model, rows: FloatArray) -> list[Model]:
    """Return the vehicles with these rows; NoResultError for numbers that no design may have."""
    try:
        return [model.with_row(row) for row in rows]
    except FileProblems as error:
        problem = error.problems[0]
        raise NoResultError(f"{problem.key}: {problem.message}") from None


def stability_responses(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> Responses:
    """Evaluate keys of stability; a critical speed above `MAX_SPEED` counts as `MAX_SPEED`.

    linear_damping is that at the case's speed, practical_critical_speed that on the case's track.
    """
    model, asked = case.vehicle.model, set(keys)
    values: dict[str, FloatArray] = {}
    if "linear_damping" in asked:
        values["linear_damping"] = linear_damping(model, rows, case.excitation.speed)
    if asked & LINEAR_KEYS:
        linear = linear_stability_many(model, rows, [MAX_SPEED])
        linear["linear_critical_speed"] = np.minimum(linear["linear_critical_speed"], MAX_SPEED)
        values |= {key: linear[key] for key in asked & LINEAR_KEYS}
    if "rest_critical_speed" in asked:
        rest = critical_speeds(model, rows, MAX_SPEED, at_rest=True)
        values["rest_critical_speed"] = np.array([MAX_SPEED if c is None else c.speed for c in rest])
    if asked & NONLINEAR_KEYS:
        values |= _nonlinear_speeds(case, rows, asked & NONLINEAR_KEYS, jobs)
    return Responses(values, np.ones(len(rows)), [""] * len(rows))


def _nonlinear_speeds(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> dict[str, FloatArray]:
    """Return the critical speeds [n] that are computed vehicle by vehicle."""
    model = case.vehicle.model
    models = _vehicles(model, rows)
    values: dict[str, FloatArray] = {}
    if "fold_speed" in keys:
        values["fold_speed"] = np.nan_to_num(nonlinear_critical_speeds(models, DEFAULT_SPEEDS, jobs), nan=MAX_SPEED)
    if "practical_critical_speed" in keys:
        source = case.excitation.source
        found = [practical_critical_speed(vehicle, source, DEFAULT_SPEEDS, jobs) for vehicle in models]
        values["practical_critical_speed"] = np.array([_practical_speed(each) for each in found])
    return values


def _practical_speed(found: Mapping[str, Any]) -> float:
    """Return a speed limit by ride criteria [m/s]: `MAX_SPEED` without a limit, 0 without an admissible speed."""
    if found["speed"] is not None:
        return float(found["speed"])
    return MAX_SPEED if found["decided_by"] is None else 0.0


def linear_damping(model: Model, rows: FloatArray, speed: float) -> FloatArray:
    """Return the damping ratio [n] of the least damped mode of linear vehicles [n, row] at a speed [m/s].

    The mode may be hunting or a mode of the bogie frame. The ratio is 0 at the linear critical speed and negative
    above it.

    >>> from railui.vehicle.resolve import resolve_model
    >>> model = resolve_model("designs/check_bogie.yaml")
    >>> round(float(linear_damping(model, model.row[None], 60.0)[0]), 4)  # 0.34808/abs(0.34808 + 30.17447j)
    0.0115
    """
    return least_damping(eigenvalues(model, rows, np.full(len(rows), speed)))


def curve_responses(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> Responses:
    """Evaluate keys of the equilibrium in the case's curve; of several wheelsets the largest magnitude counts."""
    n = len(rows)
    equilibria = solve_equilibria(case.vehicle.model, rows, np.full(n, case.radius), np.full(n, case.cant_deficiency))
    has_equilibrium = np.isfinite(equilibria.wear_number)
    arrays = {key: getattr(equilibria, key) for key in keys}
    values = {key: np.abs(x).max(axis=1) if RESPONSE_KEYS[key].is_list else x for key, x in arrays.items()}
    reasons = ["" if exists else NO_EQUILIBRIUM for exists in has_equilibrium]
    return Responses(values, np.where(has_equilibrium, 1.0, 0.0), reasons)


ANALYSES: dict[str, Analysis] = {
    "ride": ride_responses,
    "stability": stability_responses,
    "curve": curve_responses,
}
