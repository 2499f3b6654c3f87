"""The names of the panels with their keys, in one line above them."""

from __future__ import annotations

from rich.text import Text
from textual.events import Click
from textual.widgets import Static

PANELS = {
    "design": ("f2", "Design"),
    "campaign": ("f3", "Campaign"),
    "optimise": ("f4", "Optimise"),
    "track": ("f5", "Track"),
    "capture": ("f6", "Capture"),
}


class Tabs(Static):
    """The names of the panels with their keys, in one line."""

    def show(self, current: str) -> None:
        """Marks the panel that is open."""
        text = Text(no_wrap=True, overflow="ellipsis")
        for name, (key, title) in PANELS.items():
            text.append(f" {key.upper()} ", "dim")
            text.append(title, "bold reverse" if name == current else "")
            text.append(" ")
        self.update(text)

    def on_click(self, event: Click) -> None:
        at = 0
        for name, (key, title) in PANELS.items():
            wide = len(key) + len(title) + 4
            if at <= event.x < at + wide:
                self.app.call_later(self.app.run_action, f"panel('{name}')")
            at += wide
