"""The loop where the recorded input of a rig, or the prescribed motion of a component, has noise."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from tests.truth.campaign import pink
from tests.truth.effects import effect
from tests.truth.rig import Bench, respond

RATE = 500.0
SLOW = ("bump_stop", "maxwell_damper", "free_play", "hysteresis", "blow_off_damper")  # excluded to keep the tests fast


def loop(folder: Path) -> LoopResult:
    return close_loop(read_dataset(load_campaign(folder)), without=SLOW, jobs=2)


def write_campaign(folder: Path, rig: str, header: str, runs: list[FloatArray]) -> None:
    """Write runs [column, n], all for the estimation but the last."""
    (folder / "vehicle.yaml").write_text(f"name: rig\nvehicle: {{rig: {{{rig}}}}}\n")
    entries = []
    for i, columns in enumerate(runs):
        rows = "\n".join(",".join(f"{x:.8g}" for x in row) for row in columns.T)
        (folder / f"{i}.csv").write_text(f"{header}\n{rows}\n")
        entries.append(f"{{file: {i}.csv, role: {'adjust' if i + 1 < len(runs) else 'validate'}}}")
    (folder / "campaign.yaml").write_text(f"vehicle: vehicle.yaml\nruns: [{', '.join(entries)}]\n")


def driven_rig(folder: Path, friction: float) -> None:
    """Rig of 95 kg under random forces; pink noise of 1 % on z and az, white noise of 2 % on u."""
    runs = []
    rig, effects = Bench().declared, [effect("dry_friction", "rig", force=friction, slip_speed=0.01)]
    for i, rms in enumerate((200.0, 400.0, 300.0)):
        rng = np.random.default_rng([4, i])
        t = np.arange(10000) / RATE
        f, phase = rng.uniform(0.5, 12.0, 200), rng.uniform(0.0, 2.0 * np.pi, 200)
        u = 0.1 * rms * np.sin(2.0 * np.pi * f * t[:, None] + phase).sum(axis=1)
        seen = respond(rig, t, u, effects if friction else [])
        noisy = [seen[c] + 0.01 * seen[c].std() * pink(len(t), rng) for c in ("z", "az")]
        runs.append(np.stack([t, u + 0.02 * u.std() * rng.standard_normal(len(t)), *noisy]))
    write_campaign(folder, "mass: 95, stiffness: 55000, damping: 250", "t [s],u [N],z [m],az [m/s^2]", runs)


def test_noise_of_the_input_is_no_discrepancy(tmp_path: Path) -> None:
    driven_rig(tmp_path, friction=0.0)
    result = loop(tmp_path)
    assert (result.verdict, result.discrepancy) == ("none", None)
    assert result.remainder.coherent_share is not None and result.remainder.coherent_share < 0.1
    assert result.context.noise["u"] == pytest.approx(6.0, rel=0.1)


def test_a_law_under_noise_of_the_input_is_found(tmp_path: Path) -> None:
    driven_rig(tmp_path, friction=25.0)
    result = loop(tmp_path)
    assert result.verdict == "effect" and [e.kind for e in result.after.model.effects] == ["dry_friction"]


def triangle(t: FloatArray, frequency: float, amplitude: float) -> FloatArray:
    """A triangle of seven odd harmonics."""
    k = np.arange(7)
    lines = (-1.0) ** k / (2 * k + 1) ** 2 * np.sin(2.0 * np.pi * (2 * k + 1) * frequency * t[:, None])
    return np.asarray(amplitude * 8.0 / np.pi**2 * lines.sum(axis=1))


def bench(folder: Path, law: Callable[[FloatArray, FloatArray], FloatArray]) -> None:
    """Component under triangles; pink noise of 1 % on F and white noise of 0.1 % on z."""
    runs, t = [], np.arange(10000) / RATE
    for i, (f, amplitude) in enumerate(((0.5, 0.02), (1.0, 0.01), (2.0, 0.008), (1.0, 0.02), (0.7, 0.015))):
        rng = np.random.default_rng([9, i])
        z = triangle(t, f, amplitude)
        force = law(z, np.gradient(z, t))
        force = force + 0.01 * force.std() * pink(len(t), rng)
        runs.append(np.stack([t, 1e3 * (z + 1e-3 * z.std() * rng.standard_normal(len(t))), force]))
    write_campaign(folder, "input: motion, stiffness: 10 kN/m, damping: 2 kN*s/m", "t [s],z [mm],F [N]", runs)


def test_noise_of_a_prescribed_motion_is_no_discrepancy(tmp_path: Path) -> None:
    bench(tmp_path, lambda z, v: 2e4 * z + 3e3 * v)
    result = loop(tmp_path)
    assert (result.verdict, result.discrepancy) == ("none", None)


def test_a_law_under_noise_of_a_prescribed_motion_is_found(tmp_path: Path) -> None:
    bench(tmp_path, lambda z, v: 2e4 * z + 3e3 * v + 4e4 * np.abs(v) * v)
    result = loop(tmp_path)
    assert result.verdict == "effect" and [e.kind for e in result.after.model.effects] == ["quadratic_damper"]
