"""Rows of a form: headings, fields, their sliders, and the text of their values."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, sqrt
from typing import Any, Final

from railui.io.number_format import format_quantity, scale_to_prefix, typeset
from railui.io.units import NUMBER, UnitError, convert, quantity
from railui.vehicle.parameter import Parameter, split_path

LOG_SCALE_RATIO: Final = 10.0  # ratio of the ends of a range from which a slider is logarithmic
UNBOUNDED: Final = 1e15  # ends of a range at least this large count as infinite
OPEN_RANGE_RATIO: Final = 30.0  # range of a slider without usual range, over the value of the base
MAX_RANGE_RATIO: Final = 100.0  # of the ends of a slider over the value of the base, if the usual range is wider
ZERO_RANGE_RATIO: Final = 1e3  # of a logarithmic slider that has 0 at its left end
MAX_CLEARANCE: Final = 0.5  # m; ranges of lengths up to here span decades (clearances), longer ones are distances
MIN_SLIDER_SPEED: Final = 5.0  # m/s
MAX_SLIDER_SPEED: Final = 100.0  # m/s
KMH_PER_MS: Final = 3.6
SPEED_UNITS: Final = ("m/s", "km/h")  # in which a speed is shown
SLIDER_STEP: Final = 0.02  # of the range, per key press; 0 of a logarithmic slider is one step from its lowest value
GREEK_LETTERS = {"lambda": "λ", "kappa": "κ", "epsilon": "ε", "delta": "δ", "sigma": "σ", "psi": "ψ", "phi": "φ"}
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True)
class Heading:
    """Heading between the fields of a form."""

    text: str


@dataclass(frozen=True)
class Field:
    """Row of a form with a number, a text, or one of `choices`. A value of None: not given and without default.

    low, high: ends of the slider; floor: lowest positive value of a logarithmic slider that begins at 0;
    usual: range of real vehicles, outside which a warning is shown; display_unit: unit of its text and of numbers that
    are typed without one, by default that of the value with a prefix.
    """

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
    floor: float = 0.0
    usual: tuple[float, float] | None = None
    is_integer: bool = False
    display_unit: str = ""

    @property
    def name(self) -> str:
        """Name at the beginning of the row."""
        return self.title or split_path(self.path)[1].replace("_", " ").replace(".", " ")

    @property
    def group(self) -> str:
        """Group of the parameter: its path without the last part."""
        return split_path(self.path)[0]

    @property
    def is_number(self) -> bool:
        """True if the field holds a number, or none yet."""
        return not self.choices and not isinstance(self.value, str | bool)

    @property
    def is_logarithmic(self) -> bool:
        """True if the slider has a logarithmic scale."""
        return self.floor > 0 or (self.low > 0 and self.high >= LOG_SCALE_RATIO * self.low)

    @property
    def is_unusual(self) -> bool:
        """True if the value is outside the range of real vehicles."""
        if self.usual is None or not self.is_number or self.value is None:
            return False
        return not self.usual[0] <= float(self.value) <= self.usual[1]

    @property
    def shown_unit(self) -> str:
        """Unit in which the value is shown, with its prefix; that of the middle of the slider for a value of 0."""
        if self.display_unit:
            return self.display_unit
        value = self.value if isinstance(self.value, int | float) else 0.0
        return scale_to_prefix(float(value) or sqrt(max(self.floor, 0.0) * self.high) or self.high, self.unit)[1]

    def position(self, value: float) -> float:
        """Return the position of a value on the slider, 0 to 1."""
        if not self.high > self.low:
            return 0.0
        if not self.is_logarithmic:
            return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))
        lowest, begin = (self.floor, SLIDER_STEP) if self.floor else (self.low, 0.0)
        if value < lowest:
            return begin if self.floor and value > 0 else 0.0
        return min(1.0, begin + (1 - begin) * log(value / lowest) / log(self.high / lowest))

    def value_at(self, position: float) -> float:
        """Return the value at a position of the slider, rounded to three digits."""
        position = min(1.0, max(0.0, position))
        if not self.is_logarithmic:
            value = self.low + position * (self.high - self.low)
        elif not self.floor:
            value = self.low * (self.high / self.low) ** position
        elif position < 0.5 * SLIDER_STEP:
            value = 0.0
        else:
            fraction = max(0.0, position - SLIDER_STEP) / (1 - SLIDER_STEP)
            value = self.floor * (self.high / self.floor) ** fraction
        return round(value) if self.is_integer else float(f"{value:.3g}")

    def stepped(self, by: int) -> Any:
        """Return the value after a number of steps of the slider, or the next choice.

        A value beyond an end of the slider goes to this end first, and no farther outward.
        """
        if self.choices:
            position = self.choices.index(self.value) if self.value in self.choices else 0
            return self.choices[(position + (1 if by > 0 else -1)) % len(self.choices)]
        if not isinstance(self.value, int | float):
            return self.value
        value = float(self.value)
        end = min(self.high, max(self.low, value))
        if end != value:
            return end if (end > value) == (by > 0) else value
        stepped = self.value_at(self.position(value) + SLIDER_STEP * by)
        if self.is_integer and stepped == value:
            stepped = min(self.high, max(self.low, value + (1 if by > 0 else -1)))
        return stepped

    def typed(self, text: str) -> Any:
        """Return typed text as a value: a number without unit is in the unit that is shown.

        >>> Field("a", "", "", "N/m", 3e6).typed("5"), Field("a", "", "", "N/m", 3e6).typed("5 kN/m")
        ('5 MN/m', '5 kN/m')
        """
        text = text.strip()
        if not self.is_number or not NUMBER.fullmatch(text):
            return text
        unit = self.shown_unit
        return float(text) if unit == self.unit else f"{text} {unit}"


def speed_field(path: str, value: float, unit: str, source: str = "") -> Field:
    """Return the field of a running speed [m/s] shown in m/s or km/h.

    >>> value_text(speed_field("speed", 40.0, "km/h")), speed_field("speed", 40.0, "km/h").typed("160")
    ('144 km/h', '160 km/h')
    """
    usual = MIN_SLIDER_SPEED, MAX_SLIDER_SPEED
    return Field(path, "V", "speed", "m/s", value, *usual, source=source, usual=usual, display_unit=unit)


def typed_speed_unit(value: Any) -> str:
    """Return the unit of a typed speed if it can be shown in it, or an empty text.

    >>> typed_speed_unit("144 km/h"), typed_speed_unit(40.0)
    ('km/h', '')
    """
    unit = value.strip().lstrip("+-.eE0123456789 ") if isinstance(value, str) else ""
    return unit if unit in SPEED_UNITS else ""


def number_field(p: Parameter, value: float | None, reference: float | None, is_changed: bool, source: str) -> Field:
    """Return the field of a parameter; `reference` is the value of the base, which its slider contains."""
    low, high = slider_range(p, value if reference is None else reference)
    usual = p.usual_range if max(map(abs, p.usual_range)) < UNBOUNDED else None
    floor = _floor(p.unit, low, high)
    if floor and reference:
        floor = min(floor, reference)
    return Field(p.path, p.symbol, p.caption, p.unit, value, low, high, is_changed, source, floor=floor, usual=usual)


def slider_range(p: Parameter, reference: float | None) -> tuple[float, float]:
    """Return the range of a slider: that of real vehicles, extended to a reference."""
    low, high = p.usual_range
    size = OPEN_RANGE_RATIO * (abs(reference or 0.0) or 1.0)
    if not abs(low) < UNBOUNDED:
        low = -size
    if not abs(high) < UNBOUNDED:
        high = size
    if reference is not None:
        low, high = min(low, reference), max(high, reference)
        if reference > 0 and low > 0 and high > MAX_RANGE_RATIO**2 * low:
            low, high = max(low, reference / MAX_RANGE_RATIO), min(high, reference * MAX_RANGE_RATIO)
    return max(low, p.minimum), min(high, p.maximum)


def _floor(unit: str, low: float, high: float) -> float:
    """Return the lowest positive value of a slider from 0 over decades, of forces, springs, dampers and clearances."""
    is_clearance = unit.split("/")[0] in ("m", "rad") and high < MAX_CLEARANCE
    return high / ZERO_RANGE_RATIO if low == 0 < high and ("N" in unit or is_clearance) else 0.0


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
    if field.display_unit:
        return _shown(field, field.value)
    if field.value == 0:
        unit = field.shown_unit
        return "0" if unit in ("", "1") else f"0 {typeset(unit)}"
    return typeset(format_quantity(field.value, field.unit))


def _shown(field: Field, value: float) -> str:
    return typeset(f"{convert(value, field.unit, field.display_unit):.4g} {field.display_unit}")


def range_text(field: Field) -> str:
    """Return the usual range of a field, that of its slider where it has none, or its choices."""
    if field.choices:
        return " / ".join(str(c).lower() for c in field.choices)
    if isinstance(field.value, str):
        return ""
    if field.display_unit:
        both = f" · {typeset(format_quantity(float(field.value or 0.0), field.unit))}" if field.value else ""
        same = both if field.display_unit != field.unit else f" · {KMH_PER_MS * float(field.value or 0.0):.4g} km/h"
        return f"{_shown(field, field.low)} to {_shown(field, field.high)}{same}"
    return _ends_text(field, field.usual or (field.low, field.high))


def warning_text(field: Field) -> str:
    """Return a warning for a value outside the range of real vehicles, or an empty text."""
    if not field.is_unusual or field.usual is None:
        return ""
    return f"outside the usual {_ends_text(field, field.usual)}"


def _ends_text(field: Field, ends: tuple[float, float]) -> str:
    low, high = (typeset(format_quantity(end, field.unit, 5)) for end in ends)
    return f"{low} to {high}"


def typed_preview(field: Field, text: str) -> tuple[str, bool]:
    """Return typed text as it will be read, and True if it would be rejected; the unit while nothing is typed."""
    if not field.is_number:
        return "", False
    shown = typeset(field.shown_unit) if field.shown_unit not in ("", "1") else "a number"
    if not text.strip():
        return f"in {shown}, or with another unit", False
    try:
        value = quantity(field.typed(text), field.unit)
    except UnitError as error:
        return ", ".join(part for part in (error.message, error.remedy) if part), True
    read = Field(field.path, "", "", field.unit, value, usual=field.usual, display_unit=field.display_unit)
    warning = warning_text(read)
    return f"= {value_text(read)}" + (f": {warning}" if warning else ""), False
