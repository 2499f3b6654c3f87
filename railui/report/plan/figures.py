"""Figures of a plan: minimum detectable effects by run, and the attained precision against the cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.report.figures.drawing import BLUE, Picture, draw_picture, figure_file
from railui.report.plan.rows import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Document = Mapping[str, Any]
CELL: Final = (0.72, 0.22)  # inch, width and height of a cell of the map
LABEL_WIDTH: Final = 4.6  # inch
MAX_RATIO: Final = 4.0  # of a minimum detectable size over that with everything, where the colours end


def draw_plan(document: Document, rows: Sequence[Row], path: str | Path) -> None:
    """Write the map of minimum detectable effects (svg, png, pdf)."""
    width, height = map_size(document, rows)
    with figure_file(path, width, height) as figure:
        draw_limits(figure.add_subplot(), document, rows)


def map_picture(document: Document, rows: Sequence[Row]) -> Picture:
    """Draw the map of minimum detectable effects for the page."""
    width, height = map_size(document, rows)
    alt = "minimum detectable size of every effect with the selection, with everything and with every run alone"

    def draw(ax: Axes) -> None:
        draw_limits(ax, document, rows)
        ax.set_position((LABEL_WIDTH / width, 0.02, 1.0 - LABEL_WIDTH / width - 0.02, 1.0 - 1.0 / height))

    return draw_picture("plan_map", alt, (width, height), draw)


def map_size(document: Document, rows: Sequence[Row]) -> tuple[float, float]:
    """Return width and height [inch] of the map of minimum detectable effects."""
    columns = 2 + len(document["runs"])
    return LABEL_WIDTH + CELL[0] * columns + 0.2, CELL[1] * len(rows) + 1.1


def draw_limits(ax: Axes, document: Document, rows: Sequence[Row]) -> None:
    """Draw the map of minimum detectable effects: colours by the size over the best of a row, numbers in its unit."""
    values = np.array([[np.nan if x is None else abs(x) for x in row["values"]] for row in rows])
    sizes = _strength(values, rows)
    best = np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1, keepdims=True)
    ratio = np.log(sizes / best) / np.log(MAX_RATIO)
    ax.imshow(np.clip(ratio, 0.0, 1.0), cmap="YlGnBu_r", aspect="auto", vmin=-0.3, vmax=1.15)
    for i, row in enumerate(rows):
        for j, cell in enumerate(row["cells"]):
            dark = np.isfinite(ratio[i, j]) and ratio[i, j] < 0.35
            ax.text(j, i, cell, ha="center", va="center", fontsize=7, color="white" if dark else "#222222")
    ax.set_xticks(range(values.shape[1]), ["selection", "everything", *(r["name"] for r in document["runs"])])
    ax.set_yticks(range(len(rows)), [f"{row['name']}: {row['parameter']}" for row in rows])
    ax.tick_params(axis="x", labeltop=True, labelbottom=False, top=False, bottom=False, labelrotation=30, labelsize=7)
    ax.tick_params(axis="y", length=0, labelsize=7)
    for label in ax.get_xticklabels():
        label.set_horizontalalignment("left")
    ax.grid(False)
    for spine in ax.spines.values():
        spine.set_visible(False)


def _strength(values: Any, rows: Sequence[Row]) -> Any:
    """Sizes that count from small to large; those found up to a value are inverted."""
    inverted = np.array([row["bound"] == "up to" for row in rows])[:, None]
    return np.where(inverted, 1.0 / np.maximum(values, 1e-300), values)


def selection_picture(document: Document) -> Picture:
    """Draw the attained precision against the cost, step by step."""
    alt = "share of the precision of all sensors and runs against the cost of the selection"
    return draw_picture("plan_selection", alt, (6.4, 2.6), lambda ax: draw_selection(ax, document))


def draw_selection(ax: Axes, document: Document) -> None:
    """Draw the attained precision against the cost, a point for each step with what it adds."""
    steps = document["steps"]
    costs, shares = [s["cost"] for s in steps], [100 * s["attained_share"] for s in steps]
    ax.plot(costs, shares, "-o", color=BLUE, ms=4, lw=1.2)
    for i, (step, x, y) in enumerate(zip(steps, costs, shares, strict=True)):
        name = "start" if i == 0 else f"+ {step['added']}"
        ax.annotate(name, (x, y), xytext=(4, -9), textcoords="offset points", fontsize=7)
    ax.set_xlabel("cost [1]")
    ax.set_ylabel("attained precision [%]")
    ax.set_ylim(0, 105)
    ax.margins(x=0.12)
