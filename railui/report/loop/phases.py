"""Phases of rotating effects, which belong to a run and not to the vehicle, on every segment of every run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from railui.campaign.segment import Segment
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.initial_state import estimate_phases
from railui.identification.result import LoopResult
from railui.vehicle.model import RADIUS, TURN


def phase_rows(result: LoopResult, index: int) -> list[dict[str, Any]]:
    """Return the phase [rad] at distance s = 0 of a rotating effect of the model, one row per segment.

    Estimation runs: as fitted, with its standard deviation; validation runs: as estimated for the validation.
    """
    rows = []
    for path in result.after.model.run_dependent_paths():
        if not path.startswith(f"effects.{index}."):
            continue
        for segment in result.dataset.segments:
            model = estimate_phases(result.context, result.after.model, segment)
            model = model.on_segment(*segment.segment_key)
            rows.append(
                {
                    "file": segment.file,
                    "role": segment.role,
                    "stretch": segment.number,
                    "value": model.value(path) % TURN,
                    "sd": _phase_sd(result.after, path, segment),
                    "unit": "rad",
                }
            )
    return rows


def segment_text(phase: Mapping[str, Any]) -> str:
    """Return the segment of a phase in words."""
    return f"{phase['file']}" + (f", segment {phase['stretch'] + 1}" if phase["stretch"] else "")


def _phase_sd(fit: Fit, path: str, segment: Segment) -> float | None:
    """Return the standard deviation at s = 0 of phase = angle in the middle - middle/r_e; None where not fitted."""
    key, middle, _ = segment.segment_key
    radius = f"{path.rpartition('.')[0]}.{RADIUS}"
    slopes = {f"{path}@{key}": 1.0, radius: middle / fit.model.value(radius) ** 2}
    if f"{path}@{key}" not in fit.free.paths:
        return None
    g = np.array([slopes.get(p, 0.0) for p in fit.free.paths])
    return float(np.sqrt(max(g @ fit.covariance @ g, 0.0)))
