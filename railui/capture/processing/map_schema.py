"""Schema of a sensor map: channels and mounting of the sensors, reconstruction of the rails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from railui.capture.processing.conventions import CONVENTIONS
from railui.io.fields import (
    REQUIRED_LIST_OR_SCALAR,
    Group,
    Text,
    ValueReader,
    choice_reader,
    integer_reader,
    quantity_reader,
    quantity_schema,
)
from railui.io.units import UnitError


@dataclass(frozen=True)
class Quantity:
    """Measurable quantity: unit, kind of direction (whose sign depends on the convention), caption."""

    unit: str
    kind: str
    caption: str


QUANTITIES: dict[str, Quantity] = {
    **{f"ay{i}": Quantity("m/s^2", "lateral", f"accelerometer on the axle boxes of wheelset {i}") for i in (1, 2)},
    "ayf": Quantity("m/s^2", "lateral", "accelerometer on the frame"),
    "rf": Quantity("rad/s", "yaw", "yaw rate of the frame"),
    **{f"e{i}": Quantity("m", "lateral", f"wheelset {i} relative to the rails") for i in (1, 2)},
    **{f"e{i}_right": Quantity("m", "lateral", f"right wheel of wheelset {i} on its rail") for i in (1, 2)},
    **{f"e{i}_left": Quantity("m", "lateral", f"left wheel of wheelset {i} on its rail") for i in (1, 2)},
    **{f"d{i}": Quantity("m", "lateral", f"deflection of the primary suspension of wheelset {i}") for i in (1, 2)},
    **{f"psi{i}": Quantity("rad", "yaw", f"yaw of wheelset {i}") for i in (1, 2)},
    **{f"roll_rate{i}": Quantity("rad/s", "roll", f"roll rate of wheelset {i}") for i in (1, 2)},
    "roll_ratef": Quantity("rad/s", "roll", "roll rate of the frame"),
    **{f"inclination{i}": Quantity("rad", "roll", f"inclinometer on wheelset {i}") for i in (1, 2)},
    "Qy": Quantity("N", "lateral", "force of the carbody on the frame"),
    "Qpsi": Quantity("N*m", "yaw", "moment of the carbody on the frame"),
    "yw": Quantity("m", "lateral", "lateral deviation of the track centre line"),
    **{f"alignment_{j}": Quantity("m", "lateral", f"lateral deviation of the {j} rail") for j in ("right", "left")},
    "phiw": Quantity("rad", "roll", "cross-level as an angle"),
    "cross_level": Quantity("m", "roll", "cross-level as a height difference over cross_level_base"),
    **{name: Quantity("", "rig", f"{name} of a one-mass rig, in its own unit") for name in ("u", "z", "vz", "az")},
    "gauge": Quantity("m", "none", "gauge, or its deviation if below 0.5 m"),
}  # fmt: skip
TRACK_QUANTITIES = ("yw", "alignment_right", "alignment_left", "phiw", "cross_level", "gauge")
SENSOR_AXES = {"lateral": "y", "yaw": "z", "roll": "x"}  # of an accelerometer or displacement, a yaw rate, a roll rate
MAX_DELAY = 1.0  # s, of a sensor and its filter; a longer one is an error of clocks
ACCELERATIONS = ("ay1", "ay2", "ayf")


def read_axis(value: Any) -> str:
    """Read the vehicle axis along which a sensor points, with its sign; raise UnitError for any other text.

    >>> read_axis("+ y"), read_axis("-z")
    ('y', '-z')
    """
    text = str(value).strip().replace(" ", "")
    if text.lstrip("+-") not in ("x", "y", "z") or len(text) > 2:
        raise UnitError(f"{value!r} is not an axis", "write x, y, z, or -x, -y, -z")
    return text.lstrip("+")


AXIS = ValueReader(read_axis, {"type": "string", "enum": ["x", "y", "z", "-x", "-y", "-z"]})
ANY_QUANTITY = ValueReader(lambda value: value, quantity_schema(""))
Coordinate = Annotated[float, quantity_reader("m")]


class SensorModel(Group):
    """Sensor: quantity = sign x scale x (channel - offset), `delay` earlier, transferred from `position`."""

    channel: Annotated[list[Text], REQUIRED_LIST_OR_SCALAR] = Field(json_schema_extra={"sample": "channel: box1_y"})
    unit: Text | None = Field(default=None, title="unit of the channel, if the file lacks it or states it wrongly")
    axis: Annotated[str, AXIS] | None = Field(default=None, title="axis of the vehicle along which the sensor points")
    sign: Annotated[float, quantity_reader("1", -1.0, maximum=1.0)] = 1.0
    scale: Annotated[float, quantity_reader("1")] = 1.0
    offset: Annotated[Any, ANY_QUANTITY] = 0.0
    delay: Annotated[float, quantity_reader("s", -MAX_DELAY, maximum=MAX_DELAY)] = 0.0
    position: Annotated[tuple[Coordinate, Coordinate, Coordinate], ValueReader(lambda value: value)] = (0.0, 0.0, 0.0)
    gravity: Annotated[str, choice_reader(("raw", "removed"))] = "raw"
    noise: Annotated[Any, ANY_QUANTITY] | None = None
    convention: Annotated[str, choice_reader(tuple(CONVENTIONS))] | None = None


class SpeedModel(Group):
    """Speed and distance: a channel of speed, of distance, or the pulses of a wheel."""

    channel: Text | None = None
    unit: Text | None = None
    distance: Text | None = Field(default=None, title="channel of the distance")
    pulses: Text | None = Field(default=None, title="channel that counts pulses")
    per_turn: Annotated[int, integer_reader(1)] = 1
    radius: Annotated[float, quantity_reader("m", 0.0, above=True)] | None = None
    constant: Annotated[float, quantity_reader("m/s", 0.0, above=True)] | None = None


class RailsModel(Group):
    """Reconstruction of the rail position."""

    filter: Annotated[str, choice_reader(("zero_phase", "causal"))] = "zero_phase"
    longest: Annotated[float, quantity_reader("m", 0.0, above=True)] = Field(
        default=70.0, title="longest wavelength to reconstruct"
    )
    shortest: Annotated[float, quantity_reader("m", 0.0, above=True)] = Field(
        default=2.5, title="shortest wavelength to reconstruct"
    )
    natural_frequency: Annotated[float, quantity_reader("Hz", 0.0, above=True)] | None = None
    damping: Annotated[float, quantity_reader("1", 0.1, maximum=2.0)] = 0.7071
    crossover: Annotated[float, quantity_reader("Hz", 0.0, above=True)] = Field(
        default=0.2, title="frequency below which the roll comes from the inclinometer, above from the roll rate"
    )


class MapModel(Group):
    """Schema of map.yaml."""

    schema_: Text = Field(default="railui.map/1", alias="schema")
    name: Text = ""
    convention: Annotated[str, choice_reader(tuple(CONVENTIONS))] = "railui"
    vehicle: Text | None = Field(default=None, title="design that gives wheelbase, gauge, radius and roll")
    clock: Text | None = Field(default=None, title="time or distance channel, if its name is not recognised")
    rate: Annotated[float, quantity_reader("Hz", 0.0, above=True)] | None = Field(
        default=None, title="sampling rate, if there is no time channel"
    )
    speed: SpeedModel = Field(default_factory=SpeedModel)
    sensors: dict[str, SensorModel] = Field(json_schema_extra={"sample": "sensors: {ay1: {channel: box1_y}}"})
    rails: RailsModel = Field(default_factory=RailsModel)
    cross_level_base: Annotated[float, quantity_reader("m", 0.0, above=True)] = 1.5
    nominal_gauge: Annotated[float, quantity_reader("m", 0.0, above=True)] = 1.435
