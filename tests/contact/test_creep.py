"""Hertz's ellipse, Kalker's coefficients, the factors of Vermeulen and Johnson, and the laws of creep."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from railui import core
from railui.contact.contact_points import find_contacts
from railui.contact.creep import creep_coefficients, mean_creep_coefficients
from railui.contact.hertz import hertz
from railui.contact.kalker import kalker_coefficients, vermeulen_johnson_factors
from tests.contact.shapes import cones


def test_a_ball_on_a_plane_has_a_circle_of_contact() -> None:
    # a^3 = 3 P R/(4 E*), E* = E/(2 (1 - nu^2)) for two bodies of one material; p_0 = 3 P/(2 pi a^2); d = a^2/R
    P, R, E, nu = 55e3, 0.3, 210e9, 0.28
    a = (3 * P * R / (4 * E / (2 * (1 - nu**2)))) ** (1 / 3)
    result = hertz(P, 1 / R, 1 / R, E, nu)
    assert (result.a, result.b) == pytest.approx((a, a), rel=1e-9)
    assert result.pressure == pytest.approx(3 * P / (2 * np.pi * a * a), rel=1e-9)
    assert result.approach == pytest.approx(a * a / R, rel=1e-9)


@given(st.floats(0.3, 3.0), st.floats(1.0, 30.0), st.floats(1e3, 2e5))
def test_the_ellipse_obeys_hertz_s_two_conditions(along: float, across: float, load: float) -> None:
    # curvature/2 = 3 P/(4 pi E*) integral_0^inf dw/((a^2 + w) sqrt((a^2 + w)(b^2 + w) w))
    result = hertz(load, along, across)
    modulus = 210e9 / (2 * (1 - 0.28**2))
    a2, b2 = result.a**2, result.b**2
    factor = 3 * load / (4 * np.pi * modulus)
    # which is Carlson's (2/3) R_D(0, b^2, a^2)
    assert factor * 2 / 3 * elliprd(0, b2, a2) == pytest.approx(along / 2, rel=1e-6)
    assert factor * 2 / 3 * elliprd(0, a2, b2) == pytest.approx(across / 2, rel=1e-6)
    assert factor * 2 * elliprf(0, a2, b2) == pytest.approx(result.approach, rel=1e-6)


def test_a_conforming_contact_is_rejected() -> None:
    with pytest.raises(ValueError, match="conforming"):
        hertz(55e3, 2.0, -0.1)


PUBLISHED = {0.1: (3.31, 2.52, 0.473), 0.6: (3.72, 3.14, 1.03), 1.0: (4.12, 3.67, 1.47), 2.0: (5.10, 4.90, 2.62),
             10.0: (11.7, 12.8, 14.6)}  # fmt: skip


@pytest.mark.parametrize("ratio", PUBLISHED)
def test_kalker_s_table_at_its_own_points(ratio: float) -> None:
    assert kalker_coefficients(ratio) == pytest.approx(PUBLISHED[ratio], rel=1e-9)


def test_kalker_s_coefficients_lie_between_their_neighbours() -> None:
    assert kalker_coefficients(1.0, 0.0) == pytest.approx((3.40, 3.40, 1.33))
    assert kalker_coefficients(1.0, 0.5) == pytest.approx((5.20, 3.98, 1.63))
    assert 3.62 < kalker_coefficients(0.55).c11 < 3.72
    assert 4.12 < kalker_coefficients(1.0, 0.28).c11 < 5.20
    with pytest.raises(ValueError, match="the table is for"):
        kalker_coefficients(0.05)


def test_kaas_petersen_s_factors_are_those_of_one_ellipse() -> None:
    # he divides the longitudinal creepage by 0.60252, the lateral one by 0.54219: of steel, the other way round
    ratio = brentq(lambda x: vermeulen_johnson_factors(x, 0.3).psi - 0.60252, 1.0, 3.0)
    assert ratio == pytest.approx(1.672, abs=1e-3)
    assert vermeulen_johnson_factors(ratio, 0.3).phi == pytest.approx(0.54219, rel=5e-4)


@given(st.floats(0.15, 7.0))
def test_vermeulen_and_johnson_are_8_to_27_percent_steeper_than_kalker(ratio: float) -> None:
    c, f = kalker_coefficients(ratio), vermeulen_johnson_factors(ratio)
    assert 1.05 < np.pi / (f.phi * c.c11) < 1.3
    assert 1.05 < np.pi / (f.psi * c.c22) < 1.3


def test_the_coefficients_of_the_model_are_kalker_s_over_the_load() -> None:
    contacts = find_contacts(cones(0.05))
    clean, worn = (creep_coefficients(contacts, 55e3, surface=s) for s in (1.0, 0.5))
    # the wheel is straight across, the rail 0.3 m round
    assert clean.wheel_across == pytest.approx(0.0, abs=0.05)
    assert clean.rail_across == pytest.approx(1 / 0.3, rel=0.02)
    shear = 210e9 / (2 * 1.28)
    e = clean.ellipse
    assert clean.longitudinal_creep == pytest.approx(shear * e.a * e.b * clean.kalker.c11 / 55e3)
    assert clean.spin_creep == pytest.approx(shear * (e.a * e.b) ** 1.5 * clean.kalker.c23 / 55e3)
    assert worn.lateral_creep == pytest.approx(0.5 * clean.lateral_creep)


# ------------------------------------------------------------------------------------------------------- laws of creep

LAWS = ("creep_saturation", "vermeulen_johnson", "shen_hedrick_elkins", "polach")
N, KAPPA = 55e3, 200.0


def forces(kind: str, creep: np.ndarray, spin: float = 0.0, speed: float = 40.0, **values: float) -> np.ndarray:
    linear = np.stack([0.6 * KAPPA * N * creep, 0.8 * KAPPA * N * creep + spin, np.full(len(creep), spin)], axis=1)
    return core.creep_forces(kind, {"friction": 0.3, **values}, N, (KAPPA * N, KAPPA * N), linear, speed)


@pytest.mark.parametrize("kind", LAWS)
def test_a_law_begins_with_the_linear_slope_and_ends_at_the_friction_limit(kind: str) -> None:
    size = np.linalg.norm(forces(kind, np.array([1e-8, 0.5])), axis=1)
    assert size[0] == pytest.approx(KAPPA * N * 1e-8, rel=1e-4)
    assert 0.98 * 0.3 * N < size[1] <= 0.3 * N * (1 + 1e-12)


def test_mean_coefficients_are_the_normal_average_of_those_at_each_displacement() -> None:
    """Against a sum over random displacements; over no motion they are those of the centre."""
    contacts = find_contacts(cones(0.05))
    found = mean_creep_coefficients(contacts, 55e3, 1.5e-3, surface=0.6)
    e = 1.5e-3 * np.random.default_rng(1).normal(size=2000)
    each = [creep_coefficients(contacts, 55e3, x, 0.6).longitudinal_creep for x in e]
    assert found.longitudinal_creep == pytest.approx(np.mean(each), rel=2e-3)
    centre = creep_coefficients(contacts, 55e3, 0.0, 0.6)
    still = mean_creep_coefficients(contacts, 55e3, 1e-9, surface=0.6)
    assert still.spin_creep == pytest.approx(centre.spin_creep, rel=1e-12)


def test_creep_laws_agree_within_a_tenth_of_the_limit_without_spin() -> None:
    creep = np.linspace(1e-5, 0.02, 400)
    sizes = [np.linalg.norm(forces(kind, creep), axis=1) for kind in LAWS]
    assert np.ptp(sizes, axis=0).max() < 0.1 * 0.3 * N
    assert sizes[0] == pytest.approx(sizes[1])
    assert sizes[0] == pytest.approx(sizes[2])


def test_friction_that_falls_makes_the_force_of_polach_fall_at_high_slip() -> None:
    size = np.linalg.norm(
        forces("polach", np.array([0.003, 0.01, 0.05]), friction_ratio=0.4, friction_decay=0.6), axis=1
    )
    assert size[1] > size[2]
    slip = 40.0 * 0.05
    assert size[2] < 0.3 * N * (0.6 * np.exp(-0.6 * slip) + 0.4)
