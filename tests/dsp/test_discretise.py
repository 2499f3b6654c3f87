"""First-order-hold discretisation against scipy.linalg and 60 digits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from railui.dsp.discretise import first_order_hold, matrix_exponential, sampled_zeros, state_space
from railui.ride_quality.weighting import SPERLING_B, W_1974, W_D, AnalogFilter, cascade, transmissibility

RATE = 400.0


def test_the_matrix_exponential_agrees_with_scipy() -> None:
    rng = np.random.default_rng(5)
    for size in (0.0, 1e-3, 1.0, 40.0):
        a = size * rng.standard_normal((6, 6)) - size * 3.0 * np.eye(6)
        np.testing.assert_allclose(matrix_exponential(a), linalg.expm(a), rtol=1e-11, atol=1e-13)


def zeros(weight: AnalogFilter) -> tuple[np.ndarray, np.ndarray]:
    """Return sampled zeros of a weighting as distances z - 1, smallest first, by railui and by QZ of scipy.linalg."""
    system = first_order_hold(state_space(weight.zeros, weight.poles), 1.0 / RATE)
    (a, b, c, d), n = system, len(system[0])
    result = linalg.eigvals(np.block([[a, b], [c, d]]), np.diag([1.0] * n + [0.0]))
    return sampled_zeros(*system), np.array(sorted(result[np.isfinite(result)], key=abs)[:n])


@pytest.mark.parametrize("weight", [W_D, SPERLING_B])
def test_sampled_zeros_solve_the_generalised_eigenvalue_problem(weight: AnalogFilter) -> None:
    ours, theirs = (result[np.abs(result) > 1e-4] for result in zeros(weight))  # zeros at s = 0 are exact
    assert len(theirs) >= 2
    np.testing.assert_allclose(ours, theirs, rtol=1e-7)


def test_sampled_zeros_of_a_long_cascade_agree_with_sixty_digits() -> None:
    """By mpmath from the poles on; QZ has them to 1e-7."""
    ours, _ = zeros(cascade(W_1974, transmissibility(1.2, 0.2), transmissibility(3.0, 0.1)))
    exact = [-0.02175110609052692, -0.04603079678847842, -0.2099187170731711, -1.0159094595875129, -1.1768186709702337]
    assert ours[2:] == pytest.approx([*exact, -1.7914096688753176, -4.61249056141104, -41.944203831754166], rel=1e-11)
