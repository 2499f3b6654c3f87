"""The independent generator of campaigns against hand formulas, published values and its own reference."""

from __future__ import annotations

import ast
import csv
import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.blind.cases import EFFECTS_NOT_IN_LIBRARY
from tests.truth.bogie import CHECK, Bogie, Vehicle
from tests.truth.campaign import DECLARED, Campaign, Order, campaign, campaigns, main, steps_of
from tests.truth.coach import Coach
from tests.truth.coach import rate as coach_rate
from tests.truth.coach_campaign import Coaches
from tests.truth.contact import Seen
from tests.truth.effects import KINDS, PAIRED, Effect, effect, parse, sense
from tests.truth.files import paths, vehicle_of
from tests.truth.laws import Array, saturation
from tests.truth.march import simulate, simulate_many, steps_for
from tests.truth.reference import reference
from tests.truth.rig import Bench, Rig, bench_runs, respond
from tests.truth.road import WIDTH, Point, Table
from tests.truth.tracks import cross_level, eased, harmonics, lateral, met, recorder_noise

PARAMETERS: dict[str, dict[str, object]] = {
    "spring": {"stiffness": 2e6},
    "viscous_damper": {"damping": 3e4},
    "free_play": {"half_width": 3e-4},
    "cubic_stiffness": {"stiffness": 1e11},
    "quadratic_stiffness": {"stiffness": 1e7},
    "bump_stop": {"gap": 5e-4, "stiffness": 1e7},
    "dry_friction": {"force": 2e3, "slip_speed": 5e-3},
    "hysteresis": {"stiffness": 5e6, "yield": 2e3},
    "quadratic_damper": {"damping": 2e5},
    "asymmetric_damper": {"ratio": 0.8},
    "maxwell_damper": {"stiffness": 5e6, "damping": 1e5, "blow_off": 2e3},
    "creep_saturation": {"friction": 0.2},
    "vermeulen_johnson": {"friction": 0.2, "longitudinal_factor": 1.2},
    "shen_hedrick_elkins": {"friction": 0.2, "surface": 0.6},
    "polach": {"friction": 0.2, "slip_reduction": 0.4},
    "profile_shape": {
        "displacement": [-4e-3, 0.0, 4e-3],
        "radius": [-6e-3, 0.0, 6e-3],
        "radius_per_gauge": [0.0, 0.0, 0.0],
        "angle": [-6e-3, 0.0, 6e-3],
    },
    "flange_contact": {"stiffness": 2e7, "clearance": 2e-3},
    "nonlinear_conicity": {"cubic": 3e4},
    "gauge_conicity": {"per_gauge": -15.0},
    "rolling_line_offset": {"offset": 1e-3, "sway": 1e-3},
    "rolling_line": {"place": [-10.0, 20.0, 60.0], "offset": [0.0, 2e-3, -1e-3]},
    "rail_flexibility": {"stiffness": 2e7, "damping": 1e5},
    "run_out": {"force": 2e3, "rolling_radius": 0.46},
    "steady_force": {"force": 2e3},
    "coach_mode": {"mass": 1e4, "stiffness": 2e5, "damping": 3e4},
    "measured_force": {"motion": [-1e-3, 0.0, 1e-3], "force": [2e3, 0.0, -2e3]},
    "conicity_drift": {"per_km": 0.2},
    "wet_patches": {"depth": 0.6, "length": 150.0},
    "primary_drift": {"share": -0.3},
    "lateral_yaw_coupling": {"stiffness": 4e6},
    "crossed_damping": {"damping": 2e4},
    "frame_rumble": {"force": 1500.0},
    "ageing_friction": {"force": 1500.0, "slip_speed": 5e-3},
    "switching_damper": {"damping": 4e4},
    "fading_damper": {"damping": 4e4, "energy": 200.0},
    "hung_mass": {"mass": 800.0, "stiffness": 8e5, "damping": 2e3},
}
PARAMETERS |= {
    kind: known.example(5e-4, 0.02, 6e6)  # at a primary suspension
    for kind, known in KINDS.items()
    if kind not in PARAMETERS and known.example is not None
}
PLACED = [
    effect(kind, at, wheelset, **PARAMETERS[kind])
    for kind, known in KINDS.items()
    for at in known.at
    if at != "rig"
    for wheelset in ((None, 1, 2) if at in PAIRED and not known.whole else (None,))
]


