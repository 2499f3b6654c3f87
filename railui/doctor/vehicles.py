"""Checks of vehicles: wheelset on springs, reference bogie, Cooperrider's bogie, curving."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy import optimize

from railui.contact.conicity import klingel_wavelength
from railui.core import Batch, Placement, Vehicles, creep_forces
from railui.curving import curve
from railui.doctor.check import Check
from railui.ride_quality.evaluation import excitation_of
from railui.running_stability.critical_speed import critical_speeds
from railui.running_stability.limit_cycles import nonlinear_critical_speeds
from railui.running_stability.modes import modes_at
from railui.vehicle.design_reader import Design, parse_design
from railui.vehicle.manchester_coach import COACH
from railui.vehicle.model import Model
from railui.vehicle.simulate import simulate_series

INDEPENDENT: Final = "own, worked out twice independently"
BROERSEN: Final = "own, worked out twice from the equations of Broersen 1976, which has no such values"
SEPARATE_CODE: Final = "own, ramps of the speed by a separate code"
KAAS_PETERSEN: Final = "Cooperrider 1972, Kaas-Petersen 1986; bifurcation.de, exd10: 68.66, printed there as mph"

CHECK_BOGIE: Final = """
vehicle:
  frame: {mass: 2900, yaw_inertia: 3300}
  wheelset: {mass: 1850, yaw_inertia: 1050, spin_inertia: 120}
  geometry: {half_wheelbase: 1.28, half_gauge: 0.75, half_spring_base: 1.0, rolling_radius: 0.46}
  wheel_load: 55e3
  primary: {lateral_stiffness: 3.0e6, longitudinal_stiffness: 8e6}
  secondary: {lateral_stiffness: 0, yaw_stiffness: 0, lateral_damping: 3e4, yaw_damping: 3e4}
contact:
  leading: &wheels {conicity: 0.18, longitudinal_creep: 130, lateral_creep: 120, gravitational_stiffness: 8,
    contact_angle: 0.05, roll: 0.05}
  trailing: *wheels
  spin_creep: 0.25
  flange_clearance: 7e-3
"""
EIGENVALUES: Final = {
    10.0: (-2.28035, 5.38976, -738.406),
    20.0: (-4.13918, 10.98602, -350.940),
    40.0: (-4.41556, 22.55234, -147.747),
    60.0: (-0.34808, 30.17447, -89.564),
}
# c_x, then e_1, e_2 [mm], psi_1, psi_2 [mrad]; radius 600 m. (The psi_2 of c_x 8e7 is stated as 1.578: the equations
# as they stand, solved twice independently, give 1.583.)
CURVES: Final = (
    (1e-3, (-3.194, -3.194, -0.127, -0.127)),
    (8e6, (-10.940, -3.289, -1.417, 0.843)),
    (8e7, (-15.270, -5.715, -2.434, 1.583)),
)

FOLDS: Final = {0.9: 61.781, 1.5: 76.539}  # half wheelbase [m]: nonlinear critical speed [m/s], without D6
HOPF: Final = {0.9: 63.214, 1.2: 72.112, 1.5: 78.206}
COACH_SPEEDS: Final = {0.1: 82.5868526, 0.3: 63.0060765}  # conicity: linear critical speed [m/s]

COOPERRIDER: Final = """
vehicle:
  bodies:
    frame: {mass: 2918, yaw_inertia: 6780, roll_inertia: 6780, height: 0.5334}
  elements:
    wheelset: {kind: wheelset, under: frame, half_wheelbase: 1.074, mass: 1022, yaw_inertia: 678, half_gauge: 0.7163,
      rolling_radius: 0.4572, wheel_load: 66666.666666666667}
    primary: {kind: spring, between: [wheelset, frame], y: 0.620, height: 0.4572, lateral_stiffness: 1.823e6,
      longitudinal_stiffness: 3.646e6, vertical_stiffness: 3.646e6}
    secondary: {kind: spring, between: [frame, ground], y: 0.680, height: 1.1918, lateral_stiffness: 1.823e5,
      vertical_stiffness: 3.333e5}
    secondary_damper: {kind: damper, between: [frame, ground], y: 0.680, height: 1.1918, lateral_damping: 29.2e3,
      vertical_damping: 20.0e3}
    pivot: {kind: spring, between: [frame, ground], height: 1.1918, yaw_stiffness: 2.710e6}
    pivot_damper: {kind: damper, between: [frame, ground], height: 1.1918, yaw_damping: 500}
contact:
  wheels: {conicity: 0.05, longitudinal_creep: 163.38876717785303, lateral_creep: 181.56919161179658,
    gravitational_stiffness: 0, contact_angle: 0, roll: 0}
  spin_creep: 0
  flange_clearance: 9.1e-3
effects:
  - {kind: creep_saturation, at: contact, friction: 0.15}
  - {kind: flange_contact, at: contact, clearance: 9.1e-3, stiffness: 14.60e6}
