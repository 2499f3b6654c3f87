"""A small made fleet in service: what changes with weather, load, wear and sensors, and what is a fault."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.api.design import Design
from railui.documents.saving import save_design
from railui.fleet.schema import read_time
from railui.fleet.status import TypeState, alarm_row, assess_type, fleet_document
from railui.vehicle.design import Adjustment
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model
from tests.fleet.drawn import Errors, draw_fleet
from tests.fleet.simulate import START, order_of
from tests.fleet.templates import stored_templates
from tests.fleet.trial import fleet_of
from tests.truth.fleet import Fault, FleetOrder, members

LIMITS = """limits:
  - {parameter: vehicle.primary.lateral_stiffness, criterion: linear_critical_speed, below: 60 m/s}
"""
FAULTS = (
    Fault(1, "rubber", -0.30, onset=90.0),  # a layer of rubber comes off its plate
    Fault(4, "sensor", 0.20, onset=90.0, channel="ay1"),
    Fault(7, "clearance", 4e-4, onset=90.0, wheelset=1),
)


def _order(seed: int, faults: tuple[Fault, ...]) -> FleetOrder:
    return replace(order_of(seed, 12, 210, 7, 0), faults=faults)


def faulty_fleet() -> tuple[TypeState, dict[str, Any]]:
    """Draw and assess the fleet with faults."""
    order = _order(21, FAULTS)
    fleet = fleet_of(order, LIMITS)
    state = assess_type(fleet, fleet.types["bogie"], draw_fleet(fleet, order, stored_templates(), Errors()))
    return state, fleet_document(fleet, [state])


@pytest.fixture(scope="module")
def faulty() -> tuple[TypeState, dict[str, Any]]:
    return faulty_fleet()


def test_weather_load_wear_and_drifting_sensors_are_not_blamed_on_vehicles() -> None:
    """Seasons of 11 degC, loads, wheels that wear and are re-profiled, 1 % of drift a year, two sections that age."""
    order = _order(22, ())
    fleet = fleet_of(order)
    data = draw_fleet(fleet, order, stored_templates(), Errors())
    state = assess_type(fleet, fleet.types["bogie"], data)
    model = next(
        m
        for q, m in zip(data.quantities, state.monitor.models, strict=True)
        if q.name == "vehicle.primary.lateral_stiffness"
    )
    assert [(a.vehicle, a.verdict, a.name) for a in state.alarms if a.verdict != "outside"] == []
    assert len(state.alarms) <= 1
    # -0.3 % per kelvin and +2 % from empty to full, as planted
    assert model.fixed[1:3] == pytest.approx([-0.003, 0.02], abs=4.0 * float(np.max(model.fixed_sd[1:3])))
    assert model.fixed[2] > 3.0 * model.fixed_sd[2]


def test_each_fault_is_found_on_its_vehicle_and_named(faulty: tuple[TypeState, dict[str, Any]]) -> None:
    state, _ = faulty
    first = {a.crossing.subject: a for a in reversed(state.alarms)}
    assert set(first) >= {1, 4, 7}
    named = {v: (first[v].verdict, first[v].name) for v in (1, 4, 7)}
    assert named == {
        1: ("parameter", "vehicle.primary.lateral_stiffness"),
        4: ("sensor", "sensor_gain at ay1"),
        7: ("effect", "free_play at primary_lateral 1"),
    }
    assert all(first[v].raised < START + 210.0 for v in first)


def test_the_day_of_a_critical_speed_follows_from_the_drifting_parameter(
    faulty: tuple[TypeState, dict[str, Any]], tmp_path: Path
) -> None:
    state, document = faulty
    row = next(r for r in document["alarms"] if r["vehicle"] == "v02" and r["limit"] is not None)
    limit, path = row["limit"], "vehicle.primary.lateral_stiffness"
    assert (limit["parameter"], limit["criterion"], limit["limit"]) == (path, "linear_critical_speed", 60.0)
    # the vehicle of its last run, with the parameter at the reported value, has the critical speed of the limit
    data = state.data
    last = data.summaries[int(np.flatnonzero(data.vehicle == 1)[-1])]
    model = Model(state.type.campaign.design).with_path_values(last.paths, last.x)
    save_design(model.with_path_values([path], [limit["value"]]).design, tmp_path / "vehicle.yaml")
    speed = Design.load(tmp_path / "vehicle.yaml").stability([30.0, 90.0]).linear_critical_speed
    assert speed == pytest.approx(60.0, abs=0.3)
    # the spring of the generator reaches the value on a day within the interval
    sound = members(_order(21, FAULTS))[1].vehicle.c_y * 1.01  # at 10 degC and half load, of the mean of all runs
    fault = FAULTS[0]
    day = START + fault.onset + fault.ramp * (1.0 - limit["value"] / sound) / -fault.size
    assert read_time(limit["low"]) - 7.0 <= day <= read_time(limit["high"]) + 7.0
    assert read_time(limit["low"]) < read_time(limit["high"])


def test_the_limit_of_a_vehicle_with_a_prior_follows_from_its_own_effects(
    faulty: tuple[TypeState, dict[str, Any]], tmp_path: Path
) -> None:
    state, fleet = faulty[0], fleet_of(_order(21, FAULTS), LIMITS)
    path, half_width = "vehicle.primary.lateral_stiffness", "effects.0.half_width"
    clearance = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 1e-5})
    adjustment = Adjustment("v02", "0" * 64, (path, half_width), ((1e8, 0.0), (0.0, 1e-14)))
    calibrated = state.type.campaign.design.with_effects([clearance])
    save_design(replace(calibrated, adjustment=adjustment), tmp_path / "adjusted.yaml")
    (tmp_path / "loop.json").write_text("{}")
    vehicle = replace(fleet.vehicles["v02"], prior=tmp_path)
    fleet = replace(fleet, vehicles={**fleet.vehicles, "v02": vehicle})
    runs = [
        replace(s, paths=(*s.paths, half_width), x=np.append(s.x, 2e-5)) if v == 1 else s
        for v, s in zip(state.data.vehicle, state.data.summaries, strict=True)
    ]
    state = replace(state, data=replace(state.data, summaries=tuple(runs)))
    alarm = next(a for a in state.alarms if a.vehicle == "v02" and a.name == path)
    row = alarm_row(fleet, state, alarm, {}, is_date=True)
    assert row["limit"]["value"] > 0.0
