"""Trial of the sequential tests on made fleets: faults found against size, false alarms, place, and a plain threshold.

python -m tests.fleet.trial --seed 11 --fleets 3 -o tests/fleet
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy import special

from railui.arrays import FloatArray
from railui.fleet.cusum import DAYS_PER_MONTH
from railui.fleet.fleet_file import Fleet, load_fleet
from railui.fleet.observations import Observations
from railui.fleet.status import TypeState, assess_type
from tests.fleet.drawn import DETERIORATING, Errors, draw_fleet
from tests.fleet.simulate import START, fleet_text, order_of
from tests.fleet.templates import stored_templates
from tests.trial_rows import append_rows
from tests.truth.campaign import DECLARED
from tests.truth.files import design
from tests.truth.fleet import Fault, FleetOrder

BISECTIONS = 14  # of the level of a plain threshold
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
    not separated from it. later: the best explanation of any of its alarms. threshold_days: at the stated rate of false
    alarms; equal_days: at as many false alarms as the tests have.
    """

    seed: int
    kind: str
    size: float
    ramp: float
    days: float
    named: str
    separated: bool
    listed: bool
    later: bool
    onset_error: float
    threshold_days: float
    equal_days: float


@dataclass(frozen=True)
class FleetRow:
    """False alarms of a fleet on sound vehicles, by the tests and by the plain threshold, and alarms of sections.

    late: from the day on which the first section changes.
    """

    seed: int
    vehicle_months: float
    false_alarms: int
    threshold_false_alarms: int
    equal_false_alarms: int
    late_months: float
    late_false_alarms: int
    section_months: float
    section_false_alarms: int
    sections_found: int
    sections_changed: int


