"""Critical speeds of a design and of its base: what is computed, and the rows that show it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from rich.text import Text

from railui.desk.presenters.design_results import MAX_CRITICAL_SPEED, DesignResults
from railui.desk.widgets.plot_data import LimitLine
from railui.vehicle.design_reader import Design

HIGHEST_SPEED: Final = 90.0  # m/s, up to which nonlinear and ride criteria are searched
HIGHEST_SPEEDS: Final = {"linear": MAX_CRITICAL_SPEED, "nonlinear": HIGHEST_SPEED, "ride": HIGHEST_SPEED}  # m/s
KMH_PER_MS: Final = 3.6
KINDS: Final = {"linear": "linear", "nonlinear": "nonlinear", "ride": "ride criteria"}
LINE_ROLES: Final = {"linear": "series5", "nonlinear": "series4", "ride": "series3"}
NAME_COLUMNS: Final = 14
SHORT_NAMES: Final = {"linear": "linear", "nonlinear": "nonlinear", "ride": "ride"}  # at the lines of plots
MIN_WIDE_COLUMNS: Final = 44  # of rows with the base and both units


@dataclass
class CriticalSpeeds:
    """Slow results by design and track: kind -> result with the key `speed` [m/s] or None."""

    results: dict[str, dict[str, Mapping[str, Any]]] = field(default_factory=dict)
    max_size: int = 32

    def of(self, results: DesignResults) -> dict[str, Mapping[str, Any]]:
        """Return what is known of a design under its run conditions, by kind."""
        known = dict(self.results.get(critical_key(results.design, results.conditions.track), {}))
        known["linear"] = {"speed": results.critical_speed}
        return known

    def add(self, key: str, kind: str, result: Mapping[str, Any]) -> None:
        """Add a result; the oldest ones are dropped."""
        self.results.setdefault(key, {})[kind] = result
        while len(self.results) > self.max_size:
            del self.results[next(iter(self.results))]


def critical_key(design: Design, track: str) -> str:
    """Return the key of everything that determines the critical speeds of a design."""
    return json.dumps([design.content(), track], sort_keys=True, default=str)


def speed_text(speed: float | None) -> str:
    """Return a speed in both units.

    >>> speed_text(40.0), speed_text(None)
    ('40.0 m/s  144 km/h', 'none')
    """
    return "none" if speed is None else f"{speed:.1f} m/s {KMH_PER_MS * speed:4.0f} km/h"


def critical_speeds_text(
    current: Mapping[str, Mapping[str, Any]], base: Mapping[str, Mapping[str, Any]] | None, computing: str, width: int
) -> Text:
    """Return a row per kind of critical speed: of the design and of its base.

    computing: kind that is being computed; width: columns there are.
    """
    text = Text(no_wrap=True, overflow="ellipsis")
    for kind, name in KINDS.items():
        text.append(f"{name:{NAME_COLUMNS}}")
        has_both = base is None or width >= MIN_WIDE_COLUMNS
        text.append(*_speed_cell(current.get(kind), computing == kind, has_both, HIGHEST_SPEEDS[kind]))
        if base is not None:
            known = base.get(kind)
            text.append(f"  base {_base_cell(known)}", "dim")
        text.append("\n")
    reason = _reason(current)
    if reason and width:
        text.append(reason_text(reason, width), "dim")
    text.rstrip()
    return text


def _reason(current: Mapping[str, Mapping[str, Any]]) -> str:
    """Return why a critical speed was not computed; else the criterion that decides the ride."""
    failures = (f"{KINDS[kind]}: {known['failure']}" for kind, known in current.items() if known.get("failure"))
    return next(failures, str((current.get("ride") or {}).get("decided_by") or ""))


def _base_cell(known: Mapping[str, Any] | None) -> str:
    if known is None:
        return "..."
    if known.get("failure"):
        return "failed"
    return "none" if known["speed"] is None else f"{known['speed']:.1f}"


def reason_text(reason: str, width: int) -> str:
    """Return the reason of a speed limit in a line, shortened at a word.

    >>> reason_text("unstable: comfort below the limit, with a flange margin of 2", 32)
    'comfort below the limit ...'
    """
    text = reason.removeprefix("unstable: ")
    if len(text) <= width:
        return text
    return text[: max(0, width - 4)].rsplit(" ", 1)[0].rstrip(",;:") + " ..."


def _speed_cell(known: Mapping[str, Any] | None, is_computing: bool, has_both: bool, highest: float) -> tuple[str, str]:
    columns = 18 if has_both else 9
    if known is None:
        return ("computing" if is_computing else "waiting").ljust(columns), "dim"
    if known.get("failure"):
        return "failed".ljust(columns), "bold"
    if known["speed"] is None:
        return (f"none up to {highest:g} m/s" if has_both else "none").ljust(columns), "bold"
    return speed_text(known["speed"])[:columns].ljust(columns), "bold"


def critical_lines(known: Mapping[str, Mapping[str, Any]]) -> list[LimitLine]:
    """Return the critical speeds as vertical lines with their names."""
    return [
        LimitLine(known[kind]["speed"], f"{name} {known[kind]['speed']:.1f}", True, LINE_ROLES[kind])
        for kind, name in SHORT_NAMES.items()
        if kind in known and known[kind]["speed"] is not None
    ]
