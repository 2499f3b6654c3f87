"""Guidance: flange contact of a Gaussian displacement and the guidance index."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import special

from railui.ride_quality.guidance import guidance_index, log_flange_fraction_gaussian, log_ndtr

CLEARANCE = 0.007


def gaussian_share(mean, sd, clearance):
    """phi_G itself."""
    return np.exp(log_flange_fraction_gaussian(mean, sd, clearance))


def test_the_gaussian_share_of_flange_contact_is_the_sum_of_both_tails():
    m, sd, c = 1e-3, 3e-3, 7e-3
    by_hand = 0.5 * math.erfc((c - m) / (math.sqrt(2) * sd)) + 0.5 * math.erfc((c + m) / (math.sqrt(2) * sd))
    assert float(gaussian_share(m, sd, c)) == pytest.approx(by_hand, rel=1e-12)
    assert float(gaussian_share(-m, sd, c)) == pytest.approx(by_hand, rel=1e-12)


def test_the_log_share_is_finite_where_the_share_underflows():
    # far out: 2 exp(-x^2/2)/(x sqrt(2 pi)) (1 - 1/x^2), x = c/sd
    x = 70.0
    by_hand = math.log(2) - x**2 / 2 - math.log(x * math.sqrt(2 * math.pi)) + math.log1p(-1 / x**2 + 3 / x**4)
    assert float(log_flange_fraction_gaussian(0.0, 1e-4, 7e-3)) == pytest.approx(by_hand, rel=1e-9)
    assert float(gaussian_share(0.0, 1e-4, 7e-3)) == 0.0


def test_a_constant_displacement_touches_always_or_never():
    assert gaussian_share([0.0, 8e-3, -8e-3, 7e-3], 0.0, 7e-3) == pytest.approx([0, 1, 1, 0.5])


@given(st.floats(-0.02, 0.02), st.floats(0, 0.05), st.floats(0, 0.05))
def test_shares_lie_between_0_and_1_and_grow_with_the_standard_deviation(mean, one, other):
    small, large = sorted((one, other))
    result = [float(gaussian_share(mean, sd, CLEARANCE)) for sd in (small, large)]
    assert min(result) >= 0 and max(result) <= 1
    if abs(mean) < CLEARANCE:
        assert result[0] <= result[1] * (1 + 1e-12)


def test_guidance_is_0_at_the_admissible_share_and_1_at_a_millionth():
    shares = np.log([0.05, 1e-6, math.sqrt(0.05e-6), 0.2, 1e-9])
    assert guidance_index(shares, 0.05) == pytest.approx([0, 1, 0.5, 0, 1], abs=1e-12)
    assert float(guidance_index(-np.inf, 0.05)) == 1.0


def test_an_admissible_share_of_a_millionth_or_less_is_rejected():
    with pytest.raises(ValueError, match="admissible_flange_fraction"):
        guidance_index(-5.0, 1e-6)


def test_the_log_normal_distribution_agrees_with_scipy_in_its_tail():
    x = np.concatenate([-np.geomspace(1e-9, 1e150, 4000), np.geomspace(1e-9, 37.0, 500), np.linspace(-31, -29, 200)])
    np.testing.assert_allclose(log_ndtr(x), special.log_ndtr(x), rtol=1e-12)
    assert log_ndtr([-np.inf, np.inf]).tolist() == [-np.inf, 0.0]
