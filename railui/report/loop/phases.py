"""What belongs to a run and not to the vehicle: the phase of what turns, on every stretch of every run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from railui.campaign.dataset import Segment
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.estimation.output_error import Fit
from railui.identification.loop import LoopResult
from railui.vehicle.model import RADIUS, TURN


def phases(found: LoopResult, index: int) -> list[dict[str, Any]]:
    """The phase [rad] at distance s = 0 of an effect of the vehicle as found, one row per stretch; none for most.

    On adjusting runs as fitted, with its standard deviation; on validating ones as the judgement estimates it.
    """
    rows = []
    for path in found.after.model.run_paths():
        if not path.startswith(f"effects.{index}."):
            continue
        for stretch in found.measurement.stretches:
            own = estimate_phases(found.after.model, stretch, found.measurement.noise).on(*stretch.segment_key)
            rows.append(
                {
                    "file": stretch.file,
                    "role": stretch.role,
                    "stretch": stretch.number,
                    "value": own.value(path) % TURN,
                    "sd": _spread(found.after, path, stretch),
                    "unit": "rad",
                }
            )
    return rows


def phase_of(phase: Mapping[str, Any]) -> str:
    """The stretch of a phase in words."""
    return f"{phase['file']}" + (f", stretch {phase['stretch'] + 1}" if phase["stretch"] else "")


def _spread(fit: Fit, path: str, stretch: Segment) -> float | None:
    """Standard deviation at s = 0 of phase = angle in the middle - middle/r_e; None where it was not fitted."""
    where, middle = stretch.segment_key
    radius = f"{path.rpartition('.')[0]}.{RADIUS}"
    slopes = {f"{path}@{where}": 1.0, radius: middle / fit.model.value(radius) ** 2}
    if f"{path}@{where}" not in fit.free.paths:
        return None
    g = np.array([slopes.get(p, 0.0) for p in fit.free.paths])
    return float(np.sqrt(max(g @ fit.covariance @ g, 0.0)))
