"""Faults of all runs of a rig or a component that only the nominal model shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Fault
from railui.report.loop.data_faults import examine_data
from tests.campaign.test_rig_faults import FORCE, faults, rewrite, scale
from tests.truth.effects import effect
from tests.truth.laws import Array
from tests.truth.rig import Bench, Rig, write

SINES = ((0.5, 0.01), (2.0, 0.005), (4.0, 0.003), (1.0, 0.02), (3.0, 0.004))  # Hz, m


def write_bench(folder: Path, damping: str = "2 kN*s/m") -> None:
    """Spring and damper under a sine in each run, whose frequencies differ."""
    t = np.arange(4000) / 500.0
    for i, (f, amplitude) in enumerate(SINES):
        w = 2.0 * np.pi * f
        z, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
        force = 1.2e5 * z + 2.5e3 * v + 100.0
        force = force + 0.01 * force.std() * np.random.default_rng(i).standard_normal(len(t))
        save(folder, i, t, 1e3 * z, force)
    keys = f"input: motion, stiffness: 100 kN/m, damping: {damping}"
    (folder / "rig.yaml").write_text(f"name: rig\nvehicle: {{rig: {{{keys}}}}}\n")
    runs = ", ".join(f"{{file: {i}.csv, role: {'adjust' if i < 3 else 'validate'}}}" for i in range(len(SINES)))
    (folder / "campaign.yaml").write_text(f"vehicle: rig.yaml\nruns: [{runs}]\n")


def save(folder: Path, i: int, t: Array, z: Array, force: Array) -> None:
    rows = "\n".join(f"{a:.4f},{b:.8g},{c:.8g}" for a, b, c in zip(t, z, force, strict=True))
    (folder / f"{i}.csv").write_text(f"t [s],z [mm],F [N]\n{rows}\n")


def numbers(folder: Path, i: int) -> tuple[Array, Array, Array]:
    t, z, force = np.loadtxt(folder / f"{i}.csv", delimiter=",", skiprows=1).T
    return t, z, force


def only(folder: Path) -> Fault:
    [fault] = diagnose(read_dataset(load_campaign(folder))).faults
    return fault


def is_cured(folder: Path) -> bool:
    checked = examine_data(read_dataset(load_campaign(folder)), correct=True)
    return checked.is_corrected and not checked.remaining.faults


@pytest.mark.parametrize("damping", ["2 kN*s/m", "0 kN*s/m"])
def test_a_sound_component_has_no_fault(tmp_path: Path, damping: str) -> None:
    write_bench(tmp_path, damping)
    assert diagnose(read_dataset(load_campaign(tmp_path))).faults == ()


def test_a_unit_in_one_run_is_found_without_a_common_frequency(tmp_path: Path) -> None:
    write_bench(tmp_path)
    t, z, force = numbers(tmp_path, 2)
    save(tmp_path, 2, t, z, force / 1000.0)
    fault = only(tmp_path)
    assert (fault.kind, fault.channels, fault.files, fault.serious) == ("unit", ("F",), ("2.csv",), True)
    assert fault.yaml == "sensors: {F: {gain: 0.001, runs: [2.csv]}}"


def test_a_run_whose_force_is_noise_alone_has_no_unit(tmp_path: Path) -> None:
    """A motion within a clearance."""
    write_bench(tmp_path)
    t, z, _ = numbers(tmp_path, 2)
    save(tmp_path, 2, t, z, np.random.default_rng(9).standard_normal(len(t)))
    assert diagnose(read_dataset(load_campaign(tmp_path))).faults == ()


def test_exchanged_motion_and_force_are_found_and_corrected(tmp_path: Path) -> None:
    write_bench(tmp_path)
    for i in range(len(SINES)):
        t, z, force = numbers(tmp_path, i)
        save(tmp_path, i, t, force, z)
    fault = only(tmp_path)
    assert (fault.kind, fault.channels, fault.serious) == ("exchanged", ("z", "F"), True)
    assert fault.yaml == "sensors: {z: {gain: 1000, swap_with: F}, F: {gain: 0.001}}"
    assert is_cured(tmp_path)


@pytest.mark.parametrize("bench", [FORCE, Bench(effects=[effect("dry_friction", "rig", force=40.0, slip_speed=0.01)])])
def test_a_force_in_kilonewtons_is_found_and_corrected(tmp_path: Path, bench: Bench) -> None:
    write(bench, tmp_path)
    rewrite(tmp_path, scale(u=1e-3))
    [fault] = faults(tmp_path)
    assert (fault.kind, fault.channels, fault.serious) == ("unit", ("u",), True)
    assert fault.yaml == "sensors: {u: {gain: 0.001}}" and not fault.alternatives
    assert is_cured(tmp_path)


def test_exchanged_motion_and_speed_of_a_rig_are_found(tmp_path: Path) -> None:
    write(Bench(seconds=(10.0, 8.0), rate=500.0, seed=1, columns=("z", "vz", "az")), tmp_path)
    rewrite(tmp_path, lambda c: c | {"z": c["vz"], "vz": c["z"]})
    [fault] = [f for f in faults(tmp_path) if f.serious]
    assert (fault.kind, set(fault.channels)) == ("exchanged", {"z", "vz"})


@pytest.mark.parametrize("reversed_columns", [("u",), ("z", "az")])
def test_a_reversed_input_or_motion_cannot_be_told_apart(tmp_path: Path, reversed_columns: tuple[str, ...]) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, scale(**dict.fromkeys(reversed_columns, -1.0)))
    [fault] = faults(tmp_path)
    assert fault.kind == "sign" and fault.serious and not fault.is_correctable
    assert fault.yaml == "sensors: {u: {gain: -1}}"
    assert fault.alternatives == ("sensors: {z: {gain: -1}, az: {gain: -1}}",)


@pytest.mark.parametrize(("k", "c"), [(1.5e5, 150.0), (1.5e4, 150.0), (3e5, 30.0), (6e4, 1500.0)])
def test_an_inaccurate_nominal_model_reverses_nothing(tmp_path: Path, k: float, c: float) -> None:
    write(Bench(seconds=(10.0, 8.0), rate=500.0, seed=1, rig=Rig(), declared=Rig(k=k, c=c)), tmp_path)
    assert faults(tmp_path) == []
