"""What the questions ride, stability and curve answer of many vehicles of one case: the keys that a study may name."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.curving import solve_equilibria
from railui.hunting.critical_speed import linear_many
from railui.hunting.limit_cycles import nonlinear_critical_speeds
from railui.hunting.summary import SPEEDS, practical_critical_speed
from railui.optimisation.cases import Case
from railui.optimisation.response_keys import RESULTS
from railui.ride_quality.comfort import n_mv, ride_value
from railui.ride_quality.score import score_many
from railui.ride_quality.statistics import statistics_many
from railui.track.excitation import Excitation
from railui.vehicle.linear import damping_ratio, eigenvalues
from railui.vehicle.model import Model

Answer = Callable[[Case, FloatArray, Collection[str], int], "Responses"]

DIVERGED: Final = "left the track"
STIFF: Final = "too stiff to be stepped"
UNHELD: Final = "no equilibrium in the curve"
HIGHEST: Final = SPEEDS[-1]  # m/s up to which critical speeds are looked for
LINEAR: Final = {"linear_critical_speed", "linear_critical_frequency", "klingel_wavelength"}
MOST_STEPPABLE: Final = 64  # pieces of work of which the steps are remembered
_STEPPABLE: dict[tuple[int, float, float, bytes], tuple[Model, NDArray[np.int64], NDArray[np.int64]]] = {}
EACH: Final = {"fold_speed", "practical_critical_speed"}


@dataclass(frozen=True, eq=False)
class Responses:
    """Numbers of n vehicles: values [n] by key, travelled [n] (the share of the way, 1 all of it), reasons [n].

    A reason says why a vehicle failed; it is empty where it did not.
    """

    values: dict[str, FloatArray]
    travelled: FloatArray
    reasons: list[str]

    @classmethod
    def failed(cls, count: int, keys: Collection[str], reason: str) -> Responses:
        """Vehicles of which nothing is known but why."""
        return cls({key: np.full(count, np.nan) for key in keys}, np.zeros(count), [reason] * count)


def evaluate_case(case: Case, rows: FloatArray, keys: Collection[str], jobs: int = 1) -> Responses:
    """The keys of vehicles, rows [n, row], of one case; each question is asked once.

    A vehicle's digits depend on nothing but itself. Raises ValueError for what cannot be asked of any vehicle.
    """
    found = Responses({}, np.ones(len(rows)), [""] * len(rows))
    for question, answer in RESPONSES.items():
        asked = [key for key in keys if RESULTS[key].question == question]
        if asked:
            one = answer(case, rows, asked, jobs)
            found.values.update(one.values)
            np.minimum(found.travelled, one.travelled, out=found.travelled)
            found.reasons[:] = [a or b for a, b in zip(found.reasons, one.reasons, strict=True)]
    return found


def ride_answers(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> Responses:
    """Riding quality on the case's road."""
    model, road = case.vehicle.model, case.road
    found = Responses.failed(len(rows), keys, STIFF)
    able, steps = steppable(model, rows, road)
    if able.size:
        statistics = statistics_many(model, rows[able], road, steps=steps, jobs=jobs)
        start, length = road.track.s[0], road.track.length
        lost = np.isfinite(statistics["lost_at"])
        share = np.minimum((statistics["lost_at"] - start) / length, 1 - 1e-9)
        found.travelled[able] = np.where(lost, share, 1.0)
        for i, gone in zip(able, lost, strict=True):
            found.reasons[i] = DIVERGED if gone else ""
        for key, values in _scored(model, statistics, road, keys).items():
            found.values[key][able] = values
    return found


