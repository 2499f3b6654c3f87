"""Components on a bench: the bundled measured damper, and simulated campaigns with a known law and condition."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.unbiased import track_noise_scores
from railui.identification.estimation.validation import validate
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.identification.unmodelled.condition_dependence import homogeneity
from railui.io.problems import FileProblems
from railui.report.loop.data import loop_report
from railui.report.loop.element_file import NoElementError, element_text
from railui.report.loop.files import write_loop
from railui.vehicle.design_reader import parse_design
from railui.vehicle.effects import kernel_catalogue
from railui.vehicle.element import load_element

BUNDLED = Path(__file__).parents[2] / "designs" / "campaigns" / "mr_damper"
VEHICLE = "vehicle: {rig: {input: motion, stiffness: 1 kN/m, damping: 1 kN*s/m}}\n"
MOTIONS = ((20.0, 0.5), (6.0, 2.0), (10.0, 1.0), (12.0, 0.8))  # mm, Hz


def sine(seed: int, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Displacement and speed of a run at times t."""
    amplitude, f = MOTIONS[seed % len(MOTIONS)]
    w = 2.0 * np.pi * f
    return amplitude * 1e-3 * np.sin(w * t), amplitude * 1e-3 * w * np.cos(w * t)


def sines(folder: Path, name: str, friction: float, seed: int, samples: int) -> None:
    """Write a run: four sines of growing speed; F = 2000 z + 1500 z' + 25 + friction tanh(z'/0.01) + noise of 1 N."""
    t = np.arange(samples) * 0.005
    z, v = sine(seed, t)
    write_run(folder, name, seed, t, 2000.0 * z + 1500.0 * v + 25.0 + friction * np.tanh(v / 0.01))


def write_run(folder: Path, name: str, seed: int, t: FloatArray, force: FloatArray) -> None:
    """Write a run with a noise of 1 N."""
    z, v = sine(seed, t)
    force = force + np.random.default_rng(seed).standard_normal(len(t))
    rows = "\n".join(f"{a:.4f},{1e3 * b:.6f},{1e3 * c:.5f},{d:.4f}" for a, b, c, d in zip(t, z, v, force, strict=True))
    (folder / name).write_text(f"t [s],z [mm],vz [mm/s],F [N]\n{rows}\n")


def campaign(folder: Path, frictions: dict[str, float], samples: int = 1600) -> Path:
    """Write a campaign with two estimation runs and one validation run under every condition."""
    folder.mkdir(exist_ok=True)
    (folder / "vehicle.yaml").write_text(VEHICLE)
    lines = ["name: bench", "vehicle: vehicle.yaml", "runs:"]
    for label, friction in frictions.items():
        for k, role in enumerate(("adjust", "adjust", "validate")):
            name = f"run_{label.replace(' ', '')}_{k}.csv"
            sines(folder, name, friction, k, samples)
            conditions = f", conditions: {{current: {label}}}" if len(frictions) > 1 else ""
            lines.append(f"  - {{file: {name}, role: {role}{conditions}}}")
    (folder / "campaign.yaml").write_text("\n".join(lines) + "\n")
    return folder


def component(folder: Path, law: Callable[[FloatArray, FloatArray], FloatArray], delay: float = 0.0) -> Dataset:
    """Write and read a campaign of a component with a law F(z, z'), of which the force may be recorded late."""
    campaign(folder, {"": 0.0})
    t = np.arange(1600) * 0.005
    for k in range(3):
        write_run(folder, f"run__{k}.csv", k, t, law(*sine(k, t - delay)))
    return read_dataset(load_campaign(folder))


def test_a_negative_stiffness_is_no_effect(tmp_path: Path) -> None:
    loop = close_loop(component(tmp_path / "snap", lambda z, v: -9000.0 * z + 40.0 * v + 5.0))
    assert loop.verdict == "none"
    assert loop.before.model.value("vehicle.rig.stiffness") == pytest.approx(-9000.0, rel=1e-3)


def test_only_a_component_whose_motion_is_prescribed_has_a_negative_stiffness() -> None:
    snap = "vehicle: {rig: {input: motion, stiffness: -9 kN/m, damping: 40 N*s/m}}"
    assert parse_design(snap).values["vehicle.rig.stiffness"] == -9000.0
    with pytest.raises(FileProblems, match="too small for the stiffness of the linear spring"):
        parse_design("vehicle: {rig: {mass: 90 kg, stiffness: -9 kN/m}}")