def swinging(vehicle: Vehicle, V: float) -> complex:
    result = Bogie([vehicle]).eigenvalues(V)[0]
    result = result[result.imag > 1e-6]
    return complex(result[np.argmax(result.real)])


def one_point(V: float, count: int, values: Array | float = 0.0) -> Point:
    row = np.zeros((WIDTH, count))
    row[:10] = values
    row[10:12] = V
    return Point(0.0, row)


def test_the_independent_model_does_not_import_the_kernel() -> None:
    files = list((Path(__file__).parent / "truth").glob("*.py"))
    assert len(files) > 10
    for path in files:
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0] == "railui" for name in names), path


# ------------------------------------------------------------------------------------------- the linear bogie


@pytest.mark.parametrize(
    ("V", "real", "frequency", "most_negative"),
    [
        (10, -2.28035, 5.38976, -738.406),
        (20, -4.13918, 10.98602, -350.940),
        (40, -4.41556, 22.55234, -147.747),
        (60, -0.34808, 30.17447, -89.564),
    ],
)
def test_the_wheel_by_wheel_rate_has_the_published_eigenvalues(
    V: float, real: float, frequency: float, most_negative: float
) -> None:
    assert swinging(CHECK, V).real == pytest.approx(real, abs=6e-6)
    assert swinging(CHECK, V).imag == pytest.approx(frequency, abs=6e-6)
    assert Bogie([CHECK]).eigenvalues(V)[0].real.min() == pytest.approx(most_negative, abs=1e-3)


def test_the_linear_critical_speed_is_that_of_the_check_values() -> None:
    assert brentq(lambda V: swinging(CHECK, V).real, 55.0, 70.0, xtol=1e-9) == pytest.approx(61.64024, abs=1e-5)


def test_a_wheelset_on_springs_hunts_at_its_exact_speed() -> None:
    m, inertia, b, lam, r, s_y, s_psi = 1022.0, 678.0, 0.7163, 0.05, 0.4572, 1.823e5, 768800.0
    f11, f22, N = 6.563e6 / 0.60252, 6.563e6 / 0.54219, 5e4
    w2 = (f22 * s_psi + f11 * b**2 * s_y) / (f22 * inertia + f11 * b**2 * m)
    exact = np.sqrt(4 * f11 * f22 * b**2 * w2 / (4 * f11 * f22 * lam * b / r + (s_y - m * w2) * (s_psi - inertia * w2)))
    creep = {"lam": (lam, lam), "kappa_x": (f11 / N, f11 / N), "kappa_y": (f22 / N, f22 / N), "kappa_s": 0.0}
    none = {"epsilon": (0.0, 0.0), "delta": (0.0, 0.0), "sigma": (0.0, 0.0)}
    springs = {"c_y": s_y / 2, "c_x": s_psi / 2, "m_b": 1e30, "I_zb": 1e30}  # a frame that does not move
    wheelset = Vehicle(m_a=m, I_za=inertia, b=b, r=r, N=N, **creep, **none, **springs)  # type: ignore[arg-type]
    result = brentq(lambda V: swinging(wheelset, V).real, 50.0, 90.0, xtol=1e-9)
    assert exact == pytest.approx(69.83360931998, rel=1e-12)
    assert result == pytest.approx(exact, rel=1e-6)
    assert swinging(wheelset, exact).imag / (2 * np.pi) == pytest.approx(4.334738642, rel=1e-6)


