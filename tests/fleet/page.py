"""Tables of docs/fleet.md from the rows of the trial: python -m tests.fleet.page"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench.page import write_after
from tests.fleet.test_made_fleet import faulty_fleet
from tests.fleet.trial import FaultRow, FleetRow
from tests.trial_rows import read_rows
from tests.truth.fleet import Fault

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[1] / "docs/fleet.md"
NAMES = {"yaw_damper": "yaw damper fades", "rubber": "primary rubber stiffens", "sensor": "sensor loses gain"}
SPANS = (30.0, 60.0, 90.0, 120.0, 165.0)  # days after the onset; a fault has its full size after 120


LIMIT = (
    "A limit by simulation, from a fleet of 12 vehicles in which a rubber spring of v02 loses 30 % in 120 days from "
    "2026-04-01 on (`criterion: linear_critical_speed, below: 60 m/s`): at the value the vehicle of its last run, "
    "worn wheels included, becomes unstable at 60 m/s; `change` is the mean over the runs since the onset of its own "
    "row, later ones with more weight, against the level before that onset: after an alarm the vehicle is tested anew, "
    "so that the rows do not add up to the 30 %."
)


def size_text(row: FaultRow | Fault) -> str:
    """Return the size of a fault."""
    return f"{1e3 * row.size:g} mm" if row.kind == "clearance" else f"{100 * row.size:g} %"


def fault_table(rows: Sequence[FaultRow]) -> list[str]:
    """Return one line per kind and size."""
    lines = [
        "| fault, size after 120 days | found | named | wrong | outside | median days | lead | size then "
        "| threshold: found | lead |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for kind in dict.fromkeys(row.kind for row in rows):
        for size in sorted({row.size for row in rows if row.kind == kind}):
            same = [row for row in rows if row.kind == kind and row.size == size]
            days = np.array([row.days for row in same])
            plain = np.array([row.equal_days for row in same])
            known, ramp = np.isfinite(days), same[0].ramp
            then = f"{100 * np.median(np.minimum(days[known] / ramp, 1.0)):.0f} %" if known.any() else "–"
            wrong = sum(row.named not in ("", "outside") and not row.separated for row in same)
            lines.append(
                f"| {NAMES.get(kind, 'clearance grows')}, {size_text(same[0])} | {known.sum()} of {len(same)} "
                f"| {sum(r.separated for r in same)} | {wrong} | {sum(r.named == 'outside' for r in same)} "
                f"| {_median(days)} | {_median(ramp - days)} | {then} "
                f"| {np.isfinite(plain).sum()} of {len(same)} | {_median(ramp - plain)} |"
            )
    return lines


def _median(days: np.ndarray) -> str:
    known = days[np.isfinite(days)]
    return f"{np.median(known):.0f}" if len(known) else "–"


def span_table(rows: Sequence[FaultRow]) -> list[str]:
    """Return the share of the faults found until some days after their onset."""
    lines = [
        "| found until, days after the onset | " + " | ".join(f"{span:g}" for span in SPANS) + " |",
        "| --- |" + " ---: |" * len(SPANS),
    ]
    for label, column in (("sequential tests", "days"), ("plain threshold", "equal_days")):
        days = np.array([getattr(row, column) for row in rows])
        shares = " | ".join(f"{100 * np.mean(days <= span):.0f} %" for span in SPANS)
        lines.append(f"| {label} | {shares} |")
    return lines


def fleet_table(rows: Sequence[FleetRow]) -> list[str]:
    """Return the false alarms of each fleet and of all."""
    months = sum(r.vehicle_months for r in rows)
    mine = sum(r.false_alarms for r in rows)
    plain = sum(r.threshold_false_alarms for r in rows)
    section_months = sum(r.section_months for r in rows)
    false = sum(r.section_false_alarms for r in rows)
    late, late_false = sum(r.late_months for r in rows), sum(r.late_false_alarms for r in rows)
    found, changed = sum(r.sections_found for r in rows), sum(r.sections_changed for r in rows)
    return [
        "| | count | per month |",
        "| --- | ---: | ---: |",
        *(
            f"| false alarms of vehicles, seed {r.seed}, {r.vehicle_months:.0f} vehicle-months | {r.false_alarms} "
            f"| {r.false_alarms / r.vehicle_months:.3f} |"
            for r in rows
        ),
        f"| all seeds, {months:.0f} vehicle-months | {mine} | {mine / months:.3f} |",
        f"| of these after the track of a section has changed, {late:.0f} vehicle-months | {late_false} "
        f"| {late_false / late:.3f} |",
        f"| the same with the plain threshold at the stated rate | {plain} | {plain / months:.3f} |",
        f"| false alarms of sections, {section_months:.0f} section-months | {false} | {false / section_months:.3f} |",
        f"| sections that changed and were found | {found} of {changed} | |",
    ]


def limit_table(document: Mapping[str, Any]) -> list[str]:
    """Return the alarms of a fleet whose parameter has a limit."""
    lines = [
        "| raised | vehicle | parameter | change | onset (90 %) | limit | value at the limit | reached (90 %) |",
        "| --- | --- | --- | ---: | --- | --- | ---: | --- |",
    ]
    for row in document["alarms"]:
        limit, onset = row["limit"], row["onset"]
        if limit is not None:
            lines.append(
                f"| {row['raised']} | {row['vehicle']} | {row['quantity']} | {100 * row['relative_change']:+.1f} % "
                f"| {onset['day']} ({onset['low']} to {onset['high']}) | {limit['criterion']} {limit['limit']:g} "
                f"| {limit['value'] / 1e6:.3f}e6 {row['unit']} "
                f"| {limit['day']} ({limit['low']} to {limit['high'] or 'open'}) |"
            )
    return lines


def text() -> str:
    """Return the tables."""
    faults = read_rows(FOLDER / "faults.csv", FaultRow)
    fleets = read_rows(FOLDER / "fleets.csv", FleetRow)
    return "\n".join(
        [
            *fault_table(faults),
            "",
            *span_table(faults),
            "",
            *fleet_table(fleets),
            "",
            LIMIT,
            "",
            *limit_table(faulty_fleet()[1]),
            "",
        ]
    )


if __name__ == "__main__":
    write_after(PAGE, text())
