"""Measure how the cost of a score scales with length, designs, degrees of freedom, effects and threads.

python -m tests.bench.growth [--write docs/growth.md]

Rows with a peak memory are measured in a process of their own. Times are the least processor time of three runs, for
threads wall time; effects and threads are measured as `railui bench` does.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from railui.bench.benchmark_log import processor_name, source_commit
from railui.bench.cost_breakdown import effect_costs, thread_scaling
from railui.bench.standard_job import SPEED, bogie_model, coach_model, spread_designs
from railui.core import simd_level
from railui.ride_quality.evaluation import excitation_of
from railui.ride_quality.statistics import ride_statistics
from railui.vehicle.design_reader import load_design, parse_design
from railui.vehicle.model import Model
from tests.bench.page import write_after

ROOT = Path(__file__).parents[2]
TRACK = "erri_b176_high length={} seed=1"
LENGTHS = (1, 10, 100)  # km
DESIGN_COUNTS = (100, 1_000, 10_000, 100_000)
BUNDLED_VEHICLES = {7: "cooperrider", 9: "bogie_under_coach"}  # by degrees of freedom
RIG = "vehicle: {rig: {mass: 95, stiffness: 1e6, damping: 2e3, gain: 1, input: force}}"
LARGE_SEARCH_DESIGNS = 1_000_000
LARGE_SEARCH_LENGTH = 100  # km
STEPS_PER_KM = 10_000.0
NIGHT = 12.0  # h
MAX_REPEATED_DESIGNS = 20_000  # more designs run long enough to be timed once


def least_time(run: Callable[[], object], repetitions: int = 3) -> float:
    """Return the least processor time [s] of several runs."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def measure_scores(model: Model, count: int, length: float) -> dict[str, Any]:
    """Measure whole scores of `count` vehicles over `length` [m], as a search computes them."""
    start = time.process_time()
    excitation = excitation_of(TRACK.format(f"{length:g}"), SPEED)
    designs = spread_designs(model, count)
    steps = model.vehicles().required_steps(model.single_batch(), SPEED, SPEED, excitation.dt)[0]
    excitation.table(model.wheelset_spacing(), steps)
    preparation = time.process_time() - start
    run = partial(ride_statistics, model, designs, excitation, steps=np.full(count, steps), jobs=1)
    seconds = least_time(run, 1 if count > MAX_REPEATED_DESIGNS else 3)
    return {
        "ns": 1e9 * seconds / (count * (len(excitation.track) - 1) * steps),
        "seconds": seconds,
        "preparation": preparation,
        "steps": steps,
    }


def measure_rig(count: int) -> dict[str, Any]:
    """Measure one-mass rigs driven by a force, with their time series: a rig has no score."""
    model = Model(parse_design(RIG, "rig"))
    samples = 10_000
    inputs = np.zeros((2 * samples - 1, 5))
    inputs[:, 1], inputs[:, 2] = 1.0, 1e3 * np.sin(0.05 * np.arange(2 * samples - 1))
    batch = model.batch(np.tile(model.row, (count, 1)))
    run = partial(model.vehicles().simulate, batch, inputs, 1e-3, 1, ["z"])
    return {"ns": 1e9 * least_time(run) / (count * (samples - 1)), "steps": 1}


def measure_row(series: str, value: Any) -> dict[str, Any]:
    """Measure one row of a table in this process."""
    if series == "start":
        return {}
    if series == "length":
        return measure_scores(bogie_model(), 64, 1000 * value)
    if series == "designs":
        return measure_scores(bogie_model(), value, 200)
    if series == "threads":
        return {"rows": thread_scaling(value, 256, 2000.0, 3)}
    if series == "effects":
        return {"rows": effect_costs(256, 500.0, 7)}
    if value == 1:
        return measure_rig(64)
    models = {6: bogie_model, 17: coach_model} | {n: partial(_bundled, name) for n, name in BUNDLED_VEHICLES.items()}
    return measure_scores(models[value](), 64, 1000)


def _bundled(name: str) -> Model:
    return Model(load_design(ROOT / f"designs/{name}.yaml"))


