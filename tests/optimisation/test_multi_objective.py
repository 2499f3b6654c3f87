"""Multi-objective search: the knee of a front."""

from __future__ import annotations

import numpy as np

from railui.optimisation.multi_objective import knee


def test_the_knee_of_one_objective_is_its_best_value() -> None:
    assert knee(np.array([[3.0], [7.0]]), np.array([-1.0])) == 1
