"""Jobs of the Design panel: evaluate a design and its base."""

from __future__ import annotations

from collections.abc import Sequence

from textual.message import Message

from railui.desk.messages import DesignsEvaluated, JobDone, ProgressEvent
from railui.desk.presenters.design_results import (
    Comparison,
    add_curving,
    evaluate_comparison,
    evaluate_design,
)
from railui.desk.services.jobs import BackgroundJob
from railui.desk.state.run_conditions import RunConditions
from railui.desk.state.shelf import ShelfItem
from railui.vehicle.design_reader import Design


def evaluate_designs(design: Design, base: Design, conditions: RunConditions, last: Comparison | None) -> Message:
    """Evaluate a design and its base."""
    return DesignsEvaluated(*evaluate_comparison(design, base, conditions, last))


def evaluate_curving(results: Comparison) -> Message:
    """Add curving to the results of a design and its base."""
    return DesignsEvaluated(*add_curving(*results), is_addition=True)


def evaluate_one_by_one(job: BackgroundJob, items: Sequence[ShelfItem], conditions: RunConditions) -> Message:
    """Evaluate designs of the shelf; each result is posted with its letter."""
    for item in items:
        job.checkpoint()
        job.owner.post_message(ProgressEvent(job.name, (item.letter, evaluate_design(item.design, conditions))))
    return JobDone(job.name, None)
