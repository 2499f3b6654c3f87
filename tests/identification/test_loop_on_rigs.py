"""The loop on a rig, driven and freely decaying: verdict, report and page."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from railui import core
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.loop import close_loop
from railui.report.loop.data import loop_report
from railui.report.loop.files import write_loop
from tests.truth.campaign import pink
from tests.truth.effects import effect
from tests.truth.rig import Bench, Rig, respond, write

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


def test_coloured_noise_of_a_free_decay_is_no_discrepancy(tmp_path: Path):
    rng, t = np.random.default_rng(3), np.arange(2000) * 0.005
    for name, start in (("a", 0.02), ("b", 0.013)):
        z = start * np.exp(-0.2 * t) * np.cos(15.0 * t) + 1e-4 * pink(len(t), rng)
        rows = [f"{x:.3f},{y:.7g}" for x, y in zip(t, z, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t [s],z [m]", *rows]) + "\n")
    (tmp_path / "vehicle.yaml").write_text("name: decay\nvehicle: {rig: {mass: 3, stiffness: 700, damping: 1.5}}\n")
    (tmp_path / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    result = close_loop(read_dataset(load_campaign(tmp_path)), without=SLOW, jobs=1)
    assert result.validations["after"].nrmse > 1.5 * result.noise_floor.nrmse
    assert (result.verdict, result.discrepancy) == ("none", None)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_drift_of_the_sensor_of_a_free_decay_is_no_law(tmp_path: Path, friction: float):
    """A drift of 5 % of the first amplitude resembles the shift of an asymmetric spring."""
    rig = Rig(m=2.5, k=900.0, c=0.9)
    law = effect("dry_friction", "rig", force=friction, slip_speed=0.005)
    for i, (name, start, seconds) in enumerate((("a", 0.03, 12.0), ("b", -0.022, 10.0), ("c", 0.026, 9.0))):
        t = np.arange(round(200.0 * seconds)) * 0.005
        z = respond(rig, t, None, [law] if friction else [], (start, 0.0), lively=abs(start))["z"]
        z = z + 0.05 * abs(start) * t / seconds + np.random.default_rng(i).normal(0.0, 4e-5, len(t))
        rows = [f"{x:.3f},{y:.7g}" for x, y in zip(t, z, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t [s],z [m]", *rows]) + "\n")
    (tmp_path / "vehicle.yaml").write_text("name: decay\nvehicle: {rig: {mass: 2.5, stiffness: 800, damping: 1.5}}\n")
    roles = ("adjust", "validate", "validate")
    runs = ", ".join(f"{{file: {name}.csv, role: {role}}}" for name, role in zip("abc", roles, strict=True))
    (tmp_path / "campaign.yaml").write_text(f"vehicle: vehicle.yaml\nruns: [{runs}]\n")
    data, _ = close_and_report(read_dataset(load_campaign(tmp_path)), tmp_path / "out", SLOW)
    assert data["verdict"] == ("effect" if friction else "none") and data["unexplained"] < 1.3
    assert [e["kind"] for e in data["effects"]] == (["dry_friction"] if friction else [])
    assert any("sensors drift" in note for note in data["notes"])


def test_a_second_mode_of_a_free_decay_is_no_noise(tmp_path: Path):
    """Two modes, which no law of the library on one mass can follow."""
    for name, first, second, seconds in (("a", 0.01, 0.004, 9.0), ("b", -0.006, 0.008, 8.0)):
        t = np.arange(round(200.0 * seconds)) * 0.005
        z = first * np.exp(-0.2 * t) * np.cos(14.0 * t) + second * np.exp(-0.4 * t) * np.cos(33.0 * t)
        z = z + np.random.default_rng(len(name)).normal(0.0, 2e-5, len(t))
        rows = [f"{x:.3f},{y:.7g}" for x, y in zip(t, z, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t [s],z [m]", *rows]) + "\n")
    (tmp_path / "vehicle.yaml").write_text("name: decay\nvehicle: {rig: {mass: 2, stiffness: 420, damping: 1}}\n")
    (tmp_path / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    data, page = close_and_report(read_dataset(load_campaign(tmp_path)), tmp_path / "out", SLOW)
    assert data["verdict"] == "outside" and "noise is larger" not in data["sentence"]
    assert not data["effects"]
    assert data["remainder"]["vibration"] == pytest.approx(33.0 / (2.0 * np.pi), rel=0.05)
    assert "What is left is largest about 5." in data["sentence"] and "the natural frequency of the rig" in page


def test_noise_of_the_input_that_a_resonance_amplifies_is_no_discrepancy(tmp_path: Path):
    rig, declared = Rig(m=12.0, k=4700.0, c=18.0), Rig(m=12.0, k=5400.0, c=14.0)
    bench = Bench(rig=rig, declared=declared, columns=("z",), rate=250.0, seconds=(25.0, 20.0))
    write(replace(bench, noise=0.002, input_noise=0.03), tmp_path)
    result = close_loop(read_dataset(load_campaign(tmp_path)), without=SLOW, jobs=1)
    assert result.validations["after"].nrmse < 1.3 * result.noise_floor.nrmse  # which contains noise of the input
    assert (result.verdict, result.discrepancy) == ("none", None)


def varying_rig(tmp_path: Path, stiffness: Callable[[float], float], damping: Callable[[float], float]) -> Dataset:
    """Rig of 8 kg driven by a force, whose stiffness and damping are functions of time."""
    rng = np.random.default_rng(14)
    for name, seconds in (("a", 16.0), ("b", 13.0)):
        t = np.arange(round(250.0 * seconds)) * 0.004
        f, phase = np.geomspace(0.4, 10.0, 40) * rng.uniform(0.98, 1.02, 40), rng.uniform(0.0, 2.0 * np.pi, 40)
        force = CubicSpline(t, 5.6 * np.cos(2.0 * np.pi * f * t[:, None] + phase).sum(axis=1))
        z = solve_ivp(
            lambda s, x, u=force: [x[1], (u(s) - stiffness(s) * x[0] - damping(s) * x[1]) / 8.0],
            (0.0, t[-1]),
            [0.0, 0.0],
            t_eval=t,
            rtol=1e-7,
            atol=1e-10,
        ).y[0]
        z = z + np.random.default_rng(1).normal(0.0, 2e-5, len(t))
        rows = [f"{x:.3f},{u:.7g},{y:.7g}" for x, u, y in zip(t, force(t), z, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t [s],u [N],z [m]", *rows]) + "\n")
    (tmp_path / "vehicle.yaml").write_text("name: rig\nvehicle: {rig: {mass: 8, stiffness: 2600, damping: 35}}\n")
    (tmp_path / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    return read_dataset(load_campaign(tmp_path))


def test_a_stiffness_that_oscillates_is_no_noise(tmp_path: Path):
    """Its response is coherent with no input, but about the resonance."""
    dataset = varying_rig(tmp_path, lambda t: 3000.0 * (1.0 + 0.15 * np.cos(8.2 * t)), lambda t: 25.0)
    data, _ = close_and_report(dataset, tmp_path / "out", SLOW)
    assert data["verdict"] == "outside" and not data["effects"]


def test_damping_that_fades_is_a_variation_with_time(tmp_path: Path):
    dataset = varying_rig(tmp_path, lambda t: 3000.0, lambda t: 12.0 + 28.0 * np.exp(-t / 6.0))
    data, page = close_and_report(dataset, tmp_path / "out", SLOW)
    outside = data["outside"]
    assert data["verdict"] == "outside" and (outside["at"], outside["parameter"]) == ("rig", "vehicle.rig.damping")
    assert (outside["against"], outside["motion_unit"], outside["force_unit"]) == ("t", "s", "N*s/m")
    assert outside["force"][0] == pytest.approx(40.0, rel=0.15) and outside["force"][-1] == pytest.approx(
        14.0, rel=0.15
    )
    assert data["after"]["nrmse"] < 0.3 * data["before"]["nrmse"]
    assert "with vehicle.rig.damping varying with time" in data["sentence"] and "curve of vehicle.rig.damping" in page


def add_to_channels(folder: Path, extra: Callable[[Any, Any, int], Any]) -> None:
    """Add a series to each channel z and az of both runs: extra of time, channel and index of the run."""
    for i, name in enumerate(("a", "b")):
        path = folder / f"run_{name}.csv.gz"
        head, *rows = gzip.decompress(path.read_bytes()).decode().strip().split("\n")
        table = np.array([row.split(",") for row in rows], float)
        for j, column in enumerate(head.split(",")):
            if column.startswith(("z", "az")):
                table[:, j] += extra(table[:, 0], table[:, j], 10 * i + j)
        lines = [",".join(f"{x:.7g}" for x in row) for row in table]
        path.write_bytes(gzip.compress("\n".join([head, *lines, ""]).encode()))


def test_a_small_effect_under_coloured_noise_is_no_discrepancy(tmp_path: Path):
    bench = Bench([effect("asymmetric_damper", "rig", ratio=0.5)], 1, seconds=(12.0, 8.0), rate=200.0, noise=0.003)
    write(bench, tmp_path)
    add_to_channels(tmp_path, lambda t, x, i: 0.04 * x.std() * pink(len(t), np.random.default_rng(divmod(i, 10))))
    kinds = [r["kind"] for r in core.effect_catalogue() if r["kind"] not in ("asymmetric_damper", "quadratic_damper")]
    result = close_loop(read_dataset(load_campaign(tmp_path)), without=kinds, jobs=1)
    assert result.score_test.best[0].candidate.kind == "asymmetric_damper" and result.remainder.structured
    assert result.validations["after"].nrmse > 1.5 * result.noise_floor.nrmse
    assert (result.verdict, result.discrepancy) == ("none", None)


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


def test_mains_hum_is_no_discrepancy_and_is_named(tmp_path: Path):
    write(Bench(seconds=(12.0, 10.0), rate=500.0, seed=1, noise=0.005), tmp_path)
    add_to_channels(tmp_path, lambda t, x, _: 0.03 * x.std() * np.sin(2.0 * np.pi * 50.0 * t + x[0]))
    data, _ = close_and_report(read_dataset(load_campaign(tmp_path)), tmp_path / "out", SLOW)
    assert data["verdict"] == "none" and data["unexplained"] > 1.5
    line = "`sensors: {z: {hum: 50 Hz}, az: {hum: 50 Hz}}`"
    assert f"z and az contain mains hum of 50 Hz, which counts in the error; {line} removes it." in data["sentence"]
