"""Limit cycles and the nonlinear critical speed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.running_stability.limit_cycles import find_limit_cycles, nonlinear_critical_speeds, with_flange
from railui.running_stability.summary import stability
from railui.running_stability.tangent_track import Motion, TangentTrackRuns
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]


CHECK = load_design(HOME / "designs/check_bogie.yaml")


SLIPPERY = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.15})


FLANGE = PlacedEffect("flange_contact", "contact", None, {})


def with_effects(*effects: PlacedEffect, base: Design = CHECK) -> Model:
    return Model(base.with_effects(effects))


def test_hunting_decays_below_the_nonlinear_critical_speed_only() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    result = find_limit_cycles(model, [50.0, 60.0, 70.0])
    assert result.is_subcritical and result.critical_speed is not None
    assert 58.0 < result.critical_speed < 61.0  # below the linear critical speed: a hard loss
    track = TangentTrackRuns(model)
    at_fold = result.from_above.states[0]
    speeds = np.array([result.critical_speed - 0.05, result.critical_speed + 0.05])
    late = track.settle(track.start(speeds, at_fold), 1e-4)
    assert late.amplitudes[0] < 1e-4 < 7e-3 < late.amplitudes[1]


def test_the_unstable_cycle_separates_decaying_from_growing_disturbances() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    result = find_limit_cycles(model, [55.0, 62.0])
    cycles = list(result.branch)
    turn = int(np.argmin([c.speed for c in cycles[: len(cycles) // 2]]))
    assert cycles[turn].speed == pytest.approx(
        result.critical_speed, abs=0.05
    )  # shooting and simulation agree on the fold
    assert all(c.multiplier < 1 for c in cycles[:turn]) and cycles[turn + 2].multiplier > 1
    # hunting scaled down to just below and above the unstable amplitude, at a speed between
    unstable = next(c for c in cycles[turn + 2 :] if c.speed > result.critical_speed + 0.4)
    track = TangentTrackRuns(model)
    hunts = track.settle(Motion(np.array([unstable.speed]), result.from_above.states[:1]), 1e-3)
    shares = np.array([0.9, 1.1]) * unstable.amplitude / hunts.amplitudes[0]
    speeds = np.full(2, unstable.speed)
    late = track.settle(Motion(speeds, np.ascontiguousarray(shares[:, None] * hunts.states)), 1e-3)
    assert late.amplitudes[0] < 2e-3 and late.amplitudes[1] == pytest.approx(hunts.amplitudes[0], rel=0.02)


def test_cooperriders_bogie_loses_stability_subcritically() -> None:
    result = stability(HOME / "designs/cooperrider.yaml", [60.0, 75.0], fold=True)
    assert result["linear_critical_speed"] == pytest.approx(68.667, abs=5e-4)
    assert result["linear_critical_frequency"] == pytest.approx(3.998, abs=5e-4)
    assert result["fold_speed"] == pytest.approx(66.69, abs=0.05)
    assert result["fold"]["loss"] == "hard" and result["fold"]["bistable"][1] == pytest.approx(68.667, abs=0.01)
    # the unstable cycle grows out of rest at the Hopf bifurcation
    assert result["fold"]["branch"][-1]["amplitude"] < 1e-3
    assert result["fold"]["branch"][-1]["speed"] == pytest.approx(68.667, abs=0.1)


def test_the_critical_speed_does_not_depend_on_the_grid() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    folds = [find_limit_cycles(model, speeds, diagram=False).critical_speed for speeds in ([62.0], [40.0, 64.0, 90.0])]
    assert np.ptp(np.array(folds, dtype=float)) < 0.05


def test_missing_flange_contact_is_added_with_a_note() -> None:
    model, notes = with_flange(Model(CHECK))
    assert [e.kind for e in model.effects] == ["flange_contact"]
    assert len(notes) == 2 and "flange_contact" in notes[0] and "creep_saturation" in notes[1]
    again, notes = with_flange(with_effects(SLIPPERY, FLANGE))
    assert len(again.effects) == 2 and not notes


def test_axle_box_clearance_gives_a_small_cycle_below_the_critical_speed() -> None:
    play = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 5e-4})
    speeds = [30.0, 40.0, 50.0]
    small = find_limit_cycles(with_effects(SLIPPERY, FLANGE, play), speeds).from_below.amplitudes[:3]
    assert np.all((small > 2e-4) & (small < 1e-3))
    assert np.all(find_limit_cycles(with_effects(SLIPPERY, FLANGE), speeds).from_below.amplitudes == 0)
    # with linear creep the play is the only length: twice the play, twice the cycle
    wider = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 1e-3})
    once, twice = (find_limit_cycles(with_effects(FLANGE, p), [30.0]).from_below.amplitudes[0] for p in (play, wider))
    assert twice == pytest.approx(2 * once, rel=1e-3)


def test_critical_speeds_of_many_are_those_of_each() -> None:
    model = with_effects(SLIPPERY, FLANGE)
    stiff = Model(model.design.with_values({"vehicle.primary.lateral_stiffness": 4e6}))
    both = nonlinear_critical_speeds([model, stiff], [50.0, 70.0])
    assert both[1] == find_limit_cycles(stiff, [50.0, 70.0], diagram=False).critical_speed


FRICTION = PlacedEffect("dry_friction", "primary_lateral", None, {"force": 8e3, "slip_speed": 2e-3})


def test_a_stiff_friction_damper_is_sampled_more_finely_at_low_speed() -> None:
    model = with_effects(SLIPPERY, FLANGE, FRICTION)
    runs = TangentTrackRuns(model)
    with pytest.raises(ValueError, match="steps per sample"):
        runs.vehicles.required_steps(runs.single, 5.0, 5.0, 0.02)
    assert runs.sampling(5.0, 5.0, 0.02).refinement > 1 == runs.sampling(50.0, 50.0, 0.002).refinement
    slow, fast = (find_limit_cycles(model, [v, 60.0, 70.0], diagram=False).critical_speed for v in (5.0, 50.0))
    assert slow == pytest.approx(fast, abs=0.05)


def test_a_vehicle_too_stiff_for_the_finest_sampling_names_its_friction() -> None:
    hard = PlacedEffect("dry_friction", "primary_lateral", None, {"force": 8e3, "slip_speed": 1e-6})
    with pytest.raises(ValueError, match=r"limit cycles at 5 m/s: .*; .*raise the slip speed of dry friction$"):
        find_limit_cycles(with_effects(SLIPPERY, FLANGE, hard), [5.0, 60.0])


def test_a_segment_in_parts_ends_in_the_same_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = TangentTrackRuns(with_effects(SLIPPERY, FLANGE, FRICTION))
    start = runs.start(np.array([30.0, 40.0]), runs.displaced_state(5e-3))
    whole = runs.advance(start)
    monkeypatch.setattr("railui.running_stability.tangent_track.MAX_STEPS_PER_SAMPLE", 8)
    parts = runs.advance(start)
    np.testing.assert_allclose(parts.states, whole.states, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(parts.amplitudes, whole.amplitudes, rtol=1e-4)
