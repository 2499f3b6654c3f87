"""Modes followed over speed: their roots are eigenvalues, they are continuous, and hunting is named."""

from __future__ import annotations

import numpy as np
import pytest

from railui.running_stability.critical_speed import critical_speeds
from railui.running_stability.mode_tracking import matrices_over_speed, track_modes
from railui.vehicle.linear import eigenvalues, state_matrices
from railui.vehicle.resolve import resolve_model

SPEEDS = np.linspace(5.0, 100.0, 96)


@pytest.mark.parametrize("name", ["check_bogie", "cooperrider", "bogie_under_coach"])
def test_matrices_at_all_speeds_follow_from_four(name: str) -> None:
    model = resolve_model(f"designs/{name}.yaml")
    some = np.array([7.0, 33.3, 88.0])
    direct = state_matrices(model, np.repeat(model.row[None], 3, axis=0), some)
    grid = np.array([5.0, *some, 100.0])
    assert np.allclose(matrices_over_speed(model, grid)[1:4], direct, rtol=1e-6, atol=1e-7 * np.abs(direct).max())


@pytest.mark.parametrize("name", ["check_bogie", "test_bogie", "bogie_under_coach", "manchester_coach"])
def test_tracked_roots_are_the_eigenvalues_at_every_speed(name: str) -> None:
    model = resolve_model(f"designs/{name}.yaml")
    tracked = np.stack([mode.roots for mode in track_modes(model, SPEEDS)], axis=1)
    roots = eigenvalues(model, np.repeat(model.row[None], len(SPEEDS), axis=0), SPEEDS)
    for mine, theirs in zip(tracked[::19], roots[::19], strict=True):
        oscillating = theirs[theirs.imag > 0.5]
        found = mine[mine.imag > 0.5]
        assert len(found) == len(oscillating)
        assert np.allclose(np.sort_complex(found), np.sort_complex(oscillating), rtol=1e-4, atol=1e-3)


def test_hunting_is_one_continuous_mode_that_loses_stability() -> None:
    model = resolve_model("designs/check_bogie.yaml")
    hunting = track_modes(model, SPEEDS)[0]
    critical = critical_speeds(model, model.row[None], 100.0)[0]
    assert hunting.name == "hunting" and critical is not None
    assert np.abs(np.diff(hunting.frequency)).max() < 0.25  # Hz per m/s: no jump to another mode
    crossing = np.interp(0.0, hunting.roots.real[30:], SPEEDS[30:])
    assert crossing == pytest.approx(critical.speed, abs=0.02)
    assert hunting.shape_at(critical.speed).startswith("frame and wheelsets lateral")


def test_modes_of_a_coach_have_distinct_names() -> None:
    modes = track_modes(resolve_model("designs/bogie_under_coach.yaml"), SPEEDS)
    names = [mode.name for mode in modes]
    assert len(set(names)) == len(names)
    frequencies = {mode.name: float(np.nanmedian(mode.frequency)) for mode in modes}
    assert frequencies["body lateral"] == pytest.approx(0.53, abs=0.03)
    assert frequencies["body roll"] == pytest.approx(1.28, abs=0.05)
