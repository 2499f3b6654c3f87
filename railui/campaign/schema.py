"""Schema of a campaign file, for its check and for the JSON Schema."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, create_model

from railui.campaign.corrections.reading import SENSORS
from railui.campaign.sensors import SENSOR_KINDS, read_position
from railui.campaign.settings.declaration import Setting
from railui.campaign.settings.loop_settings import SETTINGS
from railui.io.fields import (
    LIST,
    PAIR,
    Group,
    Switch,
    Text,
    ValueReader,
    choice_reader,
    integer_reader,
    quantity_reader,
    quantity_schema,
)
from railui.io.units import UnitError, quantity

ROLES = ("adjust", "validate", "test")  # estimation, validation, test
ORIGINS = ("measured", "simulated")  # of the runs


def read_cut(value: Any) -> tuple[float, float]:
    """Read the length to leave out at both ends of a segment: seconds, or a share of its length.

    >>> read_cut("2 s"), read_cut("2 %")
    ((2.0, 0.0), (0.0, 0.02))
    """
    share = isinstance(value, str) and value.strip().endswith("%")
    number = quantity(value, "1" if share else "s")
    if number < 0 or (share and number >= 0.5):
        raise UnitError(f"{value!r} is out of range", "give 0 s or more, or less than 50 %")
    return (0.0, number) if share else (number, 0.0)


def read_conditions(value: Any) -> dict[str, str]:
    """Read the conditions of a run: a word, a number or a quantity for each name.

    >>> read_conditions({"current": "0.5 A", "load": 2.0})
    {'current': '0.5 A', 'load': '2'}
    """
    if value is None:
        return {}
    if not isinstance(value, dict) or any(isinstance(x, dict | list) or x is None for x in value.values()):
        raise UnitError("is not a group of conditions", "write {current: 0.5 A}")
    return {str(name): f"{x:g}" if isinstance(x, float) else str(x) for name, x in value.items()}


CONDITIONS = ValueReader(read_conditions, {"type": "object", "additionalProperties": {"type": ["string", "number"]}})


class RunModel(Group):
    """Schema of a run: its file, its role, its conditions and the load state of the vehicle."""

    file: Text = Field(json_schema_extra={"sample": "file: run_a.csv.gz"})
    role: Annotated[str, choice_reader(ROLES)] = Field(json_schema_extra={"sample": "role: adjust"})
    conditions: Annotated[dict[str, Any], CONDITIONS] = Field(
        default_factory=dict, title="conditions of the run, such as {current: 0.5 A}"
    )
    load: Text = Field(default="", title="load state of the vehicle on the run, one of its design")


class ChannelModel(Group):
    """Schema of a sensor: its kind, its body or joint, its position, whether gravity through roll is in its signal."""

    kind: Annotated[str, choice_reader(SENSOR_KINDS)] = Field(json_schema_extra={"sample": "kind: yaw_rate"})
    body: Text = ""
    joint: Text = ""
    at: Annotated[
        list[Annotated[float, quantity_reader("m")]], ValueReader(read_position, {"type": "array", "maxItems": 3})
    ] = Field(
        default_factory=list,
        title="position of an accelerometer",
        description="[x, y, z] from the centre of mass: forwards, to the right, down",
    )
    gravity: Switch = Field(default=False, title="true where an accelerometer measures gravity through roll as well")


CHANNELS = ValueReader(lambda value: {} if value is None else value)
NOISE = ValueReader(
    lambda value: {} if value is None else value,
    {"type": "object", "additionalProperties": quantity_schema("", title="standard deviation of a column")},
)
Frequency = Annotated[float, quantity_reader("Hz", 0.0, above=True)]


def setting_field(setting: Setting) -> Any:
    """Define the pydantic field of a setting: a count, or a quantity of its unit within its bounds."""
    field = Field(default=setting.default, title=setting.meaning.rstrip("."))
    if setting.is_whole:
        return Annotated[int, integer_reader(int(setting.minimum or 0))], field
    return Annotated[float, quantity_reader(setting.unit, setting.minimum, maximum=setting.maximum)], field


SettingsModel = create_model(
    "SettingsModel", __base__=Group, **{name: setting_field(setting) for name, setting in SETTINGS.items()}
)


def read_settings(value: Any) -> Any:
    """Replace an empty mapping, which YAML reads as null."""
    return {} if value is None else value


class MeasurementModel(Group):
    """Schema of what a recorded and a planned campaign have in common: sensors, noise, parameters and thresholds."""

    name: Text = ""
    noise: Annotated[dict[str, Any], NOISE] = Field(
        default_factory=dict, title="standard deviation of any column but t, s, v"
    )
    noise_band: Annotated[float, quantity_reader("m", 0.0, above=True)] = Field(
        default=2.5, title="shortest wavelength of track noise"
    )
    adjust: Annotated[list[Text], LIST] | None = Field(default=None, title="paths of the parameters to estimate")
    free: Annotated[list[Text], LIST] = Field(
        default_factory=list,
        title="numbers that may differ between the joints of an element or the wheelsets of a contact",
        description="estimated once for each joint or wheelset; of a group, those that are estimated",
    )
    band: Annotated[tuple[Frequency, Frequency], PAIR] | None = Field(
        default=None,
        title="band of the comparison",
        description="0.3 to 40 Hz; on a rig only the mean is removed",
    )
    cut: Annotated[
        Any,
        ValueReader(
            read_cut,
            quantity_schema("s", title="left out at both ends of a segment", description="2 s; on a rig 2 %"),
        ),
    ] = None
    material: Annotated[float, quantity_reader("1", 0.0, maximum=1.0)] = Field(
        default=0.10, title="share by which an effect must lower the validation error"
    )
    channels: Annotated[dict[str, ChannelModel], CHANNELS] = Field(
        default_factory=dict, title="sensors of a vehicle of bodies by the names of their columns"
    )
    track: Annotated[str, choice_reader(("unloaded", "loaded"))] = "unloaded"
    settings: Annotated[SettingsModel, ValueReader(read_settings)] = Field(  # type: ignore[valid-type]
        default_factory=SettingsModel, title="thresholds of the loop"
    )


class CampaignModel(MeasurementModel):
    """Schema of campaign.yaml."""

    schema_: Text = Field(default="railui.campaign/1", alias="schema")
    vehicle: Text = Field(json_schema_extra={"sample": "vehicle: ../vehicle.yaml"})
    runs: Annotated[list[RunModel], LIST] = Field(
        json_schema_extra={"sample": "runs: [{file: run_a.csv.gz, role: adjust}]"}
    )
    sensors: Annotated[Any, SENSORS] = Field(default_factory=list)
    data: Annotated[str, choice_reader(ORIGINS)] | None = Field(
        default=None, title="origin of the runs, which the report states"
    )
