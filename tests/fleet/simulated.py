"""Alarms of a fleet whose every run was simulated, against its planted faults.

python -m tests.fleet.simulate OUT --seed 41 --vehicles 60 --days 364 --every 1
python -m tests.fleet.simulated OUT
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from railui.fleet.cusum import DAYS_PER_MONTH
from railui.fleet.fleet_file import load_fleet
from railui.fleet.status import TypeState, assess_fleet
from railui.fleet.store import FleetStore
from tests.fleet.page import NAMES, size_text
from tests.fleet.simulate import START, vehicle_name
from tests.truth.fleet import Fault


def table(state: TypeState, faults: Sequence[Fault]) -> list[str]:
    """Return one line per fault with its first alarm, and the false alarms."""
    lines = ["| fault | onset, day | first alarm, days later | verdict |", "| --- | ---: | ---: | --- |"]
    onset = {vehicle_name(f.vehicle): START + f.onset for f in faults}
    for fault in faults:
        own = [a for a in state.alarms if a.vehicle == vehicle_name(fault.vehicle) and a.raised > onset[a.vehicle]]
        days = f"{own[0].raised - onset[own[0].vehicle]:.0f}" if own else "–"
        verdict = f"{own[0].verdict}: {own[0].name}" if own else "none"
        kind = NAMES.get(fault.kind, "clearance grows")
        lines.append(f"| {kind}, {size_text(fault)} | {fault.onset:.0f} | {days} | {verdict} |")
    false = [a for a in state.alarms if a.raised <= onset.get(a.vehicle, np.inf)]
    monitor = state.monitor
    tested = np.isfinite(monitor.score).any(axis=2)
    tested[: len(tested) - int(monitor.tested_blocks.max(initial=0))] = False
    ends = np.array([onset.get(name, np.inf) for name in state.data.vehicles])
    months = float(np.sum(tested & (monitor.start[1:, None] <= ends))) * float(np.diff(monitor.start)[0])
    months /= DAYS_PER_MONTH
    raised = Counter(f"{a.verdict}, {a.name}" for a in false)
    most = ", ".join(f"{count} {name}" for name, count in raised.most_common(3)) or "none"
    counted = f"{len(false)} in {months:.0f} vehicle-months, {len(false) / months:.3f} per month"
    return [*lines, "", f"False alarms: {counted}; most: {most}."]


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.fleet.simulated", description=__doc__)
    p.add_argument("directory", type=Path)
    given = p.parse_args(words)
    faults = [Fault(**fault) for fault in json.loads((given.directory / "truth.json").read_text())["faults"]]
    store = FleetStore(given.directory, readonly=True)
    (state,) = assess_fleet(load_fleet(given.directory), store)
    store.close()
    print("\n".join(table(state, faults)))


if __name__ == "__main__":
    main()
