"""The cases of a study: what every design is judged on, and its numbers on all of them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from railui.core import LANES, jobs_or_all
from railui.files.results import NUMBERS, RESULTS
from railui.files.study import Study
from railui.study.measures import FEWEST_BLOCKS, n_mv, ride_value
from railui.study.model import Model
from railui.study.ride import BLOCK, model_of, statistics_many
from railui.study.road import Laid, Road, is_track_file, lay
from railui.study.score import score_many
from railui.study.varied import Varied, draws
from railui.track import parse_spec

Floats = NDArray[np.float64]

DRAWS = 1  # what the random numbers of a draw are keyed by, beside the seed
KNOWN = tuple(key for key in NUMBERS if RESULTS[key].question == "ride" or key == "linear_damping")


@dataclass(frozen=True, eq=False)
class Case:
    """One case: a road, and the vehicle of a scenario and a draw."""

    road: Road
    vehicle: Varied
    scenario: int
    draw: int


@dataclass(frozen=True, eq=False)
class Numbers:
    """Keys of the results -> values [design, case]; travelled [design, case]: the share of the way, 1 all of it."""

    values: Mapping[str, Floats]
    travelled: Floats

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which designs left the track, or could not be stepped, in any case: [design]."""
        return np.asarray(np.any(self.travelled < 1, axis=1))


def seeds_of(study: Study, track: str, fresh: int | None = None) -> list[int | None]:
    """The seeds that a track of a study is laid with; None for a file, which has none.

    A spec's own seed stands where the study leaves its seeds at the default. `fresh` k: the k-th set of
    as many seeds that the study does not use.
    """
    given: list[int | None] = list(study.cases.seed)
    if is_track_file(_path(study, track)):
        return [None] * len(given)
    own = parse_spec(track).seed
    if "seed=" in track and study.cases.seed == (0,):
        given = [own]
    if fresh is None:
        return given
    specs = [t for t in study.cases.track if not is_track_file(_path(study, t))]
    first = 1 + max([*study.cases.seed, *(parse_spec(spec).seed for spec in specs)])
    return [first + fresh * len(given) + i for i in range(len(given))]


def _path(study: Study, track: str) -> str:
    beside = study.directory / track
    return str(beside) if len(track) < 400 and beside.is_file() else track


def cases_of(study: Study, fresh: int | None = None, seed: int | None = None) -> list[Case]:
    """Track x speed x seed x scenario x draw, in this order; `fresh`: on seeds that the study does not use.

    `seed`: of the draws, that of the method where None. Raises FileProblems for a vehicle that rides no track
    and for a faulty track.
    """
    made: dict[tuple[str, int | None], Laid] = {}
    laid: list[list[Laid]] = []
    for track in study.cases.track:
        for s in (seeds := seeds_of(study, track, fresh)):
            if (track, s) not in made:
                made[track, s] = lay(_path(study, track), s)
        laid.append([made[track, s] for s in seeds])
    vehicles = _vehicles(study, study.method.seed if seed is None else seed)
    roads: dict[tuple[int, float], Road] = {}
    found = []
    for lines, speed in product(laid, study.cases.speed):
        for line in lines:
            road = roads.setdefault((id(line), speed), Road(line, speed))
            found += [Case(road, vehicle, s, d) for (s, d), vehicle in vehicles.items()]
    return found


def _vehicles(study: Study, seed: int) -> dict[tuple[int, int], Varied]:
    paths = tuple(variable.path for variable in study.variables)
    found = {}
    for s, changes in enumerate(study.cases.scenario):
        model = model_of(study.design.with_values(changes) if changes else study.design)
        for d, deviations in enumerate(draws(model.design, study.cases.draws, [seed, DRAWS])):
            found[s, d] = Varied(model, paths, deviations)
    return found


