"""Quasi-static curves: the check values, a free wheelset by hand, equilibrium with effects."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.curving import curve, curve_many, curves
from railui.curving.equilibrium import solve_equilibria
from railui.report.figures.stability import draw_curves
from railui.ride_quality.running_safety import NO_FRICTION_NOTE
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model
from railui.vehicle.multibody import position_terms

HOME = Path(__file__).parents[2]
CHECK = load_design(HOME / "designs/check_bogie.yaml")
FLANGE = PlacedEffect("flange_contact", "contact", None, {})
CREEP = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.35})


def stiff(c_x: float) -> Design:
    return CHECK.with_values({"vehicle.primary.longitudinal_stiffness": c_x})


def test_linear_results_beyond_the_flange_are_called_not_credible() -> None:
    assert any("not credible" in note for note in curve(CHECK, 10.0)["notes"])
    assert not any("not credible" in note for note in curve(CHECK, 5000.0)["notes"])


def test_without_yaw_stiffness_every_wheelset_rolls_radially() -> None:
    result = curve(stiff(1e-6), 600.0)
    b, r, lam = 0.75, 0.46, 0.18
    assert result["displacement"] == pytest.approx([-b * r / (lam * 600)] * 2, rel=1e-4)
    assert 1e3 * np.array(result["angle_of_attack"]) == pytest.approx([-0.127] * 2, abs=5e-4)
    assert result["guiding_force"] == pytest.approx([0.0, 0.0], abs=1e-2)


@pytest.mark.parametrize(
    ("c_x", "e", "psi"),
    [(8e6, (-10.940, -3.289), (-1.417, 0.843)), (8e7, (-15.270, -5.715), (-2.434, 1.583))],
)
def test_the_check_values(c_x: float, e: tuple[float, float], psi: tuple[float, float]) -> None:
    result = curve(stiff(c_x), 600.0)
    assert 1e3 * np.array(result["displacement"]) == pytest.approx(e, abs=5e-4)
    assert 1e3 * np.array(result["angle_of_attack"]) == pytest.approx(psi, abs=5e-4)


def test_creepages_and_forces_are_those_of_the_model() -> None:
    # (3.3)-(3.5) with e and psi of the result; no cross-level, one conicity
    result = curve(CHECK, 600.0)
    n, kx, ky, ks, lam, eps, delta, sig, b, r = 55e3, 130, 120, 0.25, 0.18, 8, 0.05, 0.05, 0.75, 0.46
    wear = 0.0
    rows = zip(
        *(result[k] for k in ("displacement", "angle_of_attack", "guiding_force", "wheelsets")),
        strict=True,
    )
    for e, psi, q, wheels in rows:
        q_y = 0.0
        for j in (1, 2):
            s = (-1) ** j
            gamma = delta - s * eps * e / b
            u_x, u_y = s * (lam * e / r + b / 600), -psi
            u_n = (s * gamma + sig * e / b) / r + 1 / 600
            t_x, t_y = kx * n * u_x, ky * n * u_y + ks * n * u_n
            y_j = (-1) ** (j + 1) * n * gamma + t_y
            q_y -= y_j
            wear += abs(t_x * u_x) + abs(t_y * u_y)
            assert wheels["wear_number"][j - 1] == pytest.approx(abs(t_x * u_x) + abs(t_y * u_y), rel=1e-6)
            outward = (-1) ** (j + 1) * y_j
            assert wheels["guiding_force"][j - 1] == pytest.approx(outward, rel=1e-6)
            assert wheels["derailment_quotient"][j - 1] == pytest.approx(outward / n, rel=1e-6)
        assert q == pytest.approx(q_y, rel=1e-6)
    assert result["wear_number"] == pytest.approx(wear, rel=1e-6)


def test_friction_at_the_flange_by_hand() -> None:
    # right-hand curve of 300 m: the left wheel of the leading wheelset touches, so e < 0; linear creep of the treads
    mu, d, gamma = 0.3, 0.012, 1.2
    rubbing = {"clearance": 7e-3, "stiffness": 14.6e6, "friction": mu, "depth": d, "angle": gamma}
    result = curve(CHECK.with_effects([PlacedEffect("flange_contact", "contact", None, rubbing)]), 300.0)
    n, kx, ky, ks, lam, eps, delta, sig, b, r = 55e3, 130, 120, 0.25, 0.18, 8, 0.05, 0.05, 0.75, 0.46
    assert result["flange_contact"] == [True, False]
    wear = 0.0
    for e, psi, q in zip(result["displacement"], result["angle_of_attack"], result["guiding_force"], strict=True):
        press = 14.6e6 * max(0.0, -e - 7e-3)
        u_x, u_y = (lam * e - d) / r + b / 300, -psi / np.cos(gamma)
        size = np.hypot(kx * u_x, ky * u_y) / mu
        share = press / np.sin(gamma) * (1 - size / 3 + size**2 / 27 if size < 3 else 1 / size)
        q_y = press - share * ky * u_y * np.cos(gamma)
        wear += share * (kx * u_x**2 + ky * u_y**2)
        for s in (-1, 1):
            v_x, v_n = s * (lam * e / r + b / 300), (s * (delta - s * eps * e / b) + sig * e / b) / r + 1 / 300
            t_y = -ky * n * psi + ks * n * v_n
            q_y += s * n * (delta - s * eps * e / b) - t_y
            wear += kx * n * v_x**2 + abs(t_y * psi)
        assert q == pytest.approx(q_y, rel=1e-6)
    assert result["wear_number"] == pytest.approx(wear, rel=1e-6)
    assert wear > 1.3 * curve(CHECK.with_effects([FLANGE]), 300.0)["wear_number"]


def test_the_wear_of_a_flange_is_that_of_the_outer_wheel() -> None:
    rubbing = PlacedEffect("flange_contact", "contact", None, {"friction": 0.3})
    for radius, outer in ((300.0, 1), (-300.0, 0)):
        result = curve(CHECK.with_effects([CREEP, rubbing]), radius)
        wheels = np.array([wheelset["wear_number"] for wheelset in result["wheelsets"]])
        assert result["flange_contact"] == [True, False]
        assert wheels.sum() == pytest.approx(result["wear_number"], rel=1e-12)
        assert wheels[0, outer] > 2.0 * wheels[0, 1 - outer]


def test_creep_forces_without_friction_are_noted() -> None:
    assert NO_FRICTION_NOTE in curve(CHECK, 600.0)["notes"]
    assert NO_FRICTION_NOTE not in curve(CHECK.with_effects([CREEP]), 600.0)["notes"]


def test_a_curve_to_the_left_is_its_mirror_image() -> None:
    design = CHECK.with_effects([replace(FLANGE, parameters={"friction": 0.3}), CREEP])
    right, left = curves(design, [400.0, -400.0], 0.05)
    for key in ("displacement", "angle_of_attack", "guiding_force"):
        assert right[key] == pytest.approx([-x for x in left[key]], rel=1e-9)


def test_guiding_forces_carry_the_whole_cant_deficiency() -> None:
    for effects in ([], [FLANGE, CREEP]):
        result = curve(CHECK.with_effects(effects), 800.0, 0.1)
        assert sum(result["guiding_force"]) == pytest.approx(4 * 55e3 * 0.1 / (2 * 0.75), rel=1e-6)
        assert not any(note.startswith("guiding_force") for note in result["notes"])


def test_guiding_forces_of_a_coach_that_rolls_carry_the_whole_cant_deficiency() -> None:
    """The wheels of the coach carry its weight, so N d/(2 b) is asked of each, on eight wheels."""
    result = curve(HOME / "designs/manchester_coach.yaml", 600.0, 0.1)
    assert sum(result["guiding_force"]) == pytest.approx(8 * 54.546e3 * 0.1 / (2 * 0.75), rel=1e-4)
    assert not any(note.startswith("guiding_force") for note in result["notes"])


def test_wheel_loads_of_a_coach_in_a_curve_bear_its_overturning_moment() -> None:
    """About the tangent at its middle: sum of 2 b dQ = sum of m (g y - a h) over all bodies - 2 N y_i of the line."""
    model = Model(load_design(HOME / "designs/manchester_coach.yaml"))
    radius, d, b, values, structure = 600.0, 0.1, 0.75, model.design.values, model.design.structure
    assert structure is not None
    equilibria = solve_equilibria(model, model.row[None], np.array([radius]), np.array([d]))
    y = dict(zip(model.vehicles().degrees_of_freedom(model.single_batch()), equilibria.batch.initial[0], strict=False))
    moment = 0.0
    for name, member in structure.members.items():
        number = {key: values[member.part.number_path(key)] for key in member.part.keys}
        x = sum(factor * values[path] for factor, path in position_terms(structure, member))
        line, h = x**2 / (2 * radius), number["rolling_radius" if member.is_wheelset else "height"]
        moment += number["mass"] * 9.81 * (y[f"y.{name}"] + line - h * d / (2 * b))
        moment -= 2 * number["wheel_load"] * line if member.is_wheelset else 0.0
    right, left = np.array([w["wheel_load"] for w in curve(model, radius, d)["wheelsets"]]).T
    assert right + left == pytest.approx(np.full(4, 2 * 54.546e3))
    assert b * float(np.sum(right - left)) == pytest.approx(moment, rel=3e-3)
    assert moment < -50e3


def test_y_over_q_beyond_its_limit_is_noted() -> None:
    result = curve(CHECK.with_effects([FLANGE]), 120.0, 0.15)
    largest = max(q for w in result["wheelsets"] for q in w["derailment_quotient"])
    assert result["derailment_quotient"] == largest > 0.8
    assert any(f"Y/Q {largest:.3g} of the" in note and "exceeds 0.8" in note for note in result["notes"])


def test_a_note_reports_guiding_forces_that_laws_at_rolling_wheelsets_leave_out() -> None:
    design = load_design(HOME / "designs/manchester_coach.yaml")
    stiffened = PlacedEffect("cubic_stiffness", "primary_roll", None, {"stiffness": 1e13})
    (note,) = (n for n in curve(design.with_effects([stiffened]), 600.0, 0.1)["notes"] if n.startswith("guiding_force"))
    assert 0.0 < abs(float(note.split()[2])) < 0.1 * 29.1e3


def test_a_flange_keeps_the_wheelset_near_its_clearance() -> None:
    result = curve(CHECK.with_effects([FLANGE]), 600.0)
    assert result["flange_contact"] == [True, False]
    assert -8.5e-3 < result["displacement"][0] < -7e-3


def test_a_clearance_wider_than_the_motion_is_no_spring() -> None:
    play = PlacedEffect("free_play", "primary_yaw", None, {"half_width": 0.1})
    assert curve(CHECK.with_effects([play]), 600.0)["displacement"] == pytest.approx(
        curve(stiff(1e-6), 600.0)["displacement"], rel=1e-6
    )


def test_a_rail_yields_by_what_the_wheelset_presses_on_it() -> None:
    def on(stiffness: float) -> np.ndarray:
        rail = PlacedEffect("rail_flexibility", "track", None, {"stiffness": stiffness, "damping": 1e5})
        return np.array(curve(CHECK.with_effects([rail]), 600.0)["displacement"])

    plain = np.array(curve(CHECK, 600.0)["displacement"])
    assert on(1e9) == pytest.approx(plain, rel=0.02)
    # a rail ten times as soft yields ten times as much, as long as that is little
    assert on(1e8) - plain == pytest.approx(10 * (on(1e9) - plain), rel=0.1)


def test_many_designs_have_the_equilibria_of_each_alone() -> None:
    designs = [stiff(c) for c in (1e6, 5e6, 2e7)] + [CHECK.with_effects([FLANGE])]
    together = curve_many(designs, 500.0, 0.05)
    for design, result in zip(designs, together, strict=True):
        alone = curve(design, 500.0, 0.05)
        assert result["displacement"] == pytest.approx(alone["displacement"], rel=1e-9)


def test_invalid_radii_are_rejected() -> None:
    with pytest.raises(ValueError, match="radius"):
        curve(CHECK, 0.0)
    model = Model(CHECK)
    for radius in (np.inf, np.nan, 0.0):
        with pytest.raises(ValueError, match=f"other than 0: {radius:g} m"):
            solve_equilibria(model, model.row[None].repeat(2, axis=0), np.array([600.0, radius]), np.zeros(2))


def test_the_command_writes_all_keys_and_cases(tmp_path: Path) -> None:
    design = str(HOME / "designs/check_bogie.yaml")
    done = CliRunner().invoke(cli, ["curve", design, "--radius", "600", "--json", "-", "-q"])
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert [round(1e3 * e, 3) for e in report["displacement"]] == [-10.94, -3.289]
    assert {"angle_of_attack", "guiding_force", "wear_number"} <= set(report)
    words = ["curve", design, "--radii", "300:600:100", "--cant-deficiency", "100 mm", "--figure",
             str(tmp_path / "c.svg"), "--json", str(tmp_path / "c.json")]  # fmt: skip
    assert CliRunner().invoke(cli, words).exit_code == 0
    assert [c["radius"] for c in json.loads((tmp_path / "c.json").read_text())["cases"]] == [300, 400, 500, 600]
    for wrong in ([], ["--radius", "0"], ["--radius", "300 s"], ["--radius", "3", "--radii", "3:4"]):
        assert CliRunner().invoke(cli, ["curve", design, *wrong]).exit_code == 2


def test_curves_without_an_equilibrium_are_drawn_as_such(tmp_path: Path) -> None:
    keys = ("displacement", "angle_of_attack", "guiding_force", "wear_number")
    draw_curves([{"radius": radius} | dict.fromkeys(keys) for radius in (20.0, 30.0)], tmp_path / "c.svg")
    assert (tmp_path / "c.svg").read_text().count("no equilibrium") == len(keys)
