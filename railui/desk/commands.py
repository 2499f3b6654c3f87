"""Commands of the command palette and active keys of the help."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from textual.app import App, SystemCommand
from textual.binding import Binding
from textual.dom import DOMNode
from textual.screen import Screen

from railui.desk.panels.common import PANELS


def panel_commands(show: Callable[[str], object]) -> Iterator[SystemCommand]:
    """Yield a command per panel."""
    for name, (key, title) in PANELS.items():
        yield SystemCommand(title, f"{title} panel ({key})", lambda name=name: show(name))


def file_commands(
    open_file: Callable[[], object], save: Callable[[], object], save_as: Callable[[], object]
) -> Iterator[SystemCommand]:
    """Yield the commands for files."""
    yield SystemCommand("Open", "open a design, campaign or study (ctrl+o)", open_file)
    yield SystemCommand("Save", "save the design in its file (ctrl+s)", save)
    yield SystemCommand("Save as", "save the design in another file", save_as)


def key_commands(app: App[Any], nodes: list[DOMNode]) -> Iterator[SystemCommand]:
    """Yield a command per key binding of widgets."""
    for node in nodes:
        for binding in getattr(node, "BINDINGS", ()):
            if isinstance(binding, Binding) and binding.description:
                key = f"key {app.get_key_display(binding)}"
                yield SystemCommand(binding.description, key, _action_runner(app, binding.action, node))


def _action_runner(app: App[Any], action: str, node: DOMNode) -> Callable[[], Any]:
    async def run() -> None:
        await app.run_action(action, node)

    return run


def active_keys(screen: Screen[Any]) -> list[tuple[str, str]]:
    """List the active keys of a screen with their descriptions."""
    bindings = [active.binding for active in screen.active_bindings.values()]
    return [(screen.app.get_key_display(binding), binding.description) for binding in bindings if binding.description]
