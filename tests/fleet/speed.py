"""Processor time of the quick path and of a full loop's calibration on runs of several lengths.

python -m tests.fleet.speed --write docs/fleet.md
"""

from __future__ import annotations

import argparse
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
from railui.vehicle.model import Model
from tests.fleet.simulate import fleet_text, order_of
from tests.truth.campaign import DECLARED
from tests.truth.files import NOISE, design

LENGTHS = (12.0, 30.0, 120.0)  # s
REPETITIONS = 3
MARK = "<!-- speed"


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


def measure() -> list[str]:
    """Return the table of processor times."""
    lines = ["| run | quick path | 2,000 runs on 16 cores |", "| --- | ---: | ---: |"]
    with tempfile.TemporaryDirectory() as scratch:
        fleet = made_fleet(Path(scratch))
        vehicle = next(iter(fleet.vehicles.values()))
        reference = make_reference(vehicle, [made_run(fleet, 12.0, seed) for seed in (1, 2, 3)])
        for seconds in LENGTHS:
            segment = made_run(fleet, seconds, 9)
            watch = Watch(tuple(watched_candidates(vehicle, segment)))
            times = []
            for _ in range(REPETITIONS):
                started = time.process_time()
                summarise_run(vehicle, reference, watch, fleet.settings, replace(segment, tables={}))
                times.append(time.process_time() - started)
            spent = min(times)
            lines.append(f"| {seconds:g} s, 6 channels | {spent:.2f} s | {2000 * spent / 16:.0f} s |")
    return lines


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
            "Processor time of one core of the machine that wrote this page, reading excluded "
            "(`python -m tests.fleet.speed`); the last column is scaled, not measured."
        )
        lines[at + 1 : end] = ["", note, "", *table, ""]
        given.write.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