def test_a_snap_through_spring_is_named_by_its_cubic_term(tmp_path: Path) -> None:
    loop = close_loop(component(tmp_path / "snap", lambda z, v: -9000.0 * z + 1.2e8 * z**3 + 40.0 * v))
    assert loop.verdict == "effect" and [e.kind for e in loop.after.model.effects] == ["cubic_stiffness"]
    assert loop.after.model.value("effects.0.stiffness") == pytest.approx(1.2e8, rel=0.01)


@pytest.mark.parametrize(("stiffness", "damping", "delay"), [(2e3, 800.0, 0.003), (2e4, 60.0, 0.02)])
def test_a_force_that_is_recorded_late_is_a_delay_of_its_sensor(
    tmp_path: Path, stiffness: float, damping: float, delay: float
) -> None:
    """Not a damper in series with a spring, which a delay resembles; with little damping, which ends on its bound."""
    loop = close_loop(component(tmp_path / "late", lambda z, v: stiffness * z + damping * v, delay=delay))
    assert loop.verdict == "effect" and [(e.kind, e.at) for e in loop.after.model.effects] == [("sensor_delay", "F")]
    values = dict(zip(loop.after.free.paths, zip(loop.after.x, loop.after.sd, strict=True), strict=True))
    found, sd = values["sensors.0.delay"]
    assert found == pytest.approx(delay, rel=0.02, abs=3.0 * sd)


BRANCHES = ((1.2e5, 0.12), (1.5e5, 0.012))  # stiffness [N/m] and relaxation time [s] of rubber


def rubber(folder: Path) -> Dataset:
    """Write and read a campaign of rubber: two relaxation times and a spring of 400 kN/m, sines of 0.3 to 12 Hz."""
    campaign(folder, {"": 0.0})
    rng, fine = np.random.default_rng(8), np.arange(16_000) * 5e-4
    for k in range(3):
        w = 2.0 * np.pi * np.geomspace(0.3, 12.0, 14) * rng.uniform(0.97, 1.03, 14)
        angle = np.multiply.outer(fine, w) + rng.uniform(0.0, 6.0, 14)
        z, v = 2e-3 * (np.sin(angle) / w).sum(axis=1), 2e-3 * np.cos(angle).sum(axis=1)
        force = 4e5 * z
        for stiffness, tau in BRANCHES:
            kept = np.exp(-5e-4 / tau)
            mean_speed = np.convolve(v, [0.5, 0.5])[: len(v)]  # between samples
            mean_speed[0] = 0.0
            force = force + lfilter([stiffness * tau * (1.0 - kept)], [1.0, -kept], mean_speed)
        force = force[::10] + rng.normal(0.0, 0.2, 1600)
        rows = [f"{a:.4f},{1e3 * b:.8f},{c:.4f}" for a, b, c in zip(fine[::10], z[::10], force, strict=True)]
        (folder / f"run__{k}.csv").write_text("\n".join(["t [s],z [mm],F [N]", *rows]) + "\n")
    (folder / "vehicle.yaml").write_text("vehicle: {rig: {input: motion, stiffness: 450 kN/m, damping: 2 kN*s/m}}\n")
    return read_dataset(load_campaign(folder))


def test_rubber_with_two_relaxation_times_is_no_delay_of_the_force(tmp_path: Path) -> None:
    loop = close_loop(rubber(tmp_path / "rubber"))
    assert loop.verdict == "effect" and {e.kind for e in loop.after.model.effects} == {"maxwell_damper"}
    values = sorted(
        (e.parameters["stiffness"], e.parameters["damping"] / e.parameters["stiffness"])  # type: ignore[operator]
        for e in loop.after.model.effects
    )
    assert np.array(values) == pytest.approx(np.array(BRANCHES), rel=0.1)


@pytest.fixture(scope="module")
def friction(tmp_path_factory: pytest.TempPathFactory) -> LoopResult:
    folder = campaign(tmp_path_factory.mktemp("friction"), {"0 A": 120.0})
    return close_loop(read_dataset(load_campaign(folder)))


def test_a_loop_identifies_the_friction_of_a_component(friction: LoopResult) -> None:
    model = friction.after.model
    assert friction.verdict == "effect" and [e.kind for e in model.effects] == ["dry_friction"]
    assert model.value("effects.0.force") == pytest.approx(120.0, rel=0.01)
    assert model.value("vehicle.rig.damping") == pytest.approx(1500.0, rel=0.02)
    assert model.value("vehicle.rig.preload") == pytest.approx(25.0, abs=0.5)
    assert friction.validations["after"].nrmse < 0.02


