"""Presentation of objects and results: summaries as text and HTML, and axes for figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from railui.io.number_format import format_quantity, typeset

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_SIZE: Final = (7.6, 2.6)  # inch
TABLE_STYLE: Final = "border-collapse:collapse;text-align:left"


class SummaryRow(NamedTuple):
    """Row of a summary: name, value and its unit in SI; "" where there is none."""

    name: str
    value: Any
    unit: str = ""

    @property
    def text(self) -> str:
        """Value as text: numbers with a suitable prefix, None as a dash, lists with commas."""
        return _text(self.value, self.unit)


def _text(value: Any, unit: str) -> str:
    if value is None:
        return "-"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item, unit) for item in value)
    return format_quantity(value, unit or "1") if isinstance(value, float) else str(value)


def summary_text(title: str, rows: Sequence[SummaryRow], notes: Iterable[str] = ()) -> str:
    """Return a title, aligned rows and notes as text.

    >>> print(summary_text("bogie", [SummaryRow("mass", 2900.0, "kg"), SummaryRow("e", None)], ["planar"]))
    bogie
      mass  2900 kg
      e     -
    note: planar
    """
    width = max((len(row.name) for row in rows), default=0)
    lines = [f"  {row.name:<{width}}  {row.text}".rstrip() for row in rows]
    return "\n".join([title, *lines, *(f"note: {note}" for note in notes)])


def summary_html(title: str, rows: Sequence[SummaryRow], notes: Iterable[str] = ()) -> str:
    """Return a title, a table and notes as HTML; every text is escaped."""
    cells = "".join(f"<tr><th>{escape(row.name)}</th><td>{escape(typeset(row.text))}</td></tr>" for row in rows)
    items = "".join(f"<li>{escape(note)}</li>" for note in notes)
    table = f'<table style="{TABLE_STYLE}"><caption>{escape(title)}</caption>{cells}</table>'
    return table + (f"<ul>{items}</ul>" if items else "")


class Summarised:
    """Base of objects with a summary as text and HTML; subclasses give its title, rows and notes."""

    def summary_title(self) -> str:
        """Return the title of the summary."""
        raise NotImplementedError

    def summary_rows(self) -> list[SummaryRow]:
        """Return the rows of the summary."""
        raise NotImplementedError

    def summary_notes(self) -> Sequence[str]:
        """Return the notes below the summary."""
        return ()

    def summary(self) -> str:
        """Return the main values with their units, and the notes, as text."""
        return summary_text(self.summary_title(), self.summary_rows(), self.summary_notes())

    def _repr_html_(self) -> str:
        """Return the summary as HTML, for notebooks."""
        return summary_html(self.summary_title(), self.summary_rows(), self.summary_notes())


def draw_on(ax: Axes | None, draw: Callable[[Axes], object], size: tuple[float, float] = PANEL_SIZE) -> Axes:
    """Draw on axes, or on a new figure of matplotlib.pyplot [inch], in the style of the reports; return the axes."""
    import matplotlib

    from railui.report.figures.drawing import STYLE

    with matplotlib.rc_context(STYLE):
        if ax is None:
            from matplotlib import pyplot

            _, ax = pyplot.subplots(figsize=size, layout="constrained")
        draw(ax)
    return ax


def named_axes(axes: Sequence[Axes] | None, draws: Sequence[Callable[[Axes], object]]) -> list[Axes]:
    """Draw each of several panels on its own axes, or below each other on a new figure; return the axes.

    Raises
    ------
    ValueError
        If the number of axes differs from that of the panels.
    """
    import matplotlib

    from railui.report.figures.drawing import STYLE

    if axes is not None and len(axes) != len(draws):
        raise ValueError(f"{len(draws)} axes are needed, {len(axes)} are given")
    with matplotlib.rc_context(STYLE):
        if axes is None:
            from matplotlib import pyplot

            size = (PANEL_SIZE[0], 2.3 * len(draws) + 0.4)
            figure, grid = pyplot.subplots(len(draws), 1, squeeze=False, figsize=size, layout="constrained")
            axes = list(grid[:, 0])
            figure.align_ylabels()
        for ax, draw in zip(axes, draws, strict=True):
            draw(ax)
    return list(axes)


def shown_value(data: Mapping[str, Any], key: str) -> float | None:
    """Return a number of a result as float; None where it has none."""
    value = data.get(key)
    return None if value is None else float(value)
