"""Derivatives at rest by dual numbers: of every effect as by central differences, and the eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest

from railui.core import matrix_eigenvalues
from railui.vehicle.linear import state_matrices
from railui.vehicle.resolve import resolve_model
from tests.kernel.pairs import asymmetric_bogie, batch, effect_locations, structure
from tests.kernel.test_effects import strong_effect
from tests.truth.effects import effect

VEHICLE = asymmetric_bogie(11)
STEP = 1e-9  # m, rad, m/s, rad/s
# straight and level track at 40 m/s, places and slopes zero
ROW = np.array([0.0, 40.0, *np.zeros(12)])


@pytest.mark.parametrize(("kind", "at", "wheelset"), list(effect_locations()))
def test_the_derivatives_of_every_effect_are_those_of_central_differences(
    kind: str, at: str, wheelset: int | None
) -> None:
    effects = [effect(kind, at, wheelset, **strong_effect(kind, at))]
    vehicles, one = structure(VEHICLE, effects), batch([VEHICLE], [effects])
    matrix = vehicles.jacobians(one, ROW)[0]
    n = len(matrix)
    states = STEP * np.vstack([np.eye(n), -np.eye(n)])
    rates = vehicles.state_derivatives(one.select(np.zeros(2 * n, dtype=int)), ROW, states)
    differences = (rates[:n] - rates[n:]).T / (2 * STEP)
    # forces at rest leave the differences less digits
    assert np.abs(matrix - differences).max() < 2e-5 * np.abs(differences).max()


@pytest.mark.parametrize("design", ["test_bogie", "check_bogie", "manchester_coach", "roller_rig"])
def test_the_state_matrix_has_the_eigenvalues_of_the_linear_vehicle(design: str) -> None:
    model = resolve_model(f"designs/{design}.yaml")
    found = matrix_eigenvalues(state_matrices(model, model.row[None], np.array([40.0])))[0]
    batch_at_speed = model.batch(model.row[None])
    known = np.asarray(matrix_eigenvalues(model.vehicles().state_matrix(batch_at_speed, 40.0))[0])
    assert np.abs(np.sort_complex(found) - np.sort_complex(known)).max() < 1e-12 * np.abs(known).max()
