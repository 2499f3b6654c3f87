"""The shape of a map: which channel is which sensor, how it is mounted, how the rails are reconstructed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from railui.capture.processing.conventions import CONVENTIONS
from railui.io.fields import LISTED_OR_ONE, Group, Reader, Text, measure, quantity_schema, whole, word
from railui.io.units import UnitError


@dataclass(frozen=True)
class Target:
    """A quantity that a channel can be: its unit, and the direction that a convention may count otherwise."""

    unit: str
    kind: str
    caption: str


TARGETS: dict[str, Target] = {
    **{f"ay{i}": Target("m/s^2", "lateral", f"accelerometer on the axle boxes of wheelset {i}") for i in (1, 2)},
    "ayf": Target("m/s^2", "lateral", "accelerometer on the frame"),
    "rf": Target("rad/s", "yaw", "yaw rate of the frame"),
    **{f"e{i}": Target("m", "lateral", f"wheelset {i} relative to the rails") for i in (1, 2)},
    **{f"e{i}_right": Target("m", "lateral", f"right wheel of wheelset {i} on its rail") for i in (1, 2)},
    **{f"e{i}_left": Target("m", "lateral", f"left wheel of wheelset {i} on its rail") for i in (1, 2)},
    **{f"d{i}": Target("m", "lateral", f"deflection of the primary suspension of wheelset {i}") for i in (1, 2)},
    **{f"psi{i}": Target("rad", "yaw", f"yaw of wheelset {i}") for i in (1, 2)},
    **{f"roll_rate{i}": Target("rad/s", "roll", f"roll rate of wheelset {i}") for i in (1, 2)},
    "roll_ratef": Target("rad/s", "roll", "roll rate of the frame"),
    **{f"inclination{i}": Target("rad", "roll", f"inclinometer on wheelset {i}") for i in (1, 2)},
    "Qy": Target("N", "lateral", "force of the coach on the frame"),
    "Qpsi": Target("N*m", "yaw", "moment of the coach on the frame"),
    "yw": Target("m", "lateral", "lateral deviation of the track centre line"),
    **{f"alignment_{j}": Target("m", "lateral", f"lateral deviation of the {j} rail") for j in ("right", "left")},
    "phiw": Target("rad", "roll", "cross-level as an angle"),
    "cross_level": Target("m", "roll", "cross-level as a height difference over cross_level_base"),
    **{name: Target("", "rig", f"{name} of a one-mass rig, in its own unit") for name in ("u", "z", "vz", "az")},
    "gauge": Target("m", "none", "gauge, or its deviation where below 0.5 m"),
}  # fmt: skip
AXES = {"lateral": "y", "yaw": "z", "roll": "x"}  # of an accelerometer or displacement, a yaw rate, a roll rate
ACCELERATIONS = ("ay1", "ay2", "ayf")


def read_axis(value: Any) -> str:
    """An axis of the vehicle that a sensor's arrow points along, with its sign; UnitError for what is none.

    >>> read_axis("+ y"), read_axis("-z")
    ('y', '-z')
    """
    text = str(value).strip().replace(" ", "")
    if text.lstrip("+-") not in ("x", "y", "z") or len(text) > 2:
        raise UnitError(f"{value!r} is no axis", "write x, y, z, or -x, -y, -z")
    return text.lstrip("+")


AXIS = Reader(read_axis, {"type": "string", "enum": ["x", "y", "z", "-x", "-y", "-z"]})
FREE = Reader(lambda value: value, quantity_schema(""))
Place = Annotated[float, measure("m")]


class SensorModel(Group):
    """One sensor: quantity = sign x scale x (channel - offset), `delay` earlier, moved from `position`."""

    channel: Annotated[list[Text], LISTED_OR_ONE] = Field(json_schema_extra={"sample": "channel: box1_y"})
    unit: Text | None = Field(default=None, title="where the file does not say it, or says it wrongly")
    axis: Annotated[str, AXIS] | None = Field(default=None, title="the vehicle's axis that its arrow points along")
    sign: Annotated[float, measure("1", -1.0, maximum=1.0)] = 1.0
    scale: Annotated[float, measure("1")] = 1.0
    offset: Annotated[Any, FREE] = 0.0
    delay: Annotated[float, measure("s")] = 0.0
    position: Annotated[tuple[Place, Place, Place], Reader(lambda value: value)] = (0.0, 0.0, 0.0)
    gravity: Annotated[str, word(("raw", "removed"))] = "raw"
    noise: Annotated[Any, FREE] | None = None
    convention: Annotated[str, word(tuple(CONVENTIONS))] | None = None


class SpeedModel(Group):
    """Where speed and distance come from: a channel of speed, of distance, or the pulses of a wheel."""

    channel: Text | None = None
    unit: Text | None = None
    distance: Text | None = Field(default=None, title="a channel of the distance")
    pulses: Text | None = Field(default=None, title="a channel that counts pulses")
    per_turn: Annotated[int, whole(1)] = 1
    radius: Annotated[float, measure("m", 0.0, above=True)] | None = None
    constant: Annotated[float, measure("m/s", 0.0, above=True)] | None = None


class RailsModel(Group):
    """How the rail position is reconstructed."""

    filter: Annotated[str, word(("zero_phase", "causal"))] = "zero_phase"
    longest: Annotated[float, measure("m", 0.0, above=True)] = Field(default=70.0, title="longest wavelength wanted")
    shortest: Annotated[float, measure("m", 0.0, above=True)] = Field(default=2.5, title="shortest wavelength kept")
    natural_frequency: Annotated[float, measure("Hz", 0.0, above=True)] | None = None
    damping: Annotated[float, measure("1", 0.1, maximum=2.0)] = 0.7071
    crossover: Annotated[float, measure("Hz", 0.0, above=True)] = Field(
        default=0.2, title="below it the inclinometer tells the roll, above it the roll rate"
    )


class MapModel(Group):
    """The shape of map.yaml."""

    schema_: Text = Field(default="railui.map/1", alias="schema")
    name: Text = ""
    convention: Annotated[str, word(tuple(CONVENTIONS))] = "railui"
    vehicle: Text | None = Field(default=None, title="the design whose wheelbase, gauge, radius and roll are taken")
    clock: Text | None = Field(default=None, title="the channel of time, where it is not called t or time")
    rate: Annotated[float, measure("Hz", 0.0, above=True)] | None = Field(default=None, title="where there is no clock")
    speed: SpeedModel = Field(default_factory=SpeedModel)
    sensors: dict[str, SensorModel] = Field(json_schema_extra={"sample": "sensors: {ay1: {channel: box1_y}}"})
    rails: RailsModel = Field(default_factory=RailsModel)
    cross_level_base: Annotated[float, measure("m", 0.0, above=True)] = 1.5
    nominal_gauge: Annotated[float, measure("m", 0.0, above=True)] = 1.435
