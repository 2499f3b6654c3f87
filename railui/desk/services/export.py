"""Export of a pane: its picture as SVG, its table as CSV."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from railui.desk.widgets.axis import Scale
from railui.desk.widgets.bars import Bar
from railui.desk.widgets.plot_data import SERIES_COUNT, PlotData, drawn_lines, series_role
from railui.desk.widgets.table import Column
from railui.io.atomic import write_bytes, write_text
from railui.report.figures.drawing import BLUE, GREY, ORANGE, STYLE, draw_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURE_INCHES: Final = (6.4, 3.4)
COLOURS: Final = {"current": BLUE, "base": GREY, "other": ORANGE, "limit": ORANGE} | {
    series_role(k): f"C{k}" for k in range(SERIES_COUNT)
}
SUFFIXES: Final = (".svg", ".png", ".csv")
PNG_DPI: Final = 200


def file_name(title: str, suffix: str) -> str:
    """Return the proposed name of a file for a title.

    >>> file_name("e1: data and model", ".svg")
    'e1_data_and_model.svg'
    """
    return (re.sub(r"[^A-Za-z0-9]+", "_", title).strip("_").lower() or "pane") + suffix


def plot_table(data: PlotData) -> str:
    """Return the lines of a plot as CSV: name of the line, abscissa and ordinate with their units."""
    rows = [["line", data.x.label, data.y.label]]
    for line in drawn_lines(data):
        name = line.label or line.role
        rows += [[name, f"{x:.9g}", f"{y:.9g}"] for x, y in zip(line.x, line.y, strict=True)]
    return _csv(rows)


def bars_table(rows: Sequence[Bar]) -> str:
    """Return rows of bars as CSV: name, length of the bar as a fraction, text."""
    return _csv([["name", "fraction", "text"], *([row.name, f"{row.fraction:.6g}", row.text] for row in rows)])


def table_csv(columns: Sequence[Column], order: Sequence[int]) -> str:
    """Return a table as CSV: headings in one line, rows in the order shown."""
    heads = [" ".join(head for head in column.heads if head) for column in columns]
    return _csv([heads, *([column.cells[row] for column in columns] for row in order)])


def write_plot(path: Path, title: str, data: PlotData, scales: tuple[Scale, Scale]) -> Path:
    """Write a plot in the shown window as SVG or PNG, or its lines as CSV, by the ending of the path."""
    if path.suffix == ".csv":
        return write_text(path, plot_table(data))
    if path.suffix == ".png":
        return write_bytes(path, _png(lambda ax: _draw(ax, title, data, scales)))
    picture = draw_picture(title, title, PICTURE_INCHES, lambda ax: _draw(ax, title, data, scales))
    return write_bytes(path, picture.svg)


def _png(draw: Callable[[Axes], None]) -> bytes:
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=PICTURE_INCHES, layout="constrained")
        draw(figure.add_subplot())
        out = io.BytesIO()
        figure.savefig(out, format="png", dpi=PNG_DPI, metadata={"Software": None})
    return out.getvalue()


def _draw(ax: Axes, title: str, data: PlotData, scales: tuple[Scale, Scale]) -> None:
    x, y = scales
    labelled: set[str] = set()
    for line in data.lines:
        label = line.label if line.label not in labelled else ""
        labelled.add(label)
        style = {"linestyle": "none", "marker": ".", "markersize": 2} if line.is_points else {"linewidth": 1}
        ax.plot(line.x, line.y, color=COLOURS.get(line.role, BLUE), label=label or None, **style)
    for band in data.bands:
        colour = COLOURS.get(band.role, BLUE)
        ax.fill_between(band.x, band.low, band.high, color=colour, alpha=0.2, linewidth=0, label=band.label or None)
    for limit in data.limits:
        (ax.axvline if limit.is_vertical else ax.axhline)(limit.value, color=ORANGE, linestyle=":", linewidth=0.8)
    for mark in data.marks:
        ax.annotate(mark.label, (mark.x, mark.y), fontsize=8)
        ax.plot([mark.x], [mark.y], "x" if mark.character == "x" else "o", color=ORANGE, markersize=4)
    ax.set_xscale("log" if x.log else "linear")
    ax.set_yscale("log" if y.log else "linear")
    ax.set_xlim(x.low, x.high)
    ax.set_ylim(y.low, y.high)
    ax.set_xlabel(data.x.label)
    ax.set_ylabel(data.y.label)
    ax.set_title(title)
    if labelled - {""} or any(band.label for band in data.bands):
        ax.legend(loc="best", frameon=False, fontsize=8)


def _csv(rows: Sequence[Sequence[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()
