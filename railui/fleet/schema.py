"""Schema of a fleet file, for its check and for the JSON Schema."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Final

from pydantic import Field, create_model

from railui.campaign.schema import MeasurementModel, read_settings, setting_field
from railui.campaign.settings.fleet import FLEET_SETTINGS
from railui.io.fields import LIST, LIST_OR_SCALAR, PAIR, Group, Text, ValueReader, quantity_reader
from railui.io.problems import suggest_name
from railui.io.units import UnitError, quantity, read_speed

SECONDS_PER_DAY: Final = 86400.0
FIRST_DATE: Final = 3652.0  # day of 1980; a fleet whose last run is earlier has numbers of days and no dates
TIME_REMEDY: Final = "write 2026-03-01, 2026-03-01T06:30, or a number of days"


def read_time(value: Any) -> float:
    """Read a time [day]: of ISO 8601 since 1970, UTC unless it has an offset; or a number of days.

    >>> read_time("1970-01-02T12:00"), read_time("1970-01-02T12_00_00"), read_time("7")
    (1.5, 1.5, 7.0)
    """
    text = str(value).strip()
    try:
        return float(text)
    except ValueError:
        pass
    try:
        time = datetime.fromisoformat(text.replace("_", ":"))
    except ValueError:
        raise UnitError(f"{text!r} is no time", TIME_REMEDY) from None
    time = time.replace(tzinfo=UTC) if time.tzinfo is None else time
    return time.timestamp() / SECONDS_PER_DAY


def are_dates(times: Iterable[float]) -> bool:
    """True where the times of a fleet [day] are dates: the last one is of 1980 or later."""
    return max(times, default=0.0) >= FIRST_DATE


def time_text(days: float, is_date: bool) -> str | None:
    """Return a time [day] as a date, or as a number of days; None for a date after the year 9999.

    >>> time_text(20500.25, is_date=True), time_text(20500.25, is_date=False), time_text(1e7, is_date=True)
    ('2026-02-16', '20500.2', None)
    """
    if not is_date:
        return f"{round(days, 1):g}"
    try:
        return datetime.fromtimestamp(days * SECONDS_PER_DAY, UTC).date().isoformat()
    except (ValueError, OverflowError):
        return None


def _read_sections(value: Any) -> dict[str, tuple[float, float]]:
    """Read track sections: first and last distance [m] by name."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise UnitError("is not a group of sections", "write {north: [1200 m, 1700 m]}")
    sections = {}
    for name, ends in value.items():
        if not isinstance(ends, list) or len(ends) != 2:
            raise UnitError(f"section {name!r} is not a pair", "write {north: [1200 m, 1700 m]}")
        low, high = (quantity(end, "m") for end in ends)
        if not low < high:
            raise UnitError(f"section {name!r} does not end after its start", "write the smaller distance first")
        sections[str(name)] = (low, high)
    return sections


METADATA: Final = ("file", "vehicle", "time", "mileage", "load", "temperature", "section")
Speed = Annotated[float, ValueReader(read_speed)]
Time = Annotated[float, ValueReader(read_time, {"type": ["string", "number"]})]
Seconds = Annotated[float, quantity_reader("s", 0.0, above=True)]


def _followed_kinds() -> list[str]:
    from railui.core import effect_catalogue

    return [record["kind"] for record in effect_catalogue() if record["followed"]]


class TypeModel(MeasurementModel):
    """Schema of a vehicle type: design, sensors, noise, parameters to track, effects to watch."""

    vehicle: Text = Field(json_schema_extra={"sample": "vehicle: vehicle.yaml"})
    watch: Annotated[list[Text], LIST] = Field(
        default_factory=_followed_kinds, title="effects whose size is followed: kinds, or KIND at LOCATION"
    )


class VehicleModel(Group):
    """Schema of a vehicle: its type, and the results of a loop that are its reference."""

    type: Text
    prior: Text | None = Field(default=None, title="directory of a loop whose calibrated vehicle is the reference")


def _read_vehicles(value: Any) -> Any:
    """Replace the word of a vehicle by its group."""
    if not isinstance(value, Mapping):
        raise UnitError("is not a group of vehicles", "write {v01: intercity, v02: intercity}")
    return {str(name): {"type": one} if isinstance(one, str) else one for name, one in value.items()}


