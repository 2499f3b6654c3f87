"""Sensors that a campaign declares on a vehicle of bodies, and the problems of wrong ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.documents.saving import save_campaign
from railui.io.problems import FileProblems
from railui.runs.columns import VehicleColumns

COACH = Path(__file__).parents[2] / "designs/manchester_coach.yaml"
RUNS = "runs: [{file: a.csv, role: adjust}, {file: b.csv, role: validate}]\n"


def campaign(tmp_path: Path, channels: str, vehicle: Path = COACH) -> Path:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t [s], v [m/s], yw [m], floor [m/s^2]\n0, 40, 0, 0\n")
    path = tmp_path / "campaign.yaml"
    path.write_text(f"vehicle: {vehicle}\n{RUNS}{channels}")
    return path


def test_declared_sensors_are_channels_of_the_kernel(tmp_path: Path) -> None:
    text = (
        "channels:\n  floor: {kind: lateral_acceleration, body: body, at: [950 cm, 0, 0.6], gravity: true}\n"
        "  turn: {kind: yaw_rate, body: frame_2}\n  swing: {kind: lateral_deflection, joint: secondary_2}\n"
    )
    design = load_campaign(campaign(tmp_path, text)).design
    assert design.structure is not None
    floor, turn, swing = design.structure.sensors
    assert floor.accelerometer is not None
    assert (floor.accelerometer.at, floor.accelerometer.with_gravity) == ((9.5, 0.6), True)
    assert (turn.channel, turn.unit) == ("v.frame_yaw.2", "rad/s")
    assert (swing.channel, swing.unit) == ("z.secondary_lateral.2", "m")
    form = design.run_form
    assert isinstance(form, VehicleColumns) and {"floor", "turn", "swing"} <= form.columns.keys()


@pytest.mark.parametrize(
    ("channels", "text"),
    [
        ("channels: {a: {kind: yaw_rate, body: frame}}", "no body 'frame'"),
        ("channels: {a: {kind: yaw_rate}}", "has no body"),
        ("channels: {a: {kind: roll_rate, body: wheelset_1}}", "no roll inertia"),
        ("channels: {a: {kind: lateral_deflection, joint: primary_9}}", "no joint 'primary_9'"),
        ("channels: {a: {kind: speed, body: body}}", "'speed' is not known here"),
        ("channels: {a: {kind: lateral_acceleration, body: body, at: [1, 2]}}", "is not a position"),
        ("channels: {yw: {kind: yaw_rate, body: body}}", "name of another column"),
    ],
)
def test_a_wrong_sensor_is_reported_with_its_place(tmp_path: Path, channels: str, text: str) -> None:
    with pytest.raises(FileProblems) as caught:
        load_campaign(campaign(tmp_path, channels + "\n"))
    problem = next(p for p in caught.value.problems if text in str(p))
    assert "campaign.yaml:3" in str(problem) and problem.remedy


def test_a_bogie_takes_no_declared_channels(tmp_path: Path) -> None:
    text = "channels: {a: {kind: yaw_rate, body: frame}}\n"
    with pytest.raises(FileProblems, match="takes no declared channels"):
        load_campaign(campaign(tmp_path, text, COACH.with_name("test_bogie.yaml")))


def test_the_default_estimates_contact_primary_springs_and_dampers(tmp_path: Path) -> None:
    paths = load_campaign(campaign(tmp_path, "")).estimated_parameters
    assert "contact.wheels.conicity" in paths and "vehicle.elements.primary.lateral_stiffness" in paths
    assert "vehicle.elements.lateral_damper.lateral_damping" in paths
    assert not any("secondary.lateral_stiffness" in p or "mass" in p for p in paths)


def test_declared_sensors_are_written_with_the_campaign(tmp_path: Path) -> None:
    text = "channels:\n  floor: {kind: lateral_acceleration, body: body, at: [9.5 m, 0, 0.6], gravity: true}\n"
    first = load_campaign(campaign(tmp_path, text + "noise: {floor: 0.03}\n"))
    again = load_campaign(save_campaign(first, tmp_path / "again.yaml"))
    assert again.design.structure is not None and first.design.structure is not None
    assert again.design.structure.sensors == first.design.structure.sensors and again.noise == {"floor": 0.03}
