"""What the catalogue's records say at a place: units, defaults and ranges in the vehicle's own terms."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from railui.runs.columns import COLUMNS, RIG_COLUMNS

Record = Mapping[str, Any]
Catalogue = Sequence[Record]

TURNING = ("_yaw", "_roll")
PER_WHEELSET = ("primary_lateral", "primary_yaw", "wheelset", "wheelset_yaw", "contact", "track")
SENSORS = frozenset(name for name, c in (COLUMNS | RIG_COLUMNS).items() if c.part == "response")
# the reference motion of defaults and ranges: 5 mm (5 mrad) at 10 rad/s
REFERENCE = {"z": 5e-3, "w": 10.0, "v": 5e-2}
WORD = re.compile(r"([*/]?)([A-Za-z]+|1)(?:\^(\d))?")


@cache
def kernel_catalogue() -> Catalogue:
    """The catalogue of effects as the kernel states it."""
    from railui.core import catalogue

    return tuple(catalogue())


def record_of(kind: str, catalogue: Catalogue) -> Record | None:
    """The record of a kind, None where there is none."""
    return next((record for record in catalogue if record["kind"] == kind), None)


def is_sensor(record: Record) -> bool:
    """Does it stand at a column instead of a place of the vehicle?"""
    return any(at in SENSORS for at in record["at"])


def is_curve(record: Record) -> bool:
    """Is it a curve, whose parameters are lists?"""
    from railui.core import CURVES

    return record["kind"] in CURVES


def is_even(record: Record) -> bool:
    """Is it a curve over equal steps?"""
    return bool(record["kind"] == "profile_shape")


def is_against(record: Record) -> bool:
    """Is it a curve that names what it stands against: z, v or s?"""
    return bool(record["kind"] == "measured_force")


def unit_at(word: str, at: str) -> str:
    """The unit of a word of z, v, F, s, 1 at a place; SI units stay as they are; rigs are in their own units.

    >>> unit_at("F*s^2/z^2", "primary_lateral"), unit_at("F/z", "secondary_yaw"), unit_at("v", "primary_yaw")
    ('N*s^2/m^2', 'N*m/rad', 'rad/s')
    """
    if at == "rig":
        return "1"
    powers: dict[str, int] = {}
    for sign, name, power in WORD.findall(word):
        for base, p in _meaning(name, at).items():
            powers[base] = powers.get(base, 0) + p * int(power or 1) * (-1 if sign == "/" else 1)
    return _written(powers)


def _meaning(name: str, at: str) -> dict[str, int]:
    if at in SENSORS:
        unit = (COLUMNS | RIG_COLUMNS)[at].unit
        z = {base: int(power or 1) * (-1 if sign == "/" else 1) for sign, base, power in WORD.findall(unit)}
    else:
        z = {"rad": 1} if at.endswith(TURNING) else {"m": 1}
    force = {"N": 1, "m": 1} if at.endswith(TURNING) else {"N": 1}
    words = {"z": z, "v": {**z, "s": z.get("s", 0) - 1}, "F": force, "1": {}}
    return words.get(name, {name: 1})


def _written(powers: Mapping[str, int]) -> str:
    order = ("N", "kg", "s", "m", "rad")
    names = sorted((n for n, p in powers.items() if p), key=lambda n: order.index(n) if n in order else -1)
    # moments read N*m*s, forces N*s/m
    raised = [n if powers[n] == 1 else f"{n}^{powers[n]}" for n in names if powers[n] > 0]
    if powers.get("N", 0) > 0 and "m" in raised and "s" in raised:
        raised = ["N", "m", *[n for n in raised if n not in ("N", "m")]]
    lowered = [n if powers[n] == -1 else f"{n}^{-powers[n]}" for n in names if powers[n] < 0]
    return "*".join(raised or ["1"]) + "".join(f"/{n}" for n in lowered)


def site(at: str, values: Mapping[str, float]) -> dict[str, float]:
    """What defaults are multiples of: k, c, z, v, w, F, m, h, r; absent where the vehicle has none."""
    get = values.get
    b_c, primary = get("vehicle.geometry.half_spring_base", 0.0), "vehicle.primary"
    springs = {
        "secondary_lateral": (
            get("vehicle.secondary.lateral_stiffness"),
            get("vehicle.secondary.lateral_damping"),
        ),
        "secondary_yaw": (get("vehicle.secondary.yaw_stiffness"), get("vehicle.secondary.yaw_damping")),
        "primary_lateral": (2 * get(f"{primary}.lateral_stiffness", 0.0), 0.0),
        "primary_yaw": (2 * b_c * b_c * get(f"{primary}.longitudinal_stiffness", 0.0), 0.0),
        "rig": (get("vehicle.rig.stiffness"), get("vehicle.rig.damping")),
    }
    # of a vehicle of bodies and elements, `Design.at_places` says what stands at each place
    k, c = springs.get(at, (None, None)) if "vehicle.frame.mass" in values or at == "rig" else (
        get(f"site.{at}.stiffness"), get(f"site.{at}.damping")
    )  # fmt: skip
    known = {
        "k": k,
        "c": c,
        "m": get("vehicle.rig.mass") if at == "rig" else get("vehicle.frame.mass"),
        "h": get("contact.flange_clearance"),
        "r": get("vehicle.geometry.rolling_radius") or get("site.rolling_radius"),
    }
    if at != "rig":
        # where no damper is declared: the spring's force at 10 rad/s
        known["c"] = c or (k / REFERENCE["w"] if k else None)
        known |= REFERENCE | {"F": k * REFERENCE["z"] if k else None}
    return {name: value for name, value in known.items() if value}


def times(word: str, numbers: Mapping[str, float]) -> float | None:
    """The value of a product such as "k/z^2"; None where a factor is absent.

    >>> times("k/z^2", {"k": 4.0, "z": 2.0}), times("F", {})
    (1.0, None)
    """
    value = 1.0
    for sign, name, power in WORD.findall(word):
        factor = 1.0 if name == "1" else numbers.get(name)
        if factor is None:
            return None
        value *= factor ** (int(power or 1) * (-1 if sign == "/" else 1))
    return value


def default_at(parameter: Record, at: str, values: Mapping[str, float]) -> float | None:
    """The default of a parameter at a place of this vehicle; None where it has none."""
    scale = times(str(parameter.get("times", "1")), site(at, values))
    given = parameter.get("default")
    return None if given is None or scale is None else float(given) * scale


def range_at(parameter: Record, at: str, values: Mapping[str, float]) -> tuple[float, float]:
    """The possible range of a parameter at a place of this vehicle, without end where it has none."""
    scale = times(str(parameter.get("times", "1")), site(at, values))
    low, high = parameter.get("minimum"), parameter.get("maximum")
    ends = -math.inf if low is None else float(low), math.inf if high is None else float(high)
    if scale is None:
        return (0.0 if ends[0] >= 0 else -math.inf), math.inf
    return ends[0] * scale, ends[1] * scale


def is_absolute(parameter: Record) -> bool:
    """Is the range a number of its own (or of the geometry), and so a limit of what a file may say?"""
    return str(parameter.get("times", "1")) in ("1", "h", "r")
