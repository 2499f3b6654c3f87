"""Motions that slip against a linear model: pendulum, Duffing oscillator, decay with friction and drag."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railui.campaign.campaign import load_campaign
from railui.campaign.comparison import cut_samples
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import create_context
from railui.identification.estimation import growing_windows
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.failed_fit import has_failed, retry_failed_fit
from railui.identification.estimation.growing_windows import leave_wrong_minimum, misfit_ratio, slips
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.estimation.modulating_functions import dominant_period, modulating_starts
from railui.identification.estimation.noise_floor import estimate_noise_floor
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import adapt_to_model
from railui.identification.estimation.validation import validate
from railui.identification.loop import LoopResult, close_loop
from railui.identification.prediction import Predictor
from railui.report.loop.data import loop_report
from railui.vehicle.effects import PlacedEffect
from tests.truth.effects import Effect, effect
from tests.truth.files import campaign_text, write_run
from tests.truth.laws import Array
from tests.truth.rig import Rig, respond

SLOW = ("bump_stop", "maxwell_damper", "free_play", "hysteresis")  # excluded to keep the tests fast
UNITS = {"t": "s", "u": "N", "z": "m"}
DT = 0.01


def campaign(folder: Path, declared: Rig, runs: Mapping[str, Mapping[str, Array]], noise: float) -> Dataset:
    """Write the runs with noise of so much on z, run_a for estimation and run_b for validation, and read them."""
    (folder / "rig.yaml").write_text(declared.text())
    (folder / "campaign.yaml").write_text(campaign_text("free motion", "rig.yaml", {"z": f"{noise:.3g}"}))
    for i, (name, columns) in enumerate(runs.items()):
        z = columns["z"] + np.random.default_rng(i).normal(0.0, noise, len(columns["z"]))
        write_run(folder / f"run_{name}.csv.gz", {**columns, "z": z}, UNITS, time="%.7g")
    return read_dataset(load_campaign(folder))


def decay(rig: Rig, effects: list[Effect], amplitude: float, seconds: float) -> dict[str, Array]:
    t = np.arange(round(seconds / DT)) * DT
    return {"t": t, "z": respond(rig, t, None, effects, (amplitude, 0.0), lively=amplitude)["z"]}


def pendulum(amplitude: float, seconds: float, w: float = 8.0, c: float = 0.06) -> dict[str, Array]:
    """Full swing of a pendulum: z'' + c z' + w^2 sin z = 0."""
    t = np.arange(round(seconds / DT)) * DT
    found = solve_ivp(
        lambda _, x: [x[1], -c * x[1] - w * w * np.sin(x[0])],
        (0.0, t[-1]),
        [amplitude, 0.0],
        t_eval=t,
        rtol=1e-9,
        atol=1e-11,
    )
    return {"t": t, "z": found.y[0]}


def kinds(result: LoopResult) -> list[str]:
    return [e["kind"] for e in loop_report(result)["effects"]]


def value(result: LoopResult, kind: str, parameter: str) -> float:
    effects = loop_report(result)["effects"]
    return float(next(e for e in effects if e["kind"] == kind)["parameters"][parameter]["value"])


SWING = Rig(m=1.0, k=64.0, c=0.06)


@pytest.mark.parametrize("wrong", [0.6, 1.5])
def test_a_full_swing_of_a_pendulum_has_a_cubic_spring(tmp_path: Path, wrong: float):
    runs = {"a": pendulum(0.8, 25.0), "b": pendulum(0.5, 15.0)}
    data = campaign(tmp_path, Rig(m=1.0, k=wrong * 64.0, c=0.1), runs, 1e-4)
    result = close_loop(data, without=SLOW, jobs=1)
    assert "cubic_stiffness" in kinds(result)
    assert value(result, "cubic_stiffness", "stiffness") == pytest.approx(-64.0 / 6.0, rel=0.1)
    assert result.validations["after"].nrmse < 0.1 * result.validations["before"].nrmse


