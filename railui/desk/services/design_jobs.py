"""Jobs of the Design panel: evaluate designs, compute critical speeds."""

from __future__ import annotations

from textual.message import Message

from railui.desk.messages import DesignsEvaluated, JobDone
from railui.desk.presenters.design_results import (
    Comparison,
    add_curving,
    evaluate_comparison,
    load_track,
)
from railui.desk.presenters.ride_quality import critical_speeds_text
from railui.desk.services.jobs import BackgroundJob, Checkpoints
from railui.desk.state.run_conditions import RunConditions
from railui.running_stability.summary import stability
from railui.vehicle.design_reader import Design


def evaluate_designs(design: Design, base: Design, conditions: RunConditions, last: Comparison | None) -> Message:
    """Evaluate a design and its base."""
    return DesignsEvaluated(*evaluate_comparison(design, base, conditions, last))


def evaluate_curving(results: Comparison) -> Message:
    """Add curving to the results of a design and its base."""
    return DesignsEvaluated(*add_curving(*results), is_addition=True)


def compute_critical_speeds(job: BackgroundJob, design: Design, track: str) -> Message:
    """Compute the linear and nonlinear critical speeds and the speed limit by ride criteria on a track."""
    speeds = stability(design, fold=True, track=load_track(track), progress=Checkpoints(job))
    return JobDone(job.name, critical_speeds_text(speeds, track))
