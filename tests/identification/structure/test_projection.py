"""Tests of the projection onto the complement of the estimated parameters."""

import numpy as np
import pytest

from railui.identification.estimation.free_parameters import FreeParameters
from railui.identification.structure.projection import Projector

LOW, HIGH, INSIDE = 1.0, 2.0, 1.5


def parameter(prior_sd: float = np.inf) -> FreeParameters:
    low, high, size, prior = (np.array([v]) for v in (LOW, HIGH, 1.0, INSIDE))
    return FreeParameters(("a",), low, high, size, prior, np.array([prior_sd]), np.array([False]))


def unabsorbed_share(x: float, residual: float, prior_sd: float = np.inf) -> float:
    """Share of a difference parallel to the only sensitivity, which has unit length."""
    inner = np.array([[[residual**2, residual], [residual, 1.0]]])
    projector = Projector(inner, parameter(prior_sd), np.array([x]), variance=1.0)
    scores = projector.project(np.array([[[residual, 1.0]]]), np.array([[1.0]]), 0.0)
    return float(scores.unabsorbed_share[0])


@pytest.mark.parametrize(("x", "residual"), [(INSIDE, 1.0), (INSIDE, -1.0), (LOW, 1.0), (HIGH, -1.0)])
def test_a_parameter_that_can_move_absorbs_what_is_parallel_to_it(x: float, residual: float) -> None:
    assert unabsorbed_share(x, residual) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("x", "residual"), [(LOW, -1.0), (HIGH, 1.0)])
def test_a_parameter_pressed_against_its_bound_absorbs_nothing(x: float, residual: float) -> None:
    assert unabsorbed_share(x, residual) == pytest.approx(1.0, rel=1e-5)


def test_a_prior_leaves_its_share() -> None:
    """A prior as precise as the data moves the estimate half as far: (1 - 1/2)^2 of the squared length is left."""
    assert unabsorbed_share(INSIDE, 1.0, prior_sd=1.0) == pytest.approx(0.25)