def steppable(model: Model, rows: FloatArray, road: Excitation) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which rows can be stepped on a road, and their steps per sample; the others are too stiff for it."""
    key = (id(model), road.speed, road.dt, rows.tobytes())
    known = _STEPPABLE.get(key)  # tracks and seeds ask the same
    if known is None or known[0] is not model:
        known = _STEPPABLE[key] = (model, *_steppable(model, rows, road))
        for oldest in list(_STEPPABLE)[:-MOST_STEPPABLE]:
            _STEPPABLE.pop(oldest, None)
    return known[1:]


def _steppable(model: Model, rows: FloatArray, road: Excitation) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    vehicles = model.vehicles()

    def steps(some: FloatArray) -> list[int]:
        try:
            return vehicles.steps(model.batch(some), road.speed, road.speed, road.dt)
        except ValueError:
            return []

    if found := steps(rows):
        return np.arange(len(rows)), np.array(found)
    each = [(i, *steps(rows[i : i + 1])) for i in range(len(rows))]
    able = np.array([pair for pair in each if len(pair) == 2], dtype=np.int64).reshape(-1, 2)
    return able[:, 0], able[:, 1]


def _scored(
    model: Model, statistics: dict[str, FloatArray], road: Excitation, keys: Collection[str]
) -> dict[str, FloatArray]:
    """Values [n] of ride keys from statistics, each vehicle against its own clearance."""
    widen = float(road.track.gauge.mean()) / 2 if model.design.gauge_widens_clearance else 0.0
    riding, clearance = model.design.riding, statistics["clearance"] + widen
    found: dict[str, FloatArray] = {}
    for c in np.unique(clearance):
        here = np.flatnonzero(clearance == c)
        scored = score_many({name: values[here] for name, values in statistics.items()}, riding, float(c))
        for key in set(keys) & set(scored):
            found.setdefault(key, np.zeros(len(clearance)))[here] = scored[key]
    if "flange_fractions" in keys:
        found["flange_fractions"] = statistics["flange_fractions"].max(axis=1)
    if "wz" in keys:
        found["wz"] = ride_value(statistics["wz"])
    if "n_mv" in keys:
        blocks = (n_mv(one) for one in statistics["block_rms"])
        found["n_mv"] = np.array([np.nan if value is None else value for value in blocks])
    return found


def stability_answers(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> Responses:
    """Stability: linear_damping at the case's speed, critical speeds up to 90 m/s, which stands for none.

    The critical speed in practice is that of the case's track.
    """
    model, asked, found = case.vehicle.model, set(keys), dict[str, FloatArray]()
    if "linear_damping" in asked:
        found["linear_damping"] = linear_damping(model, rows, case.road.speed)
    if asked & LINEAR:
        linear = linear_many(model, rows, [HIGHEST])
        linear["linear_critical_speed"] = np.minimum(linear["linear_critical_speed"], HIGHEST)
        found |= {key: linear[key] for key in asked & LINEAR}
    if asked & EACH:
        found |= _one_by_one(case, rows, asked & EACH, jobs)
    return Responses(found, np.ones(len(rows)), [""] * len(rows))


def _one_by_one(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> dict[str, FloatArray]:
    """What is followed vehicle by vehicle: the fold, and the critical speed in practice on the case's track."""
    model = case.vehicle.model
    models = [model.with_row(list(model.columns), row) for row in rows]
    found: dict[str, FloatArray] = {}
    if "fold_speed" in keys:
        found["fold_speed"] = np.nan_to_num(nonlinear_critical_speeds(models, SPEEDS, jobs), nan=HIGHEST)
    if "practical_critical_speed" in keys:
        speeds = [practical_critical_speed(one, case.road.laid, SPEEDS, jobs)["speed"] for one in models]
        found["practical_critical_speed"] = np.array([HIGHEST if speed is None else speed for speed in speeds])
    return found


def linear_damping(model: Model, rows: FloatArray, speed: float) -> FloatArray:
    """Damping ratio [n] of the least damped mode of linear vehicles [n, row] at a speed [m/s].

    Whether hunting or the frame on its springs: 0 at the linear critical speed, negative above.

    >>> from railui.ride_quality.evaluation import model_of
    >>> model = model_of("designs/check_bogie.yaml")
    >>> round(float(linear_damping(model, model.row[None], 60.0)[0]), 4)  # 0.34808/abs(0.34808 + 30.17447j)
    0.0115
    """
    return np.asarray(damping_ratio(eigenvalues(model, rows, np.full(len(rows), speed))).min(axis=1))


def curve_answers(case: Case, rows: FloatArray, keys: Collection[str], jobs: int) -> Responses:
    """Where vehicles stand in the case's curve; of several wheelsets the largest magnitude counts."""
    n = len(rows)
    stands = solve_equilibria(case.vehicle.model, rows, np.full(n, case.radius), np.full(n, case.cant_deficiency))
    stood = np.isfinite(stands.wear_number)
    told = {key: getattr(stands, key) for key in keys}
    values = {key: np.abs(x).max(axis=1) if RESULTS[key].many else x for key, x in told.items()}
    return Responses(values, np.where(stood, 1.0, 0.0), ["" if yes else UNHELD for yes in stood])


# a question answers its keys of many vehicles of one case
RESPONSES: dict[str, Answer] = {"ride": ride_answers, "stability": stability_answers, "curve": curve_answers}
