"""Student's t and the standard normal variable of the same probability, against scipy's distributions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from railui.identification.structure.student import as_normal, from_normal, noncentrality


@pytest.mark.parametrize("freedom", [6.0, 12.0, 40.0])
@pytest.mark.parametrize("z", [0.5, 1.645, 3.09])
def test_a_standard_normal_variable_has_the_probability_of_its_t(z: float, freedom: float) -> None:
    t = from_normal(z, freedom)
    assert t == pytest.approx(stats.t.isf(stats.norm.sf(z), freedom), rel=0.015)
    assert as_normal(t, freedom) == pytest.approx(z, rel=1e-12)
    assert as_normal(-t, freedom) == pytest.approx(-z, rel=1e-12)


@pytest.mark.parametrize(("freedom", "most"), [(3.0, 0.065), (5.0, 0.015), (11.0, 0.002)])
def test_three_standard_errors_are_hardly_too_many_of_few_blocks(freedom: float, most: float) -> None:
    exact = stats.t.isf(stats.norm.sf(3.0), freedom)
    assert exact <= from_normal(3.0, freedom) <= (1.0 + most) * exact


def test_a_score_of_nothing_is_zero() -> None:
    assert from_normal(0.0, 5.0) == 0.0
    np.testing.assert_array_equal(as_normal(np.zeros(2), np.array([1.0, 9.0])), 0.0)


@pytest.mark.parametrize("freedom", [4.0, 8.0, 40.0])
@pytest.mark.parametrize("power", [0.5, 0.9])
def test_t_exceeds_its_critical_value_with_the_power(power: float, freedom: float) -> None:
    delta = noncentrality(4.0, freedom, float(stats.norm.ppf(power)))
    assert stats.nct.sf(4.0, freedom, delta) == pytest.approx(power, abs=0.02)
