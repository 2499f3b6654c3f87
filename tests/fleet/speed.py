"""Processor time of the quick path on runs of several lengths, and of a full loop on eight runs of 15 s.

python -m tests.fleet.speed --write docs/fleet.md
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from railui.campaign.segment import Segment
from railui.fleet.fleet_file import Fleet, load_fleet
from railui.fleet.quick_path import Watch, summarise_run
from railui.fleet.reference import make_reference, watched_candidates
from railui.planning.planned_runs import planned_runs, simulate_runs
from railui.progress import SILENT
from railui.report.fleet.loops import run_loop
from railui.vehicle.model import Model
from tests.fleet.simulate import fleet_text, order_of
from tests.truth.campaign import DECLARED
from tests.truth.files import NOISE, UNITS, design, write_run
from tests.truth.fleet import Fault, FleetOrder, fleet_runs

LENGTHS = (12.0, 30.0, 120.0)  # s
REPETITIONS = 3
MARK = "<!-- speed"
FAULTS = {
    "sound vehicle": (),
    "clearance of 0.4 mm": (Fault(0, "clearance", 4e-4, onset=-200.0, wheelset=1),),
}


def made_fleet(folder: Path) -> Fleet:
    """Return a fleet of the trial's kind."""
    (folder / "vehicle.yaml").write_text(design(DECLARED))
    (folder / "fleet.yaml").write_text(fleet_text(order_of(1, 2, 30, 7, 0), "pattern: 'runs/{vehicle}/{time}.csv.gz'"))
    return load_fleet(folder / "fleet.yaml")


def made_run(fleet: Fleet, seconds: float, seed: int) -> Segment:
    """Return a run of the nominal vehicle with noise on its channels."""
    vehicle_type = fleet.types["bogie"]
    channels = ("ay1", "ay2", "ayf", "rf", "d1", "d2")
    runs = planned_runs([36.0], [f"erri_b176_low seed={seed}"], seconds)
    segment = simulate_runs(vehicle_type.campaign, Model(vehicle_type.campaign.design), runs, channels).segments[0]
    rng = np.random.default_rng(seed)
    noisy = {c: segment.columns[c] + NOISE[c][0] * rng.standard_normal(segment.samples) for c in channels}
    return replace(segment, columns={**segment.columns, **noisy}, tables={})


def quick_path_seconds(fleet: Fleet) -> dict[str, float]:
    """Return the processor time [s] of the quick path by the length of the run."""
    vehicle = next(iter(fleet.vehicles.values()))
    reference = make_reference(vehicle, [made_run(fleet, 12.0, seed) for seed in (1, 2, 3)])
    spent = {}
    for seconds in LENGTHS:
        segment = made_run(fleet, seconds, 9)
        watch = Watch(tuple(watched_candidates(vehicle, segment)))
        times = []
        for _ in range(REPETITIONS):
            started = time.process_time()
            summarise_run(vehicle, reference, watch, fleet.settings, replace(segment, tables={}))
            times.append(time.process_time() - started)
        spent[f"quick path, a run of {seconds:g} s"] = min(times)
    return spent


def loop_seconds(fleet: Fleet, folder: Path) -> dict[str, float]:
    """Return the processor time [s] of full loops on 8 runs of 15 s: reading, loop and report, on one thread."""
    spent = {}
    for name, faults in FAULTS.items():
        order = FleetOrder(1, 8, 1, 7, seconds=15.0, faults=faults, track_faults=False)
        files = []
        for run in fleet_runs(order):
            files.append(str(folder / f"{name}_{run.day}.csv.gz".replace(" ", "_")))
            write_run(Path(files[-1]), run.columns, UNITS)
        started = time.process_time()
        run_loop(fleet.types["bogie"].campaign, "v01", files, folder / name, 0, 1, SILENT)
        spent[f"full loop, 8 runs of 15 s, {name}"] = time.process_time() - started
    return spent


def measure() -> list[str]:
    """Return the table of processor times."""
    lines = [
        "| task, 6 channels | processor time | per hour on one core | 2,000 on 16 cores |",
        "| --- | ---: | ---: | ---: |",
    ]
    with tempfile.TemporaryDirectory() as scratch:
        fleet = made_fleet(Path(scratch))
        for name, spent in (quick_path_seconds(fleet) | loop_seconds(fleet, Path(scratch))).items():
            night = 2000.0 * spent / 16.0
            scaled = f"{night:.0f} s" if night < 600.0 else f"{night / 3600.0:.1f} h"
            lines.append(f"| {name} | {spent:.3g} s | {3600.0 / spent:,.0f} | {scaled} |")
    return lines


def processor() -> str:
    """Return the name of the processor."""
    lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.fleet.speed", description=__doc__)
    p.add_argument("--write", type=Path)
    given = p.parse_args(words)
    table = measure()
    print("\n".join(table))
    if given.write is not None:
        lines = given.write.read_text("utf-8").splitlines()
        at = next(i for i, line in enumerate(lines) if line.startswith(MARK))
        end = next(i for i in range(at + 1, len(lines)) if lines[i].startswith("## "))
        note = (
            f"Processor time on one thread of a machine ({processor()}, {os.cpu_count()} cores, "
            "shared with other work; `python -m tests.fleet.speed`), the loop with reading and report; the last "
            "column is scaled, not measured."
        )
        lines[at + 1 : end] = ["", note, "", *table, ""]
        given.write.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
