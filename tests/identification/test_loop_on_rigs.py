"""The loop on a rig, driven and freely decaying: verdict, report and page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.loop import close_loop
from railui.report.loop.data import loop_report
from railui.report.loop.files import write_loop
from tests.truth.effects import effect
from tests.truth.rig import Bench, write

FRICTION = effect("dry_friction", "rig", force=40.0, slip_speed=0.01)
SLOW = ("bump_stop", "maxwell_damper", "free_play", "hysteresis")  # excluded to keep the tests fast


def simulated_rig(tmp_path: Path, **options: Any) -> Dataset:
    write(Bench(seconds=(3.0, 2.0), rate=500.0, **options), tmp_path)
    return read_dataset(load_campaign(tmp_path))


def close_and_report(dataset: Dataset, directory: Path, without: Sequence[str]) -> tuple[dict[str, Any], str]:
    found = close_loop(dataset, without=without, jobs=1)
    write_loop(found, loop_report(found), directory, [])
    data = json.loads((directory / "loop.json").read_text())
    return data, (directory / "report.html").read_text()


@pytest.mark.parametrize("free", [False, True])
def test_a_loop_on_a_rig_without_effects_finds_none(tmp_path: Path, free: bool):
    data, page = close_and_report(simulated_rig(tmp_path, seed=1, free=free), tmp_path / "out", SLOW)
    assert data["verdict"] == "none" and data["unexplained"] < 1.1
    assert data["sentence"].split(":")[0] in page


def test_a_loop_on_a_driven_rig_finds_its_friction(tmp_path: Path):
    data, page = close_and_report(simulated_rig(tmp_path, seed=1, effects=[FRICTION]), tmp_path / "out", SLOW)
    assert data["verdict"] == "effect" and [e["kind"] for e in data["effects"]] == ["dry_friction"]
    assert data["effects"][0]["parameters"]["force"]["value"] == pytest.approx(40.0, rel=0.02)
    assert "dry friction" in page


@pytest.mark.parametrize("free", [False, True])
def test_a_loop_on_a_rig_without_friction_candidates_ends_outside(tmp_path: Path, free: bool):
    excluded = [*SLOW, "dry_friction", "quadratic_damper", "asymmetric_damper", "viscous_damper", "measured_force"]
    data, page = close_and_report(
        simulated_rig(tmp_path, seed=1, free=free, effects=[FRICTION]), tmp_path / "out", excluded
    )
    assert data["verdict"] == "outside" and data["outside"]["at"] == "rig"
    assert len(data["outside"]["motion"]) == len(data["outside"]["force"])
    assert "identified force curve" in page


def floor_of(context: Context) -> NoiseFloor:
    return estimate_noise_floor(context, context.nominal, context.dataset.validation, 4)


def test_noise_on_the_input_of_a_rig_raises_the_noise_floor(tmp_path: Path):
    quiet = simulated_rig(tmp_path, seed=1)
    u = quiet.validation[0].columns["u"]
    noisy = Dataset(quiet.campaign, quiet.runs, quiet.segments, {**quiet.noise, "u": 0.1 * float(u.std())})
    low, high = (floor_of(create_context(m, jobs=1)) for m in (quiet, noisy))
    assert low.nrmse == pytest.approx(low.sensors_only)
    assert high.nrmse > 1.5 * high.sensors_only


def write_tanks(folder: Path, samples: int) -> None:
    """Two tanks in series, levels in V: first order each, with outflows as the square root of the level."""
    dt, rng = 4.0, np.random.default_rng(5)
    u = 3.0 + np.repeat(rng.uniform(-2.0, 2.0, samples // 32), 32)
    u = np.convolve(u, np.ones(9) / 9.0, "same")
    levels = np.array([3.0, 2.0])
    z = []
    for value in u:
        z.append(levels[1] + 0.01 * rng.standard_normal())
        for _ in range(20):
            out = np.sqrt(np.maximum(levels, 0.0))
            levels = levels + dt / 20 * np.array([0.03 * value - 0.05 * out[0], 0.05 * out[0] - 0.06 * out[1]])
    half = samples // 2
    for name, part in (("a", slice(0, half)), ("b", slice(half, None))):
        rows = [f"{4.0 * i:.1f},{x:.6g},{y:.6g}" for i, (x, y) in enumerate(zip(u[part], z[part], strict=True))]
        (folder / f"{name}.csv").write_text("\n".join(["t [s],u [V],z [V]", *rows]) + "\n")
    (folder / "vehicle.yaml").write_text(
        "name: tanks\nvehicle: {rig: {mass: 1000, stiffness: 1, damping: 60, gain: 1, input: force}}\n"
    )
    (folder / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )


def test_a_rig_sampled_too_slowly_for_a_candidate_reaches_a_verdict(tmp_path: Path):
    write_tanks(tmp_path, 512)
    data = loop_report(close_loop(read_dataset(load_campaign(tmp_path)), jobs=1))
    assert data["after"]["nrmse"] <= data["before"]["nrmse"] < data["declared"]["nrmse"]
