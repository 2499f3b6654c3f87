"""Focus of the desk: it returns to the widget that had it, and is never empty."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.widget import Widget
from textual.widgets import Static

from railui.desk.panels.common import first_focusable, is_focusable

if TYPE_CHECKING:
    from railui.desk.app import Desk


class TooSmall(Static, can_focus=True):
    """Message in a terminal that is too small for the panels; it has the focus there."""


class FocusKeeper:
    """Focus of each panel of a desk."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self._last: dict[str, Widget] = {}  # by panel

    def on_change(self, widget: Widget | None) -> None:
        """Note the focused widget; find another if there is none."""
        if widget is None:
            self.desk.call_after_refresh(self.fill)
        elif self.desk.panel in widget.ancestors:
            self._last[str(self.desk.panel.id)] = widget

    def fill(self) -> None:
        """Focus a widget of the panel if none has the focus, or one that is hidden: without a focus a key is lost."""
        if not self.desk.screen_stack:
            return
        focused = self.desk.screen_stack[0].focused
        if focused is None or not is_focusable(focused):
            self.enter_panel()

    def enter_panel(self) -> None:
        """Focus the widget of the panel that had the focus last, or the first one that can have it."""
        last = self._last.get(str(self.desk.panel.id))
        widget = last if last is not None and is_focusable(last) else first_focusable(self.desk.panel)
        self.desk.screen_stack[0].set_focus(widget or self.desk.query_one(TooSmall))
