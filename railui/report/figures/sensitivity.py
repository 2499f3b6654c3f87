"""Figure of the sensitivity of a design: changes of its results as each parameter rises by 10 %."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from railui.io.number_format import typeset_unit
from railui.report.figures.drawing import BLUE, ORANGE, axis_label, draw_changes, figure_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_BARS: Final = 14  # parameters shown
BAR_HEIGHT: Final = 0.2  # inch


def draw_sensitivity(result: Mapping[str, Any], path: str | Path) -> None:
    """Write a figure with one panel per result, the largest changes first (svg, png, pdf)."""
    keys = list(result["responses"])
    heights = [panel_height(result, key) for key in keys]
    with figure_file(path, 7.0, sum(heights) + 0.2) as figure:
        axes = figure.subplots(len(keys), 1, squeeze=False, height_ratios=heights)[:, 0]
        for ax, key in zip(axes, keys, strict=True):
            draw_changes_of(ax, result, key)


def panel_height(result: Mapping[str, Any], key: str) -> float:
    """Return the height [inch] of the panel of a result."""
    return 0.8 + BAR_HEIGHT * len(_largest(result, key))


def draw_changes_of(ax: Axes, result: Mapping[str, Any], key: str) -> None:
    """Draw the largest changes of one result."""
    row = _largest(result, key)
    draw_changes(ax, row, [BLUE if x > 0 else ORANGE for _, x in row])
    unit = result["responses"][key]["unit"]
    name = f"change of {key.replace('_', ' ')} as a parameter rises by {200 * result['step']:g} %"
    ax.set_xlabel(axis_label(name, "" if unit == "1" else typeset_unit(unit)))


def _largest(result: Mapping[str, Any], key: str) -> list[tuple[str, float]]:
    changes = [(one["path"], one["change"][key]) for one in result["parameters"]]
    finite = [(path, x) for path, x in changes if x is not None and x == x and x != 0]
    return sorted(finite, key=lambda row: -abs(row[1]))[:MAX_BARS]
