"""Rows of a form: headings, fields, and the text of their values."""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import Final

from railui.io.number_format import format_quantity, typeset
from railui.vehicle.parameter import Parameter

LOG_SCALE_RATIO: Final = 10.0  # ratio of the ends of a range from which a slider is logarithmic
UNBOUNDED: Final = 1e15  # ends of a range at least this large count as infinite
GREEK_LETTERS = {"lambda": "λ", "kappa": "κ", "epsilon": "ε", "delta": "δ", "sigma": "σ", "psi": "ψ", "phi": "φ"}
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True)
class Heading:
    """Heading between the fields of a form."""

    text: str


@dataclass(frozen=True)
class Field:
    """Row of a form with a number, a text, or one of `choices`. A value of None: not given and without default."""

    path: str
    symbol: str
    caption: str
    unit: str
    value: float | str | bool | None
    low: float = 0.0
    high: float = 1.0
    is_changed: bool = False
    source: str = ""
    choices: tuple[str | bool, ...] = ()
    title: str = ""

    @property
    def name(self) -> str:
        """Name at the beginning of the row."""
        return self.title or self.path.rpartition(".")[2].replace("_", " ")

    @property
    def group(self) -> str:
        """Group of the parameter: its path without the last part."""
        return self.path.rpartition(".")[0]

    @property
    def is_logarithmic(self) -> bool:
        """True if the slider has a logarithmic scale."""
        return self.low > 0 and self.high >= LOG_SCALE_RATIO * self.low

    def position(self, value: float) -> float:
        """Return the position of a value on the slider, 0 to 1."""
        if not self.high > self.low:
            return 0.0
        if self.is_logarithmic:
            return min(1.0, max(0.0, log(max(value, self.low) / self.low) / log(self.high / self.low)))
        return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))

    def value_at(self, position: float) -> float:
        """Return the value at a position of the slider, rounded to three digits."""
        position = min(1.0, max(0.0, position))
        if self.is_logarithmic:
            value = self.low * (self.high / self.low) ** position
        else:
            value = self.low + position * (self.high - self.low)
        return float(f"{value:.3g}")


def slider_range(p: Parameter, values: tuple[float | str | bool | None, ...]) -> tuple[float, float]:
    """Return the range of a slider: that of real vehicles, extended to the given values."""
    low, high = p.usual_range
    numbers = [float(v) for v in values if isinstance(v, int | float)]
    if not abs(low) < UNBOUNDED:
        low = min([0.0, *numbers])
    if not abs(high) < UNBOUNDED:
        high = max([1.0, *(10 * abs(v) for v in numbers)])
    low, high = min([low, *numbers]), max([high, *numbers])
    return max(low, p.minimum), min(high, p.maximum) if p.maximum < UNBOUNDED else high


def symbol_text(text: str) -> str:
    """Return a symbol with Greek letters and subscripts.

    >>> symbol_text("kappa_x_1"), symbol_text("c_spsi"), symbol_text("I_zb")
    ('κ_x₁', 'c_sψ', 'I_zb')
    """
    for name, letter in GREEK_LETTERS.items():
        text = text.replace(name, letter)
    for digit in "0123456789":
        text = text.replace(f"_{digit}", digit.translate(SUBSCRIPTS))
    return text


def value_text(field: Field) -> str:
    """Return the value of a field with its unit."""
    if field.value is None:
        return "-"
    if isinstance(field.value, bool):
        return "yes" if field.value else "no"
    if isinstance(field.value, str):
        return field.value.replace("_", " ") if field.choices else field.value
    return typeset(format_quantity(field.value, field.unit))


def range_text(field: Field) -> str:
    """Return the usual range of a field, or its choices."""
    if field.choices:
        return " / ".join(str(c).lower() for c in field.choices)
    if isinstance(field.value, str):
        return ""
    return typeset(f"{format_quantity(field.low, field.unit, 5)} to {format_quantity(field.high, field.unit, 5)}")
