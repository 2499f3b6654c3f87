"""The pictures and words of a closed loop: runs, channels, candidates, series, force against motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.text import Text

from railui.campaign.dataset import Dataset, cut_samples
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.picture import Line as Curve
from railui.desk.widgets.picture import Picture
from railui.identification.loop import LoopResult
from railui.io.number_format import suited, unit_text
from railui.report.loop.driven import Forces
from railui.report.loop.figures import Window, units_of

POINTS = 4000  # of a force against its motion
ROLES = {"measured": "base", "before": "other", "after": "now"}


@dataclass(frozen=True, eq=False)
class Closed:
    """A loop that came to its verdict, with all that is drawn of it."""

    found: LoopResult
    report: dict[str, Any]
    window: Window
    series: Mapping[str, Any]
    forces: list[Forces]


def run_text(measurement: Dataset, index: int) -> Text:
    """How long a run is, how fast it was sampled, how many channels it has, what it lacks."""
    run = measurement.runs[index]
    text = Text(f"{len(run) / run.rate:6.0f} s  {run.rate:.4g} Hz  {len(run.responses)} channels  ")
    lost = {k: n for k, n in run.counts.items() if n and k in ("gaps", "stuck", "short_stretches", "missing_rows")}
    told = ", ".join(f"{n} {k.replace('_', ' ')}" for k, n in lost.items()) or "no gaps"
    text.append(told, "yellow" if lost else "dim")
    if run.notes:
        text.append(f"  {run.notes[0]}", "yellow")
    return text


def error(value: float) -> str:
    """A normalised error as it is told; where the simulation diverged there is none."""
    return f"{value:.3f}" if np.isfinite(value) else "div."


def share(value: float, worst: float) -> float:
    """An error as a share of the worst [0 .. 1], for a bar."""
    return value / worst if np.isfinite(value) else 1.0


def short(path: str) -> str:
    """A path in the fewest words that tell it from the others."""
    *groups, name = path.split(".")
    which = groups[-1] if groups and groups[-1] not in ("contact", "vehicle") else ""
    return f"{name.replace('_', ' ')} {which}".strip()


def named(candidate: Any, narrow: bool = False) -> str:
    """An effect and its place in words."""
    which = f" {candidate.wheelset}" if candidate.wheelset else ""
    words = [word[:3] if narrow else word for word in candidate.at.split("_")]
    return f"{candidate.kind.replace('_', ' ')}, {' '.join(words)}{which}"


def series_picture(closed: Closed, channel: str) -> Picture:
    """A few telling seconds of one channel: measured, before, after."""
    window, found = closed.window, closed.found
    row = window.stretch.channels.index(channel)
    piece = slice(window.begin, window.end)
    t = window.stretch.columns["t"][cut_samples(found.measurement.campaign, window.stretch) :][piece]
    factor, unit = scale(closed.series["measured"][row, piece], units_of(found, window.stretch)[channel])
    lines = [
        Curve(t, factor * closed.series[which][row, piece], which, ROLES[which])
        for which in ("measured", "before", "after")
        if which in closed.series
    ]
    return Picture(Axis("t", "s"), Axis(channel, unit_text(unit)), lines)


def force_picture(forces: Forces) -> Picture:
    """The force at the place of an effect against the motion there, before and after."""
    every = max(1, len(forces.motion) // POINTS)
    x_factor, x_unit = scale(forces.motion, forces.motion_unit)
    y_factor, y_unit = scale(forces.after, forces.force_unit)
    lines = [
        Curve(x_factor * forces.motion[::every], y_factor * y[::every], label, ROLES[label], points=True)
        for label, y in (("before", forces.before), ("after", forces.after))
    ]
    return Picture(Axis("z", unit_text(x_unit)), Axis("force", unit_text(y_unit)), lines)


def scale(values: Any, unit: str) -> tuple[float, str]:
    """What SI values are multiplied by to be read, and their unit then."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if not largest:
        return 1.0, unit
    number, name = suited(largest, unit)
    return number / largest, name
