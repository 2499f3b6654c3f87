"""Numbers in reports: significant digits, decimals that fit a standard deviation, units of a readable size."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from railui.io.number_format import scale_to_prefix, typeset_unit

DASH = "–"
CONFIDENCE_FACTOR = 1.96  # standard deviations of a 95 % interval of a normal distribution
MILLIMETRE_RANGE = (1e-4, 0.1)  # m or m/s: lengths of this range are usually stated in mm
METRE_LIMIT = 10.0  # m or m/s


def format_number(value: float | None, digits: int = 3) -> str:
    """Return a number with significant digits, without an exponent between 0.00001 and a million.

    >>> format_number(0.05383), format_number(611939), format_number(2.5e7), format_number(None)
    ('0.0538', '612000', '2.50·10⁷', '–')
    """
    if value is None or not math.isfinite(value):
        return DASH
    if value == 0:
        return "0"
    order = math.floor(math.log10(abs(value)))
    if -5 < order < 6:
        return f"{round(value, digits - 1 - order):.{max(0, digits - 1 - order)}f}".replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·{_power_of_ten(int(exponent))}".replace("-", "−")


def digits_apart(values: Iterable[float | None], least: int = 3, most: int = 6) -> int:
    """Return the significant digits, between bounds, with which different values look different.

    >>> digits_apart([0.15189, 0.15234, 0.1612]), digits_apart([1.0, 2.0]), digits_apart([1.0, 1.0 + 1e-12])
    (4, 3, 6)
    """
    different = {value for value in values if value is not None and math.isfinite(value)}
    enough = (n for n in range(least, most) if len({format_number(v, n) for v in different}) == len(different))
    return next(enough, most)


def _power_of_ten(exponent: int) -> str:
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def format_with_sd(value: float | None, sd: float | None) -> str:
    """Return a value and its standard deviation of two digits, both with the same decimals.

    >>> format_with_sd(2.69562, 0.00487), format_with_sd(4.5e10, 2.2e8), format_with_sd(0.2, None)
    ('2.6956 ± 0.0049', '(4.500 ± 0.022)·10¹⁰', '0.200')
    """
    if value is None or not sd or not math.isfinite(sd):
        return format_number(value)
    order = math.floor(math.log10(max(abs(value), sd)))
    if not -5 < order < 6:
        return f"({format_with_sd(value / 10.0**order, sd / 10.0**order)})·{_power_of_ten(order)}"
    decimals = max(0, 1 - math.floor(math.log10(sd)))
    return f"{value:.{decimals}f} ± {sd:.{decimals}f}".replace("-", "−")


def format_percent_change(percent: float, decimals: int) -> str:
    """Return a change in per cent.

    >>> format_percent_change(-12.34, 1), format_percent_change(-0.01, 0)
    ('−12.3 %', '0 %')
    """
    text = f"{percent:+.{decimals}f}".replace("-", "−")
    return "0 %" if not text.strip("+−0.") else f"{text} %"


def readable_scale(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor and the unit that bring SI values to a readable size; the unit in plain ASCII where it is.

    >>> readable_scale(4.4e-4, "m"), readable_scale([2e3, 3e6], "N/m")
    ((1000.0, 'mm'), (1e-06, 'MN/m'))
    """
    given = np.abs(np.asarray([v for v in np.ravel(values) if v is not None], dtype=float))
    largest = float(given[np.isfinite(given)].max(initial=0.0))
    if largest == 0:
        return 1.0, unit
    low, high = MILLIMETRE_RANGE
    if unit in ("m", "m/s") and low <= largest < METRE_LIMIT:
        return (1e3, "mm" + unit[1:]) if largest < high else (1.0, unit)
    number, name = scale_to_prefix(largest, unit)
    return number / largest, name


def display_scale(values: Any, unit: str) -> tuple[float, str]:
    """Return the factor that brings SI values to a readable size, and the unit as it is printed."""
    factor, name = readable_scale(values, unit)
    return factor, typeset_unit(name)


def quantity_cells(value: float, sd: float | None, unit: str, sd_digits: int = 2) -> tuple[str, str]:
    """Return a value and its standard deviation in one unit, rounded to the digits of the latter; "-" for no sd.

    >>> quantity_cells(4.4514e-4, 2.6e-6, "m"), quantity_cells(0.0452, None, "rad")
    (('0.4451 mm', '0.0026 mm'), ('45.2 mrad', '-'))
    """
    factor, name = readable_scale(value, unit)
    suffix = "" if name in ("1", "") else f" {name}"
    if not sd or not math.isfinite(sd):
        return f"{factor * value:.4g}{suffix}", "-"
    rounded, rounded_sd = _round_to_sd(factor * value, factor * sd, sd_digits)
    return f"{rounded}{suffix}", f"{rounded_sd}{suffix}"


def quantity_with_sd(value: float, sd: float | None, unit: str) -> str:
    """Return a value with its standard deviation to one digit and its unit, in ASCII.

    >>> quantity_with_sd(4.4514e-4, 2.6e-6, "m"), quantity_with_sd(0.35, 0.021, "1"), quantity_with_sd(2e6, None, "N/m")
    ('0.445 +/- 0.003 mm', '0.35 +/- 0.02', '2 MN/m')
    """
    factor, name = readable_scale(value, unit)
    suffix = "" if name in ("1", "") else f" {name}"
    if not sd or not math.isfinite(sd):
        return f"{factor * value:.4g}{suffix}"
    return " +/- ".join(_round_to_sd(factor * value, factor * sd, 1)) + suffix


def _round_to_sd(value: float, sd: float, digits: int) -> tuple[str, str]:
    places = digits - 1 - math.floor(math.log10(sd))
    decimals = max(0, places)
    return f"{round(value, places):.{decimals}f}", f"{round(sd, places):.{decimals}f}"
