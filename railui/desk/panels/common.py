"""Shared parts of the panels: names and keys, base classes, titles, layout."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.text import Text
from textual.binding import Binding
from textual.containers import Grid, Vertical
from textual.content import Content
from textual.dom import DOMNode
from textual.events import Click
from textual.widget import Widget
from textual.widgets import Static

from railui.desk.services.jobs import BackgroundJob

PANELS = {
    "design": ("f2", "Design"),
    "campaign": ("f3", "Campaign"),
    "optimise": ("f4", "Optimise"),
    "track": ("f5", "Track"),
    "capture": ("f6", "Capture"),
    "fleet": ("f7", "Fleet"),
}
SHORT_TITLE = 5  # letters of the titles of panels where there is little room
PLOT_COLUMNS = 44  # minimum width of a plot in a grid, in cells
LAST_STOP_SECONDS = 1.0  # s for a computation to stop when the desk ends
PLOT_ROWS = 11  # minimum height

START = Binding("s", "start", "Start")
PAUSE = Binding("p", "pause", "Pause")
STOP = Binding("k", "stop", "Stop")
VIEW = Binding("v", "view(1)", "View")
COPY = Binding("c", "copy", "Copy", show=False)


class PanelTabs(Static):
    """Names of the panels with their keys, in one line; short ones where there is little room."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id)
        self.current = next(iter(PANELS))

    @property
    def _cells(self) -> list[tuple[str, str, str]]:
        """Name, shown key and shown title of each panel."""
        room = self.content_size.width or 1000
        cells = []
        for gap, letters in ((" ", 100), ("", 100), ("", SHORT_TITLE)):
            cells = [
                (name, f" {key.upper()} ", (title if name == self.current else title[:letters]) + gap)
                for name, (key, title) in PANELS.items()
            ]
            if sum(len(key) + len(title) for _, key, title in cells) <= room:
                break
        return cells

    def show(self, current: str) -> None:
        """Mark the open panel."""
        self.current = current
        text = Text(no_wrap=True, overflow="ellipsis")
        for name, key, title in self._cells:
            text.append(key, "dim")
            text.append(title.rstrip(), "bold reverse" if name == current else "")
            text.append(" " * (len(title) - len(title.rstrip())))
        self.update(text, layout=False)

    def on_resize(self) -> None:
        self.show(self.current)

    def on_click(self, event: Click) -> None:
        start = 0
        for name, key, title in self._cells:
            end = start + len(key) + len(title)
            if start <= event.x < end:
                self.app.call_later(self.app.run_action, f"panel('{name}')")
            start = end


class Pane(Static):
    """Pane of text with a title."""

    def __init__(self, title: str, *, id: str) -> None:
        super().__init__(id=id, classes="pane")
        self.border_title = title


class Panel(Vertical):
    """Panel whose parts are arranged anew when it is resized and when `v` changes the view."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.view = 0  # number of the view, modulo the number of views
        self._command_state: object = None

    def arrange_parts(self) -> None:
        """Arrange the parts of the panel."""
        raise NotImplementedError

    def on_resize(self) -> None:
        self.arrange_parts()

    def command_state(self) -> object:
        """Return everything on which it depends what commands of the panel work."""
        return None

    def update_commands(self) -> None:
        """Show the commands that work now, if they have changed."""
        if (state := self.command_state()) != self._command_state:
            self._command_state = state
            self.refresh_bindings()

    def action_view(self, by: int) -> None:
        self.view += by
        self.arrange_parts()


class JobPanel(Panel):
    """Panel with a long computation that can be paused and stopped."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.job: BackgroundJob | None = None

    def on_unmount(self) -> None:
        """Stop the computation at the end of the desk, so that its thread ends too."""
        if self.job is not None:
            self.job.stop(LAST_STOP_SECONDS)

    def show_status(self) -> None:
        """Show the state of the computation."""
        raise NotImplementedError

    def can_start(self) -> bool:
        """Return True if there is something to compute."""
        return True

    def command_state(self) -> object:
        return self.job is not None, self.can_start()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "start":
            return self.job is None and self.can_start()
        return self.job is not None if action in ("pause", "stop") else True

    def action_pause(self) -> None:
        if self.job is not None:
            self.job.toggle_pause()
            self.show_status()

    def action_stop(self) -> None:
        if self.job is not None:
            self.job.stop()
            self.show_status()


def set_titles(widget: Widget, title: str | None = None, sub: str | None = None) -> None:
    """Set title and subtitle if they differ, because setting them redraws the widget; brackets are literal."""
    for border, text in (("border_title", title), ("border_subtitle", sub)):
        if text is not None and (getattr(widget, border) or "") != (content := Content(text)).markup:
            setattr(widget, border, content)


def first_focusable(panel: DOMNode) -> Widget | None:
    """Return the first displayed widget of a panel that can have the focus."""
    return next((widget for widget in panel.query(Widget) if is_focusable(widget)), None)


def is_focusable(widget: Widget) -> bool:
    """True if a widget is displayed and can have the focus."""
    return widget.can_focus and all(node.display for node in widget.ancestors_with_self)


def draw_in_turn(owner: Widget, jobs: Sequence[Callable[[], None]]) -> None:
    """Run drawing functions, each in a refresh of its own, so that no key waits for all of them."""
    if jobs:
        jobs[0]()
        owner.call_after_refresh(draw_in_turn, owner, jobs[1:])


def arrange_grid(
    grid: Grid, parts: Sequence[Widget], first: int, max_count: int = 6, min_rows: int = PLOT_ROWS
) -> list[Widget]:
    """Show as many parts of a grid as fit, from the first one on; return the parts shown."""
    columns = max(1, min(3, grid.size.width // PLOT_COLUMNS))
    rows = max(1, min(3, grid.size.height // min_rows))
    count = min(len(parts), columns * rows, max_count)
    columns = min(columns, count)
    order = [parts[(first + k) % len(parts)] for k in range(len(parts))]
    grid.styles.grid_size_columns = columns
    grid.styles.grid_size_rows = -(-count // columns)
    for k, part in enumerate(order):
        part.display = k < count
    grid.sort_children(key=lambda part: order.index(part) if part in order else len(order))
    return order[:count]
