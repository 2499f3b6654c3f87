"""State of a fleet as a document: vehicles, parameters, alarms with their course, sections of track."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.fleet.alarm import Alarm, explain_alarm
from railui.fleet.block_means import BlockMeans
from railui.fleet.course import Arrival, Course, arrival
from railui.fleet.cusum import DAYS_PER_MONTH
from railui.fleet.fleet_file import Fleet, Limit, VehicleType
from railui.fleet.history import Monitor
from railui.fleet.limits import Margin, margin_of_criterion, margin_of_value
from railui.fleet.mixed_model import MixedModel
from railui.fleet.monitor import monitor_fleet
from railui.fleet.observations import PARAMETER, Observations, Quantity, read_observations
from railui.fleet.reference import campaign_of
from railui.fleet.schema import are_dates, time_text
from railui.fleet.store import FleetStore
from railui.vehicle.design import Design
from railui.vehicle.model import Model

FIXED_NAMES: Final = ("temperature", "load", "use")
BEFORE: Final = Arrival(-math.inf, -math.inf, -math.inf, 1.0)


@dataclass(frozen=True, eq=False)
class TypeState:
    """Observations of a vehicle type, their monitoring and its alarms."""

    type: VehicleType
    data: Observations
    monitor: Monitor
    alarms: tuple[Alarm, ...]


def assess_fleet(fleet: Fleet, store: FleetStore) -> list[TypeState]:
    """Monitor every vehicle type of a fleet and explain its alarms."""
    states = []
    for vehicle_type in fleet.types.values():
        data = read_observations(fleet, store, vehicle_type)
        if data is not None:
            states.append(assess_type(fleet, vehicle_type, data))
    return states


def assess_type(fleet: Fleet, vehicle_type: VehicleType, data: Observations) -> TypeState:
    """Monitor the vehicles of a type and explain their alarms."""
    events = [(data.vehicles.index(e.vehicle), e) for e in fleet.events if e.vehicle in data.vehicles]
    renewed = [e.time for e in fleet.events if e.section in data.sections and e.section]
    monitor = monitor_fleet(data, fleet.settings, events, renewed)
    alarms: list[Alarm] = []
    for crossing in monitor.alarms:
        alarms.append(explain_alarm(data, monitor, crossing, fleet.settings, alarms))
    return TypeState(vehicle_type, data, monitor, tuple(alarms))


def fleet_document(fleet: Fleet, states: list[TypeState], loops: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the state of a fleet as the JSON of `railui fleet status`.

    loops: reports of full loops by vehicle.
    """
    is_date = are_dates(float(state.data.time.max()) for state in states)
    alarms = [alarm_row(fleet, state, alarm, loops or {}, is_date) for state in states for alarm in state.alarms]
    return {
        "fleet": fleet.name,
        "false_alarms_per_vehicle_month": fleet.settings.false_alarms,
        "vehicles": [row for state in states for row in _vehicle_rows(state, is_date)],
        "alarms": alarms,
        "sections": [row for state in states for row in _section_rows(state, is_date)],
        "parameters": [row for state in states for row in _parameter_rows(state)],
    }


def block_means(state: TypeState) -> BlockMeans:
    """Return the block means of a monitored vehicle type."""
    data, monitor = state.data, state.monitor
    scale = np.array([quantity.scale for quantity in data.quantities])
    return BlockMeans(
        state.type.name,
        data.vehicles,
        tuple(quantity.name for quantity in data.quantities),
        tuple(_unit(state.type, quantity) for quantity in data.quantities),
        monitor.start,
        monitor.value * scale,
        monitor.expected * scale,
        monitor.spread * np.abs(scale),
        monitor.largest_sums(),
    )


