"""A map as it is read: channels to sensors in SI, with every fault told at its mark."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from railui.capture.processing.conventions import CONVENTIONS
from railui.capture.processing.map_model import (
    ACCELERATIONS,
    AXES,
    TARGETS,
    MapModel,
    RailsModel,
    SensorModel,
    SpeedModel,
)
from railui.io.fields import check_group
from railui.io.problems import Findings, nearest
from railui.io.schema_line import check_schema
from railui.io.units import UnitError, convert, own_quantity, quantity
from railui.io.yaml_document import load
from railui.vehicle.design_reader import Design
from railui.vehicle.reference import vehicle_of

STANDARD_G = 9.80665  # m/s^2 in the unit g


@dataclass(frozen=True)
class Sensor:
    """One sensor: quantity [SI] = factor(unit) x (mean of the channels - offset), with railui's sign."""

    target: str
    channels: tuple[str, ...]
    unit: str | None
    factor: float
    offset: float
    delay: float
    position: tuple[float, float, float]
    gravity: str
    noise: float | None

    def si(self, unit: str) -> float:
        """What turns a number in a unit into SI. Raises UnitError where it does not fit."""
        wanted = TARGETS[self.target].unit
        if unit in ("g", "gn", "G") and wanted == "m/s^2":
            return STANDARD_G
        return convert(1.0, unit, wanted) if wanted else 1.0


@dataclass(frozen=True)
class Geometry:
    """What the reconstruction takes of the vehicle: a, b, r [m], sigma of both wheelsets."""

    half_wheelbase: float
    half_gauge: float
    rolling_radius: float
    roll: tuple[float, float]


@dataclass(frozen=True)
class SensorMap:
    """A map: sensors by target, speed, rails, and the vehicle where it names one."""

    name: str
    source: Path
    design: Design | None
    clock: str | None
    rate: float | None
    speed: SpeedModel
    sensors: Mapping[str, Sensor]
    rails: RailsModel
    cross_level_base: float
    nominal_gauge: float

    @property
    def geometry(self) -> Geometry | None:
        """None where the map names no vehicle."""
        if self.design is None:
            return None
        value = self.design.value
        rolls = value("contact.leading.roll"), value("contact.trailing.roll")
        a, b, r = (value(f"vehicle.geometry.{name}") for name in ("half_wheelbase", "half_gauge", "rolling_radius"))
        return Geometry(a, b, r, rolls)

    @property
    def noise(self) -> dict[str, float]:
        """Stated standard deviations by target."""
        return {name: s.noise for name, s in self.sensors.items() if s.noise is not None}


def load_map(path: str | Path) -> SensorMap:
    """Reads a map; FileProblems with every fault."""
    source = Path(path)
    document = load(source)
    findings = document.findings()
    data = document.value if isinstance(document.value, dict) else {}
    check_schema(data, "map", findings)
    model = check_group(MapModel, data, findings)
    design = vehicle_of(source, data, findings, None)
    if design is not None and design.kind != "bogie":
        findings.add("vehicle", f"is a {design.kind}: it has no wheelsets", "name the design of a bogie")
    named = data.get("sensors")
    for name in named if isinstance(named, dict) else {}:
        if name not in TARGETS:
            findings.add(f"sensors.{name}", "is no quantity that is measured", nearest(name, TARGETS), key=True)
    findings.stop()
    assert model is not None
    _speed(model.speed, findings)
    sensors = {name: _sensor(name, s, model.convention, findings) for name, s in model.sensors.items()}
    findings.stop()
    return SensorMap(
        model.name or source.stem, source, design, model.clock, model.rate, model.speed, sensors, model.rails,
        model.cross_level_base, model.nominal_gauge,
    )  # fmt: skip


def _speed(model: SpeedModel, findings: Findings) -> None:
    ways = [key for key in ("channel", "pulses", "constant") if getattr(model, key) is not None]
    if len(ways) > 1:
        findings.add("speed", f"is told by {' and '.join(ways)}", "keep one of them")
    if model.pulses is not None and model.radius is None:
        findings.add("speed.radius", "is missing", "add `radius: 0.46 m` of the wheel whose pulses are counted")


def _sensor(name: str, model: SensorModel, convention: str, findings: Findings) -> Sensor:
    target, path = TARGETS[name], f"sensors.{name}"
    sign = CONVENTIONS[model.convention or convention].sign(target.kind) * model.sign
    if model.axis is not None:
        wanted = AXES.get(target.kind)
        if wanted is None or model.axis.lstrip("-") != wanted:
            findings.add(f"{path}.axis", f"{model.axis} is not what {name} needs", f"give the sensor along {wanted}")
        sign *= -1 if model.axis.startswith("-") else 1
    if abs(model.sign) != 1:
        findings.add(f"{path}.sign", f"{model.sign:g} is no sign", "write 1 or -1; a factor is the scale")
    if model.scale == 0:
        findings.add(f"{path}.scale", "0 leaves nothing", "give the factor of the channel")
    if model.gravity == "removed" and name not in ACCELERATIONS:
        findings.warn(f"{path}.gravity", "only accelerometers feel gravity", "leave it out")
    sensor = Sensor(
        name,
        tuple(model.channel),
        model.unit,
        sign * model.scale,
        0.0,
        model.delay,
        model.position,
        model.gravity,
        None,
    )
    return _with_amounts(sensor, model, path, target.unit, findings)


def _with_amounts(sensor: Sensor, model: SensorModel, path: str, unit: str, findings: Findings) -> Sensor:
    """Offset and noise, and whether the unit fits."""
    amounts: dict[str, Any] = {}
    for key in ("offset", "noise"):  # an offset is in the channel's own unit
        given = getattr(model, key)
        try:
            if given is not None:
                amounts[key] = own_quantity(given) if key == "offset" else quantity(given, unit)
        except UnitError as error:
            findings.add(f"{path}.{key}", error.message, error.remedy)
    if sensor.unit is not None:
        try:
            sensor.si(sensor.unit)
        except UnitError as error:
            findings.add(f"{path}.unit", error.message, error.remedy)
    return replace(sensor, **amounts)
