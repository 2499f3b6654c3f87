"""Integration steps of a rig's records, against the exact response of a lightly damped resonance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate

MASS, RATE, SECONDS = 2.0, 400.0, 16.0  # kg, samples/s, s
FREQUENCY, DAMPING_RATIO = 40.0, 0.005  # Hz
STIFFNESS = MASS * (2.0 * np.pi * FREQUENCY) ** 2
DAMPING = 2.0 * DAMPING_RATIO * np.sqrt(STIFFNESS * MASS)


def steady_campaign(directory: Path, seed: int = 1) -> Dataset:
    """Two records of the exact steady response to forces of many frequencies around the resonance."""
    rng, t = np.random.default_rng(seed), np.arange(SECONDS * RATE) / RATE
    omega = 2.0 * np.pi * np.arange(10.0, 70.0, 0.25)
    for name in ("a", "b"):
        force = 20.0 * np.exp(2j * np.pi * rng.random(len(omega)))
        response = force / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
        waves = np.exp(1j * np.outer(t, omega))
        u, z = (waves @ force).real, (waves @ response).real
        z += 0.01 * z.std() * rng.standard_normal(len(t))
        rows = [f"{row[0]:.4f},{row[1]:.9g},{row[2]:.9g}" for row in zip(t, u, z, strict=True)]
        (directory / f"{name}.csv").write_text("\n".join(["t [s],u [N],z [m]", *rows]) + "\n")
    nominal = f"mass: {MASS}, stiffness: {0.98 * STIFFNESS}, damping: {1.4 * DAMPING}"
    (directory / "vehicle.yaml").write_text(f"name: light resonance\nvehicle: {{rig: {{{nominal}}}}}\n")
    (directory / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    return read_dataset(load_campaign(directory))


def test_a_light_resonance_of_ten_samples_per_period_keeps_its_damping(tmp_path: Path):
    """One step per sample would take 15 % off the damping, at intervals of 0.1 %."""
    fit = calibrate(create_context(steady_campaign(tmp_path), jobs=1))
    estimates = dict(zip(fit.free.paths, fit.x, strict=True))
    assert estimates["vehicle.rig.damping"] == pytest.approx(DAMPING, rel=2e-3)
    assert estimates["vehicle.rig.stiffness"] == pytest.approx(STIFFNESS, rel=5e-5)
