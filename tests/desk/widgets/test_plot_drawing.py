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
    assert drawn(data, 34, 12)[1][0].startswith("[m/s²]")  # the title of the pane has the rest


def test_labels_of_close_limits_do_not_cover_each_other() -> None:
    limits = [LimitLine(v, f"limit {v:g}", is_vertical=True) for v in (5.1, 5.2, 5.4)]
    _, rows = drawn(PlotData(Axis("V"), Axis("y"), PAIR, limits), 60, 14)
    for limit in limits:
        assert sum(limit.label in row for row in rows) == 1


def test_a_band_fills_exactly_the_area_between_its_edges() -> None:
    band = Band(X, np.full(11, 2.0), np.full(11, 8.0), "5 seeds")
    data = PlotData(Axis("x", low=0.0, high=10.0), Axis("y", low=0.0, high=10.0), bands=(band,))
    _, rows = drawn(data, 60, 23)  # 20 rows between the header and the axis
    full = [row for row in range(23) if rows[row].count("⣿") > 40]
    assert full == list(range(1 + 4, 1 + 16))
    assert "5 seeds" in rows[0]
    assert [line.label for line in drawn_lines(data)] == ["5 seeds lowest", "5 seeds highest"]


def test_a_narrow_band_is_visible_and_a_gap_is_empty() -> None:
    low = np.where((X > 4) & (X < 7), np.nan, 5.1)
    band = Band(X, low, low + 1e-6)
    data = PlotData(Axis("x", low=0.0, high=10.0), Axis("y", low=0.0, high=10.0), bands=(band,))
    _, rows = drawn(data, 60, 23)
    dots = [[column for column, c in enumerate(row) if "⠀" < c <= "⣿"] for row in rows]
    (columns,) = [row for row in dots if row]
    assert min(columns) < 5 and max(columns) > 55 and not any(30 < column < 38 for column in columns)
    plain = drawn(data, 60, 23, is_plain=True)[1]
    assert all(ord(c) < 128 for row in plain for c in row)


def test_names_of_categories_stand_under_their_values_as_far_as_whole_words_fit() -> None:
    names = ("weighted acceleration", "flange margin", "c_y", "k_ψ")
    data = PlotData(Axis("", low=-0.5, high=3.5, categories=names), Axis("y"), PAIR)
    narrow = ["weighted", "flange margin", "c_y", "k_ψ"]
    for width, shown in ((100, list(names)), (36, narrow)):
        _, rows = drawn(data, width, 12)
        assert rows[-3].count("┬") == 4
        for number, name in enumerate(shown):
            tick = [column for column, c in enumerate(rows[-3]) if c == "┬"][number]
            assert abs(rows[-2 + number % 2].index(name) + len(name) // 2 - tick) <= 1
        assert " ".join(rows[-2:]).split() == [word for k in (0, 2, 1, 3) for word in shown[k].split()]
