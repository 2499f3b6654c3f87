"""Assessments and studies made of numbers, without a vehicle."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from railui.optimisation.objectives import Assessment
from railui.optimisation.study import Constraint, Objective, Variable

DAMPING = Constraint("linear_damping", ">=", 0.05, "")
WEAR = Constraint("wear_number", "<=", 200.0, "")


def plain_study(*objectives: Objective, constraints: tuple[Constraint, ...] = ()) -> Any:
    """Return what the search reads of a study: variables a (linear) and b (logarithmic)."""
    variables = (Variable("a", 0.0, 1.0, "1"), Variable("b", 1.0, 100.0, "1"))
    return SimpleNamespace(variables=variables, objectives=objectives, constraints=constraints)


def assessment(
    objectives: np.ndarray, constraints: np.ndarray | None = None, distance_share: np.ndarray | None = None
) -> Assessment:
    """Return an assessment, by default without constraints and failures."""
    n = len(objectives)
    return Assessment(
        objectives=objectives,
        constraints=np.zeros((n, 0)) if constraints is None else constraints,
        distance_share=np.ones(n) if distance_share is None else distance_share,
        reasons=[""] * n,
    )
