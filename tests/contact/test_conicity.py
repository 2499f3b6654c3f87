"""Equivalent conicity by EN 15302: cones, a known oscillator, the tables of the standard, shifted centres."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipk

from railui.contact.conicity import NoCentreError, equivalent_conicity, klingel_wavelength
from tests.contact.shapes import reference

Y = np.linspace(-7e-3, 7e-3, 141)


@given(st.floats(0.005, 0.6), st.floats(1e-3, 6e-3))
def test_a_cone_has_its_own_conicity_at_every_amplitude(conicity: float, amplitude: float) -> None:
    # r_1 - r_2 = 2 tan(gamma) y
    result = equivalent_conicity(Y, 2.0 * conicity * Y, [amplitude])
    assert result.tan_gamma[0] == pytest.approx(conicity, rel=1e-6)
    assert result.centre == pytest.approx(0.0, abs=1e-12)


def test_a_cubic_spring_has_the_period_of_the_elliptic_integral() -> None:
    # y'' = -(a y + c y^3): period 4 K(m)/w, w^2 = a + c A^2, m = c A^2/(2 w^2); tan gamma = (w pi/(2 K))^2/2
    a, c, A = 2 * 0.1, 2 * 0.1 * 4e4, 4e-3
    y = np.linspace(-6e-3, 6e-3, 4801)
    w2 = a + c * A**2
    expected = 0.5 * w2 * (np.pi / (2.0 * ellipk(c * A**2 / (2.0 * w2)))) ** 2
    assert equivalent_conicity(y, a * y + c * y**3, [A]).tan_gamma[0] == pytest.approx(expected, rel=2e-5)


@given(st.floats(-2e-3, 2e-3))
def test_unequal_diameters_shift_the_centre_and_leave_a_cone_its_conicity(shift: float) -> None:
    result = equivalent_conicity(Y, 0.3 * (Y - shift), [3e-3])
    assert result.centre == pytest.approx(shift, abs=1e-9)
    assert result.tan_gamma[0] == pytest.approx(0.15, rel=1e-6)


def test_the_table_is_not_extrapolated() -> None:
    result = equivalent_conicity(Y, 0.1 * Y)
    assert result.amplitude[-1] == pytest.approx(7e-3)
    assert result.omitted_amplitudes[0] == pytest.approx(7.1e-3)
    shifted = equivalent_conicity(Y, 0.1 * (Y - 1.5e-3))
    assert shifted.amplitude[-1] == pytest.approx(5.5e-3)


def test_small_motions_between_two_wells_have_no_conicity() -> None:
    # S = y^4/4 - h^2 y^2/2: a motion round both wells turns beyond h sqrt(2)
    h = 2e-3
    result = equivalent_conicity(Y, 1e5 * (Y**3 - h * h * Y), np.array([1e-3, 2.7e-3, 2.9e-3, 4e-3]))
    assert np.isnan(result.tan_gamma[:2]).all()
    assert np.isfinite(result.tan_gamma[2:]).all()
    assert result.centre == pytest.approx(0.0, abs=1e-12)


def test_a_table_without_a_centre_is_rejected() -> None:
    with pytest.raises(NoCentreError, match="no centre"):
        equivalent_conicity(Y, 0.1 * Y + 2e-3)
    with pytest.raises(NoCentreError, match="falls through zero"):
        equivalent_conicity(Y, -0.1 * Y)
    with pytest.raises(ValueError, match="must increase"):
        equivalent_conicity(Y[::-1], 0.1 * Y)


@pytest.mark.parametrize("name", ["E1", "E2", "E3", "E4"])
def test_the_tables_of_the_standard_have_their_nominal_conicity(name: str) -> None:
    y, delta_r = np.genfromtxt(reference(f"en15302/{name}_delta_r.csv"), delimiter=",", skip_header=1).T * 1e-3
    amplitude, nominal, upper, lower = np.genfromtxt(
        reference(f"en15302/{name}_conicity.csv"), delimiter=",", skip_header=1
    ).T
    result = equivalent_conicity(y, delta_r, amplitude * 1e-3)
    at = np.array([result.at(a * 1e-3) for a in amplitude])
    near = (amplitude > 1.999) & (amplitude < 5.001)
    assert np.abs(at - nominal)[near].max() < 0.004
    known = np.isfinite(at)
    assert known.sum() > 40
    assert ((lower <= at) & (at <= upper))[known].all()
    assert not known[amplitude * 1e-3 > y[-1] + 1e-9].any()
    if name == "E4":  # no rolling radius difference at all within 1.7 mm
        assert not known[amplitude < 1.65].any()


def test_klingel_s_wavelength() -> None:
    # L = 2 pi sqrt(b r/tan gamma)
    assert klingel_wavelength(0.75, 0.46, 0.1) == pytest.approx(11.670, abs=5e-4)
    assert klingel_wavelength(0.75, 0.46, 0.05) == pytest.approx(16.5045, abs=1e-4)
