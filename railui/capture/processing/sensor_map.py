"""Sensor maps as read from a file: channels to sensors in SI, with every problem at its line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from railui.capture.processing.conventions import CONVENTIONS
from railui.capture.processing.map_schema import (
    ACCELERATIONS,
    QUANTITIES,
    SENSOR_AXES,
    MapModel,
    RailsModel,
    SensorModel,
    SpeedModel,
)
from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError, convert, parse_unit, quantity, split_quantity
from railui.io.yaml_file import load_fields
from railui.vehicle.design_reader import Design
from railui.vehicle.reference import load_named_design
from railui.vehicle.track_geometry import track_geometry


@dataclass(frozen=True)
class Sensor:
    """Sensor: quantity [SI] = factor x si_factor(unit) x (mean of the channels - offset), with railui's sign.

    Attributes
    ----------
    quantity
        Name of the quantity, a key of `QUANTITIES`.
    channels
        Channels of the recording, of which the mean is taken.
    unit
        Unit of the channels, None if the recording states it.
    factor
        Sign and scale.
    offset, offset_unit
        Offset and its unit, "" for the channels' unit.
    delay
        Delay of sensor and filter [s].
    position
        x, y, z from the centre of the body [m].
    gravity
        "raw" if the accelerometer measures y'' - g phi, else "removed".
    noise
        Standard deviation [SI], None if not stated.
    """

    quantity: str
    channels: tuple[str, ...]
    unit: str | None
    factor: float
    offset: float
    offset_unit: str
    delay: float
    position: tuple[float, float, float]
    gravity: str
    noise: float | None

    def si_factor(self, unit: str) -> float:
        """Return the factor from a unit to SI; raise UnitError if the unit is not one of the quantity."""
        wanted = QUANTITIES[self.quantity].unit
        if not wanted:
            return 1.0
        try:
            return convert(1.0, unit, wanted)
        except UnitError as error:
            other = {"cross_level": "phiw", "phiw": "cross_level"}.get(self.quantity)
            if other is not None and parse_unit(unit).is_compatible(parse_unit(QUANTITIES[other].unit)):
                raise UnitError(error.message, f"name the quantity {other}: {QUANTITIES[other].caption}") from None
            raise

    def offset_in(self, unit: str) -> float:
        """Return the offset in the unit of a channel; raise UnitError if its own unit is not one of the quantity."""
        if self.offset_unit in ("", unit):
            return self.offset
        if not QUANTITIES[self.quantity].unit:  # a rig, whose channels keep their units
            return convert(self.offset, self.offset_unit, unit)
        return self.offset * self.si_factor(self.offset_unit) / self.si_factor(unit)


@dataclass(frozen=True)
class VehicleGeometry:
    """Geometry for the reconstruction: a, b, r [m], roll coefficient sigma of the first two wheelsets."""

    half_wheelbase: float
    half_gauge: float
    rolling_radius: float
    roll: tuple[float, float]


@dataclass(frozen=True)
class SensorMap:
    """Sensor map: sensors by quantity, speed, rails, and the vehicle if the map names one."""

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
    def geometry(self) -> VehicleGeometry | None:
        """Geometry of the vehicle, None without a vehicle."""
        if self.design is None:
            return None
        geometry = track_geometry(self.design)
        return VehicleGeometry(
            half_wheelbase=0.5 * geometry.wheelbase,
            half_gauge=geometry.half_gauge,
            rolling_radius=geometry.rolling_radius,
            roll=_roll_coefficients(self.design),
        )

    @property
    def noise(self) -> dict[str, float]:
        """Stated standard deviations [SI] by quantity."""
        return {name: s.noise for name, s in self.sensors.items() if s.noise is not None}


def _roll_coefficients(design: Design) -> tuple[float, float]:
    """Return the roll coefficients of the first two wheelsets."""
    groups = ["leading", "trailing"]
    if design.structure is not None:
        groups = [design.structure.contact_of(wheelset) for wheelset in design.structure.wheelsets[:2]]
    leading, trailing = (design.value(f"contact.{group}.roll") for group in groups)
    return leading, trailing


def _check_wheelsets(design: Design, findings: Findings) -> None:
    """Report a vehicle without the two wheelsets from which the rail position is reconstructed."""
    if not design.is_on_track:
        findings.add("vehicle", f"is a {design.kind}, which has no wheelsets", "name the design of a vehicle")
    elif len(track_geometry(design).distances) < 2:
        findings.add("vehicle", "has a single wheelset, the rail position needs two", "name the design of a bogie")


def load_map(path: str | Path) -> SensorMap:
    """Read a sensor map; raise FileProblems with every problem."""
    source = Path(path)
    data, model, findings = load_fields(source, "map", MapModel)
    design = load_named_design(source, data, findings, None)
    if design is not None:
        _check_wheelsets(design, findings)
    entries = data.get("sensors")
    for name in entries if isinstance(entries, dict) else {}:
        if name not in QUANTITIES:
            findings.add(f"sensors.{name}", "is not a measurable quantity", suggest_name(name, QUANTITIES), key=True)
    findings.raise_errors()
    assert model is not None
    _check_speed(model.speed, findings)
    sensors = {name: _read_sensor(name, s, model.convention, findings) for name, s in model.sensors.items()}
    findings.raise_errors()
    return SensorMap(
        name=model.name or source.stem,
        source=source,
        design=design,
        clock=model.clock,
        rate=model.rate,
        speed=model.speed,
        sensors=sensors,
        rails=model.rails,
        cross_level_base=model.cross_level_base,
        nominal_gauge=model.nominal_gauge,
    )


def _check_speed(model: SpeedModel, findings: Findings) -> None:
    sources = [key for key in ("channel", "pulses", "constant") if getattr(model, key) is not None]
    if len(sources) > 1:
        findings.add("speed", f"is given by {' and '.join(sources)}", "keep one of them")
    if model.pulses is not None and model.radius is None:
        findings.add("speed.radius", "is missing", "add `radius: 0.46 m` of the wheel whose pulses are counted")


def _read_sensor(name: str, model: SensorModel, convention: str, findings: Findings) -> Sensor:
    kind = QUANTITIES[name].kind
    path = f"sensors.{name}"
    sign = CONVENTIONS[model.convention or convention].sign(kind) * model.sign
    if model.axis is not None:
        wanted = SENSOR_AXES.get(kind)
        if wanted is None or model.axis.lstrip("-") != wanted:
            findings.add(f"{path}.axis", f"{model.axis} is not the axis of {name}", f"use the sensor along {wanted}")
        sign *= -1 if model.axis.startswith("-") else 1
    if abs(model.sign) != 1:
        findings.add(f"{path}.sign", f"{model.sign:g} is not a sign", "write 1 or -1; a factor is the scale")
    if model.scale == 0:
        findings.add(f"{path}.scale", "0 removes the signal", "give the factor of the channel")
    if model.gravity == "removed" and name not in ACCELERATIONS:
        findings.warn(f"{path}.gravity", "applies to accelerometers only", "remove it")
    sensor = Sensor(
        quantity=name,
        channels=tuple(model.channel),
        unit=model.unit,
        factor=sign * model.scale,
        offset=0.0,
        offset_unit="",
        delay=model.delay,
        position=model.position,
        gravity=model.gravity,
        noise=None,
    )
    return _with_offset_and_noise(sensor, model, path, findings)


def _with_offset_and_noise(sensor: Sensor, model: SensorModel, path: str, findings: Findings) -> Sensor:
    """Read offset and noise, and check the unit."""
    values: dict[str, Any] = {}
    try:
        if model.offset is not None:
            values["offset"], values["offset_unit"] = _read_offset(sensor, model.offset)
    except UnitError as error:
        findings.add(f"{path}.offset", error.message, error.remedy)
    try:
        if model.noise is not None:
            values["noise"] = _read_noise(sensor, model.noise)
    except UnitError as error:
        findings.add(f"{path}.noise", error.message, error.remedy)
    try:
        if sensor.unit is not None:
            sensor.si_factor(sensor.unit)
    except UnitError as error:
        findings.add(f"{path}.unit", error.message, error.remedy)
    return replace(sensor, **values)


def _read_offset(sensor: Sensor, value: Any) -> tuple[float, str]:
    """Return an offset and its unit, "" for a number alone; raise UnitError for a unit that the quantity lacks."""
    number, unit = split_quantity(value) if isinstance(value, str) else (value, "")
    if unit:
        sensor.si_factor(unit)
    return quantity(number, "1"), unit


def _read_noise(sensor: Sensor, value: Any) -> float:
    """Return a standard deviation in SI; raise UnitError if it is not above 0."""
    noise = quantity(value, QUANTITIES[sensor.quantity].unit)
    if not noise > 0:
        raise UnitError(f"{value!r} is no standard deviation", "give more than 0, or leave it out")
    return noise