def measure_in_process(series: str, value: Any) -> dict[str, Any]:
    """Measure one row in a process of its own, with its peak memory [MB]."""
    command = [sys.executable, "-m", "tests.bench.growth", "--row", series, json.dumps(value)]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if process.returncode:
        raise SystemExit(f"{series} {value}:\n{process.stderr}")
    print(".", end="", flush=True, file=sys.stderr)
    return {"value": value} | json.loads(process.stdout)


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table with numbers aligned to the right."""
    lines = [f"| {' | '.join(header)} |", f"| --- |{' ---: |' * (len(header) - 1)}"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def sections() -> Iterator[str]:
    """Measure and yield headings and tables in the order of the page."""
    memory = measure_in_process("start", 0)["memory"]
    yield f"A process that has only imported railui takes {memory:.0f} MB."
    lengths = [measure_in_process("length", km) for km in LENGTHS]
    yield "## Length: 64 bogies, whole scores, one thread"
    yield _length_table(lengths)
    yield "## Designs: over 200 m, whole scores, one thread"
    yield _design_table([measure_in_process("designs", n) for n in DESIGN_COUNTS])
    yield "## Degrees of freedom: 64 vehicles, 1 km, one thread"
    vehicles = {n: measure_in_process("freedoms", n) for n in (1, 6, *BUNDLED_VEHICLES, 17)}
    yield _vehicle_table(vehicles)
    yield "## Threads: 256 bogies, 2 km, wall time"
    yield _thread_table(measure_in_process("threads", os.cpu_count() or 1)["rows"])
    yield "## Effects: 256 bogies with one effect each, 500 m, without comfort, one thread"
    yield _effect_table(measure_in_process("effects", 0)["rows"])
    yield f"## {LARGE_SEARCH_DESIGNS:,} designs over {LARGE_SEARCH_LENGTH} km"
    yield _large_search_table({"bogie": lengths[-1]["ns"], "coach": vehicles[17]["ns"]})


def _length_table(rows: Sequence[dict[str, Any]]) -> str:
    cells = [
        (f"{r['value']}", f"{r['ns']:.1f}", f"{r['seconds']:.2f}", f"{r['preparation']:.2f}", f"{r['memory']:.0f}")
        for r in rows
    ]
    return markdown_table(("km", "ns per design-step", "simulation [s]", "input table [s]", "peak memory [MB]"), cells)


def _design_table(rows: Sequence[dict[str, Any]]) -> str:
    cells = [(f"{r['value']:,}", f"{r['ns']:.1f}", f"{r['seconds']:.2f}", f"{r['memory']:.0f}") for r in rows]
    return markdown_table(("designs", "ns per design-step", "simulation [s]", "peak memory [MB]"), cells)


def _vehicle_table(rows: dict[int, dict[str, Any]]) -> str:
    names = {1: "rig, with time series", 6: "bogie of the standard job", 17: "coach of the standard job"}
    names |= BUNDLED_VEHICLES
    cells = [(names[n], str(n), f"{r['ns']:.1f}", str(r["steps"])) for n, r in rows.items()]
    return markdown_table(("vehicle", "degrees of freedom", "ns per design-step", "steps per sample"), cells)


def _thread_table(rows: Sequence[dict[str, Any]]) -> str:
    cells = [(str(r["threads"]), f"{r['designs_per_second']:.0f}", f"{r['times_one']:.2f}") for r in rows]
    return markdown_table(("threads", "designs/s", "relative to one thread"), cells)


def _effect_table(rows: Sequence[dict[str, Any]]) -> str:
    cells = [(r["effects"], f"{r['ns_per_design_step']:.1f}", f"{r['over_none']:+.1f}", str(r["steps"])) for r in rows]
    return markdown_table(("effect", "ns per design-step", "added by the effect", "steps per sample"), cells)


def _large_search_table(ns_per_step: dict[str, float]) -> str:
    steps = LARGE_SEARCH_DESIGNS * LARGE_SEARCH_LENGTH * STEPS_PER_KM
    hours = {name: ns * steps * 1e-9 / 3600 for name, ns in ns_per_step.items()}
    cells = [(name, f"{x:.1f}", f"{x / NIGHT:.1f}") for name, x in hours.items()]
    return markdown_table(("vehicle", "core-hours", f"cores for a night of {NIGHT:g} h"), cells)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", type=Path, help="page whose results are replaced")
    parser.add_argument("--row", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row:
        series, value = options.row[0], json.loads(options.row[1])
        result = measure_row(series, value)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
        print(json.dumps(result | {"memory": peak}))
        return
    head = f"{datetime.now(UTC):%Y-%m-%d}, railui at {source_commit()}, {processor_name()}, SIMD {simd_level()}."
    text = "\n\n".join([head, *sections()]) + "\n"
    print(text)
    if options.write:
        write_after(options.write, text)


if __name__ == "__main__":
    main()
