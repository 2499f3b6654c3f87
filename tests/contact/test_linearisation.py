"""Linearisation of the contact geometry: a cubic and a broken line in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from railui.contact.contact_points import find_contacts
from railui.contact.geometry import ContactGeometry
from railui.contact.linearisation import fit_forms, linearise, linearise_harmonically
from tests.contact.shapes import cones, conicity_of_cones


def bent(curve: np.ndarray, e: np.ndarray) -> ContactGeometry:
    """A geometry whose (r_1 - r_2)/2 is a given curve."""
    zero = np.zeros_like(e)
    return ContactGeometry(cones(0.05), e, np.array([curve, -curve]), np.array([zero + 0.05] * 2), np.array([zero] * 2),
                    np.array([zero] * 2), zero)  # fmt: skip


E = np.linspace(-0.012, 0.012, 2401)


@pytest.mark.parametrize("sd", [1e-3, 2e-3, 3e-3])
def test_a_cubic_has_the_statistical_slope_lambda_plus_three_cubic_variances(sd: float) -> None:
    # E[e (l e + l l3 e^3)]/s^2 = l (1 + 3 l3 s^2)
    result = linearise(bent(0.1 * E * (1 + 2e4 * E**2), E), sd)
    assert result.conicity == pytest.approx(0.1 * (1 + 3 * 2e4 * sd**2), rel=2e-3)


def test_a_cubic_has_the_harmonic_slope_lambda_plus_three_quarters() -> None:
    result = linearise_harmonically(bent(0.1 * E * (1 + 2e4 * E**2), E), 4e-3)
    assert result.conicity == pytest.approx(0.1 * (1 + 0.75 * 2e4 * 16e-6), rel=1e-3)


def test_play_has_the_statistical_slope_of_stassen() -> None:
    # a slope beyond +/-h alone: k (1 - erf(h/(s sqrt 2)))
    h, s = 2e-3, 2.5e-3
    curve = 0.3 * (E - np.clip(E, -h, h))
    assert linearise(bent(curve, E), s).conicity == pytest.approx(0.3 * (1 - erf(h / s / np.sqrt(2))), rel=2e-3)


def test_a_motion_beyond_the_geometry_has_no_parameters() -> None:
    narrow = np.linspace(-4e-3, 4e-3, 801)
    result = linearise(bent(0.1 * narrow, narrow), 3e-3)
    assert np.isnan(result.conicity) and result.beyond > 0.1
    assert np.isnan(linearise_harmonically(bent(0.1 * narrow, narrow), 5e-3).conicity)


def test_the_fitted_forms_recover_their_own_curves() -> None:
    cubic = fit_forms(bent(0.1 * E * (1 + 2e4 * E**2), E), 2e-3)
    assert (cubic.polynomial_conicity, cubic.cubic) == pytest.approx((0.1, 2e4), rel=1e-6)
    line = fit_forms(bent(0.1 * E + 0.4 * (E - np.clip(E, -3e-3, 3e-3)), E), 2e-3)
    assert (line.inner_conicity, line.outer_conicity) == pytest.approx((0.1, 0.5), rel=0.02)
    assert line.knee == pytest.approx(3e-3, rel=0.02)
    assert line.broken_line_error < 1e-3 < line.polynomial_error


def test_a_cone_is_linear_whatever_the_motion() -> None:
    contacts = find_contacts(cones(0.05))
    result = [linearise(contacts, s).conicity for s in (5e-4, 1e-3, 2e-3)]
    assert result == pytest.approx([conicity_of_cones(0.05, contacts)] * 3, rel=2e-3)
    assert linearise_harmonically(contacts, 3e-3).conicity == pytest.approx(result[0], rel=2e-3)
