"""Plausibility of a recording for EN 14363: speed, distance, wheel loads and guiding forces against the design."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import Findings, join_names
from railui.io.table import Table
from railui.io.units import MAX_PLAUSIBLE_SPEED

KMH: Final = 3.6
SPEED_TOLERANCE: Final = 0.05  # relative, of 3.6 in the ratio of v and the distance covered
# mean wheel load over the design's static load: an empty and a laden wagon differ by 4, N and kg by 9.8
MAX_LOAD_RATIO: Final = 5.0
USUAL_LOAD_RATIO: Final = 1.25  # beyond which a note asks for the load state
# rms of a guiding force over the static wheel load: some 0.01 on good tangent track, below 1 in the sharpest curves
FORCE_RATIOS: Final = (1e-3, 2.0)


def check_speed(table: Table, columns: Mapping[str, FloatArray], findings: Findings) -> None:
    """Report a speed in km/h under the header m/s or the reverse: above 120 m/s, or not that of the distance s."""
    t, v, s = (columns.get(name) for name in ("t", "v", "s"))
    if v is None or not np.isfinite(v).any():
        return
    speed = float(np.nanmedian(v))
    if speed > MAX_PLAUSIBLE_SPEED:
        message = f"is {speed:.4g} m/s ({KMH * speed:.4g} km/h) in the median, faster than trains are tested"
        findings.add("v", message, "write `v [km/h]` where the numbers are km/h", position=_position(table, "v"))
    elif s is not None and t is not None:
        steps = np.isfinite(np.diff(s)) & np.isfinite(np.diff(t)) & (np.diff(t) > 0.0) & np.isfinite(v[1:])
        travelled = np.diff(s)[steps].sum()
        ratio = float((v[1:][steps] * np.diff(t)[steps]).sum() / travelled) if travelled > 0.0 else 1.0
        for factor, unit in ((KMH, "km/h"), (1.0 / KMH, "m/s")):
            if abs(ratio / factor - 1.0) < SPEED_TOLERANCE:
                message = f"covers {ratio:.3g} times the distance s"
                findings.add("v", message, f"write `v [{unit}]` in the header", position=_position(table, "v"))


def check_forces(
    table: Table, columns: Mapping[str, FloatArray], wheel_loads: Sequence[float], findings: Findings
) -> list[str]:
    """Report wheel loads and guiding forces of another magnitude than the static wheel loads [N]; return notes."""
    notes = []
    for i, static_load in enumerate(wheel_loads, 1):
        names = [name for name in columns if re.fullmatch(rf"Q{i}\.(right|left)", name)]
        means = [float(np.nanmean(columns[name])) for name in names if np.isfinite(columns[name]).any()]
        if not means:
            continue
        ratio = float(np.mean(means)) / static_load
        mean = f"{np.mean(means) / 1e3:.3g} kN in the mean"
        text = f"is {mean}, the static wheel load of the design is {static_load / 1e3:.3g} kN"
        if not 1.0 / MAX_LOAD_RATIO <= ratio <= MAX_LOAD_RATIO:
            findings.add(names[0], text, _unit_remedy(names[0], ratio), position=_position(table, names[0]))
        elif not 1.0 / USUAL_LOAD_RATIO <= ratio <= USUAL_LOAD_RATIO:
            notes.append(f"Q{i} {text}: give the design of the load state of the run")
    forces = [name for name in columns if re.fullmatch(r"Y\d+(\.(right|left))?", name)]
    sizes = {
        name: float(np.sqrt(np.nanmean(columns[name] ** 2))) for name in forces if np.isfinite(columns[name]).any()
    }
    largest = max(sizes, key=lambda name: sizes[name], default=None)
    if largest is not None and sizes[largest] > 0.0:
        ratio = sizes[largest] / max(wheel_loads)
        if not FORCE_RATIOS[0] <= ratio <= FORCE_RATIOS[1]:
            size = f"{sizes[largest] / 1e3:.3g} kN"
            message = f"has an rms of {size}, {ratio:.2g} of the static wheel load of the design"
            findings.add(largest, message, _unit_remedy(largest, ratio), position=_position(table, largest))
    return notes


def note_unused(table: Table, used: Mapping[str, object]) -> list[str]:
    """Return a note on the columns that no quantity of the method uses."""
    unused = [name for name in table.names if name not in used]
    if not unused:
        return []
    names = "Yi, Yi.right, Yi.left, Qi.right, Qi.left, ay_body.POINT, floor.POINT, ayf.POINT"
    return [f"columns not used: {join_names(unused)}; evaluated are {names}"]


def _unit_remedy(name: str, ratio: float) -> str:
    """Return the remedy for a force a thousand times too small or too large, or of the wrong unit."""
    unit = "kN" if ratio < 1.0 else "N"
    return f"write `{name} [{unit}]` where the numbers are {unit}, or give the design of the vehicle that was measured"


def _position(table: Table, name: str) -> tuple[int, int]:
    return table.header_position[0], table.column_positions[table.names.index(name)]
