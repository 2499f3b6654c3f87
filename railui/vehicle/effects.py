"""Effects of a vehicle, and the catalogue that defines their units, defaults and ranges."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from railui.runs.columns import BENCH_COLUMNS, COLUMNS, RIG_COLUMNS
from railui.vehicle.parameter import Parameter

Number = float | tuple[float, ...]
Record = Mapping[str, Any]
Catalogue = Sequence[Record]

ROTATION_SUFFIXES = ("_yaw", "_roll")
WHEELSET_LOCATIONS = ("primary_lateral", "primary_yaw", "wheelset", "wheelset_yaw", "contact", "track")
SENSORS = frozenset(name for name, c in (COLUMNS | RIG_COLUMNS | BENCH_COLUMNS).items() if c.role == "response")
# motion to which defaults and ranges refer: 5 mm (5 mrad) at 10 rad/s
REFERENCE_MOTION = {"z": 5e-3, "w": 10.0, "v": 5e-2}
FACTOR = re.compile(r"([*/]?)([A-Za-z]+|1)(?:\^(\d))?")


@dataclass(frozen=True)
class PlacedEffect:
    """Effect at a location of a vehicle.

    Attributes
    ----------
    kind : str
        Kind in the catalogue.
    at : str
        Location.
    wheelset : int or None
        1, 2, or None for both.
    parameters : mapping
        Numbers in SI; tuples for a curve.
    against : str or None
        Abscissa of a curve: z, v or s.
    defaulted : frozenset of str
        Parameters that the file left to their defaults.
    """

    kind: str
    at: str
    wheelset: int | None = None
    parameters: Mapping[str, Number] = field(default_factory=dict)
    against: str | None = None
    defaulted: frozenset[str] = field(default=frozenset(), compare=False, repr=False)

    def __hash__(self) -> int:
        return hash((self.kind, self.at, self.wheelset, tuple(sorted(self.parameters.items())), self.against))

    def entry(self, *, given_only: bool = False) -> dict[str, Any]:
        """Return the effect as a file lists it, SI.

        >>> PlacedEffect("free_play", "primary_lateral", 2, {"half_width": 3e-4}).entry()
        {'kind': 'free_play', 'at': 'primary_lateral', 'wheelset': 2, 'half_width': 0.0003}
        """
        keys: dict[str, Any] = {"kind": self.kind, "at": self.at}
        keys |= {k: v for k, v in (("wheelset", self.wheelset), ("against", self.against)) if v is not None}
        for key, value in self.parameters.items():
            if not (given_only and key in self.defaulted):
                keys[key] = list(value) if isinstance(value, tuple) else value
        return keys


@cache
def kernel_catalogue() -> Catalogue:
    """Return the kernel's catalogue of effects."""
    from railui.core import effect_catalogue

    return tuple(effect_catalogue())


def record_of(kind: str, catalogue: Catalogue) -> Record | None:
    """Return the record of a kind; None if it is unknown."""
    return next((record for record in catalogue if record["kind"] == kind), None)


def is_sensor(record: Record) -> bool:
    """True if the effect acts on a measured channel, not on the vehicle."""
    return any(at in SENSORS for at in record["at"])


def is_curve(record: Record) -> bool:
    """True if the effect is a curve, whose parameters are lists."""
    from railui.core import CURVE_KINDS

    return record["kind"] in CURVE_KINDS


def has_equal_steps(record: Record) -> bool:
    """True if the effect is a curve over equal steps."""
    return bool(record["kind"] == "profile_shape")


def has_abscissa(record: Record) -> bool:
    """True if the effect is a curve with a choice of abscissa: z, v or s."""
    return bool(record["kind"] == "measured_force")


def unit_at(word: str, at: str) -> str:
    """Return the unit of a product of z, v, F, s, 1 at a location.

    SI units remain as they are. A rig has units of its own, so that the result there is "1".

    >>> unit_at("F*s^2/z^2", "primary_lateral"), unit_at("F/z", "secondary_yaw"), unit_at("v", "primary_yaw")
    ('N*s^2/m^2', 'N*m/rad', 'rad/s')
    """
    if at == "rig":
        return "1"
    powers: dict[str, int] = {}
    for sign, name, power in FACTOR.findall(word):
        for base, p in _base_units(name, at).items():
            powers[base] = powers.get(base, 0) + p * int(power or 1) * (-1 if sign == "/" else 1)
    return _format_unit(powers)


def _base_units(name: str, at: str) -> dict[str, int]:
    if at in SENSORS:
        unit = (COLUMNS | RIG_COLUMNS | BENCH_COLUMNS)[at].unit
        z = {base: int(power or 1) * (-1 if sign == "/" else 1) for sign, base, power in FACTOR.findall(unit)}
    else:
        z = {"rad": 1} if at.endswith(ROTATION_SUFFIXES) else {"m": 1}
    force = {"N": 1, "m": 1} if at.endswith(ROTATION_SUFFIXES) else {"N": 1}
    words = {"z": z, "v": {**z, "s": z.get("s", 0) - 1}, "F": force, "1": {}}
    return words.get(name, {name: 1})


def _format_unit(powers: Mapping[str, int]) -> str:
    order = ("N", "kg", "s", "m", "rad")
    names = sorted((n for n, p in powers.items() if p), key=lambda n: order.index(n) if n in order else -1)
    # moments are written N*m*s, forces N*s/m
    raised = [n if powers[n] == 1 else f"{n}^{powers[n]}" for n in names if powers[n] > 0]
    if powers.get("N", 0) > 0 and "m" in raised and "s" in raised:
        raised = ["N", "m", *[n for n in raised if n not in ("N", "m")]]
    lowered = [n if powers[n] == -1 else f"{n}^{-powers[n]}" for n in names if powers[n] < 0]
    return "*".join(raised or ["1"]) + "".join(f"/{n}" for n in lowered)