def numbers_of(cases: list[Case], x: Floats, keys: Collection[str], jobs: int | None = None) -> Numbers:
    """The keys of designs with values x [design, variable] on all cases.

    Designs ride in lanes, groups of them on threads; where there are fewer groups than threads, cases do.
    Cases that are the same are ridden once.
    """
    threads = jobs_or_all(jobs)
    groups = -(-len(x) // LANES)
    different = list({(id(case.road), id(case.vehicle)): case for case in cases}.values())

    def one(case: Case) -> tuple[dict[str, Floats], Floats]:
        return _numbers(case, x, keys, max(1, threads // outer))

    outer = min(max(1, threads // groups), len(different))
    results = _mapped(one, different, outer)
    found = {(id(c.road), id(c.vehicle)): result for c, result in zip(different, results, strict=True)}
    ordered = [found[id(case.road), id(case.vehicle)] for case in cases]
    values = {key: np.stack([result[0][key] for result in ordered], axis=1) for key in keys}
    return Numbers(values, np.stack([result[1] for result in ordered], axis=1))


def _mapped(
    one: Callable[[Case], tuple[dict[str, Floats], Floats]], cases: list[Case], threads: int
) -> list[tuple[dict[str, Floats], Floats]]:
    if threads == 1:
        return [one(case) for case in cases]
    pool = ThreadPoolExecutor(threads)
    try:
        return list(pool.map(one, cases))
    finally:
        pool.shutdown(cancel_futures=True)  # after ctrl-c nothing new begins


def _numbers(case: Case, x: Floats, keys: Collection[str], jobs: int) -> tuple[dict[str, Floats], Floats]:
    model, road = case.vehicle.model, case.road
    rows = case.vehicle.rows(x)
    found = {key: np.full(len(x), np.nan) for key in keys}
    travelled = np.zeros(len(x))
    able, steps = steppable(model, rows, road)
    if "linear_damping" in keys:
        found["linear_damping"] = linear_damping(model, rows, road.speed)
    if able.size and set(keys) - {"linear_damping"}:
        statistics = statistics_many(model, rows[able], road, steps=steps, jobs=jobs)
        start, length = road.track.s[0], road.track.length
        lost = np.isfinite(statistics["lost_at"])
        travelled[able] = np.where(lost, np.minimum((statistics["lost_at"] - start) / length, 1 - 1e-9), 1.0)
        for key, values in _scored(model, statistics, road, keys).items():
            found[key][able] = values
    else:
        travelled[able] = 1.0
    return found, travelled


def steppable(model: Model, rows: Floats, road: Road) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which rows can be stepped on a road, and their steps per sample; the others are too stiff for it."""
    vehicles = model.vehicles()

    def steps(some: Floats) -> list[int]:
        try:
            return vehicles.steps(model.batch(some), road.speed, road.speed, road.dt)
        except ValueError:
            return []

    if found := steps(rows):
        return np.arange(len(rows)), np.array(found)
    each = [(i, *steps(rows[i : i + 1])) for i in range(len(rows))]
    able = np.array([pair for pair in each if len(pair) == 2], dtype=np.int64).reshape(-1, 2)
    return able[:, 0], able[:, 1]


def _scored(model: Model, statistics: dict[str, Floats], road: Road, keys: Collection[str]) -> dict[str, Floats]:
    """Values [n] of ride keys from statistics, each vehicle against its own clearance."""
    widen = float(road.track.gauge.mean()) / 2 if model.design.gauge_widens_clearance else 0.0
    riding, clearance = model.design.riding, statistics["clearance"] + widen
    found: dict[str, Floats] = {}
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


def linear_damping(model: Model, rows: Floats, speed: float) -> Floats:
    """Damping ratio [n] of the least damped mode of linear vehicles [n, row] at a speed [m/s].

    -Re(s)/abs(s) of the eigenvalue s for which it is least, whether hunting or the frame on its springs: 0
    at the linear critical speed, negative above.

    >>> model = model_of("designs/check_bogie.yaml")
    >>> round(float(linear_damping(model, model.row[None], 60.0)[0]), 4)  # 0.34808/abs(0.34808 + 30.17447j)
    0.0115
    """
    roots = model.eigenvalues(speed, rows)
    size = np.abs(roots)
    return np.asarray(np.min(-roots.real / np.where(size > 0, size, 1.0), axis=1))


def too_short(cases: list[Case]) -> Case | None:
    """A case too short for n_mv, None where all are long enough."""
    return next((case for case in cases if case.road.duration < FEWEST_BLOCKS * BLOCK), None)
