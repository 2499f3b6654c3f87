"""Rides on lines with curves: the quasi-static curve, an independent spiral, load transfer, forces, continuity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from railui.curving import curve
from railui.ride_quality.evaluation import ride, simulate
from railui.track import Track, synthetic_track
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect

HOME = Path(__file__).parents[2]
CHECK = load_design(HOME / "designs/check_bogie.yaml")
SPRUNG = load_design(HOME / "designs/test_bogie.yaml")
COACH = load_design(HOME / "designs/manchester_coach.yaml")
COOPERRIDER = load_design(HOME / "designs/cooperrider.yaml")
LAWS = (
    PlacedEffect("creep_saturation", "contact", None, {"friction": 0.35}),
    PlacedEffect("flange_contact", "contact", None, {"stiffness": 14.6e6}),
)
G = 9.81


def line(
    radius: float,
    length: float,
    cant: float = 0.0,
    start: float = 50.0,
    spiral: float = 80.0,
    end: float = 0.0,
    spacing: float = 0.1,
) -> Track:
    """A straight, a cosine spiral, a curve, and where `end` is positive a spiral and a straight of this length."""
    total = start + spiral + length + (spiral + end if end else 0.0)
    s = spacing * np.arange(round(total / spacing) + 1)
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip((s - start) / spiral, 0.0, 1.0))
    if end:
        share -= 0.5 - 0.5 * np.cos(np.pi * np.clip((s - start - spiral - length) / spiral, 0.0, 1.0))
    return Track(s, np.zeros_like(s), curvature=share / radius, cant=share * cant)


def deficiency(radius: float, cant: float, speed: float, b: float = 0.75) -> float:
    """Return the cant deficiency in m of a right-hand curve."""
    return 2 * b * speed**2 / (G * radius) - cant


@pytest.mark.parametrize("laws", [(), LAWS], ids=["linear", "with laws"])
@pytest.mark.parametrize(
    ("design", "speed"), [(CHECK, 25.0), (SPRUNG, 25.0), (COOPERRIDER, 25.0), (COACH, 22.0)], ids=lambda x: str(x)[:12]
)
def test_a_long_curve_has_the_equilibrium_of_railui_curve(
    design: Design, speed: float, laws: tuple[PlacedEffect, ...]
) -> None:
    radius, cant = 600.0, 0.05
    design = design.with_effects(laws)
    wheelsets = 4 if design is COACH or "body" in str(design.name).lower() or "vehicle 1" in design.name else 2
    b = 0.7163 if design.name.startswith("Cooperrider") else 0.75
    expected = curve(design, radius, deficiency(radius, cant, speed, b))
    numbers = range(1, wheelsets + 1)
    names = [f"{q}{i}" for q in ("e", "psi", "Y") for i in numbers]
    series = simulate(design, line(radius, 1700.0, cant, spacing=0.25), speed, names)
    result = np.array([series[name][-1] for name in names]).reshape(3, -1)
    assert expected["displacement"] is not None
    np.testing.assert_allclose(result[0], expected["displacement"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(result[1], expected["angle_of_attack"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(-result[2], expected["guiding_force"], rtol=1e-6, atol=0.1)


@pytest.mark.parametrize("stiffness", [0.0, 2e5, 1e6, 1e7])
def test_the_guiding_forces_of_a_bogie_carry_the_whole_outward_force(stiffness: float) -> None:
    radius, cant, speed = 500.0, 0.06, 25.0
    design = CHECK.with_values({"vehicle.secondary.lateral_stiffness": stiffness}).with_effects(LAWS)
    outward = 4 * 55e3 * (speed**2 / (G * radius) - cant / 1.5)
    static = curve(design, radius, deficiency(radius, cant, speed))
    assert sum(static["guiding_force"]) == pytest.approx(outward, rel=1e-9)
    assert not any("guiding_force" in note for note in static["notes"])
    series = simulate(design, line(radius, 1500.0, cant, spacing=0.25), speed, ["Y1", "Y2"])
    assert -series["Y1"][-1] - series["Y2"][-1] == pytest.approx(outward, rel=1e-6)


class Spiral:
    """A cosine spiral after 30 m of straight, as closed formulas."""

    def __init__(self, radius: float, length: float, start: float, cant_angle: float) -> None:
        self.k, self.length, self.start, self.angle = 1.0 / radius, length, start, cant_angle

    def at(self, s: float) -> tuple[float, float, float, float]:
        """Return y, heading, curvature and its derivative."""
        x, w, k, end = s - self.start, np.pi / self.length, self.k, self.length
        if x <= 0:
            return 0.0, 0.0, 0.0, 0.0
        if x <= end:
            y = 0.5 * k * (0.5 * x**2 + (np.cos(w * x) - 1) / w**2)
            theta = 0.5 * k * (x - np.sin(w * x) / w)
            return y, theta, 0.5 * k * (1 - np.cos(w * x)), 0.5 * k * w * np.sin(w * x)
        y, theta, _, _ = self.at(self.start + end)
        u = x - end
        return y + theta * u + 0.5 * k * u**2, theta + k * u, k, 0.0

    def cant(self, s: float) -> tuple[float, float, float]:
        """Return the angle of the cant and its derivatives, of the same shape."""
        x, w = s - self.start, np.pi / self.length
        if not 0 < x < self.length:
            return (0.0 if x <= 0 else self.angle), 0.0, 0.0
        wave = 0.5 * self.angle
        return wave * (1 - np.cos(w * x)), wave * w * np.sin(w * x), wave * w**2 * np.cos(w * x)


def check_bogie_rates(t: float, q: NDArray[np.float64], way: Spiral, v: float) -> NDArray[np.float64]:
    """Rates of the check bogie relative to the tangent in its middle: q = y, psi, y1, psi1, y2, psi2, y_c, velocities.

    No offsets act on the suspension here: the track under each wheelset is displaced and turned instead.
    """
    m_b, i_b, m_a, i_a, i_ya, a, b, b_c, r, n = 2900, 3300, 1850, 1050, 120, 1.28, 0.75, 1.0, 0.46, 55e3
    c_y, c_x, k_y, k_psi, kx, ky, ks, lam, eps, delta, sig = 3e6, 8e6, 3e4, 3e4, 130, 120, 0.25, 0.18, 8, 0.05, 0.05
    m_c = 4 * n / G - m_b - 2 * m_a
    s = v * t - a
    y_0, theta_0, k_0, dk_0 = way.at(s)
    phi_0, dphi_0, ddphi_0 = way.cant(s)
    p, w = q[:7], q[7:]
    force = np.zeros(7)
    force[0] = -k_y * (w[0] - w[6]) - 2 * c_y * (2 * p[0] - p[2] - p[4])
    force[0] -= (m_b + m_c) * (v**2 * k_0 - G * phi_0) + m_b * r * v**2 * ddphi_0
    force[1] = -k_psi * w[1] - 2 * c_x * b_c**2 * (2 * p[1] - p[3] - p[5])
    force[1] -= 2 * c_y * a * (2 * a * p[1] - p[2] + p[4]) + i_b * v**2 * dk_0
    force[6] = -k_y * (w[6] - w[0])
    for i, x in ((2, a), (4, -a)):
        y_i, theta_i, k_i, _ = way.at(s + x)
        phi_i, dphi_i, _ = way.cant(s + x)
        twist, dtwist = phi_i - phi_0, v * (dphi_i - dphi_0)
        e = p[i] - (y_i - y_0 - x * theta_0) - r * twist
        psi = p[i + 1] - (theta_i - theta_0)
        vy = w[i] - v * (theta_i - theta_0 - x * k_0)
        vpsi = w[i + 1] - v * (k_i - k_0)
        roll, droll = twist - sig * e / b, dtwist - sig * (vy - r * dtwist) / b
        gamma = (delta - twist + eps * e / b, delta + twist - eps * e / b)
        u_y = vy / v - r * droll / v - psi
        t_x, y_f = [], []
        for j in (1, 2):
            sign = (-1) ** j
            t_x.append(kx * n * (sign * lam * e / r + sign * b * (vpsi / v + k_i)))
            u_n = (sign * gamma[j - 1] - roll) / r + vpsi / v + k_i
            y_f.append(-sign * n * gamma[j - 1] + ky * n * u_y + ks * n * u_n)
        gyro = i_ya * v * sig / (b * r)
        force[i] = -2 * c_y * (p[i] - p[0] - x * p[1]) - y_f[0] - y_f[1] + gyro * vpsi
        force[i] -= m_a * (v**2 * k_0 + x * v**2 * dk_0 - G * phi_0 + r * v**2 * ddphi_0)
        force[i + 1] = -2 * c_x * b_c**2 * (p[i + 1] - p[1]) + b * (t_x[0] - t_x[1]) + b * psi * (y_f[0] - y_f[1])
        force[i + 1] -= gyro * vy + i_a * v**2 * dk_0
    return np.concatenate([w, force / np.array([m_b, i_b, m_a, i_a, m_a, i_a, m_c])])


def test_a_spiral_agrees_with_independent_equations() -> None:
    speed, radius, cant, a = 30.0, 500.0, 0.08, 1.28
    track = line(radius, 60.0, cant, start=30.0, spiral=60.0)
    names = ["e1", "e2", "psi1", "psi2", "d1", "d2"]
    series = simulate(CHECK, track, speed, names)
    way = Spiral(radius, 60.0, 30.0, cant / 1.5)
    found = solve_ivp(
        check_bogie_rates,
        (0.0, series["t"][-1]),
        np.zeros(14),
        method="DOP853",
        t_eval=series["t"],
        args=(way, speed),
        rtol=1e-9,
        atol=1e-12,
    )
    expected = {name: np.zeros_like(found.t) for name in names}
    for k, t in enumerate(found.t):
        s, q = speed * t - a, found.y[:, k]
        y_0, theta_0, _, _ = way.at(s)
        for number, x in ((1, a), (2, -a)):
            y_i, theta_i, _, _ = way.at(s + x)
            twist = way.cant(s + x)[0] - way.cant(s)[0]
            y, psi = q[2 * number], q[2 * number + 1]
            expected[f"e{number}"][k] = y - (y_i - y_0 - x * theta_0) - 0.46 * twist
            expected[f"psi{number}"][k] = psi - (theta_i - theta_0)
            expected[f"d{number}"][k] = y - q[0] - x * q[1]
    for name in names:
        size = np.abs(expected[name]).max()
        assert size > 1e-5
        np.testing.assert_allclose(series[name], expected[name], rtol=0, atol=2e-5 * size, err_msg=name)


def coach_masses() -> tuple[list[str], NDArray[np.float64], NDArray[np.float64]]:
    """Return lateral channels, masses and heights of the Manchester coach."""
    names = ["y.body", "y.frame_1", "y.frame_2", *(f"e{i}" for i in range(1, 5))]
    masses = np.array([32000.0, 2615.0, 2615.0, *[1813.0] * 4])
    return names, masses, np.array([1.8, 0.6, 0.6, *[0.46] * 4])


def test_the_load_transfer_of_a_curve_balances_the_lateral_acceleration() -> None:
    radius, cant, speed = 800.0, 0.04, 30.0
    names, masses, heights = coach_masses()
    unloading = [f"dQ{i}" for i in range(1, 5)]
    series = simulate(COACH.with_effects(LAWS), line(radius, 1500.0, cant, spacing=0.25), speed, [*names, *unloading])
    outward = speed**2 / radius - G * cant / 1.5
    x = np.array([0.0, 9.5, -9.5, 10.78, 8.22, -8.22, -10.78])
    offset = x**2 / (2 * radius)  # of the line against its tangent in the middle
    y = np.array([series[name][-1] for name in names]) + offset - offset[3:].mean()
    moment = masses @ (heights * outward) - G * masses @ y  # the weights act off the middle of the wheelsets
    total = -1.5 * sum(series[name][-1] for name in unloading)
    assert total == pytest.approx(moment, rel=0.01)
    assert total > 1.2 * masses @ (heights * outward)  # the coach leans outwards


def test_a_twist_unloads_the_wheels_by_the_stiffness_in_roll() -> None:
    """Cant that falls along the vehicle, at walking pace and without lateral acceleration in its middle."""
    twist, speed = 1.0e-3, 4.0  # rad/m
    s = 0.1 * np.arange(2001)
    track = Track(s, np.zeros_like(s), cant=1.5 * twist * (100.0 - s))
    numbers = range(1, 5)
    light = {f"vehicle.elements.{name}.static_load": 0.0 for name in ("primary", "secondary")}  # no weights that lean
    design = COACH.with_values(light).with_effects(LAWS)
    series = simulate(design, track, speed, [*(f"dQ{i}" for i in numbers), *(f"d{i}" for i in numbers)])
    k = int(np.argmin(np.abs(s - 100.0 - 10.78)))  # the leading wheelset is 10.78 m ahead of the middle
    primary, secondary = 2 * 1.22e6, 2 * 0.43e6 + 2 * 10.5e3 + 940e3  # in roll, per wheelset and per bogie
    between = 1 / (1 / secondary + 1 / (2 * primary))
    moment = twist * (9.5 * between / 2 + np.array([1.28, -1.28]) * primary)  # of the leading bogie's wheelsets
    lateral = np.array([-2 * 3.884e6 * series[f"d{i}"][k] for i in numbers])  # of the primary springs, at the axles
    expected = (np.concatenate([moment, -moment[::-1]]) + 0.46 * lateral) / 1.5
    result = np.array([series[f"dQ{i}"][k] for i in numbers])
    np.testing.assert_allclose(result, expected, rtol=0, atol=0.025 * np.abs(expected).max())
    assert result[0] + result[1] == pytest.approx(expected[0] + expected[1], rel=0.02)


def test_a_curve_to_the_left_is_the_mirror_image() -> None:
    names = ["e1", "psi1", "Y1", "ayf", "rf"]
    right, left = (simulate(SPRUNG, line(side * 600.0, 200.0, side * 0.05), 25.0, names) for side in (1, -1))
    for name in names:
        np.testing.assert_allclose(left[name], -right[name], rtol=0, atol=1e-9 * np.abs(right[name]).max())


def test_sensors_feel_the_uncompensated_acceleration_and_the_yaw_rate() -> None:
    series = simulate(SPRUNG, line(600.0, 1000.0, 0.05, spacing=0.25), 25.0, ["ayf", "ay1", "rf"])
    assert series["ayf"][-1] == pytest.approx(25.0**2 / 600.0 - G * 0.05 / 1.5, rel=1e-6)
    assert series["ay1"][-1] == pytest.approx(series["ayf"][-1], rel=1e-6)
    assert series["rf"][-1] == pytest.approx(25.0 / 600.0, rel=1e-6)


@pytest.mark.parametrize("design", [CHECK.with_effects(LAWS), COACH], ids=["bogie", "coach"])
def test_a_line_without_curves_rides_as_a_straight_track(design: Design) -> None:
    rough = synthetic_track("erri_b176_low", length=200.0, seed=1)
    almost = np.full(len(rough), 1e-13)
    bent = Track(rough.s, rough.yw, rough.phiw, rough.gauge, is_synthetic=True, curvature=almost)
    names = ["e1", "e2", "psi1", "Y1", "dQ1"] if design is COACH else ["e1", "e2", "psi1"]
    straight, line_ = (simulate(design, track, 30.0, names) for track in (rough, bent))
    for name in names:
        tolerance = 1e-8 if design is COACH else 0.02  # the carbody of a bogie moves on a line
        np.testing.assert_allclose(line_[name], straight[name], atol=tolerance * np.abs(straight[name]).max(), rtol=0)


def test_flange_contact_against_a_widened_gauge_counts_on_straights_only() -> None:
    drawn = synthetic_track("erri_b176_high", length=1000.0, seed=1)
    curved = line(300.0, 200.0, start=500.0, spiral=40.0, end=120.0)
    gauge = np.where(np.abs(curved.curvature) > 0.0, 20e-3, 0.0) + 2e-3 * np.sin(curved.s / 5.0)
    rough = 2.0 * drawn.yw[: len(curved)]
    track = Track(curved.s, rough, gauge=gauge, curvature=curved.curvature)
    design = SPRUNG.with_values({"contact.gauge_widens_clearance": True, "contact.flange_clearance": 4e-3})
    e = simulate(design, track, 30.0, ["e1"])["e1"]
    behind = np.array([np.abs(np.interp(track.s - back, track.s, track.curvature)) for back in (0.0, 2.56)])
    straight = np.all(behind <= 1e-4, axis=0)
    half = 0.5 * gauge
    result = ride(design, track, 30.0)
    assert result["statistics"]["mean_e"][0] == pytest.approx(e[straight].mean(), rel=1e-2)
    assert result["statistics"]["sd_e"][0] == pytest.approx(np.hypot(e[straight].std(), half[straight].std()), rel=1e-2)
    share = np.mean(np.abs(e[straight]) >= 4e-3 + half[straight])
    assert share > 0.02 and result["flange_fractions"][0] == pytest.approx(share, abs=1e-3)
    margins = [
        (4e-3 + half[straight].mean() - abs(m)) / sd
        for m, sd in zip(result["statistics"]["mean_e"], result["statistics"]["sd_e"], strict=True)
    ]
    assert result["flange_margin"] == pytest.approx(min(margins), rel=1e-3)


def test_a_ride_reports_the_line_and_its_forces() -> None:
    result = ride(COACH, line(600.0, 300.0, 0.1, end=60.0), "90 km/h")
    assert result["line"]["least_radius"] == pytest.approx(600.0)
    assert result["line"]["largest_cant_deficiency"] == pytest.approx(deficiency(600.0, 0.1, 25.0))
    assert result["forces"]["derailment_quotient"] > 0.05
    assert any("V^2/R" in note for note in result["notes"])
