"""Standard job: time per step and design on this machine, of the full and of the reduced model."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.bench.designs import BOGIE
from railui.core import LANES, Batch, RideStatistics, Vehicles, resolve_thread_count, simd_level
from railui.ride_quality.comfort import comfort_sections, felt_acceleration
from railui.ride_quality.score import score_many
from railui.ride_quality.statistics import BLOCK_DURATION, SCORE_CHANNELS, guidance_channels
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.vehicle.design_reader import parse_design
from railui.vehicle.manchester_coach import COACH
from railui.vehicle.model import Model

DESIGN_COUNT: Final = 64
RELATIVE_SPREAD: Final = 0.10
SEED: Final = 1
REPETITIONS: Final = 5  # of which the shortest counts: the others were disturbed
SPEED: Final = 40.0  # m/s
TRACK_LENGTH: Final = 2000.0  # m
TRACK: Final = "erri_b176_high length={} seed=1"
REDUCED_TO_ZERO: Final = (
    *("contact.leading.contact_angle", "contact.trailing.contact_angle", "contact.spin_creep"),
    *("vehicle.wheelset.spin_inertia", "contact.leading.roll", "contact.trailing.roll"),
)
BOGIE_SPREAD_PREFIXES: Final = (
    "vehicle.primary.",
    "vehicle.secondary.",
    "contact.leading.",
    "contact.trailing.",
    "contact.spin",
)
COACH_SPREAD_SUFFIXES: Final = ("stiffness", "damping", "conicity", "longitudinal_creep", "lateral_creep", "spin_creep")


def bogie_model(reduced: bool = False) -> Model:
    """Return the bogie; reduced: without contact angle, roll, spin creep and gyroscopic moments."""
    design = parse_design(BOGIE, "standard job")
    return Model(design.with_values(dict.fromkeys(REDUCED_TO_ZERO, 0.0)) if reduced else design)


def coach_model() -> Model:
    """Return the coach of 17 degrees of freedom."""
    return Model(parse_design(COACH, "standard job, coach"))


def spread_designs(model: Model, count: int = DESIGN_COUNT) -> FloatArray:
    """Return rows [count, row] with suspension and contact parameters drawn uniformly within +/-10 %, seeded."""
    rng = np.random.default_rng(np.random.SeedSequence([SEED]))
    rows = np.tile(model.row, (count, 1))
    is_coach = model.design.structure is not None

    def is_spread(path: str) -> bool:
        chosen = path.endswith(COACH_SPREAD_SUFFIXES) if is_coach else path.startswith(BOGIE_SPREAD_PREFIXES)
        return chosen and not path.startswith("effects.")

    columns = [column for path, column in model.columns.items() if is_spread(path)]
    rows[:, columns] *= 1 + RELATIVE_SPREAD * rng.uniform(-1, 1, (count, len(columns)))
    return rows


def standard_excitation(reduced: bool = False, length: float = TRACK_LENGTH) -> Excitation:
    """Return the track of a length [m] at the standard speed; reduced: without cross-level."""
    source = resolve_track(TRACK.format(f"{length:g}"))
    if reduced:
        source = TrackSource(Track(source.track.s, source.track.yw), f"{source.name}, no cross-level")
    return Excitation(source, SPEED)


@dataclass(frozen=True)
class RideJob:
    """Ride of vehicles on a track with one RK4 step per sample, and its statistics."""

    vehicles: Vehicles
    batch: Batch
    table: FloatArray
    dt: float
    channels: Sequence[str]
    clearance: FloatArray
    sections: Mapping[str, FloatArray]
    block: int
    wheelsets: int

    def run(self, jobs: int = 1) -> RideStatistics:
        """Simulate and return the statistics."""
        return self.vehicles.ride_statistics(
            self.batch,
            self.table,
            self.dt,
            1,
            self.channels,
            self.clearance,
            list(self.sections.values()),
            block=self.block,
            jobs=jobs,
            wheelsets=self.wheelsets,
        )


def ride_job(model: Model, rows: FloatArray, excitation: Excitation, comfort: bool = True) -> RideJob:
    """Return the ride for a score; without `comfort` with the displacements of the wheelsets alone."""
    wheelsets, points = guidance_channels(model), felt_acceleration(model) if comfort else ()
    sections = comfort_sections(model, rows, excitation.dt) if comfort else {}
    return RideJob(
        vehicles=model.vehicles(),
        batch=model.batch(rows),
        table=excitation.table(model.wheelset_spacing(), 1),
        dt=excitation.dt,
        channels=(*wheelsets, *points),
        clearance=np.ascontiguousarray(rows[:, model.columns["contact.flange_clearance"]]),
        sections={name: np.ascontiguousarray(each) for name, each in sections.items()},
        block=round(BLOCK_DURATION / excitation.dt) if comfort else 0,
        wheelsets=len(wheelsets),
    )


def reduced_ride_job(rows: FloatArray) -> RideJob:
    """Return the ride of the reduced job, with e_1 alone."""
    job = ride_job(bogie_model(reduced=True), rows, standard_excitation(reduced=True), comfort=False)
    return replace(job, channels=SCORE_CHANNELS[:1], wheelsets=1)


def full_job(rows: FloatArray, jobs: int) -> Callable[[], FloatArray]:
    """Return a function that computes the score [n] of bogies with comfort, one RK4 step per sample."""
    return score_job(bogie_model(), rows, jobs)


def coach_job(rows: FloatArray, jobs: int) -> Callable[[], FloatArray]:
    """Return a function that computes the score [n] of coaches with comfort at three floor points."""
    return score_job(coach_model(), rows, jobs)


def score_job(model: Model, rows: FloatArray, jobs: int, length: float = TRACK_LENGTH) -> Callable[[], FloatArray]:
    """Return a function that computes the score [n] of vehicles at their worst comfort point."""
    job, riding = ride_job(model, rows, standard_excitation(length=length)), model.design.riding

    def run() -> FloatArray:
        rides = job.run(jobs)
        e = rides.displacement
        statistics = {name: rides.rms[:, :, i].max(axis=1) for i, name in enumerate(job.sections)}
        statistics |= {"mean_e": e[..., 0], "sd_e": e[..., 1], "flange_fractions": e[..., 2]}
        statistics |= {"diverged": rides.diverged >= 0}
        return score_many(statistics, riding, float(job.clearance[0]))["score"]

    return run


def reduced_job(rows: FloatArray, jobs: int) -> Callable[[], FloatArray]:
    """Return a function that computes the rms [n] of e_1 alone."""
    job = reduced_ride_job(rows)

    def run() -> FloatArray:
        e = job.run(jobs).displacement[:, 0]
        return np.hypot(e[:, 0], e[:, 1])

    return run


def shortest_times(
    runs: Sequence[Callable[[], object]],
    repetitions: int = REPETITIONS,
    clock: Callable[[], float] = time.perf_counter,
) -> list[float]:
    """Return the shortest time [s] of each run, in turns after a warm-up, so that disturbances affect all alike."""
    for run in runs:
        run()
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(max(1, repetitions)):
        for run, each in zip(runs, times, strict=True):
            start = clock()
            run()
            each.append(clock() - start)
    return [min(each) for each in times]


def run_standard_job(
    jobs: int | None = None, repetitions: int = REPETITIONS, designs: int = DESIGN_COUNT
) -> dict[str, Any]:
    """Run the standard job: full, reduced and of the coach, on one thread and (`all_threads`) on all.

    `coach_to_bogie`: time of a step of the coach over that of the full job, on one thread.

    >>> sorted(run_standard_job(jobs=1, repetitions=1, designs=16))
    ['coach', 'coach_to_bogie', 'designs', 'full', 'lanes', 'reduced', 'simd', 'threads']
    """
    threads = resolve_thread_count(jobs)
    parts = {
        "full": (full_job, spread_designs(bogie_model(), designs)),
        "reduced": (reduced_job, spread_designs(bogie_model(reduced=True), designs)),
        "coach": (coach_job, spread_designs(coach_model(), designs)),
    }
    seconds = {n: shortest_times([job(rows, n) for job, rows in parts.values()], repetitions) for n in {1, threads}}
    steps = len(standard_excitation().track) - 1

    def rate(time: float) -> dict[str, float]:
        return {"ns_per_design_step": 1e9 * time / (designs * steps), "designs_per_second": designs / time}

    result: dict[str, Any] = {
        name: rate(single) | {"all_threads": rate(parallel)}
        for name, single, parallel in zip(parts, seconds[1], seconds[threads], strict=True)
    }
    result["coach_to_bogie"] = result["coach"]["ns_per_design_step"] / result["full"]["ns_per_design_step"]
    return result | {"designs": designs, "lanes": LANES, "simd": simd_level(), "threads": threads}


def as_rows(result: dict[str, Any]) -> Sequence[tuple[str, str, str, str]]:
    """Return the rows of a table: job, ns per design-step on one thread, designs/s on one thread and on all."""
    return [
        (
            name,
            f"{result[name]['ns_per_design_step']:.1f}",
            f"{result[name]['designs_per_second']:.0f}",
            f"{result[name]['all_threads']['designs_per_second']:.0f}",
        )
        for name in ("full", "reduced", "coach")
    ]
