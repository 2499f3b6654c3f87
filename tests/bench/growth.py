"""How the cost of a ride grows: with length, designs, degrees of freedom, effects and threads: make growth.

python -m tests.bench.growth [--write docs/growth.md]: every row that tells its peak memory in a process of its own;
processor time, the quickest of three, but wall time for threads; effects and threads as `railui bench` times them.
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

from railui.bench.benchmark_log import source_commit, processor_name
from railui.bench.costs import effect_costs, thread_scaling
from railui.bench.standard_job import SPEED, bogie_model, coach_model, spread_designs
from railui.core import simd_level
from railui.ride_quality.evaluation import excitation_of
from railui.ride_quality.statistics import ride_statistics
from railui.vehicle.design_reader import Design, load_design, parse_design
from railui.vehicle.model import Model
from tests.bench.page import write_after

HOME = Path(__file__).parents[2]
TRACK = "erri_b176_high length={} seed=1"
LENGTHS, DESIGNS = (1, 10, 100), (100, 1_000, 10_000, 100_000)
VEHICLES = {7: "cooperrider", 9: "bogie_under_coach"}
RIG = "vehicle: {rig: {mass: 95, stiffness: 1e6, damping: 2e3, gain: 1, input: force}}"
MANY, FAR = 1_000_000, 100  # designs, km: what an overnight search is asked for
NIGHT = 12.0  # h


def timed(run: Callable[[], object], times: int = 3) -> float:
    """The least processor time [s] of some runs."""
    found = []
    for _ in range(times):
        begun = time.process_time()
        run()
        found.append(time.process_time() - begun)
    return min(found)


def ridden(model: Model, count: int, length: float) -> dict[str, Any]:
    """Whole scores of `count` vehicles over `length` [m], as a search rides them."""
    begun = time.process_time()
    road = excitation_of(TRACK.format(f"{length:g}"), SPEED)
    rows = spread_designs(model, count)
    steps = model.vehicles().required_steps(model.single_batch(), SPEED, SPEED, road.dt)[0]
    road.table(model.wheelset_spacing(), steps)
    laid = time.process_time() - begun
    given = np.full(count, steps)
    run = partial(ride_statistics, model, rows, road, steps=given, jobs=1)
    seconds = timed(run, 1 if count > 20_000 else 3)
    return {
        "ns": 1e9 * seconds / (count * (len(road.track) - 1) * steps),
        "seconds": seconds,
        "laid": laid,
        "steps": steps,
    }


def rig(count: int) -> dict[str, Any]:
    """One mass on a spring, driven by a force, its series kept: a rig has no score."""
    model = Model(parse_design(RIG, "rig"))
    samples = 10_000
    table = np.zeros((2 * samples - 1, 5))
    table[:, 1], table[:, 2] = 1.0, 1e3 * np.sin(0.05 * np.arange(2 * samples - 1))
    batch = model.batch(np.tile(model.row, (count, 1)))
    run = partial(model.vehicles().simulate, batch, table, 1e-3, 1, ["z"])
    return {"ns": 1e9 * timed(run) / (count * (samples - 1)), "steps": 1}


def measure(what: str, value: Any) -> dict[str, Any]:
    """One row, in this process."""
    if what == "length":
        return ridden(bogie_model(), 64, 1000 * value)
    if what == "designs":
        return ridden(bogie_model(), value, 200)
    if what == "threads":
        return {"rows": thread_scaling(value, 256, 2000.0, 3)}
    if what == "effects":
        return {"rows": effect_costs(256, 500.0, 7)}
    if value == 1:
        return rig(64)
    models = {6: bogie_model, 17: coach_model} | {n: partial(_bundled, name) for n, name in VEHICLES.items()}
    return ridden(models[value](), 64, 1000)


def _bundled(name: str) -> Model:
    design: Design = load_design(HOME / f"designs/{name}.yaml")
    return Model(design)


def row(what: str, value: Any) -> dict[str, Any]:
    """One row, in a process of its own, with its peak memory [MB]."""
    words = [sys.executable, "-m", "tests.bench.growth", "--row", what, json.dumps(value)]
    told = subprocess.run(words, cwd=HOME, capture_output=True, text=True)
    if told.returncode:
        raise SystemExit(f"{what} {value}:\n{told.stderr}")
    print(".", end="", flush=True, file=sys.stderr)
    return {"value": value} | json.loads(told.stdout)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown, numbers to the right."""
    lines = [f"| {' | '.join(header)} |", f"| --- |{' ---: |' * (len(header) - 1)}"]
    return "\n".join([*lines, *(f"| {' | '.join(one)} |" for one in rows)])


