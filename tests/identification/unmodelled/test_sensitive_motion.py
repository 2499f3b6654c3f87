"""Rigs whose motion is sensitive to its start: a strongly driven Duffing oscillator moves chaotically."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui import core
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification import conclusion
from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.equation_error import EquationError
from railui.identification.estimation.validation import validate
from railui.identification.loop import close_loop
from railui.identification.unmodelled import sensitive_motion
from railui.identification.unmodelled.sensitive_motion import difference_growth, find_sensitive_motion
from railui.report.loop.data import loop_report
from railui.vehicle.effects import PlacedEffect
from tests.truth.files import campaign_text, write_run
from tests.truth.laws import Array
from tests.truth.rig import Rig

DT, SAMPLES, STEPS = 0.06, 1200, 6  # RK4 steps per sample
NOISE = 3e-3  # in the standard deviation of the response
STIFFNESS, DAMPING, CUBIC = 100.0, 0.55, 2000.0
HIGHEST = 4.5  # Hz, of the drive
UNITS = {"t": "s", "u": "N", "z": "m", "az": "m/s^2"}


def duffing(folder: Path, force: float, channel: str = "z") -> Dataset:
    """Write two runs of a Duffing oscillator under random force of a standard deviation, with noise of 0.3 %."""
    for i, name in enumerate("ab"):
        rng = np.random.default_rng(i)
        spectrum = np.fft.rfft(rng.standard_normal(2 * STEPS * SAMPLES))
        spectrum[np.fft.rfftfreq(2 * STEPS * SAMPLES, DT / (2 * STEPS)) > HIGHEST] = 0.0
        drive = np.fft.irfft(spectrum)
        u = force * drive / drive.std()
        series = respond(u)[channel]
        noisy = series + NOISE * series.std() * rng.standard_normal(SAMPLES)
        columns = {"t": np.arange(SAMPLES) * DT, "u": u[:: 2 * STEPS], channel: noisy}
        write_run(folder / f"run_{name}.csv.gz", columns, UNITS, time="%.7g")
    (folder / "rig.yaml").write_text(Rig(m=1.0, k=90.0, c=0.4).text())
    (folder / "campaign.yaml").write_text(
        campaign_text("duffing", "rig.yaml", {channel: f"{NOISE * series.std():.3g}"})
    )
    return read_dataset(load_campaign(folder))


def respond(u: Array) -> dict[str, Array]:
    """z and az at every sample under a force that is given at the half steps."""

    def rate(z: float, v: float, force: float) -> tuple[float, float]:
        return v, force - DAMPING * v - STIFFNESS * z - CUBIC * z * z * z

    z, v, h, forces, out = 0.0, 0.0, DT / STEPS, [*u.tolist(), 0.0, 0.0], []
    for i in range(STEPS * SAMPLES):
        now, middle, end = forces[2 * i : 2 * i + 3]
        a_1 = rate(z, v, now)
        if i % STEPS == 0:
            out.append((z, a_1[1]))
        a_2 = rate(z + 0.5 * h * a_1[0], v + 0.5 * h * a_1[1], middle)
        a_3 = rate(z + 0.5 * h * a_2[0], v + 0.5 * h * a_2[1], middle)
        a_4 = rate(z + h * a_3[0], v + h * a_3[1], end)
        z += h / 6.0 * (a_1[0] + 2.0 * a_2[0] + 2.0 * a_3[0] + a_4[0])
        v += h / 6.0 * (a_1[1] + 2.0 * a_2[1] + 2.0 * a_3[1] + a_4[1])
    return dict(zip(("z", "az"), np.array(out).T, strict=True))


@pytest.mark.parametrize(("force", "is_sensitive"), [(7.0, True), (1.0, False)])
def test_a_strong_drive_makes_the_motion_sensitive_to_its_start(tmp_path: Path, force: float, is_sensitive: bool):
    context = create_context(duffing(tmp_path, force), jobs=1)
    model = context.nominal.with_path_values(
        ["vehicle.rig.stiffness", "vehicle.rig.damping"], [STIFFNESS, DAMPING]
    ).with_effect(PlacedEffect("cubic_stiffness", "rig", None, {"stiffness": CUBIC}))
    growth = difference_growth(model, context.dataset.estimation[0])
    assert growth > 1e4 if is_sensitive else growth < 3.0


@pytest.mark.parametrize("channel", ["z", "az"])
def test_the_equation_error_estimates_rig_and_law_by_one_linear_solution(tmp_path: Path, channel: str):
    context = create_context(duffing(tmp_path, 7.0, channel), jobs=1)
    equations = EquationError(
        context.nominal, context.dataset.estimation, ("vehicle.rig.stiffness", "vehicle.rig.damping")
    )
    cubic = equations.estimate(PlacedEffect("cubic_stiffness", "rig", None, {"stiffness": 1000.0}))
    other = equations.estimate(PlacedEffect("quadratic_damper", "rig", None, {"damping": 1.0}))
    assert cubic is not None and other is not None
    assert cubic.values[0] == pytest.approx(STIFFNESS, rel=0.1)
    assert 1000.0 * cubic.amount == pytest.approx(CUBIC, rel=0.1)
    assert cubic.share < 0.1 and other.share > 0.8


def test_a_motion_that_is_not_sensitive_is_not_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    context = create_context(duffing(tmp_path, 1.0), jobs=1)
    monkeypatch.setattr(sensitive_motion, "follows", lambda context, fit: False)
    fit = calibrate(context)
    assert find_sensitive_motion(context, fit, validate(context, fit.model, context.dataset.selection)) is None


def test_the_law_of_a_chaotic_rig_is_not_reported_as_outside_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The search by whole runs has no candidates here, as it finds none that lowers their error."""
    data, kinds = duffing(tmp_path, 7.0), {str(record["kind"]) for record in core.effect_catalogue()}

    def find(context, fit, validation):
        few = replace(context, excluded=frozenset(kinds - {"cubic_stiffness", "quadratic_damper", "bump_stop"}))
        return find_sensitive_motion(few, fit, validation)

    monkeypatch.setattr(conclusion, "find_sensitive_motion", find)
    result = close_loop(data, without=kinds, jobs=1)
    assert result.verdict == "outside" and result.validations["after"].nrmse > 0.7
    assert result.sensitive_motion is not None
    effect = result.sensitive_motion.effect
    assert effect.kind == "cubic_stiffness" and effect.parameters["stiffness"] == pytest.approx(CUBIC, rel=0.05)
    report = loop_report(result)
    assert "no effect of the catalogue" not in report["sentence"]
    assert "its equation of motion holds with cubic stiffness in the rig" in report["sentence"]
    assert report["cautions"][0].startswith("the motion is sensitive to its start: with cubic stiffness in the rig")