def _vehicle_rows(state: TypeState, is_date: bool) -> list[dict[str, Any]]:
    data, monitor = state.data, state.monitor
    rows = []
    for v, name in enumerate(data.vehicles):
        own = np.flatnonzero(data.vehicle == v)
        alarms = [a for a in state.alarms if a.vehicle == name]
        tested = int(monitor.tested_blocks[v])
        verdict = alarms[-1].verdict if alarms else "none" if tested else "learning"
        block_days = float(monitor.start[1] - monitor.start[0])
        rows.append(
            {
                "vehicle": name,
                "type": state.type.name,
                "runs": len(own),
                "last_run": time_text(float(data.time[own[-1]]), is_date) if len(own) else None,
                "tested_months": tested * block_days / DAYS_PER_MONTH,
                "verdict": verdict,
                "alarms": len(alarms),
            }
        )
    return rows


def alarm_row(fleet: Fleet, state: TypeState, alarm: Alarm, loops: Mapping[str, str], is_date: bool) -> dict[str, Any]:
    """Return an alarm with its evidence as a row of the document; is_date: times are dates, not numbers of days."""
    quantities = state.data.quantities
    crossing, course = alarm.crossing, alarm.course
    quantity = quantities[alarm.index] if alarm.index is not None else Quantity(alarm.name, "", 1.0)
    return {
        "vehicle": alarm.vehicle,
        "type": state.type.name,
        "raised": time_text(alarm.raised, is_date),
        "verdict": alarm.verdict,
        "quantity": alarm.name,
        "not_separated_from": list(alarm.alternatives),
        "explained": alarm.explained,
        "raised_by": quantities[crossing.quantities[0]].name,
        "sum": crossing.sums[0],
        "threshold": state.monitor.threshold,
        "change": alarm.change * quantity.scale,
        "change_sd": alarm.change_sd * quantity.scale,
        "relative_change": alarm.change if quantity.kind == PARAMETER else None,
        "total_change": alarm.total_change * quantity.scale,
        "total_change_sd": alarm.total_change_sd * quantity.scale,
        "relative_total_change": alarm.total_change if quantity.kind == PARAMETER else None,
        "unit": _unit(state.type, quantity),
        "onset": _onset(course, is_date),
        "rate_per_month": None if course is None else course.rate * DAYS_PER_MONTH * quantity.scale,
        "rate_per_month_sd": None if course is None else course.rate_sd * DAYS_PER_MONTH * quantity.scale,
        "limit": _limit_row(fleet, state, alarm, is_date),
        "runs": list(alarm.files),
        "loop": loops.get(alarm.vehicle),
    }


def _unit(vehicle_type: VehicleType, quantity: Quantity) -> str:
    design = vehicle_type.campaign.design
    return design.unit(quantity.name) if quantity.kind == PARAMETER else "1"


def _onset(course: Course | None, is_date: bool) -> dict[str, str | None] | None:
    if course is None:
        return None
    days = {"day": course.onset, "low": course.onset_low, "high": course.onset_high}
    return {name: time_text(day, is_date) for name, day in days.items()}


def _limit_row(fleet: Fleet, state: TypeState, alarm: Alarm, is_date: bool) -> dict[str, Any] | None:
    """Day at which the first of the limits of a parameter is reached; None without a limit or a course."""
    limits = [x for x in fleet.limits if x.parameter == alarm.name]
    if not limits or alarm.course is None or alarm.index is None:
        return None
    expected = _expected_value(state, alarm)
    scale = state.data.quantities[alarm.index].scale
    reached: list[tuple[Limit, Margin, Arrival]] = []
    for limit in limits:
        if limit.criterion is None:
            margin = margin_of_value(limit, expected)
        else:
            margin = margin_of_criterion(_present_design(fleet, state, alarm), limit, expected)
        low, high = sorted((value - expected) / scale for value in (margin.low, margin.high))
        reached.append((limit, margin, BEFORE if margin.is_exceeded else arrival(alarm.course, low, high)))
    limit, margin, first = min(reached, key=lambda each: (each[2].day, -each[2].probability))
    value = margin.value_towards(alarm.course.rate * scale)
    days = {"day": first.day, "low": first.low, "high": first.high}
    return {
        "parameter": limit.parameter,
        "criterion": limit.criterion,
        "limit": limit.value,
        "value": limit.value if limit.criterion is None else value,
        "exceeded_before": margin.is_exceeded,
        **{name: time_text(day, is_date) if math.isfinite(day) else None for name, day in days.items()},
        "probability": first.probability,
    }


