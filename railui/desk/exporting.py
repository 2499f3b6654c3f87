"""Export of the focused pane: question for the file, and writing on a thread."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from textual.content import Content

from railui.desk.services.export import SUFFIXES, bars_table, file_name, write_plot
from railui.desk.state.design_file import free_path
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import InputDialog
from railui.desk.widgets.plot import Plot
from railui.io.atomic import write_text

if TYPE_CHECKING:
    from railui.desk.app import Desk


def export_focused(desk: Desk) -> None:
    """Ask for a file and write the focused plot as SVG or CSV, or the focused rows of bars as CSV."""
    widget = desk.focused
    title = Content.from_markup(str(getattr(widget, "border_title", None) or "")).plain
    if isinstance(widget, Plot) and widget.data.lines:
        write = partial(_write_plot, widget, title)
        question, suffix = "Export the plot: .svg for the picture, .csv for its lines", ".svg"
    elif isinstance(widget, Bars) and widget.rows:
        write = partial(_write_bars, widget)
        question, suffix = "Export the rows: .csv", ".csv"
    else:
        desk.notify("focus a plot or a list with tab first: E exports it")
        return
    proposed = str(free_path(Path(file_name(title, suffix))))
    desk.push_screen(InputDialog(question, proposed), lambda name: _export(desk, name, suffix, write))


def _write_plot(plot: Plot, title: str) -> Callable[[Path], Path]:
    """Return the function that writes what a plot shows now."""
    data, scales = plot.data, plot.scales()
    return lambda path: write_plot(path, title, data, scales)


def _write_bars(bars: Bars) -> Callable[[Path], Path]:
    table = bars_table(bars.rows)
    return lambda path: write_text(path, table)


def _export(desk: Desk, name: str | None, suffix: str, prepare: Callable[[], Callable[[Path], Path]]) -> None:
    if name is None:
        return
    path = Path(name).expanduser()
    path = path if path.suffix in SUFFIXES else path.with_name(path.name + suffix)
    if path.suffix == ".svg" and suffix == ".csv":
        desk.notify("rows are exported as a table: end the name in .csv", severity="error")
        return
    if path.exists():
        desk.notify(f"{path} exists: choose another name", severity="error")
        return
    write = prepare()

    def run() -> None:
        try:
            written = write(path)
        except (OSError, ValueError) as error:
            desk.call_from_thread(desk.notify, str(error), severity="error", timeout=10)
        else:
            desk.call_from_thread(desk.notify, f"exported {written}", timeout=4)

    desk.run_worker(run, name="export", thread=True, exit_on_error=False)