def test_wheel_by_wheel_and_collapsed_contact_forces_are_the_same() -> None:
    rng = np.random.default_rng(1)
    pairs = {
        x: (float(rng.uniform(0.5, 2) * v[0]), float(rng.uniform(0.5, 2) * v[0]))
        for x, v in {"lam": CHECK.lam, "kappa_x": CHECK.kappa_x, "kappa_y": CHECK.kappa_y}.items()
    }
    c = replace(CHECK, **pairs, epsilon=(8.0, 3.0), delta=(0.05, 0.09), sigma=(0.05, 0.02))  # type: ignore[arg-type]
    V, size = 33.0, 1e-3
    y, yd, psi, psid, y_w, y_wd, phi, phid = (size * rng.standard_normal((2, 1)) for _ in range(8))
    e, ed = y - y_w - c.r * phi, yd - y_wd - c.r * phid
    p = one_point(V, 1, np.concatenate([y_w + c.r * phi, y_wd + c.r * phid, phi, phid, 0 * phi]))
    Q_y, Q_psi, _ = Bogie([c]).contact.forces(Seen(e, ed, yd, psi, psid, None), p, np.zeros((2, 1)))
    for i in (0, 1):
        lam, kx, ky, ep, de, si = (x[i] for x in (c.lam, c.kappa_x, c.kappa_y, c.epsilon, c.delta, c.sigma))
        roll = 1 + c.r * si / c.b
        q_y = (  # (3.9)
            -2 * ky * c.N * (roll * yd[i] / V - psi[i])
            - 2 * c.kappa_s * c.N / V * psid[i]
            - 2 * c.N * (ep / c.b - c.kappa_s * (ep - si) / (c.b * c.r)) * e[i]
            + 2 * c.N * phi[i]
            + 2 * ky * c.N * c.r * si / (c.b * V) * y_wd[i]
            + 2 * ky * c.N * c.r / V * roll * phid[i]
        )
        q_psi = (
            -2 * c.b * c.N * kx * (lam * e[i] / c.r + c.b * psid[i] / V)
            + 2 * c.b * c.N * (1 - c.kappa_s / c.r) * de * psi[i]
        )
        assert Q_y[i] == pytest.approx(q_y, rel=1e-10)
        assert Q_psi[i] == pytest.approx(q_psi, rel=1e-10)


# ------------------------------------------------------------------------------------------------- track


@pytest.mark.parametrize(
    ("level", "shortest", "longest", "sd"),
    [
        ("low", 3, 25, 0.714),
        ("low", 25, 70, 1.197),
        ("low", 70, 150, 1.539),
        ("low", 2, 100, 1.696),
        ("high", 3, 25, 1.213),
        ("high", 25, 70, 2.035),
        ("high", 70, 150, 2.616),
        ("high", 2, 100, 2.883),
    ],
)
def test_track_bands_have_the_published_standard_deviations(
    level: str, shortest: float, longest: float, sd: float
) -> None:
    result = harmonics(lambda W: lateral(W, level), 20e3, 1, 0, shortest, longest).sd
    assert result * 1e3 == pytest.approx(sd, abs=0.004)


def test_a_track_by_fourier_transform_is_the_sum_of_its_harmonics() -> None:
    one = harmonics(cross_level, 1500.0, 3, 1)
    s = np.linspace(0.0, 1490.0, 300)
    assert np.abs(one.along(s) - one(s)).max() < 1e-6 * one.sd


def test_recorder_noise_has_its_size_and_nothing_below_its_wavelength() -> None:
    s = np.linspace(0.0, 1999.9, 20_000)
    noise = recorder_noise(s, 2e-5, 2.5, np.random.default_rng(2))
    lines = np.abs(np.fft.rfft(noise * np.hanning(len(s)))) ** 2
    assert noise.std() == pytest.approx(2e-5, rel=0.05)
    assert lines[np.fft.rfftfreq(len(s), 0.1) > 1.02 / 2.5].sum() < 1e-6 * lines.sum()


# ------------------------------------------------------------------------------------------------ effects


@pytest.mark.parametrize("one", [e for e in PLACED if KINDS[e.kind].silent], ids=lambda e: f"{e.kind}-{e.at}")
def test_an_effect_has_no_force_at_rest(one: Effect) -> None:
    bogie = Bogie([DECLARED], [[one]])
    carried = bogie.rate(np.zeros((bogie.size, 1)), one_point(40.0, 1))
    aged = 12 if one.kind == "ageing_friction" else None  # a contact at rest goes on healing
    assert np.all(carried[:aged] == 0.0)


