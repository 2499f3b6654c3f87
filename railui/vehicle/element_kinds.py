"""The kinds of bodies and elements, and the numbers that each of them may have."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from railui.vehicle.parameters import Parameter

GROUND: Final = "ground"
WAYS: Final = ("longitudinal", "lateral", "vertical", "yaw", "roll")
TURNS: Final = ("yaw", "roll")
UNLIMITED: Final = 1e9  # N: a damper without blow-off
NONE, MIDDLE = "none where none is named", "the middle of the vehicle"


def _number(key: str, symbol: str, unit: str, caption: str, default: float | None = 0.0, **more: object) -> Parameter:
    origin = str(more.pop("origin", NONE if default == 0.0 else ""))
    return replace(Parameter(key, symbol, unit, caption, default, origin), **more)  # type: ignore[arg-type]


def _given(key: str, symbol: str, unit: str, caption: str, *usual: float) -> Parameter:
    return Parameter(key, symbol, unit, caption, above=True, usual=(usual[0], usual[1]))


def _place(key: str, caption: str) -> Parameter:
    return _number(key, key[0], "m", caption, minimum=-1e3, maximum=1e3, usual=(-20.0, 20.0), origin=MIDDLE)


def _stiff(way: str, key: str = "", default: float | None = 0.0) -> Parameter:
    unit = "N*m/rad" if way in TURNS else "N/m"
    return _number(key or f"{way}_stiffness", "k", unit, f"{way} stiffness", default, usual=(1e3, 1e9))


def _damping(way: str, key: str = "", default: float | None = 0.0) -> Parameter:
    unit = "N*m*s/rad" if way in TURNS else "N*s/m"
    return _number(key or f"{way}_damping", "c", unit, f"{way} damping", default, usual=(1e2, 1e7))


INERTIAS: Final = (
    _given("mass", "m", "kg", "mass", 100, 1e5),
    _given("yaw_inertia", "I_z", "kg*m^2", "yaw inertia", 100, 5e6),
)
PLACED: Final = (_place("x", "place along the vehicle, forwards"), _place("height", "height above the rails"))
HALF_CENTRES: Final = replace(_given("half_centres", "a_c", "m", "half the distance of the two", 1, 15), default=None)
BODY: Final = (
    *INERTIAS,
    _given("roll_inertia", "I_x", "kg*m^2", "roll inertia", 100, 2e5),
    *PLACED,
    HALF_CENTRES,
)
WHEELSET: Final = (
    *INERTIAS,
    _number("spin_inertia", "I_y", "kg*m^2", "spin inertia", usual=(20, 400)),
    _number("half_gauge", "b", "m", "half the distance of the rolling circles", 0.75, above=True,
            origin="standard gauge", usual=(0.5, 0.9)),
    _given("rolling_radius", "r", "m", "nominal rolling radius", 0.2, 0.7),
    _given("wheel_load", "N", "N", "load of one wheel on the rail", 1e4, 2e5),
    _place("x", "place along the vehicle, forwards"),
    _given("half_wheelbase", "a", "m", "half the wheelbase", 0.7, 2.0),
)  # fmt: skip
POINT: Final = (
    *PLACED,
    _number("y", "y", "m", "place to the right; the same on the left", usual=(0.0, 2.0), origin=MIDDLE),
)
FAR_POINT: Final = tuple(replace(p, path=f"{p.path}_to", caption=f"{p.caption}, second end") for p in POINT)
LOAD: Final = _number("static_load", "P", "N", "weight that it carries, of the second body on the first",
                      minimum=-1e7, usual=(0.0, 5e5))  # fmt: skip
# the numbers of each kind but for its place; those that depend on its direction stand in `numbers_of`
LAWS: Final[dict[str, tuple[Parameter, ...]]] = {
    "spring": (*(_stiff(way) for way in WAYS), LOAD),
    "damper": tuple(_damping(way) for way in WAYS),
    "spring_damper": (),
    "stop": (),
    "link": (_stiff("axial", "stiffness", None), _damping("axial", "damping")),
    "anti_roll_bar": (_stiff("roll", "stiffness", None),),
    "wheelset": WHEELSET,
}
KINDS: Final = tuple(LAWS)
DIRECTED: Final = ("spring_damper", "stop")
# numbers that a file may leave out altogether: what they are then follows from the others
STRUCTURAL: Final = frozenset(
    {"x", "y", "height", "x_to", "y_to", "height_to", "half_centres", "half_wheelbase", "yaw_inertia", "roll_inertia"}
)


def numbers_of(kind: str, direction: str = "lateral") -> tuple[Parameter, ...]:
    """Every number that an element of a kind may have, its place included."""
    if kind == "wheelset":
        return WHEELSET
    if kind == "anti_roll_bar":
        return (*LAWS[kind], PLACED[0])
    return (*LAWS[kind], *_directed(kind, direction), *POINT, *(FAR_POINT if kind == "link" else ()))


def _directed(kind: str, direction: str) -> tuple[Parameter, ...]:
    """The numbers whose units depend on the direction in which an element acts."""
    turns = direction in TURNS
    stiffness = _stiff(direction, "stiffness", None)
    if kind == "spring_damper":
        blow_off = _number("blow_off", "F_b", "N*m" if turns else "N", "force at which the damper yields", UNLIMITED)
        limit = replace(blow_off, above=True, origin="no limit", usual=(1e2, 1e5))
        return stiffness, _damping(direction, "damping", None), limit
    if kind == "stop":
        gap = _number("gap", "h", "rad" if turns else "m", "free way to either side", None)
        return replace(gap, usual=(0.0, 0.1)), stiffness
    return ()
