"""Modes: eigenvalues, decrement, shapes in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.running_stability.modes import describe_shape, modes_at
from railui.running_stability.tangent_track import TangentTrackRuns
from railui.vehicle.design_reader import load_design
from railui.vehicle.linear import eigenvalues, state_matrices
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]


CHECK = load_design(HOME / "designs/check_bogie.yaml")


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


def test_the_state_matrix_has_the_kernels_eigenvalues() -> None:
    model = Model(CHECK)
    matrix = state_matrices(model, model.row[None], np.array([40.0]))[0]
    of_matrix = np.sort_complex(np.linalg.eigvals(matrix))
    assert of_matrix == pytest.approx(
        np.sort_complex(eigenvalues(model, model.row[None], np.array([40.0]))[0]), rel=1e-6
    )


def test_a_mode_shape_is_described_in_words() -> None:
    dofs = ["y", "psi", "y1", "psi1", "y2", "psi2"]
    assert describe_shape(dofs, np.array([0, 1, 1.28, 0, -1.28, 0]), 1.28) == (
        "frame yaw; wheelset 1 lateral; wheelset 2 lateral opposed"
    )
