"""Quantities: conversion of numbers with units to and from SI."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache

# Base labels. Radian and cycle are dimensionless but distinct: 1 Hz is not 1 rad/s.
BASE_LABELS = ("m", "kg", "s", "A", "rad", "cycle")
ANGLE_INDICES = (BASE_LABELS.index("rad"), BASE_LABELS.index("cycle"))
Dimension = tuple[int, ...]

PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "da": 1e1,
            "k": 1e3, "M": 1e6, "G": 1e9}  # fmt: skip

# symbol: factor to SI, powers of the base labels, True if it takes prefixes
SYMBOLS: dict[str, tuple[float, dict[str, int], bool]] = {
    "m": (1.0, {"m": 1}, True),
    "g": (1e-3, {"kg": 1}, True),
    "t": (1e3, {"kg": 1}, False),
    "s": (1.0, {"s": 1}, True),
    "min": (60.0, {"s": 1}, False),
    "h": (3600.0, {"s": 1}, False),
    "A": (1.0, {"A": 1}, True),
    "V": (1.0, {"m": 2, "kg": 1, "s": -3, "A": -1}, True),
    "N": (1.0, {"m": 1, "kg": 1, "s": -2}, True),
    "J": (1.0, {"m": 2, "kg": 1, "s": -2}, True),
    "W": (1.0, {"m": 2, "kg": 1, "s": -3}, True),
    "Pa": (1.0, {"m": -1, "kg": 1, "s": -2}, True),
    "bar": (1e5, {"m": -1, "kg": 1, "s": -2}, True),
    "Hz": (1.0, {"cycle": 1, "s": -1}, True),
    "rev": (1.0, {"cycle": 1}, False),
    "rpm": (1.0 / 60.0, {"cycle": 1, "s": -1}, False),
    "rad": (1.0, {"rad": 1}, True),
    "deg": (math.pi / 180.0, {"rad": 1}, False),
    "°": (math.pi / 180.0, {"rad": 1}, False),
    "%": (1e-2, {}, False),
    "‰": (1e-3, {}, False),
}
RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"
SUPERSCRIPT = re.compile(f"[{RAISED}]+")
PLAIN = str.maketrans(RAISED + "·⋅×", "0123456789-***")
NUMBER = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
TOKEN = re.compile(r"\^\(?[-+]?\d+\)?|[*/()]|1(?![\d.])|[^\W\d_]+|[%‰°]|\S")

MAX_PLAUSIBLE_SPEED = 120.0  # m/s, above the speed of measured trains: km/h are more likely
MAX_SPEED = 170.0  # m/s, above that of any train so far
SMALLEST, LARGEST = 1e-30, 1e30  # SI, beyond every quantity of a vehicle or a track

EXAMPLES = {"m": "7 mm", "m/s": "144 km/h", "s": "2 s", "Hz": "1.2 Hz", "N": "55 kN", "N/m": "3.0 MN/m",
            "N*m/rad": "0.2 MN*m/rad", "N*s/m": "30 kN*s/m", "N*m*s/rad": "30 kN*m*s/rad", "kg": "2900 kg",
            "kg*m^2": "3300 kg*m^2", "rad": "0.3 mrad", "rad/s": "0.3 mrad/s", "m/s^2": "0.05 m/s^2",
            "1": "0.15"}  # fmt: skip


class UnitError(ValueError):
    """Unreadable quantity, with message and remedy."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(f"{message}, {remedy}")
        self.message, self.remedy = message, remedy


@dataclass(frozen=True)
class Unit:
    """Unit: factor to SI and the powers of m, kg, s, A, rad, cycle."""

    text: str
    factor: float
    dimension: Dimension

    def is_compatible(self, other: Unit) -> bool:
        """True for the same dimension; an angle may be omitted, but not replaced by a cycle."""
        plain = all(
            a == b
            for i, (a, b) in enumerate(zip(self.dimension, other.dimension, strict=True))
            if i not in ANGLE_INDICES
        )
        angles = [(self.dimension[i], other.dimension[i]) for i in ANGLE_INDICES]
        left_out = all(a == 0 for a, _ in angles)
        return plain and (left_out or all(a == b for a, b in angles))


def example_quantity(unit: str) -> str:
    """Return an example of a quantity with a unit.

    >>> example_quantity("N*s/m")
    '30 kN*s/m'
    """
    return EXAMPLES.get(unit, f"2.5 {unit}" if unit != "1" else "0.15")


