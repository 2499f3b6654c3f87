"""What the notes of a report say of a rest that has no shape."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.estimation.validation import Validation
from railui.identification.loop import LoopResult, calibrate_only
from railui.identification.unmodelled.run_dependence import RunDependence, RunEstimate
from railui.report.loop.data import run_dependence_text, unstated_track_noise_notes, unstructured_residual_notes
from railui.vehicle.design_reader import PlacedEffect
from tests.truth.campaign import Order, campaign, write
from tests.truth.effects import effect


def found(unexplained: float, p: float, **more: Any) -> LoopResult:
    last = SimpleNamespace(sightings=(1,), p=p, rho2=0.05)
    after = SimpleNamespace(channels={"e1": 0.05, "ayf": 0.13})
    floor = SimpleNamespace(channels={"e1": 0.05, "ayf": 0.10})
    fit = SimpleNamespace(rest=1.19)
    found = SimpleNamespace(
        unexplained=unexplained, last=last, outside=None, judged={"after": after}, floor=floor, after=fit
    )
    return cast(LoopResult, SimpleNamespace(**(vars(found) | more)))


def test_a_rest_that_no_candidate_sees_is_put_down_to_forces_or_noise_and_its_channels_named():
    (note,) = unstructured_residual_notes(found(1.2, p=0.5))
    assert note.startswith("1.20 times the floor is left") and "ayf 1.30, e1 1.00" in note


@pytest.mark.parametrize("other", [{"unexplained": 1.05}, {"p": 0.001}, {"outside": "a curve"}])
def test_a_rest_at_the_floor_or_with_a_shape_or_told_as_outside_has_no_such_note(other: dict[str, Any]):
    assert unstructured_residual_notes(found(**({"unexplained": 1.2, "p": 0.5} | other))) == []


def test_a_rest_on_the_validating_runs_alone_is_put_down_to_a_vehicle_that_changes():
    (note,) = unstructured_residual_notes(found(1.28, p=0.5, after=SimpleNamespace(rest=1.04)))
    assert "adjusted to leave 1.04 times theirs" in note and "from run to run" in note and "white" not in note


@pytest.mark.parametrize(
    ("stated", "named"),
    [({"ay1": 0.05}, "yw, gauge"), ({"yw": 2e-5}, "gauge"), ({"yw": 2e-5, "gauge": 0.0}, None)],
)
def test_track_noise_that_is_not_stated_is_named_in_a_warning(stated: dict[str, float], named: str | None):
    stretch = SimpleNamespace(columns=dict.fromkeys(("t", "yw", "gauge", "ay1")))
    measurement = SimpleNamespace(campaign=SimpleNamespace(noise=stated), stretches=(stretch,))
    notes = unstated_track_noise_notes(cast(Dataset, measurement))
    assert [note.split(":")[0] for note in notes] == ([f"no noise stated for {named}"] if named else [])


@pytest.mark.parametrize(
    ("path", "named"),
    [("effects.0.damping", "damping of viscous damper at primary_yaw"), ("contact.spin_creep", "contact.spin_creep")],
)
def test_what_differs_from_run_to_run_is_told_by_its_name_with_its_value_on_every_run(path: str, named: str):
    effects = (PlacedEffect("viscous_damper", "primary_yaw", None, {"damping": 1e5}),)
    model = SimpleNamespace(effects=effects, design=SimpleNamespace(unit=lambda path: "N*m*s/rad"))
    one = found(1.2, p=0.5, after=SimpleNamespace(model=model))
    runs = (RunEstimate(0, "a.csv", "adjust", 40.0, 1.5e5, 1e3), RunEstimate(1, "b.csv", "validate", 31.0, 2e5, 2e3))
    told = run_dependence_text(one, RunDependence(path, {path: 1.0}, runs, 5e-4, cast(Validation, None)))
    assert f"run to run, {named} would be 150 kN*m*s/rad on a.csv (40 m/s) and 200 kN*m*s/rad on b.csv" in told


def test_a_damper_that_fades_leaves_its_rest_on_the_run_at_another_speed(tmp_path: Path):
    """It is as hot at 40 m/s as the adjusted damping takes it, and cooler at 31 m/s."""
    fading = effect("fading_damper", "secondary_lateral", damping=1.2e5, energy=60.0)
    write(campaign(Order(effects=(fading,), seed=6018, speeds=(40.0, 31.0))), tmp_path)
    adjusted = calibrate_only(read_dataset(load_campaign(tmp_path)))
    assert adjusted.before.error_to_noise < 1.07 and adjusted.error_to_noise > 1.15
