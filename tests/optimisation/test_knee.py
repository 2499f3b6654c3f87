"""Knee of a front: the plane that it is farthest from, and fronts that have none."""

from __future__ import annotations

import numpy as np
import pytest

from railui.optimisation.knee import find_knee, knee_notes, knee_warnings


def test_the_knee_of_one_objective_is_its_best_value() -> None:
    assert find_knee(np.array([[-3.0], [-7.0]])).index == 1


def test_the_knee_of_three_objectives_is_farthest_from_the_plane_through_the_ends() -> None:
    """Ends (0, 1, 0.6), (0.6, 0, 1), (1, 0.6, 0): the plane is x + y + z = 1.6."""
    ends = np.array([[0.0, 1.0, 0.6], [0.6, 0.0, 1.0], [1.0, 0.6, 0.0]])
    knee = find_knee(np.vstack([ends, [[0.4, 0.45, 0.4]], [[0.1, 0.7, 0.6]]]))
    assert (knee.index, knee.through) == (3, "ends")
    assert knee.distance == pytest.approx((1.6 - 1.25) / np.sqrt(3))
    assert knee_notes(knee) == [] == knee_warnings(knee, 5, 3)


def test_a_worse_value_is_never_a_gain_of_the_knee() -> None:
    """The plane through these ends rises with the first objective, from which design 3 would be the farthest."""
    front = np.array([[0.0, 0.02, 0.75], [0.06, 0.0, 1.0], [1.0, 1.0, 0.0], [0.5, 0.2, 0.3], [0.05, 0.07, 0.5]])
    normal = np.linalg.solve(front[:3], np.ones(3))
    assert normal[0] < 0 and np.argmax(1 - front @ normal) == 3
    knee = find_knee(front)
    assert (knee.index, knee.through) == (4, "axes")
    assert knee.distance == pytest.approx((1 - front[4].sum()) / np.sqrt(3))
    assert "least sum of scaled objectives" in knee_notes(knee)[0]


def test_ends_that_coincide_span_no_plane() -> None:
    """The first design is the best of two objectives, the third objective is the same on the whole front."""
    costs = np.array([[0.0, 0.0, 1.0, 5.0], [0.2, 0.2, 0.1, 5.0], [1.0, 1.0, 0.0, 5.0]])
    knee = find_knee(costs)
    assert (knee.index, knee.through) == (1, "axes") and knee.distance == pytest.approx(0.5 / np.sqrt(3))


def test_fronts_without_a_knee_are_said() -> None:
    one = find_knee(np.array([[0.2, 0.4]]))
    assert (one.index, one.through, one.distance) == (0, None, None)
    assert knee_warnings(one, 1, 2) == [
        "the front is one design, of all tried the best in every objective: there is no knee to choose"
    ]
    two = find_knee(np.array([[0.0, 1.0], [1.0, 0.0]]))
    hollow = find_knee(np.array([[0.0, 1.0], [0.8, 0.8], [1.0, 0.0]]))
    assert two.distance == pytest.approx(0, abs=1e-12) and hollow.index == 0
    assert "the front of two designs does not bulge" in knee_warnings(two, 2, 2)[0]
    assert "the front does not bulge" in knee_warnings(hollow, 3, 2)[0]
    assert knee_warnings(find_knee(np.array([[1.0]])), 1, 1) == []