def fleet_of(order: FleetOrder, more: str = "") -> Fleet:
    """Return the fleet of an order, with more lines in its file."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "vehicle.yaml").write_text(design(DECLARED))
        (folder / "fleet.yaml").write_text(fleet_text(order, "pattern: 'runs/{vehicle}/{time}.csv.gz'") + more)
        return load_fleet(folder)


def run_fleet(seed: int, every: int, errors: Errors) -> tuple[list[FaultRow], FleetRow]:
    """Draw a fleet, monitor it, and compare the alarms with the truth."""
    order = order_of(seed, 60, 364, every)
    fleet = fleet_of(order)
    data = draw_fleet(fleet, order, stored_templates(), errors)
    state = assess_type(fleet, fleet.types["bogie"], data)
    means = block_means(data, state)
    plain = threshold_alarms(means, state, fleet, stated_level(fleet, data))
    equal = equal_alarms(means, state, fleet, order)
    rows = [_fault_row(seed, fault, state, plain, equal) for fault in order.faults]
    sound = {k for k in range(order.vehicles)} - {fault.vehicle for fault in order.faults}
    raised = [data.quantities[a.crossing.quantities[0]].name for a in state.alarms if a.crossing.subject in sound]
    print("false alarms raised by", {name: raised.count(name) for name in sorted(set(raised))}, flush=True)
    return rows, _fleet_row(seed, order, state, plain, equal)


def _fault_row(
    seed: int, fault: Fault, state: TypeState, plain: list[tuple[int, float]], equal: list[tuple[int, float]]
) -> FaultRow:
    onset = START + fault.onset
    own = [a for a in state.alarms if a.crossing.subject == fault.vehicle and a.raised > onset]
    place = PLACES[fault.kind]
    place += (
        f" {fault.wheelset}" if fault.kind == "clearance" else f" {fault.channel}" if fault.kind == "sensor" else ""
    )
    first = min((a.raised for a in own), default=float("nan"))
    alarm = next(iter(own), None)
    simple, fair = (
        min((day for v, day in alarms if v == fault.vehicle and day > onset), default=float("nan"))
        for alarms in (plain, equal)
    )
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
        any(a.verdict != "outside" and a.name == place for a in own),
        float("nan") if course is None else course.onset - onset,
        simple - onset,
        fair - onset,
    )


def is_false(order: FleetOrder, vehicle: int, day: float) -> bool:
    """True for an alarm of a vehicle without a fault, or before its onset."""
    return day <= min((START + f.onset for f in order.faults if f.vehicle == vehicle), default=np.inf)


def _fleet_row(
    seed: int, order: FleetOrder, state: TypeState, plain: list[tuple[int, float]], equal: list[tuple[int, float]]
) -> FleetRow:
    monitor, data = state.monitor, state.data
    days = monitor.start[1:]
    tested = np.isfinite(monitor.score).any(axis=2)
    tested[: len(tested) - int(monitor.tested_blocks.max(initial=0))] = False
    sound = np.array([[is_false(order, v, day) for v in range(len(data.vehicles))] for day in days])
    block_months = float(days[1] - days[0]) / DAYS_PER_MONTH
    sections = [(data.sections[x.subject], float(monitor.start[x.block + 1])) for x in monitor.section_alarms]
    changed = {name: START + day for name, day in DETERIORATING.items()}
    first = min(changed.values())
    return FleetRow(
        seed,
        float(np.sum(tested & sound)) * block_months,
        sum(is_false(order, a.crossing.subject, a.raised) for a in state.alarms),
        sum(is_false(order, v, day) for v, day in plain),
        sum(is_false(order, v, day) for v, day in equal),
        float(np.sum(tested & sound & (days > first)[:, None])) * block_months,
        sum(is_false(order, a.crossing.subject, a.raised) and a.raised > first for a in state.alarms),
        len(data.sections) * float(tested.any(axis=1).sum()) * block_months,
        sum(day < changed.get(name, np.inf) for name, day in sections),
        len({name for name, day in sections if day >= changed.get(name, np.inf)}),
        len(changed),
    )


def block_means(data: Observations, state: TypeState) -> FloatArray:
    """Mean of every vehicle in every block [block, v, q], as it is measured."""
    blocks, vehicles, quantities = state.monitor.value.shape
    raw = np.full((blocks, vehicles, quantities), np.nan)
    for b in range(blocks):
        for v in range(vehicles):
            runs = (state.monitor.block_of_run == b) & (data.vehicle == v)
            if runs.any():
                raw[b, v] = data.y[runs].mean(axis=0)
    return raw


def stated_level(fleet: Fleet, data: Observations) -> float:
    """Standard deviations that normal values exceed at the stated rate of false alarms."""
    per_month = DAYS_PER_MONTH / fleet.settings.block_days
    return -float(special.ndtri(fleet.settings.false_alarms / (2.0 * len(data.quantities) * per_month)))


def threshold_alarms(means: FloatArray, state: TypeState, fleet: Fleet, level: float) -> list[tuple[int, float]]:
    """Alarms of a plain threshold per vehicle: a block's mean against mean and scatter of the first blocks.

    After an alarm the vehicle starts anew from the blocks that follow.
    """
    baseline = fleet.settings.baseline_blocks
    alarms = []
    for v in range(means.shape[1]):
        first = 0
        for b in range(baseline, len(means)):
            if b < first + baseline:
                continue
            base = means[first : first + baseline, v]
            z = (means[b, v] - np.nanmean(base, axis=0)) / np.nanstd(base, axis=0, ddof=1)
            if np.nanmax(np.abs(z)) > level:
                alarms.append((v, float(state.monitor.start[b + 1])))
                first = b + 1
    return alarms


def equal_alarms(means: FloatArray, state: TypeState, fleet: Fleet, order: FleetOrder) -> list[tuple[int, float]]:
    """Alarms of the plain threshold whose level gives as many false alarms as the tests had, or just fewer."""
    wanted = sum(is_false(order, a.crossing.subject, a.raised) for a in state.alarms)
    low, high = 1.0, 200.0
    for _ in range(BISECTIONS):
        level = float(np.sqrt(low * high))
        alarms = threshold_alarms(means, state, fleet, level)
        low, high = (level, high) if sum(is_false(order, *a) for a in alarms) > wanted else (low, level)
    return threshold_alarms(means, state, fleet, high)


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.fleet.trial", description=__doc__)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--fleets", type=int, default=3)
    p.add_argument("--every", type=int, default=7)
    p.add_argument("-o", "--out", type=Path, required=True)
    given = p.parse_args(words)
    for seed in range(given.seed, given.seed + given.fleets):
        faults, fleet = run_fleet(seed, given.every, Errors())
        append_rows(given.out / "faults.csv", faults)
        append_rows(given.out / "fleets.csv", [fleet])
        print(asdict(fleet), flush=True)
        for row in faults:
            print(f"{row.kind:12s} {row.size:8.3g} {row.days:6.0f} {row.named} {row.equal_days:6.0f}", flush=True)


if __name__ == "__main__":
    main()
