"""The standard job: how many nanoseconds a step of one design takes on this machine, whole and reduced."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.bench.designs import BOGIE, COACH
from railui.core import LANES, Batch, RideStatistics, Vehicles, resolve_thread_count, simd_level
from railui.ride_quality.comfort import comfort_sections, felt_acceleration
from railui.ride_quality.score import score_many
from railui.ride_quality.statistics import BLOCK_DURATION, SCORE_CHANNELS, guidance_channels
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource, resolve_track
from railui.vehicle.design_reader import parse_design
from railui.vehicle.model import Model

DESIGN_COUNT: Final = 64
SPREAD: Final = 0.10
SEED: Final = 1
REPETITIONS: Final = 5  # of which the quickest counts: the others were disturbed
SPEED: Final = 40.0  # m/s
TRACK_LENGTH: Final = 2000.0  # m
TRACK: Final = "erri_b176_high length={} seed=1"
REDUCED_TO_ZERO: Final = (
    *("contact.leading.contact_angle", "contact.trailing.contact_angle", "contact.spin_creep"),
    *("vehicle.wheelset.spin_inertia", "contact.leading.roll", "contact.trailing.roll"),
)
SPREAD_OVER: Final = ("vehicle.primary.", "vehicle.secondary.", "contact.leading.", "contact.trailing.", "contact.spin")
SPREAD_OVER_COACH: Final = ("stiffness", "damping", "conicity", "longitudinal_creep", "lateral_creep", "spin_creep")


def bogie_model(reduced: bool = False) -> Model:
    """The bogie of the standard job; reduced: without contact angle, roll, spin creep and gyroscopic moments."""
    design = parse_design(BOGIE, "standard job")
    return Model(design.with_values(dict.fromkeys(REDUCED_TO_ZERO, 0.0)) if reduced else design)


def coach_model() -> Model:
    """The coach of 17 degrees of freedom whose step stands beside that of the bogie."""
    return Model(parse_design(COACH, "standard job, coach"))


def spread_designs(model: Model, count: int = DESIGN_COUNT) -> FloatArray:
    """Rows [count, row]: suspension and contact parameters spread evenly by +/-10 %, seeded."""
    rng = np.random.default_rng(np.random.SeedSequence([SEED]))
    rows = np.tile(model.row, (count, 1))
    built = model.design.structure is not None
    chosen = [path.endswith(SPREAD_OVER_COACH) if built else path.startswith(SPREAD_OVER) for path in model.columns]
    own = [not path.startswith("effects.") for path in model.columns]
    columns = [column for column, yes, mine in zip(model.columns.values(), chosen, own, strict=True) if yes and mine]
    rows[:, columns] *= 1 + SPREAD * rng.uniform(-1, 1, (count, len(columns)))
    return rows


def standard_excitation(reduced: bool = False, length: float = TRACK_LENGTH) -> Excitation:
    """The road of the standard job, its first `length` [m]; reduced: without cross-level."""
    laid = resolve_track(TRACK.format(f"{length:g}"))
    if reduced:
        laid = TrackSource(Track(laid.track.s, laid.track.yw), f"{laid.name}, no cross-level")
    return Excitation(laid, SPEED)


@dataclass(frozen=True)
class RideJob:
    """Vehicles on a road with one step of RK4 per sample, and what is summed along it."""

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
        """Their statistics."""
        return self.vehicles.ride_statistics(
            self.batch, self.table, self.dt, 1, self.channels, self.clearance, list(self.sections.values()),
            block=self.block, jobs=jobs, wheelsets=self.wheelsets,
        )  # fmt: skip


def ride_job(model: Model, rows: FloatArray, way: Excitation, comfort: bool = True) -> RideJob:
    """Vehicles as a score needs them; without `comfort` the displacements of their wheelsets alone."""
    wheels, points = guidance_channels(model), felt_acceleration(model) if comfort else ()
    sections = comfort_sections(model, rows, way.dt) if comfort else {}
    return RideJob(
        model.vehicles(), model.batch(rows), way.table(model.wheelset_spacing(), 1), way.dt, (*wheels, *points),
        np.ascontiguousarray(rows[:, model.columns["contact.flange_clearance"]]),
        {name: np.ascontiguousarray(each) for name, each in sections.items()},
        block=round(BLOCK_DURATION / way.dt) if comfort else 0, wheelsets=len(wheels),
    )  # fmt: skip


def reduced_ride_job(rows: FloatArray) -> RideJob:
    """The bogies of the reduced job, with e_1 alone."""
    bogies = ride_job(bogie_model(reduced=True), rows, standard_excitation(reduced=True), comfort=False)
    return replace(bogies, channels=SCORE_CHANNELS[:1], wheelsets=1)


def full_job(rows: FloatArray, jobs: int) -> Callable[[], FloatArray]:
    """The whole score [n] of bogies, comfort included, one step of RK4 per sample."""
    return score_job(bogie_model(), rows, jobs)


def coach_job(rows: FloatArray, jobs: int) -> Callable[[], FloatArray]:
    """The same of coaches, comfort at three floor points."""
    return score_job(coach_model(), rows, jobs)


def score_job(model: Model, rows: FloatArray, jobs: int, length: float = TRACK_LENGTH) -> Callable[[], FloatArray]:
    """The whole score [n] of vehicles on the road of the standard job, at their worst comfort point."""
    vehicles, riding = ride_job(model, rows, standard_excitation(length=length)), model.design.riding

    def run() -> FloatArray:
        found = vehicles.run(jobs)
        e = found.displacement
        statistics = {name: found.rms[:, :, i].max(axis=1) for i, name in enumerate(vehicles.sections)}
        statistics |= {"mean_e": e[..., 0], "sd_e": e[..., 1], "flange_fractions": e[..., 2]}
        told = score_many(statistics | {"diverged": found.diverged >= 0}, riding, float(vehicles.clearance[0]))
        return told["score"]

    return run


def reduced_job(rows: FloatArray, jobs: int) -> Callable[[], FloatArray]:
    """The rms [n] of e_1 alone."""
    vehicles = reduced_ride_job(rows)

    def run() -> FloatArray:
        e = vehicles.run(jobs).displacement[:, 0]
        return np.hypot(e[:, 0], e[:, 1])

    return run


def shortest_times(
    runs: Sequence[Callable[[], object]],
    repetitions: int = REPETITIONS,
    clock: Callable[[], float] = time.perf_counter,
) -> list[float]:
    """The least time [s] of each of some runs, in turns, after one to warm up: what disturbs one disturbs all."""
    for run in runs:
        run()
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(max(1, repetitions)):
        for run, each in zip(runs, times, strict=True):
            begun = clock()
            run()
            each.append(clock() - begun)
    return [min(each) for each in times]


def run_standard_job(jobs: int | None = None, repetitions: int = REPETITIONS, designs: int = DESIGN_COUNT) -> dict[str, Any]:
    """The standard job, full, reduced and of the coach, on one thread and (`all_threads`) on all; lanes, simd, threads.

    `coach_to_bogie`: a step of the coach over one of the full job, on one thread.

    >>> sorted(bench(jobs=1, repetitions=1, designs=16))
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

    found: dict[str, Any] = {
        name: rate(alone) | {"all_threads": rate(together)}
        for name, alone, together in zip(parts, seconds[1], seconds[threads], strict=True)
    }
    found["coach_to_bogie"] = found["coach"]["ns_per_design_step"] / found["full"]["ns_per_design_step"]
    return found | {"designs": designs, "lanes": LANES, "simd": simd_level(), "threads": threads}


def as_rows(found: dict[str, Any]) -> Sequence[tuple[str, str, str, str]]:
    """The rows of a table: job, ns per design-step on one thread, designs/s on one thread and on all."""
    return [
        (
            name,
            f"{found[name]['ns_per_design_step']:.1f}",
            f"{found[name]['designs_per_second']:.0f}",
            f"{found[name]['all_threads']['designs_per_second']:.0f}",
        )
        for name in ("full", "reduced", "coach")
    ]