def test_a_duffing_oscillator_swept_through_resonance_is_found(tmp_path: Path):
    true, law = Rig(m=1.0, k=100.0, c=0.4), effect("cubic_stiffness", "rig", stiffness=4000.0)
    runs = {}
    for name, seconds, force in (("a", 40.0, 1.0), ("b", 30.0, 0.7)):
        t = np.arange(round(seconds / DT)) * DT
        u = force * np.sin(2.0 * np.pi * (0.5 * t + 0.5 * (3.0 - 0.5) / seconds * t * t))
        runs[name] = {"t": t, "u": u, "z": respond(true, t, u, [law], lively=0.1)["z"]}
    data = campaign(tmp_path, Rig(m=1.0, k=140.0, c=0.6), runs, 1e-4)
    result = close_loop(data, without=SLOW, jobs=1)
    assert kinds(result) == ["cubic_stiffness"]
    assert value(result, "cubic_stiffness", "stiffness") == pytest.approx(4000.0, rel=0.02)
    assert result.validations["after"].nrmse < 1.2 * result.noise_floor.nrmse


@pytest.mark.parametrize("first", [8, 12, 28, 44])
def test_the_start_of_a_strongly_nonlinear_decay_follows_from_its_acceleration(tmp_path: Path, first: int):
    """A spring five times as stiff as at rest: no harmonic motion relates acceleration and displacement."""
    true, law = Rig(m=4.0, k=1600.0, c=1.2), effect("cubic_stiffness", "rig", stiffness=2e6)
    t = np.arange(1800) * 0.005
    motion = respond(true, t, None, [law], (-0.0588, 0.0), lively=0.0588)
    columns = {"t": t[: len(t) - first], "az": motion["az"][first:] + 0.12}
    for name in "ab":
        write_run(tmp_path / f"run_{name}.csv.gz", columns, {"t": "s", "az": "m/s^2"}, time="%.7g")
    (tmp_path / "rig.yaml").write_text(true.text())
    (tmp_path / "campaign.yaml").write_text(campaign_text("decay", "rig.yaml", {"az": "0.03"}))
    context = create_context(read_dataset(load_campaign(tmp_path)), jobs=1)
    model = context.nominal.with_effect(PlacedEffect("cubic_stiffness", "rig", None, {"stiffness": 2e6}))
    start = estimate_initial_state(context, model, context.dataset.estimation[0])
    assert start[0] == pytest.approx(motion["z"][first], abs=1e-3)
    assert start[1] == pytest.approx(motion["vz"][first], abs=0.02)


def test_a_stiffening_decay_with_few_samples_per_period_keeps_its_phase(tmp_path: Path):
    t = np.arange(2800) * 0.005
    z = solve_ivp(
        lambda _, x: [x[1], -(1600.0 * x[0] + 1.2 * x[1] + 2e6 * x[0] ** 3) / 4.0],
        (0.0, t[-1]),
        [0.07, 0.0],
        t_eval=t,
        rtol=1e-9,
        atol=1e-11,
    ).y[0]
    data = campaign(tmp_path, Rig(m=4.0, k=1600.0, c=1.2), {n: {"t": t, "z": z} for n in "ab"}, 2e-5)
    context = create_context(data, jobs=1)
    model = context.nominal.with_effect(PlacedEffect("cubic_stiffness", "rig", None, {"stiffness": 2e6}))
    segment, start = data.validation[0], np.array([0.07, 0.0])
    errors = [
        float((Predictor(model, s, initial_state=start).simulate().series[0, 0] - z).std() / z.std())
        for s in (replace(segment, least_steps=1), segment)
    ]
    assert errors[1] < 0.1 * errors[0] and errors[1] < 0.01


FRICTION = effect("dry_friction", "rig", force=0.15, slip_speed=0.02)
DRAG = effect("quadratic_damper", "rig", damping=0.05)


def decays_with_friction_and_drag(folder: Path, amplitude: float, seconds: float) -> Dataset:
    """Decays of which run_b starts from a larger amplitude than run_a."""
    runs = {"a": decay(SWING, [FRICTION, DRAG], amplitude, seconds), "b": decay(SWING, [FRICTION, DRAG], 1.5, 15.0)}
    return campaign(folder, Rig(m=1.0, k=0.7 * 64.0, c=0.1), runs, 1e-4)


