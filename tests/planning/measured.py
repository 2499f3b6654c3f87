"""A measurement that was proposed after a loop, simulated with the true vehicle by the independent generator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.campaign.dataset import segments_of_run
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.planning.component_bench import FORCE, FORCE_NOISE, SAMPLING_RATE, PlannedBench, decide_bench
from railui.planning.decision import Decision, decide
from railui.planning.next_run import NextRun
from railui.planning.planned_runs import PlannedRun
from railui.planning.rivals import RivalModel
from railui.runs.run import load_run
from railui.track import parse_spec
from tests.truth.bogie import Vehicle
from tests.truth.campaign import RESPONSES, Campaign, campaign, write
from tests.truth.component import component_force

LADEN = "laden"
FRAME_MASS, WHEEL_LOAD = 1.3, 1.2  # laden over empty


@dataclass(frozen=True, eq=False)
class Case:
    """A campaign that left rivals: its identification, the truth, and the rivals, the true one first."""

    context: Context
    truth: Campaign
    rivals: Sequence[RivalModel]


def laden_design(folder: Path, declared: Vehicle) -> None:
    """Add a load state to the design of a campaign."""
    mass, load = FRAME_MASS * declared.m_b, WHEEL_LOAD * declared.N
    with (folder / "vehicle.yaml").open("a", encoding="utf-8") as file:
        file.write(f"load:\n  {LADEN}: {{vehicle.frame.mass: {mass:.12g}, vehicle.wheel_load: {load:.12g}}}\n")


def kind_of(found: NextRun, sensors: int) -> str:
    """Kind of a measurement, next to a campaign with a number of sensors."""
    if isinstance(found.run, PlannedBench):
        return "bench"
    if found.run.load is not None:
        return LADEN
    return "one more sensor" if len(found.sensors) > sensors else "same sensors"


def measure(case: Case, found: NextRun, folder: Path) -> tuple[bool, bool]:
    """Make a measurement; return whether it decides for the true rival, and for a wrong one.

    A vehicle that leaves the track decides nothing.
    """
    try:
        if isinstance(found.run, PlannedBench):
            decisions = _decide_bench(case, found.run)
        else:
            decisions = _decide_run(case, found.run, found.sensors, folder)
    except (ArithmeticError, ValueError):
        return False, False
    return all(d.is_clear and d.z > 0 for d in decisions), any(d.is_clear and d.z < 0 for d in decisions)


def _decide_run(case: Case, run: PlannedRun, sensors: Sequence[str], folder: Path) -> list[Decision]:
    order, vehicle = case.truth.order, case.truth.vehicle
    if run.load is not None:
        vehicle = replace(vehicle, m_b=FRAME_MASS * order.declared.m_b, N=WHEEL_LOAD * order.declared.N)
    order = replace(
        order,
        seed=order.seed + 7,
        scale=parse_spec(run.source.name).scale,
        speeds=(run.speed, run.speed),
        seconds=(run.duration, 10.0),
        without=[c for c in RESPONSES if c not in sensors],
        vehicle=vehicle,
    )
    write(campaign(order), folder)
    segments = segments_of_run(load_run(folder / "run_a.csv.gz"), "run_a.csv.gz", "test")
    return decide(case.context, [r.in_load_state(run.load) for r in case.rivals], segments)


def _decide_bench(case: Case, bench: PlannedBench) -> list[Decision]:
    z = bench.motion()
    t = np.arange(len(z)) / SAMPLING_RATE
    force = component_force(case.truth.vehicle, case.truth.effects["a"], bench.at, bench.port, t, z)
    noise = np.random.default_rng([case.truth.order.seed, 17]).standard_normal(len(z))
    columns = {"t": t, "z": z, FORCE: force + FORCE_NOISE * np.std(force) * noise}
    segment = Segment("bench.csv", "test", 0, columns, 1.0 / SAMPLING_RATE, "bench")
    return decide_bench(case.context, case.rivals, bench, [segment])
