"""Residual force of a component over displacement and velocity together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import create_context
from railui.identification.loop import close_loop
from railui.identification.residual.restoring_force_surface import SurfaceShares, surface_shares
from railui.report.loop.sentence import sentence

Law = Callable[[FloatArray, FloatArray], FloatArray]


def bench(folder: Path, law: Law, nominal: str = "stiffness: 2000, damping: 500") -> Dataset:
    """Bench of a component with 2 kN/m, 500 N s/m and a law of z [m] and v [m/s], with 1 N of noise."""
    rng, t = np.random.default_rng(8), np.arange(2400) * 2.5e-3
    for name, f in (("a", (0.7, 1.9, 3.1)), ("b", (0.9, 1.6, 3.4))):
        w = 2.0 * np.pi * np.array(f)
        phase = np.multiply.outer(t, w) + rng.uniform(0.0, 6.0, 3)
        z, v = 6e-3 * np.sin(phase).sum(axis=1), 6e-3 * np.cos(phase) @ w
        force = 2000.0 * z + 500.0 * v + law(z, v) + rng.normal(0.0, 1.0, len(t))
        rows = [f"{a:.4f},{b:.8f},{c:.3f}" for a, b, c in zip(t, z, force, strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["t [s],z [m],F [N]", *rows]) + "\n")
    (folder / "vehicle.yaml").write_text(f"name: x\nvehicle: {{rig: {{input: motion, {nominal}}}}}\n")
    (folder / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    return read_dataset(load_campaign(folder))


def shares(folder: Path, law: Law) -> SurfaceShares:
    dataset = bench(folder, law)
    found = surface_shares(create_context(dataset).nominal, dataset.estimation, dataset.selection)
    assert found is not None
    return found


def growing_friction(z: FloatArray, v: FloatArray) -> FloatArray:
    """Friction of 8 kN per metre of deflection, larger to one side."""
    return 8e3 * z * np.tanh(v / 2e-3)


def test_friction_that_grows_with_the_deflection_is_no_sum_of_two_functions(tmp_path: Path) -> None:
    found = shares(tmp_path, growing_friction)
    assert found.joint > 0.8 and found.additive < 0.1


def test_a_sum_of_two_functions_is_explained_as_well_by_either(tmp_path: Path) -> None:
    found = shares(tmp_path, lambda z, v: 1e8 * z**3 + 300.0 * np.tanh(v / 0.02))
    assert found.additive > 0.9 and found.joint < found.additive + 0.02


def test_a_stiffness_that_fades_during_a_sweep_is_no_friction(tmp_path: Path) -> None:
    """A sweep visits the ends of the velocity at its end only, when the stiffness has changed."""
    rng, t = np.random.default_rng(5), np.arange(4800) * 2.5e-3
    phase = 2.0 * np.pi * (0.5 * t + 0.2 * t**2)
    for name, amplitude in (("a", 8e-3), ("b", 8.4e-3)):
        z, v = amplitude * np.sin(phase), amplitude * 2.0 * np.pi * (0.5 + 0.4 * t) * np.cos(phase)
        force = 5000.0 * np.exp(-t / 8.0) * z + 500.0 * v + rng.normal(0.0, 1.0, len(t))
        rows = [f"{a:.4f},{b:.8f},{c:.3f}" for a, b, c in zip(t, z, force, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t [s],z [m],F [N]", *rows]) + "\n")
    (tmp_path / "vehicle.yaml").write_text("name: x\nvehicle: {rig: {input: motion, stiffness: 2600, damping: 500}}\n")
    (tmp_path / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    dataset = read_dataset(load_campaign(tmp_path))
    found = surface_shares(create_context(dataset).nominal, dataset.estimation, dataset.selection)
    assert found is not None and found.interaction < 0.1


def test_noise_of_a_component_depends_on_no_motion(tmp_path: Path) -> None:
    found = shares(tmp_path, lambda z, v: np.zeros_like(z))
    assert max(found) < 0.02


def plain_friction(z: FloatArray, v: FloatArray) -> FloatArray:
    """Friction of 150 N."""
    return 150.0 * np.tanh(v / 0.01)


@pytest.mark.parametrize(("law", "is_found"), [(growing_friction, True), (plain_friction, False)])
def test_a_loop_says_what_the_force_depends_on(tmp_path: Path, law: Law, is_found: bool) -> None:
    dataset = bench(tmp_path, law, "stiffness: 1800, damping: 600")
    found = close_loop(dataset, without=("maxwell_damper",), jobs=1)
    assert found.verdict == "effect" if not is_found else found.verdict in ("partial", "outside")
    assert ("depends on displacement and velocity together" in sentence(found)) == is_found
    assert (found.remainder.surface is not None) == is_found
