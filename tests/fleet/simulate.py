"""Quick path over a made fleet in memory: summaries of every run into the store of a fleet.

python -m tests.fleet.simulate OUT --seed 1 --vehicles 60 --days 365 --every 3
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from railui.campaign.dataset import segments_of_run
from railui.campaign.segment import Segment
from railui.fleet.fleet_file import Fleet, load_fleet
from railui.fleet.quick_path import Watch, summarise_run
from railui.fleet.reference import make_reference, watched_candidates
from railui.fleet.store import FleetStore
from railui.io.table import Table
from railui.runs.run import run_of_table
from tests.truth.campaign import DECLARED
from tests.truth.files import NOISE, UNITS, design
from tests.truth.fleet import RECORD_DAYS, FleetOrder, FleetRun, fleet_runs, members, planted_faults

KINDS = (
    ("yaw_damper", (0.1, 0.2, 0.4, 0.8)),
    ("clearance", (0.5e-4, 1e-4, 2e-4, 4e-4)),
    ("rubber", (0.02, 0.04, 0.08, 0.16)),
    ("sensor", (0.05, 0.1, 0.2, 0.4)),
)
START = 20454  # 2026-01-01 as a day
WEEK = 7


def order_of(seed: int, vehicles: int, days: int, every: int, repeats: int = 1, few: bool = False) -> FleetOrder:
    """Return the specification of the fleet of a trial; few: one fault of each kind, of its third size."""
    kinds = tuple((kind, sizes[2:3] if few else sizes * repeats) for kind, sizes in KINDS)
    return FleetOrder(vehicles, days, every, seed, faults=planted_faults(seed, vehicles, kinds))


def fleet_text(order: FleetOrder, pattern: str) -> str:
    """Return fleet.yaml of a made fleet: what its operator knows, the re-profiling of wheels included."""
    noise = ", ".join(f"{c}: {NOISE[c][1]}" for c in ("yw", "phiw", "gauge", *order.channels))
    lines = [
        "schema: railui.fleet/1",
        "name: made fleet (simulated)",
        "types:",
        f"  bogie: {{vehicle: vehicle.yaml, noise: {{{noise}}}, watch: [free_play at primary_lateral, sensor_gain]}}",
        "vehicles:",
        *(f"  {vehicle_name(k)}: bogie" for k in range(order.vehicles)),
        f"runs: {{{pattern}}}",
        f"settings: {{reference_runs: 3, block_days: {max(order.every, WEEK)}}}",
        "events:",
    ]
    for k, member in enumerate(members(order)):
        for x in member.profiled:
            day = (x - member.start) / 550.0
            if 0.0 < day < order.days:
                lines.append(f"  - {{vehicle: {vehicle_name(k)}, time: {START + day:.2f}, resets: [contact]}}")
    for number in range(1, int(order.days // RECORD_DAYS) + 1):
        lines.append(f"  - {{section: north, time: {START + RECORD_DAYS * number:.2f}, note: track recorded anew}}")
    return "\n".join(lines) + "\n"


def vehicle_name(k: int) -> str:
    """Return the name of a vehicle by its number."""
    return f"v{k + 1:02d}"


def segment_of(run: FleetRun) -> Segment:
    """Return the samples of a run as its file would give them."""
    names = tuple(run.columns)
    rows = np.stack([run.columns[c] for c in names], axis=1)
    name = f"{vehicle_name(run.vehicle)}_{run.day:03d}"
    table = Table(name, names, tuple(UNITS[c] for c in names), rows, (), (0, 0), (0,) * len(names))
    segments = segments_of_run(run_of_table(table, "", "bogie"), name, "adjust")
    return max(segments, key=lambda s: s.samples)


def simulate_fleet(out: Path, order: FleetOrder) -> None:
    """Simulate a fleet, summarise every run by the quick path, and store the summaries with the truth."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "vehicle.yaml").write_text(design(DECLARED))
    (out / "fleet.yaml").write_text(fleet_text(order, "pattern: 'runs/{vehicle}/{time}.csv.gz'"))
    truth = {"seed": order.seed, "days": order.days, "every": order.every, "faults": [asdict(f) for f in order.faults]}
    (out / "truth.json").write_text(json.dumps(truth, indent=1))
    fleet = load_fleet(out / "fleet.yaml")
    store = FleetStore(out)
    seconds = _summarise(fleet, store, order)
    (out / "seconds.json").write_text(json.dumps(seconds))
    store.close()


def _summarise(fleet: Fleet, store: FleetStore, order: FleetOrder) -> list[float]:
    first: dict[int, list[FleetRun]] = {}
    references, watch, rows, seconds = {}, None, [], []

    def summarise(run: FleetRun) -> None:
        nonlocal watch
        vehicle = fleet.vehicles[vehicle_name(run.vehicle)]
        segment = segment_of(run)
        watch = watch or Watch(tuple(watched_candidates(vehicle, segment)))
        started = time.perf_counter()
        try:
            summary = summarise_run(vehicle, references[run.vehicle], watch, fleet.settings, segment)
        except ValueError as error:
            print(f"{segment.file}: {error}", flush=True)
            return
        seconds.append(time.perf_counter() - started)
        key = segment.file
        store.write(key, "summary", vehicle.name, replace(summary, section=run.section).arrays())
        numbers = (run.mileage, run.load, run.temperature)
        rows.append((key, vehicle.name, "bogie", START + float(run.day), *numbers, run.section, key, "summarised"))

    started = time.perf_counter()
    for count, run in enumerate(fleet_runs(order), 1):
        if run.vehicle not in references:
            early = first.setdefault(run.vehicle, [])
            early.append(run)
            if len(early) < fleet.settings.reference_runs:
                continue
            vehicle = fleet.vehicles[vehicle_name(run.vehicle)]
            references[run.vehicle] = make_reference(vehicle, [segment_of(r) for r in early])
            for one in early:
                summarise(one)
        else:
            summarise(run)
        if count % 100 == 0:
            store.replace_runs(rows)
            print(f"{count} runs, {time.perf_counter() - started:.0f} s, {np.median(seconds):.3f} s", flush=True)
    store.replace_runs(rows)
    return seconds


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.fleet.simulate", description=__doc__)
    p.add_argument("out", type=Path)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--vehicles", type=int, default=60)
    p.add_argument("--days", type=int, default=365)
    p.add_argument("--every", type=int, default=14)
    p.add_argument("--sound", action="store_true", help="without faults")
    p.add_argument("--few", action="store_true", help="one fault of each kind, of its third size")
    given = p.parse_args(words)
    order = order_of(given.seed, given.vehicles, given.days, given.every, 0 if given.sound else 1, given.few)
    simulate_fleet(given.out, order)


if __name__ == "__main__":
    main()
