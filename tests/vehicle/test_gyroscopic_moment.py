"""Size of the gyroscopic moment by the roll of the track, which the model leaves out as (3.1) of the thesis does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.arrays import ComplexArray, FloatArray
from railui.track.spectra import spectrum_density
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from railui.vehicle.transfer import linearise

WAVE = np.linspace(2 * np.pi / 150.0, 2 * np.pi / 3.0, 2000)  # rad/m
TEST_BOGIE = Path(__file__).parents[2] / "designs/test_bogie.yaml"
SLOPES = {"yw": 1, "phiw": 3}  # columns dyw/ds, dphiw/ds of B


def changes(speed: float) -> FloatArray:
    """Relative changes [channel] of the rms of e1, e2, d1 and d2 of the test bogie by the moment, at a speed [m/s].

    A wheelset that spins with V/r and rolls adds -I_ya (V/r) phi' to the left of (3.1), by Euler's equations. With
    phi = phi_w - sigma (y - y_w - r phi_w)/b this is G (y' - y_w') - I_ya (V/r) (1 + sigma r/b) phi_w', of which the
    model has G y'.
    """
    model = Model(load_design(TEST_BOGIE))
    vehicle = linearise(model, speed, ("e1", "e2", "d1", "d2"))
    value = model.design.values
    I_ya, I_za = value["vehicle.wheelset.spin_inertia"], value["vehicle.wheelset.yaw_inertia"]
    r, b = value["vehicle.geometry.rolling_radius"], value["vehicle.geometry.half_gauge"]
    sigma = value["contact.leading.roll"]
    G = I_ya * speed * sigma / (b * r)
    B = vehicle.B.copy()
    dofs = list(model.vehicles().degrees_of_freedom(model.single_batch()))
    for wheelset, psi in enumerate(("psi1", "psi2")):
        row = len(dofs) + dofs.index(psi)
        B[wheelset, SLOPES["yw"], row] += speed * G / I_za
        B[wheelset, SLOPES["phiw"], row] += speed * (I_ya * speed / r) * (1.0 + sigma * r / b) / I_za

    density = np.stack([spectrum_density("erri_b176_low", q, WAVE) for q in SLOPES], axis=1)

    def rms(transfer: ComplexArray) -> FloatArray:
        """Root of the power [channel], but for a factor, of transfer functions [wave number, channel, input]."""
        return np.asarray(np.sqrt(np.einsum("wci,wi->c", np.abs(transfer[..., :2]) ** 2, density)))

    frequency = WAVE * speed / (2 * np.pi)
    without, with_moment = vehicle.transfer(frequency), replace(vehicle, B=B).transfer(frequency)
    return np.asarray(rms(with_moment - without) / rms(without))


def test_the_moment_by_the_roll_of_the_track_changes_displacements_by_five_to_eight_percent() -> None:
    change = changes(40.0)
    assert np.all((change > 0.05) & (change < 0.08)), change


@pytest.mark.parametrize(("speed", "least", "largest"), [(20.0, 0.01, 0.02), (30.0, 0.03, 0.045), (60.0, 0.12, 0.14)])
def test_the_change_by_the_roll_of_the_track_grows_as_the_square_of_the_speed(
    speed: float, least: float, largest: float
) -> None:
    change = changes(speed)
    assert np.all((change > least) & (change < largest)), change