"""


def check_bogie() -> Design:
    """Return the reference bogie."""
    return parse_design(CHECK_BOGIE)


def wheelset_on_springs() -> Iterator[Check]:
    """Yield the critical speed of a wheelset on springs, which is known exactly."""
    f11, f22, b, r = 6.563e6 / 0.60252, 6.563e6 / 0.54219, 0.7163, 0.4572
    numbers = np.array([[1022.0, 678.0, 0.0, b, r, 1.0, 1.823e5, 768800.0, 0.05, f11, f22, 0.0, 0.0, 0.0, 0.0]])
    vehicles, batch = Vehicles("wheelset"), Batch.from_arrays(numbers)
    v = optimize.brentq(lambda v: vehicles.eigenvalues(batch, v)[0, 0].real, 50.0, 90.0, xtol=1e-12, rtol=1e-14)
    w = abs(vehicles.eigenvalues(batch, v)[0, 0].imag)
    yield Check("wheelset on springs, critical speed [m/s]", 69.83360931998, float(v), INDEPENDENT, 1e-8)
    yield Check("wheelset on springs, its frequency [Hz]", 4.334738642, float(w / (2 * np.pi)), INDEPENDENT, 1e-8)


def bogie_eigenvalues() -> Iterator[Check]:
    """Yield eigenvalues and critical speed of the reference bogie."""
    model = Model(check_bogie())
    for v, expected in EIGENVALUES.items():
        modes = modes_at(model, v)
        least = max((m for m in modes if m["imag"] > 0), key=lambda m: float(m["real"]))
        computed = (least["real"], least["imag"], min(m["real"] for m in modes))
        yield Check(
            f"bogie at {v:g} m/s, least stable oscillation [1/s, rad/s]", expected[:2], computed[:2], BROERSEN, 5e-6
        )
        yield Check(f"bogie at {v:g} m/s, most negative eigenvalue [1/s]", expected[2], computed[2], BROERSEN, 5e-4)
    critical = critical_speeds(model, model.row[None], 90.0)[0]
    speed = critical.speed if critical else None
    yield Check("bogie, linear critical speed [m/s]", 61.64024, speed, BROERSEN, 5e-6)


def curving() -> Iterator[Check]:
    """Yield quasi-static curving of the reference bogie."""
    for c_x, expected in CURVES:
        result = curve(check_bogie().with_values({"vehicle.primary.longitudinal_stiffness": c_x}), 600.0)
        computed = [1e3 * x for x in (*result["displacement"], *result["angle_of_attack"])]
        name = f"curve of 600 m, c_x {c_x:g} N/m, e [mm] and psi [mrad]"
        yield Check(name, expected, computed, BROERSEN, 1e-3)


def cooperriders_bogie() -> Iterator[Check]:
    """Yield the Hopf bifurcation of a bogie of seven degrees of freedom."""
    model = Model(parse_design(COOPERRIDER))
    hopf = critical_speeds(model, model.row[None], 90.0)[0]
    speed, frequency = (hopf.speed, hopf.frequency) if hopf else (None, None)
    yield Check("Cooperrider's bogie, linear critical speed [m/s]", 68.667, speed, KAAS_PETERSEN, 5e-4)
    yield Check("Cooperrider's bogie, its frequency [Hz]", 3.998, frequency, KAAS_PETERSEN, 5e-4)


def nonlinear_critical_speeds_of_the_bogie() -> Iterator[Check]:
    """Yield the fold of Cooperrider's bogie, and fold and Hopf bifurcation at other half wheelbases b, undamped."""
    wheelbase, damping = "vehicle.elements.wheelset.half_wheelbase", "vehicle.elements.pivot_damper.yaw_damping"
    design, undamped = parse_design(COOPERRIDER), {damping: 0.0}
    cases: dict[str, tuple[dict[str, float], float]] = {"b 1.074 m": ({}, 66.688)} | {
        f"b {b:g} m, D6 0": ({wheelbase: b} | undamped, v) for b, v in FOLDS.items()
    }
    for name, (changes, expected) in cases.items():
        speeds = [expected + 3.0]
        fold = float(nonlinear_critical_speeds([Model(design.with_values(changes))], speeds, jobs=1)[0])
        title = f"Cooperrider's bogie, nonlinear critical speed, {name} [m/s]"
        yield Check(title, expected, fold, SEPARATE_CODE, 0.02)
    for b, expected in HOPF.items():
        model = Model(design.with_values({wheelbase: b} | undamped))
        hopf = critical_speeds(model, model.row[None], 90.0)[0]
        title = f"Cooperrider's bogie, linear critical speed, b {b:g} m, D6 0 [m/s]"
        yield Check(title, expected, hopf.speed if hopf else None, INDEPENDENT, 1e-3)


