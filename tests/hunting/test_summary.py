"""Stability: modes and critical speeds against hand formulas, hunting against a march of our own."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from railui.cli import cli
from railui.core import Batch, Vehicles
from railui.hunting.critical_speed import critical_speeds, linear_stability_many
from railui.hunting.limit_cycles import find_limit_cycles, nonlinear_critical_speeds, with_flange
from railui.hunting.modes import modes_at, describe_shape
from railui.hunting.summary import stability
from railui.hunting.tangent_track import Motion, TangentTrackRuns
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.linear import eigenvalues, linear_effects, state_matrices
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]
CHECK = load_design(HOME / "designs/check_bogie.yaml")
SLIPPERY = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.15})
FLANGE = PlacedEffect("flange_contact", "contact", None, {})


def with_effects(*effects: PlacedEffect, base: Design = CHECK) -> Model:
    return Model(base.with_effects(effects))


def wheelset_on_springs(
    m: float, i: float, f11: float, f22: float, b: float, lam: float, r: float, s_y: float, s_psi: float
) -> tuple[float, float]:
    """V_c [m/s] and w [rad/s] at neutral stability: the exact solution of one wheelset on springs."""
    w2 = (f22 * s_psi + f11 * b**2 * s_y) / (f22 * i + f11 * b**2 * m)
    bottom = 4 * f11 * f22 * lam * b / r + (s_y - m * w2) * (s_psi - i * w2)
    return float(np.sqrt(4 * f11 * f22 * b**2 * w2 / bottom)) if bottom > 0 else np.nan, float(np.sqrt(w2))


def roots_of_wheelset(v: float, m: float, i: float, f11: float, f22: float, b: float, lam: float, r: float,
                      s_y: float, s_psi: float) -> np.ndarray:  # fmt: skip
    numbers = [m, i, 0.0, b, r, 1.0, s_y, s_psi, lam, f11, f22, 0.0, 0.0, 0.0, 0.0]
    return Vehicles("wheelset").eigenvalues(Batch.from_arrays(np.array([numbers])), v)[0]


PUBLISHED = (1022.0, 678.0, 6.563e6 / 0.60252, 6.563e6 / 0.54219, 0.7163, 0.05, 0.4572, 1.823e5, 768800.0)


def test_the_published_wheelset_is_neutral_at_its_critical_speed() -> None:
    v, w = wheelset_on_springs(*PUBLISHED)
    assert v == pytest.approx(69.83360931998, abs=1e-9)
    assert w / (2 * np.pi) == pytest.approx(4.334738642, abs=1e-9)
    root = roots_of_wheelset(v, *PUBLISHED)[0]
    assert abs(root.real) < 1e-8 and abs(root.imag) == pytest.approx(w, rel=1e-9)


@settings(deadline=None, max_examples=60)
@given(st.tuples(*(st.floats(0.5, 2.0) for _ in PUBLISHED)))
def test_any_wheelset_is_neutral_where_the_formula_says(factors: tuple[float, ...]) -> None:
    numbers = tuple(float(f * x) for f, x in zip(factors, PUBLISHED, strict=True))
    v, w = wheelset_on_springs(*numbers)
    assume(np.isfinite(v) and 5 < v < 300)
    roots = roots_of_wheelset(v, *numbers)
    nearest = roots[np.argmin(np.abs(roots - 1j * w))]
    assert abs(nearest - 1j * w) < 1e-6 * w


@pytest.mark.parametrize(
    ("v", "real", "imag", "fastest"),
    [
        (10.0, -2.28035, 5.38976, -738.406),
        (20.0, -4.13918, 10.98602, -350.940),
        (40.0, -4.41556, 22.55234, -147.747),
        (60.0, -0.34808, 30.17447, -89.564),
    ],
)
def test_the_bogie_has_the_eigenvalues_of_the_table(v: float, real: float, imag: float, fastest: float) -> None:
    modes = modes_at(Model(CHECK), v)
    least = max((m for m in modes if m["imag"] > 0), key=lambda m: m["real"])
    assert (least["real"], least["imag"]) == (pytest.approx(real, abs=5e-6), pytest.approx(imag, abs=5e-6))
    assert min(m["real"] for m in modes) == pytest.approx(fastest, abs=5e-4)
    assert least["decrement"] == pytest.approx(-2 * np.pi * real / imag, rel=3e-5)


def test_the_critical_speed_of_the_bogie() -> None:
    found = stability(CHECK)
    assert found["linear_critical_speed"] == pytest.approx(61.64024, abs=5e-6)
    assert found["klingel_wavelength"] == pytest.approx(2 * np.pi * np.sqrt(0.75 * 0.46 / 0.18), rel=1e-12)
    assert found["rest_critical_speed"] == found["linear_critical_speed"]
    assert found["fold_speed"] is None and found["practical_critical_speed"] is None
    assert stability(CHECK, [20.0, 40.0])["linear_critical_speed"] is None


def test_many_designs_have_the_numbers_that_each_has_alone() -> None:
    model = Model(CHECK)
    rows = np.repeat(model.row[None], 5, axis=0)
    rows[:, model.columns["vehicle.primary.longitudinal_stiffness"]] *= np.linspace(0.5, 1.5, 5)
    together = linear_stability_many(model, rows, [30.0, 90.0])
    for i, row in enumerate(rows):
        alone = linear_stability_many(model, row[None], [30.0, 90.0])
        for key, values in together.items():
            assert values[i] == alone[key][0], key
    assert np.all(np.diff(together["linear_critical_speed"]) > 0)  # a stiffer primary hunts later


def test_the_decrement_is_that_of_the_free_vibration() -> None:
    track = TangentTrackRuns(Model(CHECK))
    motion = track.start(np.array([60.0]), track.displaced_state(1e-3))
    for _ in range(2):  # the other modes die first
        motion = track.advance(motion)
    first = motion.amplitudes[0]
    motion = track.advance(motion)
    turns = 250.0 / 60.0 * 30.17447 / (2 * np.pi)
    assert np.log(first / motion.amplitudes[0]) / turns == pytest.approx(0.07248, rel=0.01)
    assert motion.frequencies[0] == pytest.approx(30.17447 / (2 * np.pi), rel=1e-3)


# effects


def test_linear_effects_are_told_from_others_by_what_they_do() -> None:
    model = with_effects(
        PlacedEffect("spring", "secondary_lateral", None, {"stiffness": 1e5}),
        PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4}),
        PlacedEffect("maxwell_damper", "secondary_yaw", None, {"stiffness": 1e6, "damping": 1e5}),
        PlacedEffect("dry_friction", "secondary_yaw", None, {"force": 1e3}),
        PlacedEffect("rail_flexibility", "track", None, {}),
        SLIPPERY,
    )
    assert linear_effects(model) == (True, False, True, False, True, False)


def test_a_spring_as_an_effect_is_the_declared_spring() -> None:
    declared = Model(CHECK.with_values({"vehicle.secondary.lateral_stiffness": 4e5}))
    added = with_effects(PlacedEffect("spring", "secondary_lateral", None, {"stiffness": 4e5}))
    one, other = (critical_speeds(m, m.row[None], 120.0)[0] for m in (declared, added))
    assert one is not None and other is not None
    assert one.speed == pytest.approx(other.speed, abs=1e-6)


def test_at_rest_a_free_play_holds_nothing() -> None:
    model = with_effects(PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4}))
    loose = Model(CHECK.with_values({"vehicle.primary.lateral_stiffness": 1e-6}))
    v = np.array([40.0])
    at_rest = eigenvalues(model, model.row[None], v, at_rest=True)[0]
    assert at_rest == pytest.approx(eigenvalues(loose, loose.row[None], v)[0], abs=1e-5)
    assert eigenvalues(model, model.row[None], v)[0] == pytest.approx(
        eigenvalues(Model(CHECK), Model(CHECK).row[None], v)[0], abs=1e-6
    )


def test_the_state_matrix_has_the_kernels_eigenvalues() -> None:
    model = Model(CHECK)
    matrix = state_matrices(model, model.row[None], np.array([40.0]))[0]
    of_matrix = np.sort_complex(np.linalg.eigvals(matrix))
    assert of_matrix == pytest.approx(
        np.sort_complex(eigenvalues(model, model.row[None], np.array([40.0]))[0]), rel=1e-6
    )


def test_a_shape_is_told_in_words() -> None:
    dofs = ["y", "psi", "y1", "psi1", "y2", "psi2"]
    assert describe_shape(dofs, np.array([0, 1, 1.28, 0, -1.28, 0]), 1.28) == (
        "frame yaw; wheelset 1 lateral; wheelset 2 lateral opposed"
    )


# hunting


def test_hunting_dies_at_the_fold_and_not_above() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    found = find_limit_cycles(model, [50.0, 60.0, 70.0])
    assert found.is_subcritical and found.critical_speed is not None
    assert 58.0 < found.critical_speed < 61.0  # below the linear critical speed: a hard loss
    track = TangentTrackRuns(model)
    at_fold = found.from_above.states[0]
    speeds = np.array([found.critical_speed - 0.05, found.critical_speed + 0.05])
    late = track.settle(track.start(speeds, at_fold), 1e-4)
    assert late.amplitudes[0] < 1e-4 < 7e-3 < late.amplitudes[1]


def test_the_unstable_cycle_is_where_disturbances_part() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    found = find_limit_cycles(model, [55.0, 62.0])
    cycles = list(found.branch)
    turn = int(np.argmin([c.speed for c in cycles[: len(cycles) // 2]]))
    assert cycles[turn].speed == pytest.approx(found.critical_speed, abs=0.05)  # shooting and simulation agree on the fold
    assert all(c.multiplier < 1 for c in cycles[:turn]) and cycles[turn + 2].multiplier > 1
    # hunting scaled down to just below and above the unstable amplitude, at a speed between
    unstable = next(c for c in cycles[turn + 2 :] if c.speed > found.critical_speed + 0.4)
    track = TangentTrackRuns(model)
    hunts = track.settle(Motion(np.array([unstable.speed]), found.from_above.states[:1]), 1e-3)
    shares = np.array([0.9, 1.1]) * unstable.amplitude / hunts.amplitudes[0]
    speeds = np.full(2, unstable.speed)
    late = track.settle(Motion(speeds, np.ascontiguousarray(shares[:, None] * hunts.states)), 1e-3)
    assert late.amplitudes[0] < 2e-3 and late.amplitudes[1] == pytest.approx(hunts.amplitudes[0], rel=0.02)


def test_cooperriders_bogie_loses_stability_hard() -> None:
    found = stability(HOME / "designs/cooperrider.yaml", [60.0, 75.0], fold=True)
    assert found["linear_critical_speed"] == pytest.approx(68.667, abs=5e-4)
    assert found["linear_critical_frequency"] == pytest.approx(3.998, abs=5e-4)
    assert found["fold_speed"] == pytest.approx(66.69, abs=0.05)
    assert found["fold"]["loss"] == "hard" and found["fold"]["bistable"][1] == pytest.approx(68.667, abs=0.01)
    # the unstable cycle grows out of rest at the Hopf bifurcation
    assert found["fold"]["branch"][-1]["amplitude"] < 1e-3
    assert found["fold"]["branch"][-1]["speed"] == pytest.approx(68.667, abs=0.1)


def test_the_fold_does_not_depend_on_where_it_was_looked_for_from() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    folds = [find_limit_cycles(model, speeds, diagram=False).critical_speed for speeds in ([62.0], [40.0, 64.0, 90.0])]
    assert np.ptp(np.array(folds, dtype=float)) < 0.05


def test_a_vehicle_without_flange_contact_is_given_it_and_told_so() -> None:
    model, notes = with_flange(Model(CHECK))
    assert [e.kind for e in model.effects] == ["flange_contact"]
    assert len(notes) == 2 and "flange_contact" in notes[0] and "creep_saturation" in notes[1]
    again, notes = with_flange(with_effects(SLIPPERY, FLANGE))
    assert len(again.effects) == 2 and not notes


def test_free_play_in_the_axle_boxes_gives_a_small_cycle_below_any_other_critical_speed() -> None:
    play = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 5e-4})
    speeds = [30.0, 40.0, 50.0]
    small = find_limit_cycles(with_effects(SLIPPERY, FLANGE, play), speeds).from_below.amplitudes[:3]
    assert np.all((small > 2e-4) & (small < 1e-3))
    assert np.all(find_limit_cycles(with_effects(SLIPPERY, FLANGE), speeds).from_below.amplitudes == 0)
    # with linear creep the play is the only length: twice the play, twice the cycle
    wider = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 1e-3})
    once, twice = (find_limit_cycles(with_effects(FLANGE, p), [30.0]).from_below.amplitudes[0] for p in (play, wider))
    assert twice == pytest.approx(2 * once, rel=1e-3)


def test_folds_of_many_are_those_of_each() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    stiff = Model(model.design.with_values({"vehicle.primary.lateral_stiffness": 4e6}))
    both = nonlinear_critical_speeds([model, stiff], [50.0, 70.0])
    assert both[1] == find_limit_cycles(stiff, [50.0, 70.0], diagram=False).critical_speed


# practice


def test_the_critical_speed_in_practice_is_the_last_admissible_one() -> None:
    design = CHECK.with_effects([SLIPPERY, FLANGE])
    found = stability(design, [40.0, 50.0, 60.0, 70.0], track="erri_b176_low length=600")
    v = found["practical_critical_speed"]
    good = ("very good", "good", "satisfactory", "just admissible")
    assert ride(design, "erri_b176_low length=600", v)["class"] in good
    assert ride(design, "erri_b176_low length=600", v + 0.1)["class"] not in good


def test_the_command_tells_all_three_in_one_table(tmp_path: Path) -> None:
    text = (HOME / "designs/check_bogie.yaml").read_text("utf-8")
    (tmp_path / "hard.yaml").write_text(
        text + "effects: [{kind: creep_saturation, at: contact, friction: 0.15}, {kind: flange_contact, at: contact}]\n"
    )
    files = ["--json", str(tmp_path / "s.json"), "--figure", str(tmp_path / "s.svg")]
    words = ["stability", str(tmp_path / "hard.yaml"), "--speeds", "50:70:10", "--fold", *files]
    words += ["--track", "erri_b176_low length=600"]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 0, done.output
    told = json.loads((tmp_path / "s.json").read_text())
    assert list(told)[:5] == ["schema", "version", "inputs", "seed", "simd"]
    assert told["linear_critical_speed"] == pytest.approx(61.64024, abs=5e-6)
    assert told["practical_critical_speed"] < told["fold_speed"] < told["linear_critical_speed"]
    assert {"speed", "real", "imag", "decrement"} <= set(told["modes"][0])
    assert (tmp_path / "s.svg").read_text().count("<svg") == 1


def test_the_command_refuses_what_cannot_be() -> None:
    for words in (["--speeds", "150"], ["--speeds", "60:20:5"], ["--track", "erri_b176_hi"]):
        done = CliRunner().invoke(cli, ["stability", str(HOME / "designs/check_bogie.yaml"), *words])
        assert done.exit_code == 2, done.output
