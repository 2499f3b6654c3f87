"""Jobs of the Design panel: evaluate a design and its base."""

from __future__ import annotations

from textual.message import Message

from railui.desk.messages import DesignsEvaluated
from railui.desk.presenters.design_results import (
    Comparison,
    add_curving,
    evaluate_comparison,
)
from railui.desk.state.run_conditions import RunConditions
from railui.vehicle.design_reader import Design


def evaluate_designs(design: Design, base: Design, conditions: RunConditions, last: Comparison | None) -> Message:
    """Evaluate a design and its base."""
    return DesignsEvaluated(*evaluate_comparison(design, base, conditions, last))


def evaluate_curving(results: Comparison) -> Message:
    """Add curving to the results of a design and its base."""
    return DesignsEvaluated(*add_curving(*results), is_addition=True)
