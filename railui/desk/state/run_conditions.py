"""Run conditions of the Design panel."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RunConditions:
    """Run conditions: track (spec or file) and speed [m/s]."""

    track: str = "erri_b176_low length=2000 seed=1"
    speed: float = 40.0