def around(kind: str, cycles: int = 6) -> tuple[float, float]:
    """Work of a law on the body over the last closed cycle, and the work that goes in and out."""
    known, t = KINDS[kind], np.linspace(0.0, 1.0, 4001)
    p = {**known.optional, **PARAMETERS[kind], "k0": np.array([6e6]), "c0": np.array([3e4])}
    p = {name: np.array([x]) if isinstance(x, float) else x for name, x in p.items()}
    x, work = np.zeros((known.states, 1, 1)), np.zeros(len(t))
    for cycle in range(cycles):
        for k, angle in enumerate(2 * np.pi * t):
            z, v = np.array([[2e-3 * np.sin(angle)]]), np.array([[2e-3 * 25.0 * np.cos(angle)]])
            assert known.law is not None
            F, rate = known.law(p, z, v, x, 0.0)
            x = x if rate is None else x + rate * (2 * np.pi / 25.0 * t[1])
            work[k] = F[0, 0] * v[0, 0] if cycle == cycles - 1 else 0.0
    period = 2 * np.pi / 25.0
    return float(np.trapezoid(work, t * period)), float(np.trapezoid(np.abs(work), t * period))


@pytest.mark.parametrize("kind", [k for k, known in KINDS.items() if known.cycle and known.law])
def test_no_energy_is_generated_over_a_closed_cycle(kind: str) -> None:
    gained, moved = around(kind, 3 if KINDS[kind].states else 1)
    if KINDS[kind].cycle == "loss":
        assert gained < -0.01 * moved
    else:
        assert abs(gained) < 1e-4 * moved


@pytest.mark.parametrize("kind", [k for k, known in KINDS.items() if known.odd and known.law and known.silent])
def test_an_odd_law_is_odd(kind: str) -> None:
    known, rng = KINDS[kind], np.random.default_rng(4)
    p = {**known.optional, **PARAMETERS[kind], "k0": 6e6, "c0": 3e4}
    z, v, x = (
        2e-3 * rng.standard_normal((1, 9)),
        0.05 * rng.standard_normal((1, 9)),
        rng.uniform(-1, 1, (1, 1, 9)),
    )
    assert known.law is not None
    there, back = known.law(p, z, v, x, 0.0), known.law(p, -z, -v, -x, 0.0)
    assert np.allclose(there[0], -back[0], rtol=1e-14)


def test_creep_forces_saturate_at_friction_and_start_linear() -> None:
    q = np.array([0.0, 1e-9, 3.0, 3.0 + 1e-12, 50.0])
    assert np.allclose(q * saturation(q), [0.0, 1e-9, 1.0, 1.0, 1.0], rtol=1e-9)
    assert saturation(np.array([0.0]))[0] == 1.0


@pytest.mark.parametrize("saturated", [False, True])
def test_a_rail_that_yields_balances_every_lateral_force_of_the_wheels(saturated: bool) -> None:
    rail = effect("rail_flexibility", "track", stiffness=2e7, damping=1e5)
    flange = effect("flange_contact", "contact", clearance=1e-3, stiffness=1e7)
    slip = [effect("creep_saturation", "contact", friction=0.2)] if saturated else []
    bogie = Bogie([DECLARED], [[rail, flange, *slip]])
    rng = np.random.default_rng(5)
    u, e, ed, yd, psi, psid = (s * rng.standard_normal((2, 1)) for s in (3e-4, 3e-3, 0.05, 0.05, 3e-3, 0.1))
    side, p = bogie.contact.flange(e), one_point(40.0, 1)
    Q_y, _, ud = bogie.contact.forces(Seen(e, ed, yd, psi, psid, u), p, side)
    assert ud is not None
    assert np.abs(side).max() > 0.0
    assert 2e7 * u + 1e5 * ud == pytest.approx(-(Q_y + side), rel=1e-8)


