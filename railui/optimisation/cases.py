"""The cases of a study: the roads, vehicles and curves that every design is judged on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

from railui.optimisation.scenarios import in_scenario
from railui.optimisation.study import Study
from railui.ride_quality.comfort import FEWEST_BLOCKS
from railui.ride_quality.statistics import BLOCK
from railui.track import parse_spec
from railui.track.excitation import Excitation, TrackSource, is_track_file, resolve_track
from railui.vehicle.resolve import model_of
from railui.vehicle.sampling import ParameterisedModel, draws

DRAWS = 1  # what the random numbers of a draw are keyed by, beside the seed


@dataclass(frozen=True, eq=False)
class Case:
    """One case: a road, the vehicle of a scenario and a draw, and the curve [m] for the keys of curve."""

    road: Excitation
    vehicle: ParameterisedModel
    scenario: int
    draw: int
    radius: float
    cant_deficiency: float


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
    made: dict[tuple[str, int | None], TrackSource] = {}
    laid: list[list[TrackSource]] = []
    for track in study.cases.track:
        for s in (seeds := seeds_of(study, track, fresh)):
            if (track, s) not in made:
                made[track, s] = resolve_track(_path(study, track), s)
        laid.append([made[track, s] for s in seeds])
    vehicles = _vehicles(study, study.method.seed if seed is None else seed)
    roads: dict[tuple[int, float], Excitation] = {}
    curve = (study.cases.radius, study.cases.cant_deficiency)
    found = []
    for lines, speed in product(laid, study.cases.speed):
        for line in lines:
            road = roads.setdefault((id(line), speed), Excitation(line, speed))
            found += [Case(road, vehicle, s, d, *curve) for (s, d), vehicle in vehicles.items()]
    return found


def _vehicles(study: Study, seed: int) -> dict[tuple[int, int], ParameterisedModel]:
    paths = tuple(variable.path for variable in study.variables)
    found = {}
    for s, changes in enumerate(study.cases.scenario):
        model = model_of(in_scenario(study.design, changes))
        for d, deviations in enumerate(draws(model.design, study.cases.draws, [seed, DRAWS])):
            found[s, d] = ParameterisedModel(model, paths, deviations)
    return found


def too_short(cases: Sequence[Case]) -> Case | None:
    """A case too short for n_mv, None where all are long enough."""
    return next((case for case in cases if case.road.duration < FEWEST_BLOCKS * BLOCK), None)