@pytest.mark.parametrize(("amplitude", "seconds"), [(0.5, 10.0), (0.3, 8.0)])
def test_friction_and_drag_of_a_decay_are_found_as_a_pair(tmp_path: Path, amplitude: float, seconds: float):
    result = close_loop(decays_with_friction_and_drag(tmp_path, amplitude, seconds), without=SLOW, jobs=1)
    report = loop_report(result)
    assert sorted(kinds(result)) == ["dry_friction", "quadratic_damper"]
    assert report["pairs"]["scored"] >= 30 and report["pairs"]["refitted"] >= 5
    assert any("pairs scored" in note for note in report["notes"])
    assert value(result, "dry_friction", "force") == pytest.approx(0.15, rel=0.1)
    assert value(result, "quadratic_damper", "damping") == pytest.approx(0.05, rel=0.1)
    assert result.validations["after"].nrmse < 0.2 * result.validations["before"].nrmse


def test_friction_alone_and_drag_alone_do_not_cure_a_decay(tmp_path: Path):
    context = create_context(decays_with_friction_and_drag(tmp_path, 0.3, 8.0), jobs=1)
    fit = calibrate(context)
    before = validate(context, fit.model, context.dataset.selection).nrmse

    def error_with(*effects: Effect) -> float:
        model = fit.model
        for e in effects:
            model = model.with_effect(PlacedEffect(e.kind, "rig", None, dict(e.parameters)))
        paths = [*context.campaign.estimated_parameters, *model.effect_paths()]
        fitted = fit_output_error(context, model, paths, segments=adapt_to_model(context, model, fit.segments))
        return validate(context, fitted.model, context.dataset.selection).nrmse

    assert error_with(FRICTION) > 1.2 * before and error_with(DRAG) > 0.9 * before
    assert error_with(FRICTION, DRAG) < 0.3 * before


def test_modulating_functions_estimate_a_rig_without_initial_states(tmp_path: Path):
    data = campaign(tmp_path, Rig(m=1.0, k=40.0, c=0.5), {n: decay(SWING, [], 1.0, 20.0) for n in "ab"}, 1e-3)
    starts = modulating_starts(create_context(data).nominal, data.estimation, data.campaign.estimated_parameters)
    for stiffness, damping, *_ in starts:
        assert stiffness == pytest.approx(64.0, rel=0.01) and 0.0 < damping < 0.15
    assert dominant_period(data.estimation[0]) == pytest.approx(2.0 * np.pi / 8.0, rel=0.05)


