"""Events of a loop, reduced to what the desk shows of them: those of the identification contain whole models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from railui.api.events import ModelValidated, NoiseFloor, Refit, ScoreTestResult
from railui.vehicle.design import Design

FLOOR = "floor"


@dataclass(frozen=True, eq=False)
class ErrorsKnown:
    """NRMSE of a model (declared, before, after), or of noise (floor), per channel and over all channels."""

    model: str
    channels: Mapping[str, float]
    total: float


@dataclass(frozen=True, eq=False)
class CandidateRefitted:
    """Candidate that was fitted with all parameters: its residual sum of squares and the fitted vehicle."""

    candidate: Any
    rss: float
    design: Design


@dataclass(frozen=True, eq=False)
class RefitsBegun:
    """End of a score test: the best candidates are fitted."""


def reduced_event(event: object) -> object:
    """Return an event of a loop without models and series."""
    if isinstance(event, ModelValidated):
        return ErrorsKnown(event.stage, dict(event.validation.channels), event.validation.nrmse)
    if isinstance(event, NoiseFloor):
        return ErrorsKnown(FLOOR, dict(event.channels), event.nrmse)
    if isinstance(event, Refit):
        return CandidateRefitted(event.candidate, event.rss, event.fit.model.design)
    return RefitsBegun() if isinstance(event, ScoreTestResult) else event
