"""Export of panes: the focused one to a file, or all pictures and tables of a panel to a directory."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from textual.content import Content
from textual.widget import Widget

from railui.desk.panels.design import DesignPanel
from railui.desk.presenters.ride_quality import quality_csv
from railui.desk.services.export import SUFFIXES, bars_table, file_name, table_csv, write_plot
from railui.desk.state.design_file import free_path
from railui.desk.widgets.axis import Scale
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import InputDialog
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.plot_data import PlotData
from railui.desk.widgets.table import Table
from railui.io.atomic import write_text

if TYPE_CHECKING:
    from railui.desk.app import Desk

PICTURE_SUFFIXES: Final = (".svg", ".png")
Write = Callable[[Path], Path]


def export_focused(desk: Desk) -> None:
    """Ask for a file and write the focused plot as SVG, PNG or CSV, or the focused table as CSV."""
    widget = desk.focused
    if widget is None or not has_export(widget):
        desk.notify("focus a plot or a table with tab first: E exports it; ctrl+p, Export all exports all")
        return
    is_plot = isinstance(widget, Plot)
    question = "Export the plot: .svg or .png, or .csv for its lines" if is_plot else "Export the table: .csv"
    suffix = ".svg" if is_plot else ".csv"
    proposed = str(free_path(Path(file_name(title_of(widget), suffix))))
    desk.push_screen(InputDialog(question, proposed), lambda name: _export(desk, name, suffix, widget))


def has_export(widget: Widget) -> bool:
    """True if a widget is a plot or a table with contents."""
    if isinstance(widget, Plot):
        return bool(widget.data.lines or widget.data.bands)
    return bool(widget.rows) if isinstance(widget, Bars) else isinstance(widget, Table) and bool(widget.columns)


def title_of(widget: Widget) -> str:
    """Return the title of a pane."""
    return Content.from_markup(str(widget.border_title or "")).plain


def writer_of(widget: Widget) -> Write:
    """Return the function that writes what a plot or a table shows now, by the ending of the path."""
    if isinstance(widget, Plot):
        return partial(_write_plot, title_of(widget), widget.data, widget.scales())
    if isinstance(widget, Bars):
        text = bars_table(widget.rows)
    else:
        assert isinstance(widget, Table)
        text = table_csv(widget.columns, widget.order)
    return lambda path: write_text(path, text)


def _write_plot(title: str, data: PlotData, scales: tuple[Scale, Scale], path: Path) -> Path:
    return write_plot(path, title, data, scales)


def _export(desk: Desk, name: str | None, suffix: str, widget: Widget) -> None:
    if name is None:
        return
    path = Path(name).expanduser()
    path = path if path.suffix in SUFFIXES else path.with_name(path.name + suffix)
    if path.suffix in PICTURE_SUFFIXES and suffix == ".csv":
        desk.notify("rows are exported as a table: end the name in .csv", severity="error")
        return
    if path.exists():
        desk.notify(f"{path} exists: choose another name", severity="error")
        return
    write = writer_of(widget)
    _run(desk, lambda: f"exported {write(path)}")


def export_all(desk: Desk) -> None:
    """Ask for a directory and write every picture (SVG, PNG, CSV) and table (CSV) that the panel shows."""
    proposed = str(free_path(Path(f"railui-{desk.panel.id}")))
    desk.push_screen(InputDialog("Export all pictures and tables to a new directory", proposed), partial(_all, desk))


def _all(desk: Desk, name: str | None) -> None:
    if name is None:
        return
    directory = Path(name).expanduser()
    if directory.exists():
        desk.notify(f"{directory} exists: choose a new directory", severity="error")
        return
    writes: dict[str, Write] = {}
    for widget in desk.panel.query(Widget):
        if has_export(widget) and is_on_page(widget):
            title = title_of(widget)
            suffixes = SUFFIXES if isinstance(widget, Plot) else (".csv",)
            writes |= {file_name(title, suffix): writer_of(widget) for suffix in suffixes}
    if isinstance(desk.panel, DesignPanel) and desk.panel.results is not None:
        text = quality_csv(*desk.panel.results)
        writes["ride_quality.csv"] = lambda path: write_text(path, text)
    if not writes:
        desk.notify("the panel has no picture and no table yet")
        return

    def write_files() -> str:
        directory.mkdir(parents=True)
        for file, write in writes.items():
            write(directory / file)
        return f"{len(writes)} files in {directory}"

    _run(desk, write_files)


def is_on_page(widget: Widget) -> bool:
    """True if a widget is on the page that is shown, also if there is no room for it."""
    return all(node.display for node in widget.ancestors if isinstance(node, Widget))


def _run(desk: Desk, write: Callable[[], str]) -> None:
    """Write on a thread, and say what was written."""

    def run() -> None:
        try:
            text = write()
        except (OSError, ValueError) as error:
            desk.call_from_thread(desk.notify, str(error), severity="error", timeout=10)
        else:
            desk.call_from_thread(desk.notify, text, timeout=4)

    desk.run_worker(run, name="export", thread=True, exit_on_error=False)
