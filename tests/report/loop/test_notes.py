"""Notes of the loop report: unstated noise, residuals without structure."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.noise.model import ColumnNoise, NoiseModel
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.campaign.segment import Segment
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.loop import calibrate_only
from railui.identification.result import LoopResult
from railui.report.loop.noise import noise_notes
from railui.report.loop.notes import (
    absent_cross_level_notes,
    no_agreement_notes,
    overstated_noise_notes,
    unstated_track_noise_notes,
    unstructured_residual_notes,
)
from railui.vehicle.design_reader import load_design
from tests.truth.campaign import Order, campaign, write
from tests.truth.effects import effect

ROOT = Path(__file__).parents[3]


def result(error_to_noise: float, p: float, **more: Any) -> LoopResult:
    """Return a loop result whose best candidate explains 0.05 of the residual, with a family-wise p."""
    best = SimpleNamespace(admissible_rho=np.sqrt(0.05), is_extrapolated=False)
    fields = {
        "context": SimpleNamespace(settings=LoopSettings()),
        "error_to_noise": error_to_noise,
        "score_test": SimpleNamespace(results=(best,), best=(best,), p=p, is_significant=lambda score: p <= 0.01),
        "discrepancy": None,
        "validations": {"after": SimpleNamespace(channels={"e1": 0.05, "ayf": 0.13})},
        "noise_floor": SimpleNamespace(channels={"e1": 0.05, "ayf": 0.10}, source="both"),
        "is_by_condition": False,
        "after": SimpleNamespace(error_to_noise=1.19),
    }
    return cast(LoopResult, SimpleNamespace(**(fields | more)))


def test_a_residual_without_structure_is_attributed_to_forces_or_noise_with_its_channels() -> None:
    (note,) = unstructured_residual_notes(result(1.2, p=0.5))
    assert note.startswith("the error is 1.20 times the noise floor")
    assert "unmeasured force" in note and "ayf 1.30, e1 1.00" in note


@pytest.mark.parametrize("other", [{"error_to_noise": 1.05}, {"p": 0.001}, {"discrepancy": "a curve"}])
def test_a_residual_at_the_floor_with_structure_or_localised_has_no_such_note(other: dict[str, Any]) -> None:
    assert unstructured_residual_notes(result(**({"error_to_noise": 1.2, "p": 0.5} | other))) == []


@pytest.mark.parametrize(
    ("ratio", "sensors_only", "kind", "named"),
    [
        (0.57, 0.02, "bogie", "the track columns"),
        (0.57, 0.02, "rig", "the input"),
        (0.57, 0.16, "bogie", "the channels"),
        (0.97, 0.02, "bogie", None),
        (float("nan"), 0.02, "bogie", None),
    ],
)
def test_an_error_below_the_noise_floor_shows_that_noise_is_overstated(
    ratio: float, sensors_only: float, kind: str, named: str | None
) -> None:
    floor = SimpleNamespace(nrmse=0.163, sensors_only=sensors_only, source="both")
    nominal = SimpleNamespace(design=SimpleNamespace(kind=kind))
    notes = overstated_noise_notes(result(ratio, p=0.5, noise_floor=floor, nominal=nominal))
    assert [f"the noise of {named} is smaller" in note for note in notes] == ([] if named is None else [True])


def test_a_model_that_agrees_with_nothing_is_said_to_mean_nothing() -> None:
    def notes(nrmse: float) -> list[str]:
        return no_agreement_notes(result(2.0, 0.5, validations={"after": SimpleNamespace(nrmse=nrmse)}))

    (note,) = notes(7.1)
    assert "check signs, units" in note
    assert notes(0.9) == []


def test_a_residual_of_the_validation_runs_alone_is_attributed_to_a_changing_vehicle() -> None:
    (note,) = unstructured_residual_notes(result(1.28, p=0.5, after=SimpleNamespace(error_to_noise=1.04)))
    assert "on the estimation runs the ratio is 1.04" in note and "from run to run" in note and "white" not in note


@pytest.mark.parametrize(
    ("stated", "named"),
    [({"ay1": 0.05}, "yw, gauge"), ({"yw": 2e-5}, "gauge"), ({"yw": 2e-5, "gauge": 0.0}, None)],
)
def test_unstated_noise_of_the_track_columns_is_a_warning(stated: dict[str, float], named: str | None) -> None:
    columns = {"t": np.arange(3.0), "yw": np.ones(3), "phiw": np.zeros(3), "gauge": np.ones(3), "ay1": np.ones(3)}
    segment = SimpleNamespace(columns=columns)
    dataset = SimpleNamespace(campaign=SimpleNamespace(noise=stated), segments=(segment,), noise={})
    notes = unstated_track_noise_notes(cast(Dataset, dataset))
    start = [f"no noise stated for {named}, and the channels do not determine it"] if named else []
    assert [note.split(":")[0] for note in notes] == start


@pytest.mark.parametrize(
    ("recorded", "named"),
    [(("yw",), "run_1.csv"), (("yw", "phiw"), None), ((), None)],
)
def test_a_run_without_cross_level_is_a_warning(recorded: tuple[str, ...], named: str | None) -> None:
    """A free decay has none either, but no irregularity at all."""
    with_both = segment("run_0.csv", "yw", "phiw")
    notes = absent_cross_level_notes(dataset_on("check_bogie", with_both, segment("run_1.csv", *recorded)))
    assert [note.split(":")[0] for note in notes] == ([f"no cross-level (phiw) in {named}"] if named else [])


def test_runs_that_all_lack_cross_level_have_one_warning() -> None:
    segments = (segment("run_0.csv", "yw"), segment("run_1.csv", "yw"))
    (note,) = absent_cross_level_notes(dataset_on("check_bogie", *segments))
    assert note.startswith("no cross-level (phiw) in the runs: taken as zero.")


@pytest.mark.parametrize(("design", "warnings"), [("cooperrider", 1), ("roller_rig", 0)])
def test_rollers_need_no_cross_level(design: str, warnings: int) -> None:
    assert len(absent_cross_level_notes(dataset_on(design, segment("run_0.csv", "yw")))) == warnings


def dataset_on(design: str, *segments: Segment) -> Dataset:
    """Return segments of runs with a bundled design."""
    campaign = SimpleNamespace(design=load_design(ROOT / "designs" / f"{design}.yaml"))
    return cast(Dataset, SimpleNamespace(campaign=campaign, segments=segments))


def segment(file: str, *recorded: str) -> Segment:
    """Return a segment of which only these track columns are not zero."""
    columns = {name: np.full(3, float(name in (*recorded, "ay1"))) for name in ("t", "yw", "phiw", "gauge", "ay1")}
    return Segment(file, "adjust", 0, columns, 0.01)


def test_a_fading_damper_leaves_its_error_on_the_run_at_another_speed(tmp_path: Path) -> None:
    """At 40 m/s the calibrated damping has the temperature of the run; at 31 m/s the damper is cooler."""
    fading = effect("fading_damper", "secondary_lateral", damping=1.2e5, energy=60.0)
    write(campaign(Order(effects=(fading,), seed=6018, speeds=(40.0, 31.0))), tmp_path)
    calibrated = calibrate_only(read_dataset(load_campaign(tmp_path)))
    assert calibrated.before.error_to_noise < 1.07 and calibrated.error_to_noise > 1.15


def test_noise_that_the_data_contradict_is_a_note_with_its_ratio() -> None:
    stated = ColumnNoise(0.05, NoiseSpectrum(0.05), 0.05, source="both")
    larger = ColumnNoise(0.155, NoiseSpectrum(0.05, ((1.2, 0.15),)), 0.05, 0.155, source="both")
    unsure = ColumnNoise(0.2, NoiseSpectrum(0.2), 0.05, source="stated")
    notes = noise_notes(NoiseModel({"e1": stated, "ay1": larger, "rf": unsure}))
    assert notes == [
        "the noise of ay1 is 3.1 times the stated one",
        "noise that is not white, with its share of the variance: ay1 (90 %)",
    ]


def test_noise_that_the_channels_determine_needs_no_statement() -> None:
    segment = SimpleNamespace(columns={"yw": np.ones(3), "e1": np.ones(3)})
    dataset = SimpleNamespace(campaign=SimpleNamespace(noise={}), segments=(segment,), noise={"yw": 2e-5})
    assert unstated_track_noise_notes(cast(Dataset, dataset)) == []