def quick(seconds: float = 1.0, level: str = "high") -> Table:
    return eased(met(40.0, seconds, 3, level=level, spread=0.0), 2.56)


def test_neutral_parameters_do_not_change_the_vehicle() -> None:
    run, v = quick(), DECLARED
    plain = simulate(v, run, [], 2)
    neutral = [
        effect("free_play", "primary_lateral", half_width=0.0),
        effect("coach_mode", "secondary_lateral", mass=1e15, stiffness=v.c_sy, damping=v.k_y),
        effect("creep_saturation", "contact", friction=1e9),
        effect("rail_flexibility", "track", stiffness=1e15, damping=1e13),
        effect("asymmetric_damper", "secondary_yaw", ratio=0.0),
    ]
    for name, x in simulate(v, run, neutral, 2).items():
        assert np.abs(x - plain[name]).max() < 1e-6 * np.abs(plain[name]).max(), name


def test_a_measured_curve_of_a_spring_is_that_spring() -> None:
    run, curve = quick(), {"motion": [-0.1, 0.1], "force": [2e5, -2e5]}
    as_curve = simulate(DECLARED, run, [effect("measured_force", "primary_lateral", 2, **curve)], 2)
    as_spring = simulate(DECLARED, run, [effect("spring", "primary_lateral", 2, stiffness=2e6)], 2)
    assert np.allclose(as_curve["e1"], as_spring["e1"], rtol=0.0, atol=1e-12)


def test_a_measured_coach_force_replaces_the_secondary_suspension() -> None:
    run = quick(2.0)
    secondary = [parse("dry_friction at=secondary_lateral force=1500 slip_speed=0.02")]
    truth = simulate(DECLARED, run, secondary, 4)
    driven = replace(run, Qy=truth["Qy"], Qpsi=truth["Qpsi"])
    other = replace(DECLARED, c_sy=9e5, c_spsi=9e5, k_y=1e3, k_psi=1e3)
    again = simulate(other, driven, [parse("spring at=secondary_yaw stiffness=1e6")], 4)
    assert np.abs(again["e1"] - truth["e1"]).max() < 2e-4 * truth["e1"].std()
    assert np.allclose(again["Qy"], truth["Qy"])


def test_a_blown_off_damper_gives_no_more_than_its_limit() -> None:
    one = effect("maxwell_damper", "secondary_yaw", stiffness=5e6, damping=5e5, blow_off=500.0)
    bare = replace(DECLARED, c_spsi=0.0, k_psi=0.0)
    assert np.abs(simulate(bare, quick(), [one], 2)["Qpsi"]).max() == pytest.approx(500.0, rel=1e-12)


def test_sensors_delay_scale_and_shift_their_own_channel_only() -> None:
    run = quick()
    plain = simulate(DECLARED, run, [], 2)
    faults = [
        parse("sensor_delay at=ayf delay=0.01"),
        parse("sensor_gain at=ayf gain=2"),
        parse("sensor_offset at=ayf offset=0.5"),
    ]
    seen = simulate(DECLARED, run, faults, 2)
    assert np.allclose(seen["ayf"][2:], 2.0 * plain["ayf"][:-2] + 0.5, atol=1e-10)
    assert np.array_equal(seen["ay1"], plain["ay1"])


def test_a_delayed_signal_of_a_derailed_vehicle_is_none() -> None:
    t = np.arange(100) / 200.0
    e1 = np.where(t < 0.3, 1e-3, np.nan)
    seen = sense({"e1": e1, "d1": t}, t, [effect("sensor_delay", at, delay=0.02) for at in ("e1", "d1")])
    assert np.isnan(seen["e1"]).all() and np.isfinite(seen["d1"]).all()


def test_vehicles_of_a_batch_run_as_alone() -> None:
    run = quick(0.5)
    effects = [[PLACED[0]], [], [parse("hysteresis at=primary_yaw wheelset=2 stiffness=1e7 yield=3e3")]]
    together = simulate_many([DECLARED, CHECK, DECLARED], [run] * 3, effects, 3)
    for vehicle, own, seen in zip([DECLARED, CHECK, DECLARED], effects, together, strict=True):
        assert np.array_equal(simulate(vehicle, run, own, 3)["d2"], seen["d2"])


