"""Decision between the rivals of a loop on a measured run, by Vuong's test of their corrected predictions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.campaign.comparison import compared_channels, comparison_filter
from railui.campaign.segment import Segment
from railui.campaign.settings.planning import PlanningSettings
from railui.identification.context import Context
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.estimation.noise_floor import noise_weights
from railui.planning.rival_runs import Misfit, predict
from railui.planning.rivals import RivalModel


@dataclass(frozen=True)
class Decision:
    """Comparison of the final model with another on a measured run.

    Attributes
    ----------
    rival
        Number of the other model.
    z
        Vuong's statistic, positive for the final model.
    is_clear
        True where the test decides at the separation level.
    """

    rival: int
    z: float
    is_clear: bool


def decide(context: Context, rivals: Sequence[RivalModel], segments: Sequence[Segment]) -> list[Decision]:
    """Compare the final model with each other rival on measured segments, by Vuong's test."""
    quiet = context.in_background(1)
    misfits: list[list[Misfit]] = [[] for _ in rivals]
    for segment in segments:
        weights = noise_weights(quiet, rivals[0].model, segment)
        rows = [segment.channels.index(c) for c in compared_channels(segment) if c in context.noise]
        measured = comparison_filter(context.campaign, segment, segment.measured(segment.channels)) * weights[:, None]
        for rival, found in zip(rivals, misfits, strict=True):
            model = estimate_phases(quiet, rival.model, segment)
            start = estimate_initial_state(quiet, model, segment)
            prediction = predict(quiet, replace(rival, model=model), segment, weights, start)
            found += prediction.products(measured[None]).misfits(rows)
    return compare_misfits(misfits, context.settings.planning)


def compare_misfits(misfits: Sequence[Sequence[Misfit]], settings: PlanningSettings) -> list[Decision]:
    """Compare the misfits of the final model on some segments with those of each other rival."""
    joined = [Misfit(np.concatenate([m.errors for m in x]), sum(m.distance for m in x)) for x in misfits]
    statistics = [joined[0].statistic(other) for other in joined[1:]]
    return [Decision(j, z, abs(z) > settings.critical_z) for j, z in enumerate(statistics, 1)]
