"""Tables of docs/fleet.md from the rows of the trial: python -m tests.fleet.page"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.bench.page import write_after
from tests.fleet.trial import FaultRow, FleetRow
from tests.trial_rows import read_rows

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[1] / "docs/fleet.md"
NAMES = {"yaw_damper": "yaw damper fades", "rubber": "primary rubber stiffens", "sensor": "sensor loses gain"}
LATE = 165.0  # days after the onset, about the rest of the year


def size_text(row: FaultRow) -> str:
    """Return the size of a fault."""
    return f"{1e3 * row.size:g} mm" if row.kind == "clearance" else f"{100 * row.size:g} %"


def fault_table(rows: Sequence[FaultRow]) -> list[str]:
    """Return one line per kind and size."""
    lines = [
        "| fault, size after 120 days | found | by full size | median days | size then | attributed | quantity "
        "| threshold: found | median days |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for kind in dict.fromkeys(row.kind for row in rows):
        for size in sorted({row.size for row in rows if row.kind == kind}):
            same = [row for row in rows if row.kind == kind and row.size == size]
            days = np.array([row.days for row in same])
            plain = np.array([row.threshold_days for row in same])
            found, count = np.isfinite(days), len(same)
            grown = np.minimum(days[found] / same[0].ramp, 1.0)
            then = f"{100 * np.median(grown):.0f} %" if found.any() else "–"
            lines.append(
                f"| {NAMES.get(kind, 'clearance grows')}, {size_text(same[0])} | {found.sum()} of {count} "
                f"| {np.sum(days <= same[0].ramp)} | {_median(days)} | {then} | {sum(r.separated for r in same)} "
                f"| {sum(r.listed for r in same)} | {np.isfinite(plain).sum()} of {count} | {_median(plain)} |"
            )
    return lines


def _median(days: np.ndarray) -> str:
    known = days[np.isfinite(days)]
    return f"{np.median(known):.0f}" if len(known) else "–"


def fleet_table(rows: Sequence[FleetRow]) -> list[str]:
    """Return the false alarms of all fleets."""
    months = sum(r.vehicle_months for r in rows)
    mine, plain = sum(r.false_alarms for r in rows), sum(r.threshold_false_alarms for r in rows)
    section_months = sum(r.section_months for r in rows)
    false = sum(r.section_false_alarms for r in rows)
    found, changed = sum(r.sections_found for r in rows), sum(r.sections_changed for r in rows)
    return [
        "| | count | per month |",
        "| --- | ---: | ---: |",
        f"| false alarms of vehicles, {months:.0f} vehicle-months | {mine} | {mine / months:.3f} |",
        f"| the same with the plain threshold | {plain} | {plain / months:.3f} |",
        f"| false alarms of sections, {section_months:.0f} section-months | {false} | {false / section_months:.3f} |",
        f"| sections that changed and were found | {found} of {changed} | |",
    ]


def text() -> str:
    """Return the tables."""
    faults = read_rows(FOLDER / "faults.csv", FaultRow)
    fleets = read_rows(FOLDER / "fleets.csv", FleetRow)
    return "\n".join([*fault_table(faults), "", *fleet_table(fleets), ""])


if __name__ == "__main__":
    write_after(PAGE, text())