def _present_design(fleet: Fleet, state: TypeState, alarm: Alarm) -> Design:
    """Design of a vehicle as its last run estimates it."""
    data = state.data
    last = data.summaries[int(np.flatnonzero(data.vehicle == alarm.crossing.subject)[-1])]
    nominal = campaign_of(fleet.vehicles[alarm.vehicle]).design
    return Model(nominal).with_path_values(last.paths, last.x).design


def _expected_value(state: TypeState, alarm: Alarm) -> float:
    """Value of the alarm's quantity that was expected before the onset, in its unit."""
    data, monitor, crossing = state.data, state.monitor, alarm.reference
    assert alarm.index is not None
    levels = monitor.levels[min(crossing.started + 1, crossing.block)]
    own = np.flatnonzero(data.vehicle == crossing.subject)
    use = float(data.use[own[-1], alarm.index])
    v, j = crossing.subject, alarm.index
    return float(data.quantities[j].scale * (levels.a[v, j] + levels.b[v, j] * use))


def _section_rows(state: TypeState, is_date: bool) -> list[dict[str, Any]]:
    data, monitor = state.data, state.monitor
    rows = []
    for s, name in enumerate(data.sections):
        alarms = [
            {
                "raised": time_text(float(monitor.start[x.block + 1]), is_date),
                "quantities": [data.quantities[j].name for j in x.quantities],
                "sum": x.sums[0],
            }
            for x in monitor.section_alarms
            if x.subject == s
        ]
        runs = int(np.sum(data.section == s))
        rows.append({"section": name or "all", "type": state.type.name, "runs": runs, "alarms": alarms})
    return rows


def _parameter_rows(state: TypeState) -> list[dict[str, Any]]:
    """Fleet mean, spread of the vehicles, slopes, and the present value of every vehicle."""
    rows, largest = [], state.monitor.largest_sums()
    for j, (quantity, model) in enumerate(zip(state.data.quantities, state.monitor.models, strict=True)):
        row = {
            "quantity": quantity.name,
            "type": state.type.name,
            "kind": quantity.kind,
            "unit": _unit(state.type, quantity),
            "mean": quantity.scale * float(model.fixed[0]),
            "mean_sd": quantity.scale * float(model.fixed_sd[0]),
            "vehicle_sd": quantity.scale * math.sqrt(model.level_variance),
            "section_sd": quantity.scale * math.sqrt(model.cell_variance),
            **_slopes(quantity, model),
            "vehicles": _present(state, j, largest[:, j]),
        }
        rows.append(row)
    return rows


def _slopes(quantity: Quantity, model: MixedModel) -> dict[str, float]:
    slopes = {}
    for i, name in enumerate(FIXED_NAMES, 1):
        slopes[f"per_{name}"] = quantity.scale * float(model.fixed[i])
        slopes[f"per_{name}_sd"] = quantity.scale * float(model.fixed_sd[i])
    return slopes


def _present(state: TypeState, j: int, largest: FloatArray) -> dict[str, dict[str, float | None]]:
    """Value before the last block, its standard deviation, its score and its largest sum, by vehicle."""
    data, monitor, model = state.data, state.monitor, state.monitor.models[j]
    scale = data.quantities[j].scale
    found: dict[str, dict[str, float | None]] = {}
    last = monitor.levels[-1]
    for v, name in enumerate(data.vehicles):
        own = np.flatnonzero(data.vehicle == v)
        use = float(data.use[own[-1], j]) if len(own) else 0.0
        value = float(last.a[v, j] + last.b[v, j] * use)
        sd = math.sqrt(max(float(last.aa[v, j] + 2 * use * last.ab[v, j] + use**2 * last.bb[v, j]), 0.0))
        usual = float(model.fixed[0] + model.fixed[3] * use)
        spread = math.sqrt(model.level_variance + sd**2) or 1.0
        found[name] = {
            "value": scale * value,
            "sd": scale * sd,
            "score": (value - usual) / spread,
            "largest_sum": float(largest[v]),
        }
    return found
