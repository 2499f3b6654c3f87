"""Formatting of values with SI prefixes, for reports and screens."""

from __future__ import annotations

import math

from railui.io.units import parse_unit

STEPS = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
# usual prefixes of units that may take one as the first factor of a product
PREFIXED = {
    "N": "GMk",
    "Pa": "GMk",
    "J": "Mk",
    "W": "Mk",
    "V": "kmµ",
    "A": "mµ",
    "Hz": "k",
    "rad": "mµ",
    "m": "kmµ",
}
ALONE = ("m",)
LONG = 1e6  # from here on a power of ten is easier to read


def scale_to_prefix(value: float, unit: str) -> tuple[float, str]:
    """Scale a value to 1 .. 1000; return it and its unit with the prefix.

    >>> scale_to_prefix(3.0e6, "N/m")
    (3.0, 'MN/m')
    >>> scale_to_prefix(14400.0, "s")
    (4.0, 'h')
    """
    if unit == "s":
        return _scale_time(value)
    first = next(
        (symbol for symbol in PREFIXED if unit == symbol or unit.startswith((f"{symbol}*", f"{symbol}/"))),
        None,
    )
    if first is None or (first in ALONE and unit != first) or value == 0 or not math.isfinite(value):
        return value, unit
    usual = [(step, prefix) for step, prefix in STEPS if prefix == "" or prefix in PREFIXED[first]]
    prefix = next((p for step, p in usual if abs(value) >= step), usual[-1][1])
    return _divide_by_unit(value, prefix + first), prefix + unit


def format_quantity(value: float, unit: str, digits: int = 4) -> str:
    """Format a value with a suitable prefix.

    >>> format_quantity(0.007, "m"), format_quantity(30e3, "N*s/m"), format_quantity(0.15, "1")
    ('7 mm', '30 kN*s/m', '0.15')
    >>> format_quantity(14500.0, "kg")
    '14500 kg'
    """
    number, name = scale_to_prefix(value, unit)
    text = f"{number:.{digits}g}"
    if "e" in text and 1 <= abs(number) < LONG:
        text = f"{float(text):.0f}"
    return text if name in ("1", "") else f"{text} {name}"


def typeset(text: str) -> str:
    """Typeset a quantity with middle dots and superscripts.

    >>> typeset("30 kN*m*s/rad"), typeset("3300 kg*m^2")
    ('30 kN·m·s/rad', '3300 kg·m²')
    """
    return text.replace("*", "·").replace("^2", "²").replace("^3", "³")


def typeset_unit(unit: str) -> str:
    """Typeset a unit; a pure number has none.

    >>> typeset_unit("kN*s^2/m^2"), typeset_unit("1")
    ('kN·s²/m²', '')
    """
    return "" if unit == "1" else typeset(unit)


def _scale_time(value: float) -> tuple[float, str]:
    if abs(value) >= 3600:
        return value / 3600, "h"
    return (value, "s") if abs(value) >= 1 or value == 0 else (value * 1e3, "ms")


def _divide_by_unit(value: float, unit: str) -> float:
    factor = parse_unit(unit).factor
    return value / factor if factor >= 1 else value * round(1 / factor)