def site_quantities(at: str, values: Mapping[str, float]) -> dict[str, float]:
    """Return the quantities that defaults are multiples of at a location.

    Keys are k, c, z, v, w, F, m, h, r; those that the vehicle does not have are absent.
    """
    get = values.get
    if at == "rig" and "vehicle.rig.mass" not in values:
        return {}  # a component: its nominal spring and damper do not bound the laws that it may have
    stiffness, damping = _stiffness_and_damping(at, values)
    known = {
        "k": stiffness,
        "c": damping,
        "m": get("vehicle.rig.mass") if at == "rig" else get("vehicle.frame.mass"),
        "h": get("contact.flange_clearance"),
        "r": get("vehicle.geometry.rolling_radius") or get("site.rolling_radius"),
    }
    if at != "rig":
        # without a damper: the one with the spring's force at 10 rad/s
        known["c"] = damping or (stiffness / REFERENCE_MOTION["w"] if stiffness else None)
        known |= REFERENCE_MOTION | {"F": stiffness * REFERENCE_MOTION["z"] if stiffness else None}
    return {name: value for name, value in known.items() if value}


def _stiffness_and_damping(at: str, values: Mapping[str, float]) -> tuple[float | None, float | None]:
    get = values.get
    if at != "rig" and "vehicle.frame.mass" not in values:  # multibody: from `Design.values_with_sites`
        return get(f"site.{at}.stiffness"), get(f"site.{at}.damping")
    half_base = get("vehicle.geometry.half_spring_base", 0.0)
    lateral = 2 * get("vehicle.primary.lateral_stiffness", 0.0)
    yaw = 2 * half_base * half_base * get("vehicle.primary.longitudinal_stiffness", 0.0)
    springs: dict[str, tuple[float | None, float | None]] = {
        "secondary_lateral": (get("vehicle.secondary.lateral_stiffness"), get("vehicle.secondary.lateral_damping")),
        "secondary_yaw": (get("vehicle.secondary.yaw_stiffness"), get("vehicle.secondary.yaw_damping")),
        "primary_lateral": (lateral, 0.0),
        "primary_yaw": (yaw, 0.0),
        "rig": (get("vehicle.rig.stiffness"), get("vehicle.rig.damping")),
    }
    return springs.get(at, (None, None))


def evaluate_product(word: str, numbers: Mapping[str, float]) -> float | None:
    """Return the value of a product such as "k/z^2"; None if a factor is absent.

    >>> evaluate_product("k/z^2", {"k": 4.0, "z": 2.0}), evaluate_product("F", {})
    (1.0, None)
    """
    value = 1.0
    for sign, name, power in FACTOR.findall(word):
        factor = 1.0 if name == "1" else numbers.get(name)
        if factor is None:
            return None
        value *= factor ** (int(power or 1) * (-1 if sign == "/" else 1))
    return value


def default_at(parameter: Record, at: str, values: Mapping[str, float]) -> float | None:
    """Return the default of a parameter at a location of a vehicle; None if it has none."""
    scale = evaluate_product(str(parameter.get("times", "1")), site_quantities(at, values))
    given = parameter.get("default")
    return None if given is None or scale is None else float(given) * scale


def range_at(parameter: Record, at: str, values: Mapping[str, float]) -> tuple[float, float]:
    """Return the range of a parameter at a location of a vehicle, infinite if it has none."""
    scale = evaluate_product(str(parameter.get("times", "1")), site_quantities(at, values))
    low, high = parameter.get("minimum"), parameter.get("maximum")
    ends = -math.inf if low is None else float(low), math.inf if high is None else float(high)
    if scale is None:
        return (0.0 if ends[0] >= 0 else -math.inf), math.inf
    return ends[0] * scale, ends[1] * scale


def has_absolute_range(parameter: Record) -> bool:
    """True if the range depends on geometry at most, so that it limits the values in a file."""
    return str(parameter.get("times", "1")) in ("1", "h", "r")


def parameter_unit(parameter: Record, at: str, against: str | None = None) -> str:
    """Return the unit of a parameter at a location; the motion of a curve has the unit of its abscissa."""
    word = str(parameter["unit"])
    if against in ("v", "s") and parameter["key"] == "motion":
        word = "v" if against == "v" else "m"
    return unit_at(word, at)


def effect_parameter(
    effect: PlacedEffect, key: str, path: str, catalogue: Catalogue, values: Mapping[str, float]
) -> Parameter | None:
    """Return the parameter record of a number of an effect; None if it has no such number.

    Parameters
    ----------
    effect : PlacedEffect
    key, path : str
        Key of the number in the catalogue, and its path in the design.
    catalogue : sequence of records
    values : mapping
        Numbers of the vehicle, on which the range depends.
    """
    record = record_of(effect.kind, catalogue) or {}
    parameter = next((p for p in record.get("parameters", ()) if p["key"] == key), None)
    if parameter is None:
        return None
    low, high = range_at(parameter, effect.at, values)
    return Parameter(
        path,
        str(parameter["symbol"]),
        parameter_unit(parameter, effect.at, effect.against),
        f"{key.replace('_', ' ')} of the {record['title']}",
        origin=str(parameter.get("origin", "")),
        minimum=low,
        maximum=high,
        usual_range=(low, high),
    )
