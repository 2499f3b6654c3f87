"""Kinds of bodies and elements, and the parameters of each kind."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from railui.vehicle.parameter import INFINITE, MAX_PLAUSIBLE, Parameter

GROUND: Final = "ground"
DIRECTIONS: Final = ("longitudinal", "lateral", "vertical", "yaw", "roll")
ROTATIONS: Final = ("yaw", "roll")
NO_BLOW_OFF_FORCE: Final = 1e9  # N: a damper without blow-off
NO_ELEMENT: Final = "none where none is named"  # origin of the default 0
CENTRE: Final = "the middle of the vehicle"


def _number(
    key: str,
    symbol: str,
    unit: str,
    caption: str,
    default: float | None = 0.0,
    *,
    origin: str = "",
    minimum: float = 0.0,
    maximum: float = MAX_PLAUSIBLE,
    exclusive_minimum: bool = False,
    usual_range: tuple[float, float] = (0.0, INFINITE),
) -> Parameter:
    origin = origin or (NO_ELEMENT if default == 0.0 else "")
    return Parameter(
        key, symbol, unit, caption, default, origin, minimum, maximum, exclusive_minimum, usual_range=usual_range
    )


def _required(key: str, symbol: str, unit: str, caption: str, *usual: float) -> Parameter:
    return _number(key, symbol, unit, caption, None, exclusive_minimum=True, usual_range=(usual[0], usual[1]))


def _coordinate(key: str, caption: str) -> Parameter:
    return _number(key, key[0], "m", caption, origin=CENTRE, minimum=-1e3, maximum=1e3, usual_range=(-20.0, 20.0))


def _stiffness(direction: str, key: str = "", default: float | None = 0.0) -> Parameter:
    unit = "N*m/rad" if direction in ROTATIONS else "N/m"
    caption = f"{direction} stiffness"
    return _number(key or f"{direction}_stiffness", "k", unit, caption, default, usual_range=(1e3, 1e9))


def _damping(direction: str, key: str = "", default: float | None = 0.0) -> Parameter:
    unit = "N*m*s/rad" if direction in ROTATIONS else "N*s/m"
    caption = f"{direction} damping"
    return _number(key or f"{direction}_damping", "c", unit, caption, default, usual_range=(1e2, 1e7))


INERTIAS: Final = (
    _required("mass", "m", "kg", "mass", 100, 1e5),
    _required("yaw_inertia", "I_z", "kg*m^2", "yaw inertia", 100, 5e6),
)
POSITION: Final = (
    _coordinate("x", "position along the vehicle, positive forwards"),
    _coordinate("height", "height above the rails"),
)
BODY: Final = (
    *INERTIAS,
    _required("roll_inertia", "I_x", "kg*m^2", "roll inertia", 100, 2e5),
    *POSITION,
    _required("half_centres", "a_c", "m", "half the distance of the two", 1, 15),
)
WHEELSET: Final = (
    replace(INERTIAS[0], example="1500 kg"),
    replace(INERTIAS[1], example="900 kg*m^2"),
    _number("spin_inertia", "I_y", "kg*m^2", "spin inertia", usual_range=(20, 400)),
    _number("half_gauge", "b", "m", "half the distance of the rolling circles", 0.75, exclusive_minimum=True,
            origin="standard gauge", usual_range=(0.5, 0.9)),
    replace(_required("rolling_radius", "r", "m", "nominal rolling radius", 0.2, 0.7), example="0.46 m"),
    _required("wheel_load", "N", "N", "load of one wheel on the rail", 1e4, 2e5),
    _coordinate("x", "position along the vehicle, positive forwards"),
    replace(_required("half_wheelbase", "a", "m", "half the wheelbase", 0.7, 2.0), example="1.28 m"),
    _required("roller_radius", "R", "m", "radius of the rollers that carry the wheels; a track where absent", 0.1, 2.0),
)  # fmt: skip
POINT: Final = (
    *POSITION,
    _number("y", "y", "m", "distance to the right, and the same to the left", usual_range=(0.0, 2.0), origin=CENTRE),
)
SECOND_POINT: Final = tuple(replace(p, path=f"{p.path}_to", caption=f"{p.caption}, second end") for p in POINT)
STATIC_LOAD: Final = _number(
    "static_load",
    "P",
    "N",
    "weight of the second body that the element transmits to the first",
    minimum=-1e7,
    usual_range=(0.0, 5e5),
)
# parameters of each kind without its position; those that depend on its direction are in `parameters_of_kind`
PARAMETERS_BY_KIND: Final[dict[str, tuple[Parameter, ...]]] = {
    "spring": (*(_stiffness(direction) for direction in DIRECTIONS), STATIC_LOAD),
    "damper": tuple(_damping(direction) for direction in DIRECTIONS),
    "spring_damper": (),
    "stop": (),
    "link": (_stiffness("axial", "stiffness", None), _damping("axial", "damping")),
    "anti_roll_bar": (_stiffness("roll", "stiffness", None),),
    "wheelset": WHEELSET,
}
ELEMENT_KINDS: Final = tuple(PARAMETERS_BY_KIND)
DIRECTED_KINDS: Final = ("spring_damper", "stop")
# parameters that a file may omit: their values then follow from the others
OMISSIBLE_KEYS: Final = frozenset(
    {
        *("x", "y", "height", "x_to", "y_to", "height_to", "half_centres", "half_wheelbase", "roller_radius"),
        *("yaw_inertia", "roll_inertia"),
    }
)


def parameters_of_kind(kind: str, direction: str = "lateral") -> tuple[Parameter, ...]:
    """Return every parameter that an element of a kind may have, its position included."""
    if kind == "wheelset":
        return WHEELSET
    if kind == "anti_roll_bar":
        return (*PARAMETERS_BY_KIND[kind], POSITION[0])
    return (
        *PARAMETERS_BY_KIND[kind],
        *_parameters_by_direction(kind, direction),
        *POINT,
        *(SECOND_POINT if kind == "link" else ()),
    )


def _parameters_by_direction(kind: str, direction: str) -> tuple[Parameter, ...]:
    """Return the parameters whose units depend on the direction of an element."""
    is_rotation = direction in ROTATIONS
    stiffness = _stiffness(direction, "stiffness", None)
    if kind == "spring_damper":
        blow_off = _number(
            "blow_off",
            "F_b",
            "N*m" if is_rotation else "N",
            "force at which the damper yields",
            NO_BLOW_OFF_FORCE,
            origin="no limit",
            exclusive_minimum=True,
            usual_range=(1e2, 1e5),
        )
        return stiffness, _damping(direction, "damping", None), blow_off
    if kind == "stop":
        unit = "rad" if is_rotation else "m"
        return _number("gap", "h", unit, "clearance to either side", None, usual_range=(0.0, 0.1)), stiffness
    return ()