def coach() -> Iterator[Check]:
    """Yield the linear critical speed of a coach of 17 degrees of freedom."""
    design = parse_design(COACH)
    for conicity, expected in COACH_SPEEDS.items():
        paths = [path for path in design.values if path.endswith(".conicity")]
        model = Model(design.with_values(dict.fromkeys(paths, conicity)))
        critical = critical_speeds(model, model.row[None], 120.0)[0]
        title = f"coach of 17 degrees of freedom, critical speed at conicity {conicity:g} [m/s]"
        yield Check(title, expected, critical.speed if critical else None, INDEPENDENT, 1e-5)


def guiding_force_at_rest() -> Iterator[Check]:
    """Yield the guiding forces of the wheels of a bogie at rest: N delta (1 - kappa_s/r), outwards at both wheels."""
    excitation = excitation_of("erri_b176_low length=10 scale=1e-12", 40.0)
    series, _ = simulate_series(Model(check_bogie()), excitation, ["Y1.right", "Y1.left"])
    expected = 55e3 * 0.05 * (1.0 - 0.25 / 0.46)
    title = "bogie at rest, guiding forces of the right and left wheel [N]"
    yield Check(title, [expected, -expected], series[:, 0].tolist(), "equations of Broersen 1976, by hand", 1e-3)


def creep_laws() -> Iterator[Check]:
    """Yield the creep laws of Shen, Hedrick, Elkins and of Polach by their formulas, with spin and falling friction."""
    mu, n, slope = 0.3, 6e4, 9e6
    u = np.array([5e-4, 1e-3, 2e-3, 4e-3, 2e-2])
    linear = np.stack([0.6 * slope * u, 0.8 * slope * u, np.zeros(u.size)], axis=1)
    e = np.minimum(0.6 * slope * u / (mu * n), 3.0)  # surface 0.6
    expected = np.where(e < 3.0, e - e**2 / 3 + e**3 / 27, 1.0)
    found = creep_forces("shen_hedrick_elkins", {"friction": mu, "surface": 0.6}, n, (slope, slope), linear, 40.0)
    computed = np.hypot(*found.T) / (mu * n)
    source = "Shen, Hedrick, Elkins 1983, the formula by hand"
    yield Check("creep law of Shen, Hedrick, Elkins, F/(mu N)", expected.tolist(), computed.tolist(), source, 1e-9)
    falling = mu * (0.6 * np.exp(-0.6 * 40.0 * u) + 0.4)
    e = 0.25 * np.pi * slope * u / (falling * n)
    expected = 2 * falling / (np.pi * mu) * (e / (1 + e**2) + np.arctan(0.4 * e))
    values = {"friction": mu, "slip_reduction": 0.4, "friction_ratio": 0.4, "friction_decay": 0.6}
    found = creep_forces("polach", values, n, (slope, slope), linear, 40.0)
    computed = np.hypot(*found.T) / (mu * n)
    yield Check("creep law of Polach, F/(mu N)", expected.tolist(), computed.tolist(), "Polach 2005, by hand", 1e-9)


def creep_of_vermeulen_and_johnson() -> Iterator[Check]:
    """Yield F/(mu N) = u - u^2/3 + u^3/27, 1 beyond u = 3: the lateral force of a wheelset at a fixed yaw angle."""
    mu, kappa, n, m = 0.3, 150.0, 6e4, 1000.0
    numbers = [m, 1e3, 0.0, 0.75, 0.46, n, 1e3, 1e3, 0.0, kappa, kappa, 0.0, 0.0, 0.0, 0.0]
    u = np.array([0.5, 1.0, 2.0, 3.0, 5.0])
    states = np.zeros((len(u), 4))
    states[:, 1] = u * mu / kappa
    placements = [Placement("creep_saturation", "contact")]
    effects, amounts = np.full((len(u), placements[0].parameter_count), mu), np.ones((len(u), 1))
    batch = Batch.from_arrays(np.tile(numbers, (len(u), 1)), effects, amounts)
    row = np.array([0.0, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    force = Vehicles("wheelset", placements).state_derivatives(batch, row, states)[:, 2] * m
    expected = np.where(u < 3, u - u**2 / 3 + u**3 / 27, 1.0)
    computed = (force / (2 * mu * n)).tolist()
    yield Check(
        "creep saturation, F/(mu N) at u 0.5, 1, 2, 3, 5", expected.tolist(), computed, "Vermeulen, Johnson 1964", 1e-9
    )


def klingel() -> Iterator[Check]:
    """Yield Klingel's wavelength."""
    for conicity, expected in ((0.1, 11.670), (0.05, 16.505)):
        computed = klingel_wavelength(0.75, 0.46, conicity)
        yield Check(
            f"Klingel's wavelength at conicity {conicity:g} [m]",
            expected,
            computed,
            "Klingel 1883, the formula by hand",
            1e-3,
        )


GROUPS: Final = (
    wheelset_on_springs,
    bogie_eigenvalues,
    curving,
    cooperriders_bogie,
    nonlinear_critical_speeds_of_the_bogie,
    coach,
    guiding_force_at_rest,
    creep_of_vermeulen_and_johnson,
    creep_laws,
    klingel,
)
