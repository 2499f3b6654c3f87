"""Drawing of a plot: legends, bands and limits."""

from __future__ import annotations

import numpy as np
from rich.style import Style

from railui.desk.widgets.axis import Axis, scale_of
from railui.desk.widgets.canvas import Canvas
from railui.desk.widgets.plot_data import Band, LimitLine, Line, PlotData, drawn_lines
from railui.desk.widgets.plot_drawing import PlotDrawing

X = np.linspace(0.0, 10.0, 11)
PAIR = (Line(X, X, "base", "base"), Line(X, X**2, "current"))


def drawn(data: PlotData, width: int, height: int, is_plain: bool = False) -> tuple[Canvas, list[str]]:
    """Draw a plot; return its canvas and its rows as text."""
    scales = scale_of(data.x, [X], margin=0.0), scale_of(data.y, [line.y for line in drawn_lines(data)], margin=0.06)
    canvas = Canvas(width, height, Style())
    PlotDrawing(data, *scales, lambda role: Style(color="red", meta={"role": role}), is_plain).draw(canvas)
    return canvas, [strip.text for strip in canvas.strips()]


def test_the_legend_names_everything_drawn_at_any_width() -> None:
    data = PlotData(Axis("V", "m/s"), Axis("weighted acceleration", "m/s²"), PAIR)
    for width in (24, 34, 44, 90):
        _, rows = drawn(data, width, 12)
        assert "━━ base" in rows[0] + rows[1] and "━━ current" in rows[0] + rows[1]
    assert "weighted acceleration [m/s²]" in drawn(data, 90, 12)[1][0]
    assert drawn(data, 34, 12)[1][0].startswith("[m/s²]")  # the name of the pane tells the rest


def test_labels_of_close_limits_do_not_cover_each_other() -> None:
    limits = [LimitLine(v, f"limit {v:g}", is_vertical=True) for v in (5.1, 5.2, 5.4)]
    _, rows = drawn(PlotData(Axis("V"), Axis("y"), PAIR, limits), 60, 14)
    for limit in limits:
        assert sum(limit.label in row for row in rows) == 1


def test_a_band_shades_exactly_the_cells_between_its_edges() -> None:
    band = Band(X, np.full(11, 2.0), np.full(11, 8.0), "5 seeds")
    data = PlotData(Axis("x", low=0.0, high=10.0), Axis("y", low=0.0, high=10.0), bands=(band,))
    canvas, rows = drawn(data, 60, 23)  # 20 rows between the header and the axis
    shaded = [row for row in range(23) if sum(colour is not None for colour in canvas.backgrounds[row]) > 40]
    assert shaded == list(range(1 + 4, 1 + 16))
    assert "5 seeds" in rows[0]
    assert [line.label for line in drawn_lines(data)] == ["5 seeds lowest", "5 seeds highest"]


def test_a_line_over_a_band_keeps_the_band_below_it() -> None:
    band = Band(X, np.zeros(11), np.full(11, 100.0))
    canvas, rows = drawn(PlotData(Axis("x"), Axis("y"), PAIR[1:], bands=(band,)), 60, 23)
    dots = [(x, y) for y, row in enumerate(rows) for x, c in enumerate(row) if "⠀" < c <= "⣿"]
    assert dots and sum(canvas.backgrounds[y][x] is not None for x, y in dots) > 0.8 * len(dots)
    plain, _ = drawn(PlotData(Axis("x"), Axis("y"), bands=(band,)), 60, 23, is_plain=True)
    assert not any(any(row) for row in plain.backgrounds)