def test_an_initial_state_is_in_the_model_s_order() -> None:
    state = np.arange(1.0, 13.0) * 1e-5
    seen = simulate(DECLARED, quick(0.05), [], 2, state)
    assert seen["psi1"][0] == pytest.approx(4e-5)
    assert seen["e2"][0] == pytest.approx(5e-5)
    assert seen["rf"][0] == pytest.approx(8e-5)
    assert seen["d1"][0] == pytest.approx(3e-5 - 1e-5 - DECLARED.a * 2e-5)


def test_two_effects_that_supersede_one_spring_are_rejected() -> None:
    play = parse("free_play at=secondary_lateral half_width=1e-3")
    coach = parse("coach_mode at=secondary_lateral mass=1e4 stiffness=2e5 damping=3e4")
    with pytest.raises(ValueError, match="coach_mode and free_play"):
        Bogie([DECLARED], [[play, coach]])


# ---------------------------------------------------------------------------------------- the reference


def test_steps_converge_to_the_reference_with_the_fourth_order() -> None:
    run = quick(0.4)
    exact = reference(DECLARED, run)
    error = [np.abs(simulate(DECLARED, run, [], n)["e1"] - exact["e1"]).max() / exact["e1"].std() for n in (2, 4, 8)]
    assert error[2] < 1e-7
    assert error[0] / error[1] > 12.0 and error[1] / error[2] > 12.0


def test_steps_approach_the_reference_with_flanges_and_clearance() -> None:
    run = quick(0.4)
    effects = [
        effect("flange_contact", "contact", clearance=1e-3, stiffness=14.6e6),
        effect("free_play", "primary_lateral", 2, half_width=2e-4),
    ]
    exact, result = reference(DECLARED, run, effects), simulate(DECLARED, run, effects, 8)
    assert np.abs(exact["e1"]).max() > 1e-3
    assert np.abs(result["e1"] - exact["e1"]).max() < 1e-4 * exact["e1"].std()


# -------------------------------------------------------------------------------------------- campaigns


RUN_OUT = parse("run_out at=wheelset wheelset=1 force=500 rolling_radius=0.46")
SHORT = Order([RUN_OUT], seed=5, seconds=(3.0, 1.5), coloured=0.02, columns=["Qy"], steps=2)


def test_friction_that_has_aged_needs_the_steps_of_friction_as_strong() -> None:
    ageing = effect("ageing_friction", "primary_lateral", force=1500.0, slip_speed=5e-3, rise=3.0)
    plain = effect("dry_friction", "primary_lateral", force=6000.0, slip_speed=5e-3)
    of_ageing, of_plain = (steps_for(Bogie([DECLARED], [[one]]), 40.0, 5e-3) for one in (ageing, plain))
    assert of_plain >= 6 and 0.75 * of_plain <= of_ageing <= of_plain


@pytest.mark.slow
@pytest.mark.parametrize("stranger", EFFECTS_NOT_IN_LIBRARY, ids=lambda e: f"{e.kind} at {e.at}")
def test_the_steps_of_a_campaign_suffice_for_its_effect(stranger: Effect) -> None:
    order = Order([stranger], seed=63022, seconds=(4.0, 2.0))
    steps = steps_of(order)
    found, finer = (campaign(replace(order, steps=n)).clean["a"]["ay1"] for n in (steps, 2 * steps))
    assert np.std(found - finer) < 0.01 * np.std(finer)


@pytest.fixture(scope="module")
def short() -> Campaign:
    return campaign(SHORT)


def test_a_campaign_is_repeatable_and_its_runs_differ(short: Campaign) -> None:
    again, other = campaigns([SHORT, replace(SHORT, seed=6)])
    assert np.array_equal(again.runs["b"]["e1"], short.runs["b"]["e1"])
    assert not np.allclose(short.runs["a"]["yw"], other.runs["a"]["yw"])
    assert short.effects["a"][0].parameters["phase"] != short.effects["b"][0].parameters["phase"]


