"""Axes of a plot: linear and logarithmic scales, ticks at round values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MIN_TICKS = 3
MAX_DECADES = 6  # of a logarithmic axis without a lower end


@dataclass(frozen=True)
class Axis:
    """Axis of a plot: name, unit (may be empty), ends (None: from the data).

    With categories, their names stand at 0, 1, 2 ... in place of numbers.
    """

    name: str
    unit: str = ""
    log: bool = False
    low: float | None = None
    high: float | None = None
    categories: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Scale:
    """Mapping of the values of an axis to 0 .. 1."""

    low: float
    high: float
    log: bool = False

    def position(self, values: FloatArray | float) -> FloatArray:
        """Return the positions of values, 0 at the lower end; NaN for values without a logarithm."""
        x = np.asarray(values, dtype=float)
        if not self.log:
            return np.asarray((x - self.low) / (self.high - self.low))
        with np.errstate(divide="ignore", invalid="ignore"):
            y = (np.log10(x) - math.log10(self.low)) / (math.log10(self.high) - math.log10(self.low))
        return np.where(x > 0, y, np.nan)

    def value(self, position: float) -> float:
        """Return the value at a position."""
        if not self.log:
            return self.low + position * (self.high - self.low)
        return float(10 ** (math.log10(self.low) + position * (math.log10(self.high) - math.log10(self.low))))

    def zoomed(self, begin: float, end: float) -> Scale:
        """Return the part of the scale between two positions."""
        return Scale(self.value(begin), self.value(end), self.log)


def scale_of(axis: Axis, data: Sequence[FloatArray], *, margin: float) -> Scale:
    """Return the scale of an axis for data, with a relative margin at ends that the axis does not fix."""
    values = np.concatenate([np.ravel(d) for d in data]) if data else np.zeros(0)
    values = values[np.isfinite(values) & ((values > 0) if axis.log else True)]
    low, high = (float(values.min()), float(values.max())) if len(values) else ((0.1, 1.0) if axis.log else (0.0, 1.0))
    if axis.log:
        high = axis.high if axis.high is not None else high * 10**margin
        low = axis.low if axis.low is not None else max(low, high * 10**-MAX_DECADES)
        return Scale(low, high if high > low else 10 * low, True)
    extra = margin * (high - low)
    low = axis.low if axis.low is not None else low - extra
    high = axis.high if axis.high is not None else high + extra
    if not high > low:
        spread = abs(low) * 0.1 or 1.0
        low, high = low - spread, high + spread
    return Scale(low, high)


def ticks(scale: Scale, max_count: int) -> list[tuple[float, str]]:
    """Return about `max_count` round values of a scale with their texts.

    >>> ticks(Scale(0.0, 10.0), 3)
    [(0.0, '0'), (5.0, '5'), (10.0, '10')]
    >>> [text for _, text in ticks(Scale(0.5, 2000.0, True), 4)]
    ['1', '10', '100', '1000']
    """
    max_count = max(max_count, 2)
    return _logarithmic_ticks(scale, max_count) if scale.log else _linear_ticks(scale, max_count)


def _linear_ticks(scale: Scale, max_count: int) -> list[tuple[float, str]]:
    span = scale.high - scale.low
    raw = span / max_count
    base = 10.0 ** math.floor(math.log10(raw)) if raw > 0 else 1.0
    steps = [s * base for s in (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)]
    at = next(i for i, s in enumerate(steps) if s >= raw * (1 - 1e-9))
    values = _multiples(scale, steps[at])
    if len(values) < MIN_TICKS:  # few round values may lie in the range
        at -= 1
        values = _multiples(scale, steps[at])
    step = steps[at]
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    large = max(abs(scale.low), abs(scale.high))
    plain = digits <= 5 and large < 1e5
    # as many digits as distinguish neighbours
    significant = max(3, 1 + math.floor(math.log10(large)) - math.floor(math.log10(step) + 1e-9))
    return [(v, f"{v:.{digits}f}" if plain else f"{v:.{significant}g}") for v in values]


def _multiples(scale: Scale, step: float) -> list[float]:
    first, last = math.ceil(scale.low / step - 1e-9), math.floor(scale.high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def _logarithmic_ticks(scale: Scale, max_count: int) -> list[tuple[float, str]]:
    low, high = math.log10(scale.low), math.log10(scale.high)
    values = [m * 10.0**k for k in range(math.floor(low), math.ceil(high) + 1) for m in (1, 2, 5)]
    values = [v for v in values if scale.low * (1 - 1e-9) <= v <= scale.high * (1 + 1e-9)]
    if len(values) <= max_count:
        return [(v, log_tick_text(v)) for v in values]
    exponents = range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)
    every = max(1, math.ceil(len(exponents) / max_count))
    return [(10.0**k, log_tick_text(10.0**k)) for k in exponents if k % every == 0 or len(exponents) == 1]


def log_tick_text(value: float) -> str:
    """Return the text of a value on a logarithmic axis.

    >>> log_tick_text(0.1), log_tick_text(1e-5), log_tick_text(200.0)
    ('0.1', '10⁻⁵', '200')
    """
    power = round(math.log10(value), 6)
    if -3 <= power <= 4:
        return f"{value:.4g}"
    whole = math.floor(power)
    lead = round(value / 10**whole)
    return ("" if lead == 1 else f"{lead}·") + "10" + str(whole).translate(SUPERSCRIPTS)
