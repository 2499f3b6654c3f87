"""Cases of a study: the excitations, vehicles and curves on which every design is evaluated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

from railui.arrays import FloatArray
from railui.memo import IdentityCache
from railui.optimisation.scenarios import apply_scenario
from railui.optimisation.study import Study
from railui.ride_quality.comfort import MIN_BLOCKS
from railui.ride_quality.statistics import BLOCK_DURATION
from railui.track import parse_spec
from railui.track.excitation import LINE_FILES, Excitation, TrackSource, is_track_file, resolve_track
from railui.vehicle.model import Model
from railui.vehicle.resolve import require_rating, resolve_model
from railui.vehicle.sampling import ParameterisedModel, draw_deviations

PARAMETER_SAMPLE_STREAM: Final = 1  # random stream of the parameter samples, combined with the seed
FRESH_SAMPLE_STREAM: Final = 3  # of those on fresh seeds, combined with the seed and the number of the set
MAX_CACHED_SEEDS: Final = 64
_OWN_SEEDS: Final = IdentityCache[int | None](MAX_CACHED_SEEDS)  # a line is built to find its seed


@dataclass(frozen=True, eq=False)
class Case:
    """Case on which designs are evaluated.

    Attributes
    ----------
    excitation : Excitation
        Track at a speed.
    vehicle : ParameterisedModel
        Vehicle of a scenario and a parameter sample; the variables of the study are its parameters.
    scenario, sample : int
        Index of the scenario and of the parameter sample.
    radius, cant_deficiency : float
        Curve for the keys of curve [m].
    """

    excitation: Excitation
    vehicle: ParameterisedModel
    scenario: int
    sample: int
    radius: float
    cant_deficiency: float


def seeds_of(study: Study, track: str, fresh: int | None = None) -> list[int | None]:
    """Return the seeds with which a track of a study is generated; None for a file without synthetic irregularities.

    The seed of a track's spec, or of the spec in a designed line, is used if the study leaves its seeds at the default.
    With `fresh` = k, return the k-th set of as many seeds that the study does not use.
    """
    own_seed = _own_seed(study, track)
    if own_seed is None:
        return [None] * len(study.cases.seed)
    seeds: list[int | None] = [own_seed] if study.cases.has_default_seed else list(study.cases.seed)
    if fresh is None:
        return seeds
    own_seeds = [_own_seed(study, each) for each in study.cases.track]
    first = 1 + max(*study.cases.seed, *(seed for seed in own_seeds if seed is not None))
    return [first + fresh * len(seeds) + i for i in range(len(seeds))]


def used_seeds(study: Study) -> list[int]:
    """Return the seeds with which the tracks of a study are generated, each once; none for files only."""
    seeds = [seed for track in study.cases.track for seed in seeds_of(study, track) if seed is not None]
    return list(dict.fromkeys(seeds))


def _own_seed(study: Study, track: str) -> int | None:
    """Return the seed in a track's spec, or in a designed line; None for a file without synthetic irregularities."""
    return _OWN_SEEDS.get(track, lambda: _read_own_seed(study, track), owner=study)


def _read_own_seed(study: Study, track: str) -> int | None:
    path = _track_path(study, track)
    if not is_track_file(path):
        return parse_spec(track).seed
    return resolve_track(path).seed if path.lower().endswith(LINE_FILES) else None


def _track_path(study: Study, track: str) -> str:
    path = study.directory / track
    return str(path) if len(track) < 400 and path.is_file() else track


def cases_of(study: Study, fresh: int | None = None, seed: int | None = None) -> list[Case]:
    """Return the cases of a study: track x speed x seed x scenario x parameter sample, in this order.

    Parameters
    ----------
    study : Study
    fresh : int, optional
        Use the set of track seeds of this index that the study does not use, and parameter samples of its own.
    seed : int, optional
        Seed of the parameter samples; that of the method by default.

    Raises
    ------
    FileProblems
        For a vehicle that cannot run on a track, and for a faulty track.
    """
    sources = _track_sources(study, fresh)
    seed = study.method.seed if seed is None else seed
    stream = [seed, PARAMETER_SAMPLE_STREAM] if fresh is None else [seed, FRESH_SAMPLE_STREAM, fresh]
    vehicles = _vehicles(study, stream)
    excitations: dict[tuple[int, float], Excitation] = {}
    curve = (study.cases.radius, study.cases.cant_deficiency)
    cases = []
    for of_track, speed in product(sources, study.cases.speed):
        for source in of_track:
            excitation = excitations.setdefault((id(source), speed), Excitation(source, speed))
            cases += [Case(excitation, vehicle, s, d, *curve) for (s, d), vehicle in vehicles.items()]
    return cases


def _track_sources(study: Study, fresh: int | None) -> list[list[TrackSource]]:
    """Return the generated or read tracks, [track][seed]; the same track and seed are the same object."""
    known: dict[tuple[str, int | None], TrackSource] = {}
    sources = []
    for track in study.cases.track:
        seeds = seeds_of(study, track, fresh)
        for seed in seeds:
            if (track, seed) not in known:
                known[track, seed] = resolve_track(_track_path(study, track), seed)
        sources.append([known[track, seed] for seed in seeds])
    return sources


def _vehicles(study: Study, stream: Sequence[int]) -> dict[tuple[int, int], ParameterisedModel]:
    paths = tuple(variable.path for variable in study.variables)
    vehicles = {}
    for s, overrides in enumerate(study.cases.scenario):
        model = resolve_model(apply_scenario(study.design, overrides))
        require_rating(model.design)
        for d, deviations in enumerate(draw_deviations(model.design, study.cases.draws, stream)):
            # what the study sets itself has no error of estimation
            own = {path: by for path, by in deviations.items() if path not in paths and path not in overrides}
            vehicles[s, d] = ParameterisedModel(model, paths, own)
    return vehicles


def has_seeds(cases: Sequence[Case]) -> bool:
    """Return True if a track has a seed or parameters are drawn: objectives vary from seed to seed."""
    return any(case.excitation.source.seed is not None or case.vehicle.deviations for case in cases)


def vehicles_of(cases: Sequence[Case], x: FloatArray) -> list[tuple[Model, FloatArray]]:
    """Return the models of a design x [variable] in all scenarios and parameter samples, each with its row [1, row]."""
    vehicles = {(case.scenario, case.sample): case.vehicle for case in cases}
    return [(vehicle.model, vehicle.rows(x[None])) for vehicle in vehicles.values()]


def case_too_short_for_n_mv(cases: Sequence[Case]) -> Case | None:
    """Return a case too short for n_mv, None if all are long enough."""
    return next((case for case in cases if case.excitation.duration < MIN_BLOCKS * BLOCK_DURATION), None)
