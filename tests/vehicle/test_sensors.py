"""Sensors of vehicles of bodies: names of their channels, and what an accelerometer measures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from railui.vehicle.sensors import Accelerometer, Sensor, standard_sensors, vehicle_columns

DESIGN = load_design(Path(__file__).parents[2] / "designs/manchester_coach.yaml")
ROAD = Excitation(resolve_track("erri_b176_high length=300 seed=2"), 40.0)


def with_sensor(sensor: Sensor) -> Model:
    assert DESIGN.structure is not None
    return Model(replace(DESIGN, structure=replace(DESIGN.structure, sensors=(sensor,))))


def series(model: Model, channels: list[str]) -> np.ndarray:
    table = ROAD.table(model.wheelset_spacing(), 1)
    motion, diverged = model.vehicles().simulate(model.single_batch(), table, ROAD.dt, 1, channels)
    assert diverged[0] == -1
    return np.asarray(motion[0])


def test_every_standard_sensor_can_be_simulated_under_its_name() -> None:
    assert DESIGN.structure is not None
    sensors = standard_sensors(DESIGN.structure)
    names = [s.name for s in sensors]
    assert {"e4", "ay4", "d4", "psi4", "ayf", "rf", "ay.body", "rf.frame_2", "rp.body", "ay.body.middle"} <= set(names)
    assert np.isfinite(series(Model(DESIGN), names)).all()


def test_columns_of_the_runs_hold_track_and_declared_sensors_first() -> None:
    sensor = Sensor("swing", "m", "swing", "z.secondary_lateral.2")
    structure = with_sensor(sensor).design.structure
    assert structure is not None
    columns = vehicle_columns(structure).columns
    assert columns["swing"].unit == "m" and columns["yw"].role == "track" and "Qy" not in columns


@pytest.mark.parametrize("with_gravity", [False, True])
def test_an_accelerometer_measures_the_motion_of_its_point(with_gravity: bool) -> None:
    x, z = 7.0, 0.6  # u_y = y + psi x - phi z of a point forwards and below, z down
    sensor = Sensor("a", "m/s^2", "", "sensor.a", Accelerometer("body", (x, z), with_gravity))
    a, ay, apsi, aphi, phi = series(with_sensor(sensor), ["a", "ay.body", "apsi.body", "aphi.body", "phi.body"])
    expected = ay + x * apsi - z * aphi - (9.81 * phi if with_gravity else 0.0)
    assert a == pytest.approx(expected, abs=1e-12)


def test_a_yaw_rate_is_the_derivative_of_the_yaw_angle() -> None:
    rate, angle = series(Model(DESIGN), ["rf.frame_2", "psi.frame_2"])
    derived = np.gradient(angle, ROAD.dt)[5:-5]
    assert rate[5:-5] == pytest.approx(derived, abs=0.02 * derived.std())