def test_recorded_columns_have_the_declared_noise(short: Campaign) -> None:
    for name, sd in {"e1": 5e-5, "ayf": 0.02, "rf": 3e-4, "yw": 2e-5, "gauge": 5e-5, "Qy": 100.0}.items():
        noise = short.runs["a"][name] - short.clean["a"][name]
        assert noise.std() == pytest.approx(sd, rel=0.3), name
    noise = short.runs["a"]["e1"] - short.clean["a"]["e1"]
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(np.exp(-0.005 / 0.02), abs=0.1)


def test_a_run_starts_in_motion_and_its_distance_is_the_integral_of_its_speed(short: Campaign) -> None:
    run = short.clean["a"]
    walked = np.cumsum(0.5 * (run["v"][1:] + run["v"][:-1]) * np.diff(run["t"]))
    assert run["t"][0] == 0.0 and abs(run["s"][0]) < 1e-9
    assert np.abs(run["s"][1:] - walked).max() < 1e-4
    assert np.abs(run["ay1"][:100]).max() > 0.05


def test_written_campaigns_have_the_columns_of_the_file_format(tmp_path: Path) -> None:
    out, truth = tmp_path / "bad_box", tmp_path / "truth.yaml"
    words = ["--effect", "free_play at=primary_lateral wheelset=2 half_width=0.3e-3", "--seconds", "2", "1"]
    main([str(out), *words, "--seed", "3", "--truth", str(truth)])
    with gzip.open(out / "run_b.csv.gz", "rt") as file:
        rows = list(csv.reader(file))
    track = "t [s],s [m],v [m/s],yw [m],phiw [rad],gauge [m],"
    boxes = "e1 [m],e2 [m],ay1 [m/s^2],ay2 [m/s^2],ayf [m/s^2],rf [rad/s],d1 [m],d2 [m]"
    assert ",".join(rows[0]) == track + boxes
    assert len(rows) == 201
    assert sorted(p.name for p in out.iterdir()) == [
        "campaign.yaml",
        "run_a.csv.gz",
        "run_b.csv.gz",
        "vehicle.yaml",
    ]
    assert "free_play" not in (out / "campaign.yaml").read_text()
    assert '"half_width": 0.0003' in truth.read_text()


def test_numbers_go_to_design_names_and_back() -> None:
    assert len(paths(DECLARED)) == 30
    assert vehicle_of(paths(DECLARED), CHECK) == DECLARED


# ------------------------------------------------------------------------------------------------- the rig


def test_a_rig_rings_as_the_textbook_says() -> None:
    rig, t = Rig(), np.arange(1500) / 1000.0
    own, fade = np.sqrt(rig.k / rig.m), rig.c / (2 * rig.m)
    w = np.sqrt(own**2 - fade**2)
    exact = 1e-3 * np.exp(-fade * t) * (np.cos(w * t) + fade / w * np.sin(w * t))
    assert np.abs(respond(rig, t, start=(1e-3, 0.0))["z"] - exact).max() < 1e-8


def test_a_base_that_moves_and_one_that_is_accelerated_are_the_same_rig() -> None:
    t = np.arange(2000) / 1000.0
    x = 1e-3 * np.sin(2 * np.pi * 3.0 * t) ** 3
    w = 2 * np.pi * 3.0
    acceleration = 1e-3 * w**2 * (6 * np.sin(w * t) * np.cos(w * t) ** 2 - 3 * np.sin(w * t) ** 3)
    friction = [parse("dry_friction at=rig force=20 slip_speed=0.02")]
    moved = respond(Rig(input="base_displacement"), t, x, friction)["z"] - x
    shaken = respond(Rig(input="base_acceleration"), t, acceleration, friction)["z"]
    assert np.abs(moved - shaken).max() < 1e-5 * np.abs(shaken).max()