def count_simulations(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the list in which the simulations of every fit on windows and whole runs are entered."""
    counts: list[int] = []

    def counted(*given, **options):
        fit = fit_output_error(*given, **options)
        counts.append(fit.simulations)
        return fit

    monkeypatch.setattr(growing_windows, "fit_output_error", counted)
    return counts


def test_windows_of_growing_length_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    data = campaign(tmp_path, Rig(m=1.0, k=60.0, c=0.06), {n: decay(SWING, [], 1.0, 20.0) for n in "ab"}, 1e-3)
    context = create_context(data, jobs=1)
    counts = count_simulations(monkeypatch)
    paths = context.campaign.estimated_parameters
    _, spent = growing_windows.lengthen_windows(context, context.nominal, paths, data.estimation, 10.0)
    assert len(counts) > 1 and spent == sum(counts)


@pytest.mark.parametrize(("is_same", "expected"), [(True, 40), (False, 70)])
def test_one_fit_before_and_after_is_counted_once(is_same: bool, expected: int):
    """The last step of the estimates makes another fit of the same normal equations."""
    equations = SimpleNamespace()
    before = SimpleNamespace(simulations=40 if is_same else 30, normal=equations)
    after = SimpleNamespace(simulations=40, normal=equations if is_same else SimpleNamespace())
    assert LoopResult.simulations.fget(SimpleNamespace(before=before, after=after)) == expected


def test_short_windows_find_the_frequency_that_whole_runs_miss(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    data = campaign(tmp_path, Rig(m=1.0, k=32.0, c=0.06), {n: decay(SWING, [], 1.0, 40.0) for n in "ab"}, 1e-3)
    context = create_context(data, jobs=1)
    stuck = calibrate(context)
    counts = count_simulations(monkeypatch)
    fit, windowed = leave_wrong_minimum(context, stuck)
    assert fit.simulations == stuck.simulations + sum(counts)
    assert fit.model.value("vehicle.rig.stiffness") == pytest.approx(64.0, rel=1e-3)
    assert windowed is None and not slips(context, fit) and misfit_ratio(context.settings.windows, fit) < 0.01


def test_a_fit_worse_than_the_nominal_model_is_tried_again_and_reported(tmp_path: Path):
    data = campaign(tmp_path, SWING, {n: decay(SWING, [], 1.0, 20.0) for n in "ab"}, 1e-3)
    context = create_context(data, jobs=1)
    paths = context.campaign.estimated_parameters
    declared = validate(context, context.nominal, data.selection)
    wrong = context.nominal.with_path_values(paths, np.array([70.0, 0.06, 1.0, 0.0])[: len(paths)])
    bad = fit_output_error(context, wrong, paths, max_iterations=0)
    before = validate(context, bad.model, data.selection)
    assert has_failed(context, bad, declared, before) and not has_failed(context, bad, before, declared)
    again, _, validation = retry_failed_fit(context, bad, declared, before)
    assert validation.nrmse < 1.1 * declared.nrmse and not has_failed(context, again, declared, validation)


def test_a_fit_that_follows_its_motion_is_left_as_it_is(tmp_path: Path):
    data = campaign(tmp_path, SWING, {n: decay(SWING, [], 1.0, 20.0) for n in "ab"}, 1e-3)
    context = create_context(data, jobs=1)
    fit = calibrate(context)
    declared, before = (validate(context, m, data.selection) for m in (context.nominal, fit.model))
    assert retry_failed_fit(context, fit, declared, before) == (fit, None, before)


@pytest.mark.parametrize("column", ["vz", "az"])
def test_a_decay_of_a_hardening_spring_starts_where_its_speed_or_acceleration_says(tmp_path: Path, column: str):
    rig, start = Rig(m=2.0, k=1800.0, c=1.5), (0.02, 0.1)
    t = np.arange(800) * 0.005
    series = respond(rig, t, None, [effect("cubic_stiffness", "rig", stiffness=8e6)], start, steps=8)
    units = {"t": "s", "vz": "m/s", "az": "m/s^2"}
    (tmp_path / "rig.yaml").write_text(rig.text() + "effects: [{kind: cubic_stiffness, at: rig, stiffness: 8e6}]\n")
    (tmp_path / "campaign.yaml").write_text(campaign_text("decay", "rig.yaml", {}))
    for name in "ab":
        write_run(tmp_path / f"run_{name}.csv.gz", {"t": t, column: series[column]}, units, time="%.7g")
    context = create_context(read_dataset(load_campaign(tmp_path)), jobs=1)
    state = estimate_initial_state(context, context.nominal, context.dataset.estimation[0])
    assert state[:2] == pytest.approx(start, rel=1e-3)


def test_errors_of_a_slow_rig_are_summed_over_the_blocks_of_its_fit(tmp_path: Path) -> None:
    """A record of 200 s has 50 blocks of 4 s, one of 60 s has blocks of 2 s: neighbouring errors are correlated."""
    slow = Rig(m=1.0, k=1.0, c=0.02)
    for seconds, blocks in ((200.0, 50), (60.0, 30)):
        folder = tmp_path / f"{seconds:g}"
        folder.mkdir()
        runs = {"a": decay(slow, [], 1.0, seconds), "b": decay(slow, [], 0.7, seconds)}
        context = create_context(campaign(folder, slow, runs, 1e-3))
        found = validate(context, context.nominal, context.dataset.validation).block_errors
        assert blocks - 2 <= len(found) <= blocks  # the comparison leaves the ends of a record out


def test_the_noise_floor_of_a_test_is_that_after_its_start(tmp_path: Path) -> None:
    """In a decay the noise is a larger share of the motion after the start, where the error of the test counts."""
    rig, noise = Rig(m=1.0, k=64.0, c=0.3), 1e-3
    runs = {"a": decay(rig, [], 1.0, 40.0), "b": decay(rig, [], 0.7, 40.0)}
    context = create_context(campaign(tmp_path, rig, runs, noise))
    (segment,) = context.dataset.validation
    start = context.settings.initial_state.initial_state_duration
    z = segment.columns["z"]
    whole, after = (
        estimate_noise_floor(context, context.nominal, [segment], 20, is_after_start=x).nrmse for x in (False, True)
    )
    cut = cut_samples(context.dataset.campaign, segment)  # at the start, while the motion is largest
    power = np.mean(z[cut:] ** 2) / np.mean(z[round(start / DT) :] ** 2)
    assert power > 2.0 and after / whole == pytest.approx(np.sqrt(power), rel=0.05)
