"""The axes of a plot: ranges, ticks at round numbers, linear or in decades, values with their units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
FEWEST = 3  # ticks of an axis
MOST_DECADES = 6  # of a logarithmic axis that names no lower end


@dataclass(frozen=True)
class Axis:
    """What runs along an axis: its name, its unit ("" where there is none), its ends (None: from the data)."""

    name: str
    unit: str = ""
    log: bool = False
    low: float | None = None
    high: float | None = None

    @property
    def label(self) -> str:
        """The name with its unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Scale:
    """Values of an axis laid on 0 .. 1."""

    low: float
    high: float
    log: bool = False

    def place(self, values: FloatArray | float) -> FloatArray:
        """Where values lie, 0 at the low end; NaN where a logarithm has none."""
        x = np.asarray(values, dtype=float)
        if not self.log:
            return np.asarray((x - self.low) / (self.high - self.low))
        with np.errstate(divide="ignore", invalid="ignore"):
            y = (np.log10(x) - math.log10(self.low)) / (math.log10(self.high) - math.log10(self.low))
        return np.where(x > 0, y, np.nan)

    def value(self, place: float) -> float:
        """The value at a place."""
        if not self.log:
            return self.low + place * (self.high - self.low)
        return float(10 ** (math.log10(self.low) + place * (math.log10(self.high) - math.log10(self.low))))

    def part(self, begin: float, end: float) -> Scale:
        """The piece of it between two places."""
        return Scale(self.value(begin), self.value(end), self.log)


def scaled(axis: Axis, data: Sequence[FloatArray], *, margin: float) -> Scale:
    """The scale of an axis over data, with a margin (a share of its length) where the axis names no end."""
    values = np.concatenate([np.ravel(d) for d in data]) if data else np.zeros(0)
    values = values[np.isfinite(values) & ((values > 0) if axis.log else True)]
    low, high = (float(values.min()), float(values.max())) if len(values) else ((0.1, 1.0) if axis.log else (0.0, 1.0))
    if axis.log:
        high = axis.high if axis.high is not None else high * 10**margin
        low = axis.low if axis.low is not None else max(low, high * 10**-MOST_DECADES)
        return Scale(low, high if high > low else 10 * low, True)
    extra = margin * (high - low)
    low = axis.low if axis.low is not None else low - extra
    high = axis.high if axis.high is not None else high + extra
    if not high > low:
        spread = abs(low) * 0.1 or 1.0
        low, high = low - spread, high + spread
    return Scale(low, high)


def ticks(scale: Scale, most: int) -> list[tuple[float, str]]:
    """Round values inside a scale with their texts, about so many.

    >>> ticks(Scale(0.0, 10.0), 3)
    [(0.0, '0'), (5.0, '5'), (10.0, '10')]
    >>> [text for _, text in ticks(Scale(0.5, 2000.0, True), 4)]
    ['1', '10', '100', '1000']
    """
    most = max(most, 2)
    return _decades(scale, most) if scale.log else _even(scale, most)


def _even(scale: Scale, most: int) -> list[tuple[float, str]]:
    span = scale.high - scale.low
    raw = span / most
    base = 10.0 ** math.floor(math.log10(raw)) if raw > 0 else 1.0
    steps = [s * base for s in (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)]
    at = next(i for i, s in enumerate(steps) if s >= raw * (1 - 1e-9))
    values = _multiples(scale, steps[at])
    if len(values) < FEWEST:  # an odd range may hold few of the round values
        at -= 1
        values = _multiples(scale, steps[at])
    step = steps[at]
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    large = max(abs(scale.low), abs(scale.high))
    plain = digits <= 5 and large < 1e5
    return [(v, f"{v:.{digits}f}" if plain else f"{v:.3g}") for v in values]


def _multiples(scale: Scale, step: float) -> list[float]:
    first, last = math.ceil(scale.low / step - 1e-9), math.floor(scale.high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def _decades(scale: Scale, most: int) -> list[tuple[float, str]]:
    low, high = math.log10(scale.low), math.log10(scale.high)
    few = [m * 10.0**k for k in range(math.floor(low), math.ceil(high) + 1) for m in (1, 2, 5)]
    few = [v for v in few if scale.low * (1 - 1e-9) <= v <= scale.high * (1 + 1e-9)]
    if len(few) <= most:
        return [(v, decade(v)) for v in few]
    whole = range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)
    every = max(1, math.ceil(len(whole) / most))
    return [(10.0**k, decade(10.0**k)) for k in whole if k % every == 0 or len(whole) == 1]


def decade(value: float) -> str:
    """A value of a logarithmic axis.

    >>> decade(0.1), decade(1e-5), decade(200.0)
    ('0.1', '10⁻⁵', '200')
    """
    power = round(math.log10(value), 6)
    if -3 <= power <= 4:
        return f"{value:.4g}"
    whole = math.floor(power)
    lead = round(value / 10**whole)
    return ("" if lead == 1 else f"{lead}·") + "10" + str(whole).translate(RAISED)