@pytest.mark.parametrize("friction", [0.0, 120.0])
def test_noise_of_a_displacement_without_measured_speed_makes_no_law(tmp_path: Path, friction: float) -> None:
    """Differentiated, noise of 0.06 mm at 200 samples/s is a third of the speed."""
    folder = campaign(tmp_path, {"0 A": friction})
    for k in range(3):
        path = folder / f"run_0A_{k}.csv"
        table = np.loadtxt(path, delimiter=",", skiprows=1)[:, [0, 1, 3]]
        table[:, 1] += 0.06 * np.random.default_rng(10 + k).standard_normal(len(table))
        np.savetxt(path, table, delimiter=",", fmt="%.6g", header="t [s],z [mm],F [N]", comments="")
    result = close_loop(read_dataset(load_campaign(folder)), jobs=1)
    assert [e.kind for e in result.after.model.effects] == (["dry_friction"] if friction else [])
    assert result.verdict == ("effect" if friction else "none")
    assert result.after.model.value("vehicle.rig.damping") == pytest.approx(1500.0, rel=0.03)


def test_noise_of_the_prescribed_motion_biases_the_estimates(tmp_path: Path) -> None:
    """A least-squares slope over a motion recorded with noise is too low."""
    dataset = read_dataset(load_campaign(campaign(tmp_path, {"0 A": 0.0})))
    context = create_context(replace(dataset, noise={"z": 1e-3, "F": 1.0}), jobs=1)
    fit = calibrate(context)
    optimiser = GaussNewton.of_fit(context, fit)
    scores = dict(zip(fit.free.paths, track_noise_scores(context, fit, optimiser).mean, strict=True))
    assert scores["vehicle.rig.stiffness"] < 0.0


def test_the_exported_element_has_the_identified_law(friction: LoopResult, tmp_path: Path) -> None:
    file = tmp_path / "damper.yaml"
    file.write_text(element_text(friction))
    element = load_element(file, kernel_catalogue())
    assert [e.kind for e in element.effects] == ["spring", "viscous_damper", "measured_force", "dry_friction"]
    doubled = element.mount("secondary_lateral", None, 2.0)[-1]
    assert doubled.parameters["force"] == pytest.approx(2.0 * friction.after.model.value("effects.0.force"))
    assert doubled.parameters["slip_speed"] == friction.after.model.value("effects.0.slip_speed")


@pytest.mark.parametrize(("deviations", "is_written"), [(-1.0, True), (-5.0, False)])
def test_a_stiffness_below_zero_is_zero_within_its_uncertainty_and_else_no_element(
    friction: LoopResult, tmp_path: Path, deviations: float, is_written: bool
) -> None:
    path, fit = "vehicle.rig.stiffness", friction.after
    value = deviations * fit.sd[fit.free.paths.index(path)]
    after = replace(fit, model=fit.model.with_path_values([path], np.array([value])))
    result = replace(friction, after=after)
    if not is_written:
        with pytest.raises(NoElementError, match=f"{path} is -"):
            element_text(result)
        return
    file = tmp_path / "damper.yaml"
    file.write_text(element_text(result))
    assert "\nstiffness: 0 " in file.read_text()
    assert [e.kind for e in load_element(file, kernel_catalogue()).effects][-1] == "dry_friction"


