"""Quantities: conversion of numbers with units to and from SI."""

from __future__ import annotations

import math
import re

from railui.io.unit_parser import Unit, UnitError, parse_unit

__all__ = [
    "UnitError",
    "convert",
    "example_quantity",
    "parse_unit",
    "parse_unit_like",
    "quantity",
    "quantity_in_any_unit",
    "read_speed",
    "split_quantity",
]
NUMBER = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
MAX_PLAUSIBLE_SPEED = 120.0  # m/s, above the speed of measured trains: km/h are more likely
MAX_SPEED = 170.0  # m/s, above that of any train so far
STANDARD_GRAVITY = 9.80665  # m/s^2
UNITS_OF_GRAVITY = {"g": STANDARD_GRAVITY, "gn": STANDARD_GRAVITY, "G": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY}
SMALLEST, LARGEST = 1e-30, 1e30  # SI, beyond every quantity of a vehicle or a track

EXAMPLES = {"m": "7 mm", "m/s": "144 km/h", "s": "2 s", "Hz": "1.2 Hz", "N": "55 kN", "N/m": "3.0 MN/m",
            "N*m/rad": "0.2 MN*m/rad", "N*s/m": "30 kN*s/m", "N*m*s/rad": "30 kN*m*s/rad", "kg": "2900 kg",
            "kg*m^2": "3300 kg*m^2", "rad": "0.3 mrad", "rad/s": "0.3 mrad/s", "m/s^2": "0.05 m/s^2",
            "1": "0.15"}  # fmt: skip


def example_quantity(unit: str) -> str:
    """Return an example of a quantity with a unit.

    >>> example_quantity("N*s/m")
    '30 kN*s/m'
    """
    return EXAMPLES.get(unit, f"2.5 {unit}" if unit != "1" else "0.15")


def split_quantity(text: str) -> tuple[float, str]:
    """Split a text into number and unit.

    >>> split_quantity("30 kN*s/m")
    (30.0, 'kN*s/m')
    """
    match = NUMBER.match(text.strip())
    if match is None:
        raise UnitError(f"{text!r} is not a quantity", "write a number, or a number and its unit such as '7 mm'")
    unit = text.strip()[match.end() :].strip()
    if re.match(r",\d", unit):
        raise UnitError(f"{text!r} has a decimal comma", f"write {_with_decimal_point(text)!r}")
    return float(match[0]), unit


def _with_decimal_point(text: str) -> str:
    """Replace a decimal comma by a point and remove points between thousands.

    >>> _with_decimal_point("0,15 mm"), _with_decimal_point("55.000,5 N")
    ('0.15 mm', '55000.5 N')
    """
    whole, _, decimals = text.strip().partition(",")
    return f"{whole.replace('.', '')}.{decimals}"


def parse_unit_like(text: str, wanted: str) -> Unit:
    """Parse a unit where one like `wanted` is expected: for an acceleration, g is that of gravity, not the gram.

    >>> parse_unit_like("g", "m/s^2").factor, parse_unit_like("g", "kg").factor
    (9.80665, 0.001)
    """
    acceleration = parse_unit("m/s^2")
    if text in UNITS_OF_GRAVITY and parse_unit(wanted).dimension == acceleration.dimension:
        return Unit(text, UNITS_OF_GRAVITY[text], acceleration.dimension)
    return parse_unit(text)


def quantity(value: object, unit: str, example: str = "") -> float:
    """Return a value in SI: a number as it is, a string converted; UnitError if its dimension is not `unit`'s.

    example: quantity for the remedy; by default one of the unit.

    >>> quantity("7 mm", "m"), quantity("144 km/h", "m/s"), quantity(0.15, "1")
    (0.007, 40.0, 0.15)
    """
    remedy = f"write for example {example or example_quantity(unit)!r}"
    number, text = _number_and_unit(value, remedy)
    if text:
        given, wanted = _parse_unit_of(value, text, unit, remedy), parse_unit(unit)
        if not given.is_compatible(wanted):
            raise UnitError(f"{value!r} has the unit {text}, {_expected_unit(unit)} is expected", remedy)
        # rounded once: 7 mm is exactly 0.007
        number = _scale(number, given.factor)
    _check_size(value, number, remedy)
    return number


def _check_size(value: object, number: float, remedy: str) -> None:
    """Raise UnitError for a number that is not finite, or beyond every physical range."""
    if not math.isfinite(number):
        raise UnitError(f"{value!r} is not finite", remedy)
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise UnitError(f"{value!r} is not between {SMALLEST:g} and {LARGEST:g} in SI", remedy)


def quantity_in_any_unit(value: object) -> float:
    """Return a value with any unit in SI; a number as it is (rigs have units of their own).

    >>> quantity_in_any_unit("95 kg"), quantity_in_any_unit(3)
    (95.0, 3.0)
    """
    remedy = f"write for example {example_quantity('1')!r}"
    number, text = _number_and_unit(value, remedy)
    number = _scale(number, parse_unit(text).factor) if text else number
    _check_size(value, number, remedy)
    return number


def read_speed(value: object) -> float:
    """Return a speed [m/s]; reject one above 170 m/s, and a number above 120 without a unit, which may be in km/h.

    >>> read_speed("144 km/h"), read_speed(40)
    (40.0, 40.0)
    """
    speed = quantity(value, "m/s")
    is_bare = not isinstance(value, str) or not split_quantity(value)[1]
    if is_bare and speed > MAX_PLAUSIBLE_SPEED:
        remedy = f"is it in km/h? write {value} km/h" if speed <= 3.6 * MAX_SPEED else f"give up to {MAX_SPEED:g} m/s"
        raise UnitError(f"{value} m/s is faster than any train", remedy)
    if speed > MAX_SPEED:
        raise UnitError(f"{value} is faster than any train", f"give up to {MAX_SPEED:g} m/s")
    if speed <= 0:
        raise UnitError(f"{value!r} is not a speed", "give more than 0 m/s")
    return speed


def convert(value: float, source: str, target: str) -> float:
    """Convert a value from one unit to another of the same dimension.

    >>> convert(40.0, "m/s", "km/h")
    144.0
    """
    a, b = parse_unit_like(source, target), parse_unit_like(target, source)
    if not (a.is_compatible(b) or b.is_compatible(a)):
        raise UnitError(f"{source} is not {target}", f"{_expected_unit(target)} is expected")
    return _scale(value, a.factor / b.factor)


def _number_and_unit(value: object, remedy: str) -> tuple[float, str]:
    if isinstance(value, str):
        return split_quantity(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UnitError(f"{_describe(value)} is not a quantity", remedy)
    return float(value), ""


def _describe(value: object) -> str:
    names = {dict: "a group of keys", list: "a list", type(None): "nothing"}
    return names.get(type(value), str(value).lower())


def _parse_unit_of(value: object, text: str, unit: str, remedy: str) -> Unit:
    try:
        return parse_unit_like(text, unit)
    except UnitError as error:
        raise UnitError(f"{value!r}: {error.message}", remedy) from None


def _expected_unit(unit: str) -> str:
    return "a number without unit" if unit == "1" else f"a unit like {unit}"


def _scale(number: float, factor: float) -> float:
    inverse = 1.0 / factor
    if factor < 1.0 and inverse == round(inverse):
        return number / inverse
    if factor < 1.0 and abs(inverse - round(inverse)) < 1e-9 * inverse:
        return number / round(inverse)
    return number * factor
