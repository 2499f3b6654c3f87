"""Cost breakdown of the standard job: effects, comfort filters, calls of the kernel, and scaling with threads."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.bench.standard_job import (
    DESIGN_COUNT,
    REPETITIONS,
    TRACK_LENGTH,
    bogie_model,
    reduced_job,
    ride_job,
    score_job,
    shortest_times,
    spread_designs,
    standard_excitation,
)
from railui.bench.step_error import effect_cases
from railui.core import LANES, resolve_thread_count
from railui.ride_quality.statistics import SCORE_CHANNELS
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model

EFFECTS_LENGTH: Final = 1000.0  # m: the cost of a design apart from its steps is below 1 ns per step
THREADS_LENGTH: Final = 500.0  # m
BUNDLED: Final = Path(__file__).parents[1] / "designs"
GROUPS_PER_THREAD: Final = 8  # SIMD batches: few enough to be quick, enough to balance the threads
PARAMETER_COUNT: Final = 15  # perturbed one by one, with the vehicle itself one SIMD batch of sixteen
CALLS: Final = 10  # per timing, and factor of the repetitions: short runs are easily disturbed


def costs(jobs: int | None = None, repetitions: int = REPETITIONS) -> dict[str, Any]:
    """Measure all parts; keys of `railui bench`."""
    return {
        "scaling": thread_scaling(resolve_thread_count(jobs), repetitions=repetitions),
        "effects": effect_costs(repetitions=repetitions),
        "forms": bundled_forms(),
        "comfort_ns_per_design_step": comfort_cost(repetitions=repetitions),
        "alone": single_design_times(repetitions=repetitions),
        **call_costs(repetitions),
    }


def thread_scaling(
    threads: int, designs: int | None = None, length: float = THREADS_LENGTH, repetitions: int = REPETITIONS
) -> list[dict[str, float]]:
    """Measure scores of bogies with every number of threads from one: designs/s, and the ratio to one thread.

    >>> [row["threads"] for row in thread_scaling(3, designs=32, length=50.0, repetitions=1)]
    [1, 2, 3]
    """
    designs = designs or GROUPS_PER_THREAD * LANES * threads
    rows = spread_designs(bogie_model(), designs)
    seconds = shortest_times([score_job(bogie_model(), rows, n, length) for n in range(1, threads + 1)], repetitions)
    return [
        {"threads": n, "designs_per_second": designs / each, "times_one": seconds[0] / each}
        for n, each in enumerate(seconds, start=1)
    ]


def effect_costs(
    designs: int = LANES, length: float = EFFECTS_LENGTH, repetitions: int = REPETITIONS
) -> list[dict[str, Any]]:
    """Measure the bogie without effects, with each alone and with its own: ns per design-step, and the difference.

    Without comfort filters, on one thread, in turns because the differences are small; processor time. Each bogie takes
    the steps per sample that it requires.
    """
    excitation = standard_excitation(length=length)
    names, steps = [], []
    runs: list[Callable[[], object]] = []
    for vehicle, kinds, design in effect_cases():
        if vehicle != "bogie":
            continue
        model = Model(design)
        batch = model.batch(np.tile(model.row, (designs, 1)))
        taken = model.vehicles().required_steps(
            model.single_batch(), excitation.speed, excitation.speed, excitation.dt
        )[0]
        table = excitation.table(model.wheelset_spacing(), taken)
        clearance = np.full(designs, 7e-3)
        vehicles = model.vehicles()
        runs.append(partial(vehicles.ride_statistics, batch, table, excitation.dt, taken, SCORE_CHANNELS, clearance))
        names.append(kinds)
        steps.append(taken)
    seconds = shortest_times(runs, repetitions, time.process_time)
    samples = designs * (len(excitation.track) - 1)
    ns = [1e9 * each / (samples * taken) for each, taken in zip(seconds, steps, strict=True)]
    return [
        {"effects": kinds, "steps": taken, "ns_per_design_step": each, "over_none": each - ns[0]}
        for kinds, taken, each in zip(names, steps, ns, strict=True)
    ]


def bundled_forms() -> dict[str, str]:
    """Return the form of the kernel's rate of change that each bundled vehicle takes on a track with cross-level.

    >>> bundled_forms()["test_bogie.yaml"] in ("bogie", "general")
    True
    """
    models = {path.name: Model(load_design(path)) for path in sorted(BUNDLED.glob("*.yaml"))}
    return {name: model.vehicles().form(model.single_batch()) for name, model in models.items()}


def comfort_cost(designs: int = DESIGN_COUNT, length: float = TRACK_LENGTH, repetitions: int = REPETITIONS) -> float:
    """Measure the cost of accelerations and their comfort filters in the full job [ns per design-step]."""
    rows, excitation = spread_designs(bogie_model(), designs), standard_excitation(length=length)
    whole, bare = shortest_times(
        [ride_job(bogie_model(), rows, excitation, yes).run for yes in (True, False)], repetitions
    )
    return 1e9 * (whole - bare) / (designs * (len(excitation.track) - 1))


def single_design_times(length: float = TRACK_LENGTH, repetitions: int = REPETITIONS) -> dict[str, float]:
    """Measure one design on 2 km, on one thread: milliseconds of the full and the reduced job, cost of a Jacobian.

    `jacobian_of_15`: a Jacobian by differences over fifteen parameters, one SIMD batch, over the full job. One after
    another, as they are used: in turns they would evict the track from each other's cache.
    """

    def full(designs: int) -> Callable[[], object]:
        return score_job(bogie_model(), spread_designs(bogie_model(), designs), 1, length)

    runs = full(1), reduced_job(spread_designs(bogie_model(reduced=True), 1), 1), full(1 + PARAMETER_COUNT)
    single, reduced, jacobian = (shortest_times([run], CALLS * repetitions)[0] for run in runs)
    return {"full_ms": 1e3 * single, "reduced_ms": 1e3 * reduced, "jacobian_of_15": jacobian / single}


def call_costs(repetitions: int = REPETITIONS) -> dict[str, float]:
    """Measure the costs of a call of the kernel and of a design apart from its steps [us].

    Rides of one RK4 step, of one bogie and of one SIMD batch, on one thread. The intercept of the line through both is
    the cost of a call: arguments, a thread, results; the slope is the setup of a design: matrices,
    coefficients, filters.
    """
    model, excitation = bogie_model(), standard_excitation(length=THREADS_LENGTH)

    def many(designs: int) -> Callable[[], object]:
        job = ride_job(model, spread_designs(model, designs), excitation)
        one_step = replace(job, table=np.ascontiguousarray(job.table[:3]))
        return lambda: [one_step.run() for _ in range(CALLS)]

    single, batch = (1e6 * each / CALLS for each in shortest_times([many(1), many(LANES)], CALLS * repetitions))
    setup = (batch - single) / (LANES - 1)
    return {"crossing_us_per_call": single - setup, "setup_us_per_design": setup}