def test_the_report_of_a_component_is_written_and_is_json(friction: LoopResult, tmp_path: Path) -> None:
    write_loop(friction, loop_report(friction), tmp_path / "out", [])
    data = json.loads((tmp_path / "out" / "loop.json").read_text())
    assert data["conditions"] is None and data["effects"][0]["kind"] == "dry_friction"
    assert re.search(r"force \d+\.?\d* \+/- \S+ N, slip speed \S+ \+/- \S+ mm/s", data["sentence"]), data["sentence"]
    assert (tmp_path / "out" / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize("samples", [1600, pytest.param(6600, id="6600, of which a part is held back")])
def test_a_friction_that_depends_on_the_current_is_reported_for_every_current(tmp_path: Path, samples: int) -> None:
    folder = campaign(tmp_path / "currents", {"0 A": 40.0, "1 A": 160.0}, samples)
    loop = close_loop(read_dataset(load_campaign(folder)))
    found = loop.conditions
    assert found is not None and found.name == "current" and found.conditions == ("0 A", "1 A")
    row = found.parameters[0]
    assert row.depends and found.model.value(row.path) > 0 and row.path.endswith(".force")
    assert row.values == pytest.approx((40.0, 160.0), rel=0.05)
    others = {r.path: r for r in found.parameters[1:]}
    assert not others["vehicle.rig.damping"].depends
    assert found.separate_nrmse < 0.05 < found.common_nrmse
    assert loop.verdict == "effect" and loop.is_by_condition and loop.discrepancy is None
    assert loop.explained is not None and loop.explained.value > 0.99
    assert loop.test is None if samples == 1600 else loop.test is not None
    if loop.test is not None:  # of the model of each current
        assert loop.test.nrmse_after < 0.05 < loop.test.nrmse_before and not loop.test.is_contradicted
    report = loop_report(loop)
    assert re.search(r"dry friction in the rig, force \S+ \+/- \S+ N at 0 A, \S+ \+/- \S+ N at 1 A", report["sentence"])
    assert report["conditions"]["decides"] and [e["kind"] for e in report["effects"]] == ["dry_friction"]


@pytest.mark.parametrize(("cold", "hot", "decides"), [(3000.0, 1200.0, True), (2000.0, 2000.0, False)])
def test_a_damping_that_depends_on_the_temperature_is_no_effect(
    tmp_path: Path, cold: float, hot: float, decides: bool
) -> None:
    folder = campaign(tmp_path / "temperatures", {"-20 degC": 0.0, "50 degC": 0.0})
    t = np.arange(1600) * 0.005
    for label, damping in (("-20degC", cold), ("50degC", hot)):
        for k in range(3):
            z, v = sine(k, t)
            write_run(folder, f"run_{label}_{k}.csv", k, t, 2000.0 * z + damping * v)
    loop = close_loop(read_dataset(load_campaign(folder)))
    assert loop.verdict == "none" and loop.discrepancy is None and loop.is_by_condition == decides
    assert not loop.after.model.effects and loop.error_to_noise < 1.5
    text = loop_report(loop)["sentence"]
    assert text.startswith("No unmodelled effect detected")
    assert ("current changes vehicle.rig.damping" in text) == decides and "outside" not in text


def test_a_condition_that_only_some_runs_state_is_an_error(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "currents", {"0 A": 40.0, "1 A": 160.0})
    text = (folder / "campaign.yaml").read_text()
    (folder / "campaign.yaml").write_text(text.replace(", conditions: {current: 1 A}", "", 1))
    with pytest.raises(FileProblems, match="has no condition 'current'"):
        load_campaign(folder)


def test_estimates_within_their_scatter_are_homogeneous() -> None:
    rng = np.random.default_rng(1)
    for n in (2, 3, 5):
        p = []
        for size in rng.uniform(0.5, 2.0, (4000, n)):
            samples = size * rng.standard_normal((8, n))
            p.append(homogeneity(samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(8), np.full(n, 7.0)))
        assert np.mean(np.array(p) < 0.1) == pytest.approx(0.1, abs=0.025)
        assert np.mean(np.array(p) < 0.01) == pytest.approx(0.01, abs=0.007)


def test_an_estimate_without_a_standard_deviation_differs_from_nothing() -> None:
    assert homogeneity(np.array([1.0, 2.0]), np.array([0.0, 0.1]), np.array([9.0, 9.0])) == 1.0


def test_a_condition_of_no_validation_run_leaves_the_loop_its_result(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "currents", {"0 A": 40.0, "1 A": 160.0})
    text = (folder / "campaign.yaml").read_text().splitlines()
    changed = [re.sub("current: [01] A", "current: 2 A", line) if "validate" in line else line for line in text]
    (folder / "campaign.yaml").write_text("\n".join(changed))
    result = close_loop(read_dataset(load_campaign(folder)), jobs=1)
    assert result.conditions is None and np.isfinite(result.validations["after"].nrmse)


def test_the_measured_damper_has_friction_and_hysteresis() -> None:
    dataset = read_dataset(load_campaign(BUNDLED))
    result = close_loop(dataset)
    kinds = {e.kind for e in result.after.model.effects}
    assert {"dry_friction", "hysteresis"} <= kinds
    assert result.validations["before"].nrmse > 0.25 and result.validations["after"].nrmse < 0.15
    assert validate(result.context, result.after.model, dataset.test).nrmse < 0.15