def _read_columns(value: Any) -> dict[str, str]:
    """Read the names that a table has for its columns."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value.values()):
        raise UnitError("is not a group of names", "write {time: run_no, temperature: oil_degC}")
    unknown = [str(name) for name in value if name not in METADATA]
    if unknown:
        raise UnitError(f"unknown column {unknown[0]!r}", suggest_name(unknown[0], METADATA))
    return {str(name): str(own) for name, own in value.items()}


class RunsModel(Group):
    """Schema of the runs: a table of them, or a pattern of their names."""

    index: Text | None = Field(
        default=None,
        title="CSV of the runs: file, vehicle, time; mileage, load, temperature, section where known",
    )
    columns: Annotated[
        dict[str, str], ValueReader(_read_columns, {"type": "object", "additionalProperties": {"type": "string"}})
    ] = Field(default_factory=dict, title="names that the index has for its columns; others are then ignored")
    pattern: Text | None = Field(
        default=None,
        title="path of the runs with {vehicle}, {time}, {section}, {mileage}, {load}, {temperature} and * in it, such "
        "as runs/{vehicle}/{time}.csv.gz",
    )
    glob: Text | None = Field(default=None, title="path of the runs with * and **, such as runs/**/*.csv")
    regex: Text | None = Field(
        default=None,
        title="with glob: regular expression that is searched in the path below the directory of the file, with groups "
        "such as (?P<time>[0-9]+); without a group time the runs are numbered in the order of their names",
    )


class TriggersModel(Group):
    """Schema of the conditions that make runs comparable."""

    speed: Annotated[tuple[Speed, Speed], PAIR] | None = Field(default=None, title="window of a steady speed")
    sections: Annotated[
        dict[str, tuple[float, float]],
        ValueReader(_read_sections, {"type": "object", "additionalProperties": {"type": "array"}}),
    ] = Field(default_factory=dict, title="first and last distance of track sections")
    min_duration: Seconds | None = Field(
        default=None, title="shortest part of a run that is used; 8 s by default, on a rig any"
    )
    max_duration: Seconds = Field(default=30.0, title="longest part of a run that is used")


class EventModel(Group):
    """Schema of maintenance of a vehicle, or of a new track record: after it, levels are learnt anew."""

    vehicle: Text = ""
    section: Text = Field(default="", title="track section, in place of a vehicle")
    time: Time
    resets: Annotated[list[Text], LIST_OR_SCALAR] = Field(
        default_factory=list, title="beginnings of the paths that it changes, such as contact; all by default"
    )
    note: Text = ""


class LimitModel(Group):
    """Schema of a limit: of a parameter, or of a safety criterion while the parameter drifts."""

    parameter: Text
    below: Any = Field(default=None, title="the limit is reached below this value")
    above: Any = Field(default=None, title="the limit is reached above this value")
    criterion: Text | None = Field(default=None, title="key of railui map, such as linear_critical_speed")


FleetSettingsModel = create_model(
    "FleetSettingsModel", __base__=Group, **{name: setting_field(s) for name, s in FLEET_SETTINGS.items()}
)


class FleetModel(Group):
    """Schema of fleet.yaml."""

    schema_: Text = Field(default="railui.fleet/1", alias="schema")
    name: Text = ""
    types: dict[str, TypeModel] = Field(json_schema_extra={"sample": "types: {intercity: {vehicle: vehicle.yaml}}"})
    vehicles: Annotated[dict[str, VehicleModel], ValueReader(_read_vehicles, {"type": "object"})] = Field(
        json_schema_extra={"sample": "vehicles: {v01: intercity}"}
    )
    runs: RunsModel = Field(json_schema_extra={"sample": "runs: {pattern: 'runs/{vehicle}/{time}.csv.gz'}"})
    triggers: TriggersModel = Field(default_factory=TriggersModel)
    events: Annotated[list[EventModel], LIST] = Field(default_factory=list)
    limits: Annotated[list[LimitModel], LIST] = Field(default_factory=list)
    settings: Annotated[FleetSettingsModel, ValueReader(read_settings)] = Field(  # type: ignore[valid-type]
        default_factory=FleetSettingsModel, title="thresholds of the fleet"
    )