def test_a_bench_gives_two_runs_and_a_rig_near_the_nominal_one() -> None:
    rig, runs = bench_runs(Bench([parse("free_play at=rig half_width=5e-4")], 2, free=True, seconds=(1.0, 0.5)))
    assert list(runs["a"]) == ["t", "z", "az"] and len(runs["b"]["t"]) == 500
    assert 0.0 < abs(rig.k / Rig().k - 1.0) <= 0.2


def test_coaches_side_by_side_have_the_rates_of_the_single_one() -> None:
    rng = np.random.default_rng(3)
    x = np.concatenate([rng.normal(0.0, 0.01, 17), rng.normal(0.0, 0.1, 17), np.zeros(4)])
    rails, speed = rng.normal(0.0, 2e-3, (4, 4)), 40.0
    in_time = rails * [1.0, speed, 1.0, speed]
    both = Coaches([Coach(), Coach()], [(), ()])
    found = both.rate(np.stack([x, x], 1), np.full(2, speed), np.stack([in_time.ravel()] * 2, 1), 0.0)
    known = coach_rate(Coach(), x[:34], speed, rails)
    assert np.abs(found[:34, 1] - known).max() < 1e-12 * np.abs(known).max()


def test_half_as_conical_again_at_5_mm_turns_a_wheelset_of_a_coach_half_as_much_again() -> None:
    x, rails, speed = np.zeros((34, 1)), np.zeros((16, 1)), np.full(1, 40.0)
    x[11] = 5e-3  # of the second wheelset; its yaw is the next co-ordinate
    c = replace(Coach(), friction=1e6)
    more = Effect("nonlinear_conicity", "contact", 2, {"cubic": 2e4})
    plain, curved = (Coaches([c], [e]).rate(x, speed, rails, 0.0)[17:, 0] for e in ((), (more,)))
    turning = 2 * c.b * c.kappa_x * c.N * c.lam * 5e-3 / c.r / c.I_zw
    assert plain[12] - curved[12] == pytest.approx(0.5 * turning, rel=1e-3)
    assert np.delete(plain - curved, 12) == pytest.approx(np.zeros(16), abs=1e-6 * turning)


@pytest.mark.parametrize("kind", ["free_play", "hysteresis", "asymmetric_damper", "ageing_friction", "primary_drift"])
@pytest.mark.parametrize("at", ["primary_lateral", "primary_yaw", "lateral_damper_lateral", "secondary_yaw"])
def test_effect_at_a_joint_of_a_coach_pushes_both_bodies_alike(kind: str, at: str) -> None:
    parameters = {k: x for k, x in PARAMETERS[kind].items() if k != "at"}
    effects = [Effect(kind, at, None, parameters), Effect("dry_friction", at, 2, PARAMETERS["dry_friction"])]
    c, rng = Coach(), np.random.default_rng(4)
    x = np.concatenate([rng.normal(0.0, 1e-3, 17), rng.normal(0.0, 0.1, 17), rng.normal(0.0, 0.1, 4)])[:, None]
    rails, speed = np.zeros((16, 1)), np.full(1, 40.0)
    x = x[: 34 + Coaches([c], [effects]).effects.states]
    with_effects = Coaches([c], [effects]).rate(x, speed, rails, 1.0)
    more = (with_effects[:34] - Coaches([c], [()]).rate(x[:34], speed, rails, 1.0))[17:, 0]
    lateral, yaw = [0, 3, 6, 9, 11, 13, 15], [1, 4, 7, 10, 12, 14, 16]
    force = more[lateral] * [c.m, c.m_f, c.m_f, *[c.m_w] * 4]
    moment = more[yaw] * [c.I_z, c.I_zf, c.I_zf, *[c.I_zw] * 4]
    places = np.array([0.0, c.a_c, -c.a_c, c.a_c + c.a, c.a_c - c.a, c.a - c.a_c, -c.a - c.a_c])
    assert np.abs(more).max() > 0.0
    assert abs(force.sum()) <= 1e-9 * np.abs(force).sum()
    assert abs(moment.sum() + places @ force) <= 1e-9 * (np.abs(moment).sum() + np.abs(places * force).sum())
