"""Design space: the initial population."""

from __future__ import annotations

import numpy as np
import pytest

from railui.optimisation.design_space import DesignSpace, initial_population
from railui.optimisation.study import Variable


def test_the_initial_population_fills_every_stratum_and_contains_the_baseline() -> None:
    space = DesignSpace([Variable("a", 1.0, 2.0, "1"), Variable("b", 1.0, 1000.0, "1")])
    population = initial_population(space, 16, np.array([1.5, 5000.0]), 1)
    assert np.array_equal(np.sort((16 * population).astype(int), axis=0), np.tile(np.arange(16), (2, 1)).T)
    with_baseline = initial_population(space, 16, np.array([1.5, 10.0]), 1)
    assert with_baseline[0] == pytest.approx([0.5, 1 / 3])
    assert space.to_unit(space.from_unit(population)) == pytest.approx(population)
