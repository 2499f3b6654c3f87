"""What the parts of a ride cost beside the standard job: effects, comfort, a call of the kernel; what threads gain."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from railui.bench.standard_job import (
    DESIGN_COUNT,
    TRACK_LENGTH,
    REPETITIONS,
    bogie_model,
    shortest_times,
    reduced_job,
    standard_excitation,
    ride_job,
    score_job,
    spread_designs,
)
from railui.bench.step_error import effect_cases
from railui.core import LANES, resolve_thread_count
from railui.ride_quality.statistics import SCORE_CHANNELS
from railui.vehicle.model import Model

KILOMETRE: Final = 1000.0  # m, for effects: what a design costs beside its steps is below 1 ns per step there
MIDDLE: Final = 500.0  # m, for threads
GROUPS: Final = 8  # of sixteen, per thread: few enough to be quick, enough to share them evenly
PARAMETERS: Final = 15  # varied one by one beside the vehicle itself: sixteen lanes
CALLS: Final = 10  # at a time, and so many times as often as all else: what is short is easily disturbed


def costs(jobs: int | None = None, repetitions: int = REPETITIONS) -> dict[str, Any]:
    """All of them, by the names of their functions where these return rows."""
    return {
        "scaling": thread_scaling(resolve_thread_count(jobs), repetitions=repetitions),
        "effects": effect_costs(repetitions=repetitions),
        "comfort_ns_per_design_step": comfort_cost(repetitions=repetitions),
        "alone": single_design_times(repetitions=repetitions),
        **call_costs(repetitions),
    }


def thread_scaling(
    threads: int, designs: int | None = None, length: float = MIDDLE, repetitions: int = REPETITIONS
) -> list[dict[str, float]]:
    """Whole scores of bogies with every number of threads from one on: designs/s, and over those of one thread.

    >>> [row["threads"] for row in scaling(3, designs=32, length=50.0, repetitions=1)]
    [1, 2, 3]
    """
    designs = designs or GROUPS * LANES * threads
    rows = spread_designs(bogie_model(), designs)
    seconds = shortest_times([score_job(bogie_model(), rows, n, length) for n in range(1, threads + 1)], repetitions)
    return [
        {"threads": n, "designs_per_second": designs / each, "times_one": seconds[0] / each}
        for n, each in enumerate(seconds, start=1)
    ]


def effect_costs(designs: int = LANES, length: float = KILOMETRE, repetitions: int = REPETITIONS) -> list[dict[str, Any]]:
    """The bogie without effects, with each alone and with its own: ns per design-step, and over those without any.

    Without comfort, on one thread, in turns, for their differences are small; processor time. Each takes the steps per
    sample that it needs.
    """
    way, names, steps = standard_excitation(length=length), [], []
    runs: list[Callable[[], object]] = []
    for vehicle, kinds, design in effect_cases():
        if vehicle != "bogie":
            continue
        model = Model(design)
        batch = model.batch(np.tile(model.row, (designs, 1)))
        taken = model.vehicles().required_steps(model.single_batch(), way.speed, way.speed, way.dt)[0]
        table = way.table(model.wheelset_spacing(), taken)
        runs.append(partial(model.vehicles().ride_statistics, batch, table, way.dt, taken, SCORE_CHANNELS, np.full(designs, 7e-3)))
        names.append(kinds)
        steps.append(taken)
    seconds = shortest_times(runs, repetitions, time.process_time)
    samples = designs * (len(way.track) - 1)
    ns = [1e9 * each / (samples * taken) for each, taken in zip(seconds, steps, strict=True)]
    return [
        {"effects": kinds, "steps": taken, "ns_per_design_step": each, "over_none": each - ns[0]}
        for kinds, taken, each in zip(names, steps, ns, strict=True)
    ]


def comfort_cost(designs: int = DESIGN_COUNT, length: float = TRACK_LENGTH, repetitions: int = REPETITIONS) -> float:
    """What the accelerations and their comfort filters add to a ride of the full job [ns per design-step]."""
    rows, way = spread_designs(bogie_model(), designs), standard_excitation(length=length)
    whole, bare = shortest_times([ride_job(bogie_model(), rows, way, yes).run for yes in (True, False)], repetitions)
    return 1e9 * (whole - bare) / (designs * (len(way.track) - 1))


def single_design_times(length: float = TRACK_LENGTH, repetitions: int = REPETITIONS) -> dict[str, float]:
    """One design by itself on 2 km: milliseconds of the full and of the reduced job, and how many times the full one
    takes a Jacobian by differences over fifteen parameters, all sixteen side by side; on one thread.

    One after another, for that is how they are asked for: in turns they would take the track out of each other's cache.
    """

    def full(designs: int) -> Callable[[], object]:
        return score_job(bogie_model(), spread_designs(bogie_model(), designs), 1, length)

    runs = full(1), reduced_job(spread_designs(bogie_model(reduced=True), 1), 1), full(1 + PARAMETERS)
    one, reduced, all_ = (shortest_times([run], CALLS * repetitions)[0] for run in runs)
    return {"full_ms": 1e3 * one, "reduced_ms": 1e3 * reduced, "jacobian_of_15": all_ / one}


def call_costs(repetitions: int = REPETITIONS) -> dict[str, float]:
    """What a call of the kernel costs beside its steps, and what every design in it costs beside its steps [us].

    RideStatistics of one step of RK4, of one bogie and of a group of sixteen, on one thread. The line through both meets no
    designs at what is the crossing's own: arguments, a thread, results. Its slope is what makes a design ready: its
    matrices, coefficients, filters.
    """
    model, way = bogie_model(), standard_excitation(length=MIDDLE)

    def many(designs: int) -> Callable[[], object]:
        rides = ride_job(model, spread_designs(model, designs), way)
        least = replace(rides, table=np.ascontiguousarray(rides.table[:3]))
        return lambda: [least.run() for _ in range(CALLS)]

    one, group = (1e6 * each / CALLS for each in shortest_times([many(1), many(LANES)], CALLS * repetitions))
    each = (group - one) / (LANES - 1)
    return {"crossing_us_per_call": one - each, "setup_us_per_design": each}
