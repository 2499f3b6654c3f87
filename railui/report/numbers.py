"""Numbers as one writes them: so many digits, the decimals that a standard deviation leaves, no number as a dash."""

from __future__ import annotations

import math

DASH = "–"


def number(value: float | None, digits: int = 3) -> str:
    """A number as one writes it: so many digits, no exponent between 0.0001 and a million.

    >>> number(0.05383), number(611939), number(2.5e7), number(None)
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
    return f"{mantissa}·{_power(int(exponent))}".replace("-", "−")


def _power(exponent: int) -> str:
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def with_sd(value: float | None, sd: float | None) -> str:
    """A value to the decimals that its standard deviation leaves, which has two digits.

    >>> with_sd(2.69562, 0.00487), with_sd(4.5e10, 2.2e8), with_sd(0.2, None)
    ('2.6956 ± 0.0049', '(4.500 ± 0.022)·10¹⁰', '0.200')
    """
    if value is None or not sd or not math.isfinite(sd):
        return number(value)
    order = math.floor(math.log10(max(abs(value), sd)))
    if not -5 < order < 6:
        return f"({with_sd(value / 10.0**order, sd / 10.0**order)})·{_power(order)}"
    decimals = max(0, 1 - math.floor(math.log10(sd)))
    return f"{value:.{decimals}f} ± {sd:.{decimals}f}".replace("-", "−")


def signed(percent: float, decimals: int) -> str:
    """A deviation in per cent.

    >>> signed(-12.34, 1), signed(-0.01, 0)
    ('−12.3 %', '0 %')
    """
    text = f"{percent:+.{decimals}f}".replace("-", "−")
    return "0 %" if not text.strip("+−0.") else f"{text} %"
