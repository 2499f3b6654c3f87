"""Trial of the sequential tests on made fleets: faults found against size, false alarms, place, and a plain threshold.

python -m tests.fleet.simulate TEMPLATES --sound --vehicles 12 --days 180 --every 30
python -m tests.fleet.trial TEMPLATES --seed 1 --fleets 3 -o tests/fleet
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy import special

from railui.fleet.cusum import DAYS_PER_MONTH
from railui.fleet.fleet_file import Fleet, load_fleet
from railui.fleet.observations import Observations
from railui.fleet.status import TypeState, assess_type
from railui.fleet.store import FleetStore
from railui.fleet.summary import RunSummary
from tests.fleet.drawn import DETERIORATING, Errors, draw_fleet
from tests.fleet.simulate import START, fleet_text, order_of
from tests.trial_rows import append_rows
from tests.truth.fleet import Fault, FleetOrder

PLACES = {
    "yaw_damper": "vehicle.secondary.yaw_damping",
    "rubber": "vehicle.primary.lateral_stiffness",
    "clearance": "free_play at primary_lateral",
    "sensor": "sensor_gain at",
}


@dataclass(frozen=True)
class FaultRow:
    """A planted fault: the day of its first alarm after the onset, what it named, and the day of the plain threshold.

    Days from the onset; NaN: none. separated: the planted cause is the best explanation; listed: among those that are
    not separated from it.
    """

    seed: int
    kind: str
    size: float
    ramp: float
    days: float
    named: str
    separated: bool
    listed: bool
    onset_error: float
    threshold_days: float


@dataclass(frozen=True)
class FleetRow:
    """False alarms of a fleet on sound vehicles, by the tests and by the plain threshold, and alarms of sections."""

    seed: int
    vehicle_months: float
    false_alarms: int
    threshold_false_alarms: int
    section_months: float
    section_false_alarms: int
    sections_found: int
    sections_changed: int


def read_templates(directory: Path) -> list[RunSummary]:
    """Read the summaries of simulated runs."""
    store = FleetStore(directory, readonly=True)
    found = [store.read(str(row[8])) for row in store.runs()]
    store.close()
    return [RunSummary.of_arrays(arrays) for arrays in found if arrays is not None]


def fleet_of(order: FleetOrder, directory: Path) -> Fleet:
    """Return the fleet file of a made fleet, beside the design of the templates."""
    file = directory / f"trial_{order.seed}.yaml"
    file.write_text(fleet_text(order, "pattern: 'runs/{vehicle}/{time}.csv.gz'"))
    return load_fleet(file)


def run_fleet(seed: int, templates: Path, every: int, errors: Errors) -> tuple[list[FaultRow], FleetRow]:
    """Draw a fleet, monitor it, and compare the alarms with the truth."""
    order = order_of(seed, 60, 364, every)
    fleet = fleet_of(order, templates)
    data = draw_fleet(fleet, order, read_templates(templates), errors)
    state = assess_type(fleet, fleet.types["bogie"], data)
    plain = threshold_alarms(data, fleet, state)
    rows = [_fault_row(seed, fault, state, plain) for fault in order.faults]
    sound = {k for k in range(order.vehicles)} - {fault.vehicle for fault in order.faults}
    raised = [data.quantities[a.crossing.quantities[0]].name for a in state.alarms if a.crossing.subject in sound]
    print("false alarms raised by", {name: raised.count(name) for name in sorted(set(raised))}, flush=True)
    return rows, _fleet_row(seed, order, state, plain)


def _fault_row(seed: int, fault: Fault, state: TypeState, plain: list[tuple[int, float]]) -> FaultRow:
    onset = START + fault.onset
    own = [a for a in state.alarms if a.crossing.subject == fault.vehicle and a.raised > onset]
    place = PLACES[fault.kind]
    place += (
        f" {fault.wheelset}" if fault.kind == "clearance" else f" {fault.channel}" if fault.kind == "sensor" else ""
    )
    first = min((a.raised for a in own), default=float("nan"))
    alarm = next(iter(own), None)
    simple = min((day for v, day in plain if v == fault.vehicle and day > onset), default=float("nan"))
    course = None if alarm is None else alarm.course
    return FaultRow(
        seed,
        fault.kind,
        fault.size,
        fault.ramp,
        first - onset,
        "" if alarm is None else alarm.name if alarm.verdict != "outside" else "outside",
        alarm is not None and alarm.verdict != "outside" and alarm.name == place,
        alarm is not None and place in (alarm.name, *alarm.alternatives),
        float("nan") if course is None else course.onset - onset,
        simple - onset,
    )


def _fleet_row(seed: int, order: FleetOrder, state: TypeState, plain: list[tuple[int, float]]) -> FleetRow:
    onset = {f.vehicle: START + f.onset for f in order.faults}

    def is_false(vehicle: int, day: float) -> bool:
        return day <= onset.get(vehicle, np.inf)

    monitor, data = state.monitor, state.data
    days = monitor.start[1:]
    tested = np.isfinite(monitor.score).any(axis=2)
    tested[: len(tested) - int(monitor.tested_blocks.max(initial=0))] = False
    sound = np.array([[is_false(v, day) for v in range(len(data.vehicles))] for day in days])
    block_months = float(days[1] - days[0]) / DAYS_PER_MONTH
    sections = [(data.sections[x.subject], float(monitor.start[x.block + 1])) for x in monitor.section_alarms]
    changed = {name: START + day for name, day in DETERIORATING.items()}
    return FleetRow(
        seed,
        float(np.sum(tested & sound)) * block_months,
        sum(is_false(a.crossing.subject, a.raised) for a in state.alarms),
        sum(is_false(v, day) for v, day in plain),
        len(data.sections) * float(tested.any(axis=1).sum()) * block_months,
        sum(day < changed.get(name, np.inf) for name, day in sections),
        len({name for name, day in sections if day >= changed.get(name, np.inf)}),
        len(changed),
    )


def threshold_alarms(data: Observations, fleet: Fleet, state: TypeState) -> list[tuple[int, float]]:
    """Alarms of a plain threshold per vehicle: a block's mean against mean and scatter of the first blocks.

    The threshold is that of normal values at the same stated rate of false alarms. After an alarm the vehicle starts
    anew from the blocks that follow.
    """
    monitor, settings = state.monitor, fleet.settings
    blocks, vehicles, quantities = monitor.value.shape
    per_month = DAYS_PER_MONTH / settings.block_days
    level = -float(special.ndtri(settings.false_alarms / (2.0 * quantities * per_month)))
    raw = np.full((blocks, vehicles, quantities), np.nan)
    for b in range(blocks):
        for v in range(vehicles):
            runs = (monitor.block_of_run == b) & (data.vehicle == v)
            if runs.any():
                raw[b, v] = data.y[runs].mean(axis=0)
    alarms = []
    for v in range(vehicles):
        first = 0
        for b in range(settings.baseline_blocks, blocks):
            base = raw[first : first + settings.baseline_blocks, v]
            if b < first + settings.baseline_blocks:
                continue
            z = (raw[b, v] - np.nanmean(base, axis=0)) / np.nanstd(base, axis=0, ddof=1)
            if np.nanmax(np.abs(z)) > level:
                alarms.append((v, float(monitor.start[b + 1])))
                first = b + 1
    return alarms


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.fleet.trial", description=__doc__)
    p.add_argument("templates", type=Path)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--fleets", type=int, default=3)
    p.add_argument("--every", type=int, default=7)
    p.add_argument("-o", "--out", type=Path, required=True)
    given = p.parse_args(words)
    for seed in range(given.seed, given.seed + given.fleets):
        faults, fleet = run_fleet(seed, given.templates, given.every, Errors())
        append_rows(given.out / "faults.csv", faults)
        append_rows(given.out / "fleets.csv", [fleet])
        print(asdict(fleet), flush=True)
        for row in faults:
            print(f"{row.kind:12s} {row.size:8.3g} {row.days:6.0f} {row.named} {row.threshold_days:6.0f}", flush=True)


if __name__ == "__main__":
    main()