class _UnitParser:
    """Recursive-descent parser of products, quotients, powers and brackets."""

    def __init__(self, text: str) -> None:
        self.text = text
        plain = SUPERSCRIPT.sub(lambda match: f"^{match[0]}", text).replace("**", "^").translate(PLAIN)
        self.tokens = TOKEN.findall(plain)
        self.factor, self.powers = 1.0, dict.fromkeys(BASE_LABELS, 0)

    def parse(self) -> Unit:
        self.read_product(1)
        if self.tokens:
            raise self.error()
        return Unit(self.text, self.factor, tuple(self.powers[name] for name in BASE_LABELS))

    def read_product(self, sign: int) -> None:
        self.read_factor(-sign if self.take("/") else sign)
        while self.tokens and self.tokens[0] != ")":
            over = self.take("/")
            if not over:
                self.take("*")
            self.read_factor(-sign if over else sign)

    def read_factor(self, sign: int) -> None:
        if self.take("("):
            self.read_product(sign)
            if not self.take(")"):
                raise self.error("lacks a closing bracket")
        elif not self.take("1"):
            if not self.tokens or not re.match(r"[^\W\d_]|[%‰°]", self.tokens[0]):
                raise self.error()
            factor, powers = parse_symbol(self.tokens.pop(0))
            power = sign * self.read_power()
            self.factor *= factor**power
            for name, p in powers.items():
                self.powers[name] += p * power

    def read_power(self) -> int:
        if not self.tokens or not self.tokens[0].startswith("^") or self.tokens[0] == "^":
            return 1
        power = int(self.tokens.pop(0).strip("^()"))
        if abs(power) > 9:
            raise self.error("has a power beyond 9")
        return power

    def take(self, token: str) -> bool:
        is_next = bool(self.tokens) and self.tokens[0] == token
        if is_next:
            self.tokens.pop(0)
        return is_next

    def error(self, what: str = "") -> UnitError:
        where = f"cannot be read at {self.tokens[0]!r}" if self.tokens else "ends too early"
        return UnitError(f"the unit {self.text!r} {what or where}", "write units like kN*s/m, m/s^2, 1/m")


def parse_symbol(symbol: str) -> tuple[float, dict[str, int]]:
    """Return factor and powers of a symbol with its prefix; UnitError if it is unknown."""
    if symbol in SYMBOLS:
        factor, powers, _ = SYMBOLS[symbol]
        return factor, powers
    for prefix, scale in PREFIXES.items():
        bare = symbol.removeprefix(prefix)
        if bare != symbol and bare in SYMBOLS and SYMBOLS[bare][2]:
            factor, powers, _ = SYMBOLS[bare]
            return (1.0 if symbol == "kg" else scale * factor), powers
    raise UnitError(f"unknown unit {symbol!r}", f"known are {', '.join(SYMBOLS)} with prefixes n u m c d da k M G")


@lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Parse a unit; UnitError if it cannot be read.

    >>> parse_unit("kN*s/m").factor
    1000.0
    >>> parse_unit("m/s^2").dimension
    (1, 0, -2, 0, 0, 0)
    """
    if len(text) > 60:
        raise UnitError(f"the unit {text[:20]!r}... is {len(text)} characters long", "write units like kN*s/m")
    return _UnitParser(text).parse()


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


def quantity(value: object, unit: str) -> float:
    """Return a value in SI: a number as it is, a string converted; UnitError if its dimension is not `unit`'s.

    >>> quantity("7 mm", "m"), quantity("144 km/h", "m/s"), quantity(0.15, "1")
    (0.007, 40.0, 0.15)
    """
    number, text = _number_and_unit(value, unit)
    if text:
        given, wanted = _parse_unit_of(value, text, unit), parse_unit(unit)
        if not given.is_compatible(wanted):
            raise UnitError(
                f"{value!r} has the unit {text}, {_expected_unit(unit)} is expected",
                f"write for example {example_quantity(unit)!r}",
            )
        # rounded once: 7 mm is exactly 0.007
        number = _scale(number, given.factor)
    _check_size(value, number, unit)
    return number


def _check_size(value: object, number: float, unit: str) -> None:
    """Raise UnitError for a number that is not finite, or beyond every physical range."""
    if not math.isfinite(number):
        raise UnitError(f"{value!r} is not finite", f"write for example {example_quantity(unit)!r}")
    if number and not SMALLEST <= abs(number) <= LARGEST:
        extent = f"not between {SMALLEST:g} and {LARGEST:g} in SI"
        raise UnitError(f"{value!r} is {extent}", f"write for example {example_quantity(unit)!r}")


def quantity_in_any_unit(value: object) -> float:
    """Return a value with any unit in SI; a number as it is (rigs have units of their own).

    >>> quantity_in_any_unit("95 kg"), quantity_in_any_unit(3)
    (95.0, 3.0)
    """
    number, text = _number_and_unit(value, "1")
    number = _scale(number, parse_unit(text).factor) if text else number
    _check_size(value, number, "1")
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
    a, b = parse_unit(source), parse_unit(target)
    if not (a.is_compatible(b) or b.is_compatible(a)):
        raise UnitError(f"{source} is not {target}", f"{_expected_unit(target)} is expected")
    return _scale(value, a.factor / b.factor)


def _number_and_unit(value: object, unit: str) -> tuple[float, str]:
    if isinstance(value, str):
        return split_quantity(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UnitError(f"{_describe(value)} is not a quantity", f"write for example {example_quantity(unit)!r}")
    return float(value), ""


def _describe(value: object) -> str:
    names = {dict: "a group of keys", list: "a list", type(None): "nothing"}
    return names.get(type(value), str(value).lower())


def _parse_unit_of(value: object, text: str, unit: str) -> Unit:
    try:
        return parse_unit(text)
    except UnitError as error:
        raise UnitError(f"{value!r}: {error.message}", f"write for example {example_quantity(unit)!r}") from None


def _expected_unit(unit: str) -> str:
    return "a number without unit" if unit == "1" else f"a unit like {unit}"


def _scale(number: float, factor: float) -> float:
    inverse = 1.0 / factor
    if factor < 1.0 and inverse == round(inverse):
        return number / inverse
    if factor < 1.0 and abs(inverse - round(inverse)) < 1e-9 * inverse:
        return number / round(inverse)
    return number * factor
