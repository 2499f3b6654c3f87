"""Ride quality of a design and its base as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import shorten
from typing import Any

from rich.text import Text

from railui.desk.presenters.design_results import CURVE_RADII, DesignResults
from railui.io.number_format import format_quantity, typeset

CLASS_COLOURS = {
    "very good": "green",
    "good": "green",
    "satisfactory": "yellow",
    "just admissible": "dark_orange",
    "not admissible": "red",
    "dangerous": "bold red",
}
NARROW_COLUMNS = 48  # width below which short names are used
TWO_TABLE_COLUMNS = 94  # width from which the extra rows are shown too
GUIDING_FORCE_RADIUS = 600.0  # m
RELATIVE_TOLERANCE = 1e-3  # smaller changes are not marked


@dataclass(frozen=True)
class Row:
    """Row of the table; `sign` is 1 if smaller values are better, -1 if larger values are."""

    key: str
    name: str
    short_name: str
    unit: str
    sign: int


MAIN_ROWS = (
    Row("score", "score", "score", "1", -1),
    Row("comfort_hours", "reduced comfort after", "comfort", "h", -1),
    Row("safety_share", "share of safety limit", "safety share", "1", 1),
    Row("flange_margin", "flange margin", "flange margin", "sd", -1),
    Row("flange_fraction", "flange contact time", "flange time", "%", 1),
    Row("linear_critical_speed", "linear critical speed", "critical V", "m/s", -1),
    Row("linear_damping", "minimum damping ratio", "min. damping", "1", -1),
)
EXTRA_ROWS = (
    Row("weighted_acceleration", "weighted acceleration", "", "m/s^2", 1),
    Row("wz", "ride index Wz", "", "1", 1),
    Row("n_mv", "N_mv, lateral part", "", "1", 1),
    Row("sd_e1", "e₁ standard deviation", "", "m", 1),
    Row("sd_e2", "e₂ standard deviation", "", "m", 1),
    Row("flange_fraction_gaussian", "flange time, Gaussian", "", "%", 1),
    Row("guiding_force", "sum Y, R 600 m", "", "N", 1),
)
ALL_ROWS = (*MAIN_ROWS, *EXTRA_ROWS)


def quality_values(results: DesignResults) -> dict[str, Any]:
    """Return the values of all rows by key."""
    quality = results.quality
    sd = quality["statistics"].get("sd_e", (None, None))
    values: dict[str, Any] = {row.key: quality.get(row.key) for row in ALL_ROWS}
    values |= {
        "linear_critical_speed": results.critical_speed,
        "linear_damping": results.linear_damping,
        "sd_e1": sd[0],
        "sd_e2": sd[1],
        "guiding_force": None,
    }
    if results.guiding_force is not None:
        leading = results.guiding_force[CURVE_RADII.index(GUIDING_FORCE_RADIUS), 0]
        values["guiding_force"] = float(abs(leading))
    return values


def quality_csv(current: DesignResults, base: DesignResults) -> str:
    """Return the values of all rows as CSV: quantity, unit, design, base; in SI."""
    values, others = quality_values(current), quality_values(base)
    rows = [
        f"{row.name.replace(',', '')},{row.unit},{_number(values[row.key])},{_number(others[row.key])}"
        for row in ALL_ROWS
    ]
    return "\n".join(["quantity,unit,design,base", *rows]) + "\n"


def _number(value: Any) -> str:
    return "" if value is None else f"{value:.9g}"


def comparison_text(current: DesignResults, base: DesignResults, width: int) -> Text:
    """Return the class, the criterion that decided it, and the values of the design and of its base."""
    text = Text(no_wrap=True, overflow="ellipsis")
    quality_class = str(current.quality["class"])
    text.append(quality_class.upper(), f"bold {CLASS_COLOURS.get(quality_class, '')}")
    if base is not current and base.quality["class"] != quality_class:
        text.append(f"  base: {base.quality['class']}", "dim")
    text.append("  (no acceptance)"[: max(0, width - text.cell_len)], "dim")
    text.append("\n" + shorten(str(current.quality["decided_by"]), max(3, width), placeholder=" ...") + "\n", "dim")
    values = quality_values(current)
    base_values = quality_values(base) if base is not current else None
    for main, extra in zip(MAIN_ROWS, EXTRA_ROWS, strict=True):
        _append_row(text, main, values, base_values, width < NARROW_COLUMNS)
        if width >= TWO_TABLE_COLUMNS:
            text.append("  ")
            _append_row(text, extra, values, base_values, False)
        text.append("\n")
    text.rstrip()
    return text


def _append_row(
    text: Text, row: Row, values: Mapping[str, Any], base_values: Mapping[str, Any] | None, is_narrow: bool
) -> None:
    columns = 10 if is_narrow else 11
    text.append(f"{row.short_name:13}" if is_narrow else f"{row.name:22}")
    text.append(f"{value_text(values[row.key], row.unit):>{columns}}", "bold")
    if base_values is None:
        text.append("" if is_narrow else " " * (columns + 2))
        return
    base = value_text(base_values[row.key], row.unit)
    text.append(f"{base.split(' ')[0]:>7}" if is_narrow else f"{base:>{columns}}", "dim")
    text.append(*_arrow(values[row.key], base_values[row.key], row.sign))


def value_text(value: Any, unit: str) -> str:
    """Return a value of the table with its unit."""
    if value is None:
        return "none"
    if unit == "%":
        return f"{100 * value:.3g} %"
    if unit in ("1", "sd", "h"):
        return f"{value:.3g}" + (f" {unit}" if unit != "1" else "")
    return typeset(format_quantity(float(value), unit, 3))


def _arrow(value: Any, base: Any, sign: int) -> tuple[str, str]:
    """Return an arrow for the direction of a change and its colour, green for an improvement."""
    if value is None or base is None or abs(value - base) <= RELATIVE_TOLERANCE * max(abs(value), abs(base)):
        return "  ", ""
    is_better = sign * (value - base) < 0
    return " ▲" if value > base else " ▼", "green" if is_better else "red"
