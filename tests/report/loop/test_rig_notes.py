"""Notes on rigs: an input late or of unknown noise, motions that no estimation run reaches, slip at a high speed."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.report.loop.data import loop_report
from railui.report.loop.motion_notes import gradual_slip_notes, unreached_motion_notes
from railui.report.loop.rig_notes import (
    held_input_notes,
    late_force_notes,
    late_input_notes,
    unstated_input_noise_notes,
)
from railui.report.loop.summary import summary_lines
from railui.vehicle.effects import PlacedEffect


def segment(**columns: float) -> SimpleNamespace:
    """Segment of a rig whose columns are sines of these amplitudes."""
    wave = np.sin(np.linspace(0.0, 20.0, 400))
    channels = [c for c in columns if c != "u"]
    return SimpleNamespace(kind="rig", channels=channels, columns={c: a * wave for c, a in columns.items()})


def result(*segments: SimpleNamespace, verdict: str = "outside", noise: Any = None, **delays: float) -> LoopResult:
    effects = tuple(PlacedEffect("sensor_delay", at, None, {"delay": x}) for at, x in delays.items())
    dataset = SimpleNamespace(
        segments=segments,
        estimation=segments[:1],
        selection=segments[1:],
        campaign=SimpleNamespace(noise={}),
    )
    context = SimpleNamespace(noise=noise or {}, settings=LoopSettings())
    after = SimpleNamespace(model=SimpleNamespace(effects=effects))
    return cast(LoopResult, SimpleNamespace(dataset=dataset, context=context, verdict=verdict, after=after))


def test_equal_delays_of_all_channels_are_one_of_the_input() -> None:
    driven = segment(u=1.0, z=1.0, az=1.0)
    (note,) = late_input_notes(result(driven, driven, z=-6.01e-3, az=-6.0e-3))
    assert "u is recorded 6 ms late" in note and "`sensors: {u: {delay: 6 ms}}`" in note
    (note,) = late_input_notes(result(driven, driven, z=2e-3, az=2e-3))
    assert "2 ms early" in note and "delay: -2 ms" in note


@pytest.mark.parametrize("delays", [{"z": -6e-3}, {"z": -6e-3, "az": -5e-3}, {"z": -6e-3, "az": 6e-3}, {}])
def test_other_delays_are_those_of_sensors(delays: dict[str, float]) -> None:
    driven = segment(u=1.0, z=1.0, az=1.0)
    assert late_input_notes(result(driven, driven, **delays)) == []


def sampled(dt: float, u: np.ndarray) -> SimpleNamespace:
    return SimpleNamespace(kind="rig", channels=["z"], dt=dt, columns={"u": u, "z": u})


def test_a_delay_of_half_a_coarse_sample_may_be_that_of_a_held_input() -> None:
    coarse = sampled(0.05, np.random.default_rng(1).standard_normal(400))
    (note,) = held_input_notes(result(coarse, coarse, z=24.556e-3))
    assert "zero-order hold" in note and "`sensors: {u: {delay: -25 ms}}`" in note
    for delay in (-25e-3, 10e-3, 22e-3, 50e-3):
        assert held_input_notes(result(coarse, coarse, z=delay)) == []
    fine = sampled(0.05, np.sin(0.1 * np.arange(400)))
    assert held_input_notes(result(fine, fine, z=25e-3)) == held_input_notes(result(coarse, coarse)) == []


def test_a_residual_of_a_rig_is_no_force_before_the_noise_of_its_input_is_stated() -> None:
    driven, free = segment(u=1.0, z=1.0), segment(u=0.0, z=1.0)
    assert "no noise is stated for the input u" in unstated_input_noise_notes(result(driven, driven))[0]
    assert unstated_input_noise_notes(result(driven, driven, noise={"u": 0.1})) == []
    assert unstated_input_noise_notes(result(driven, driven, verdict="none")) == []
    assert unstated_input_noise_notes(result(free, free)) == []


def test_a_motion_beyond_that_of_the_estimation_runs_is_noted() -> None:
    near, far = segment(u=1.0, z=5e-3), segment(u=1.0, z=12e-3)
    (note,) = unreached_motion_notes(result(near, far))
    assert "z moves by 12 mm on the validation runs, by 5 mm at most on the estimation runs" in note
    assert unreached_motion_notes(result(far, near)) == []
    assert unreached_motion_notes(result(near, segment(u=1.0, z=6e-3))) == []
    assert unreached_motion_notes(result(near, far, verdict="effect")) == []


def bench_of_friction(folder: Path, slip_speed: float) -> LoopResult:
    """Loop on a bench whose component resists with 300 N tanh(v/v_0), at an rms speed of 0.13 m/s."""
    rng, t = np.random.default_rng(4), np.arange(1600) * 2.5e-3
    for name, f in (("a", (0.7, 1.9, 3.1)), ("b", (0.9, 1.6, 3.4))):
        phase = np.multiply.outer(t, 2.0 * np.pi * np.array(f)) + rng.uniform(0.0, 6.0, 3)
        z, v = 6e-3 * np.sin(phase).sum(axis=1), 6e-3 * (np.cos(phase) @ (2.0 * np.pi * np.array(f)))
        force = 2000.0 * z + 300.0 * np.tanh(v / slip_speed) + rng.normal(0.0, 3.0, len(t))
        rows = [f"{a:.4f},{b:.8f},{c:.3f}" for a, b, c in zip(t, z, force, strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(["t [s],z [m],F [N]", *rows]) + "\n")
    (folder / "vehicle.yaml").write_text("name: x\nvehicle: {rig: {input: motion, stiffness: 1500, damping: 900}}\n")
    (folder / "campaign.yaml").write_text(
        "vehicle: vehicle.yaml\nruns: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"
    )
    return close_loop(read_dataset(load_campaign(folder)), without=("hysteresis", "maxwell_damper"), jobs=1)


@pytest.mark.parametrize(("slip_speed", "is_noted"), [(0.06, True), (0.01, False)])
def test_friction_that_slips_near_the_speed_of_the_motion_may_be_a_damper_with_a_valve(
    tmp_path: Path, slip_speed: float, is_noted: bool
) -> None:
    found = bench_of_friction(tmp_path, slip_speed)
    (effect,) = found.after.model.effects
    assert effect.kind == "dry_friction" and effect.parameters["slip_speed"] == pytest.approx(slip_speed, rel=0.05)
    notes = gradual_slip_notes(found)
    assert len(notes) == is_noted and all("blow-off valve" in n and "in the rig: the slip speed of" in n for n in notes)
    report = loop_report(found)
    assert report["cautions"] == notes and set(notes) <= set(report["notes"])
    assert [line for line in summary_lines(report) if "blow-off valve" in line] == [f"{n}." for n in notes]


@pytest.mark.parametrize(
    ("form", "delays", "count"),
    [("bench", {"F": 4e-3}, 1), ("bench", {"F": -4e-3}, 0), ("bench", {}, 0), ("rig", {"F": 4e-3}, 0)],
)
def test_a_late_force_of_a_component_may_be_that_of_its_mounting(
    form: str, delays: dict[str, float], count: int
) -> None:
    found = result(segment(z=1.0, F=1.0), **delays)
    found.nominal = SimpleNamespace(design=SimpleNamespace(form=form))  # type: ignore[misc]
    notes = late_force_notes(found)
    assert len(notes) == count and all("4 ms late" in note and "mounting" in note for note in notes)
