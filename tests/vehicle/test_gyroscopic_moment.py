"""Size of the gyroscopic moment by the roll of the track, which the model leaves out as (3.1) of the thesis does."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from railui.vehicle.state_space import state_space

SPEED = 40.0  # m/s
LENGTHS = (3.0, 150.0)  # m, wavelengths of the track
CHANNELS = ("e1", "e2", "d1", "d2")
DESIGNS = Path(__file__).parents[2] / "designs"


def track_spectra(wave: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Spectra of ERRI B176, low: alignment [m^2/(rad/m)] and cross-level [rad^2/(rad/m)] at wave numbers [rad/m]."""
    c, r, s = 0.8246, 0.0206, 0.4380
    shape = c**2 / ((wave**2 + r**2) * (wave**2 + c**2))
    return 2.119e-7 * shape, 4.032e-7 / 0.75**2 * shape * wave**2 / (wave**2 + s**2)


def test_the_moment_by_the_roll_of_the_track_changes_displacements_by_five_to_eight_percent() -> None:
    """I_ya V/r times the roll rate: I_ya omega phi', phi = phi_w - sigma (y - y_w - r phi_w)/b."""
    design = load_design(DESIGNS / "test_bogie.yaml")
    system = state_space(Model(design), SPEED, CHANNELS)
    A, B, C, D = system.matrices()
    I_za, I_ya = (design.values[f"vehicle.wheelset.{axis}_inertia"] for axis in ("yaw", "spin"))
    r, b, a = (design.values[f"vehicle.geometry.{x}"] for x in ("rolling_radius", "half_gauge", "half_wheelbase"))
    sigma = design.values["contact.leading.roll"]
    inputs, states = list(system.inputs), list(system.states)
    slopes = {x: [inputs.index(f"d{x}_ds.{i}") for i in (1, 2)] for x in ("yw", "phiw")}
    levels = {x: [inputs.index(f"{x}.{i}") for i in (1, 2)] for x in ("yw", "phiw")}
    rates = [states.index(f"dpsi{i}_dt") for i in (1, 2)]
    G = I_ya * SPEED * sigma / (b * r)
    full = B.copy()
    for row, y, phi in zip(rates, slopes["yw"], slopes["phiw"], strict=True):
        full[row, y] += G * SPEED / I_za
        full[row, phi] += I_ya * SPEED / r * (1.0 + sigma * r / b) * SPEED / I_za

    wave = np.linspace(2 * np.pi / LENGTHS[1], 2 * np.pi / LENGTHS[0], 2000)
    resolvent = C @ np.linalg.inv(1j * wave[:, None, None] * SPEED * np.eye(len(A)) - A)
    behind = np.exp(-1j * wave[:, None] * np.array([0.0, 2 * a]))

    def response(inputs_of: np.ndarray, x: str) -> np.ndarray:
        """Transfer [wave number, channel] from alignment or cross-level to the channels."""
        each = resolvent @ inputs_of + D
        by_wheelset = each[..., levels[x]] + 1j * wave[:, None, None] * each[..., slopes[x]]
        return (by_wheelset * behind[:, None, :]).sum(axis=-1)

    def rms(of: dict[str, np.ndarray]) -> np.ndarray:
        densities = [np.abs(of[x]) ** 2 * s[:, None] for x, s in zip(of, track_spectra(wave), strict=True)]
        return np.sqrt(np.sum(densities, axis=(0, 1)))

    with_moment, without = ({x: response(m, x) for x in ("yw", "phiw")} for m in (full, B))
    change = rms({x: with_moment[x] - without[x] for x in without}) / rms(without)
    assert np.all((change > 0.05) & (change < 0.08)), change