def tables() -> Iterator[str]:
    """What the page shows, part by part."""
    start = row("start", 0)["memory"]
    yield f"A process that has read railui and nothing else takes {start:.0f} MB."
    found = [row("length", km) for km in LENGTHS]
    ns = found[-1]["ns"]
    yield "## Length: 64 bogies, whole scores, one thread"
    yield table(
        ("km", "ns per design-step", "riding [s]", "laying the track [s]", "peak memory [MB]"),
        [
            (f"{r['value']}", f"{r['ns']:.1f}", f"{r['seconds']:.2f}", f"{r['laid']:.2f}", f"{r['memory']:.0f}")
            for r in found
        ],
    )
    yield "## Designs: over 200 m, whole scores, one thread"
    found = [row("designs", n) for n in DESIGNS]
    yield table(
        ("designs", "ns per design-step", "riding [s]", "peak memory [MB]"),
        [(f"{r['value']:,}", f"{r['ns']:.1f}", f"{r['seconds']:.2f}", f"{r['memory']:.0f}") for r in found],
    )
    yield "## Degrees of freedom: 64 vehicles, 1 km, one thread"
    freedoms = {n: row("freedoms", n) for n in (1, 6, *VEHICLES, 17)}
    names = {1: "rig, series kept", 6: "bogie of the standard job", 17: "coach of the standard job"} | VEHICLES
    yield table(
        ("vehicle", "degrees of freedom", "ns per design-step", "steps per sample"),
        [(names[n], str(n), f"{r['ns']:.1f}", str(r["steps"])) for n, r in freedoms.items()],
    )
    yield "## Threads: 256 bogies, 2 km, wall time"
    found = row("threads", os.cpu_count() or 1)["rows"]
    yield table(
        ("threads", "designs/s", "times one thread"),
        [(str(r["threads"]), f"{r['designs_per_second']:.0f}", f"{r['times_one']:.2f}") for r in found],
    )
    yield "## Effects: 256 bogies with one effect each, 500 m, without comfort, one thread"
    found = row("effects", 0)["rows"]
    yield table(
        ("effect", "ns per design-step", "over none", "steps per sample"),
        [(r["effects"], f"{r['ns_per_design_step']:.1f}", f"{r['over_none']:+.1f}", str(r["steps"])) for r in found],
    )
    yield f"## {MANY:,} designs over {FAR} km"
    steps = MANY * FAR * 10_000.0
    hours = {name: each * steps * 1e-9 / 3600 for name, each in (("bogie", ns), ("coach", freedoms[17]["ns"]))}
    yield table(
        ("vehicle", "core-hours", f"cores for a night of {NIGHT:g} h"),
        [(name, f"{each:.1f}", f"{each / NIGHT:.1f}") for name, each in hours.items()],
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", type=Path, help="a page whose results are written anew")
    parser.add_argument("--row", nargs=2, help=argparse.SUPPRESS)
    told = parser.parse_args()
    if told.row:
        what, value = told.row[0], json.loads(told.row[1])
        found = measure(what, value) if what != "start" else {}
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
        print(json.dumps(found | {"memory": peak}))
        return
    head = f"{datetime.now(UTC):%Y-%m-%d}, railui at {source_commit()}, {processor_name()}, SIMD {simd_level()}."
    text = "\n\n".join([head, *tables()]) + "\n"
    print(text)
    if told.write:
        write_after(told.write, text)


if __name__ == "__main__":
    main()
