"""Commands that work in the present focus: one list for the footer, the help and the command palette."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

from textual.app import App, SystemCommand
from textual.binding import Binding
from textual.dom import DOMNode
from textual.screen import Screen

CURSOR_KEYS: Final = frozenset(
    f"{modifier}{key}"
    for modifier in ("", "shift+", "ctrl+")
    for key in ("up", "down", "left", "right", "pageup", "pagedown", "home", "end")
)
FRAMEWORK_ACTIONS: Final = ("app.focus_next", "app.focus_previous", "screen.copy_text", "help_quit")
OTHER_SYSTEM_COMMANDS: Final = ("Theme", "Screenshot")  # of the framework; its others have keys of the desk


@dataclass(frozen=True)
class Command:
    """Command of a key; is_shown: the footer has it; is_cursor: it moves a cursor."""

    key: str
    title: str
    explanation: str
    action: str
    node: DOMNode
    is_shown: bool
    is_cursor: bool


def active_commands(screen: Screen[Any]) -> list[Command]:
    """List the commands whose keys work on a screen now, those of the focused widget first; each once."""
    found: dict[tuple[int, str], Command] = {}
    for active in screen.active_bindings.values():
        binding = active.binding
        if not binding.description or not active.enabled or binding.action in FRAMEWORK_ACTIONS:
            continue
        found.setdefault((id(active.node), binding.action), _command(screen.app, active.node, binding))
    return list(found.values())


def _command(app: App[Any], node: DOMNode, binding: Binding) -> Command:
    is_cursor = binding.key in CURSOR_KEYS
    key = app.get_key_display(binding)
    return Command(key, binding.description, binding.tooltip, binding.action, node, binding.show, is_cursor)


def palette_commands(app: App[Any], screen: Screen[Any]) -> Iterator[SystemCommand]:
    """Yield the active commands for the command palette; cursor keys need no entry."""
    for command in active_commands(screen):
        if not command.is_cursor and command.action != "command_palette":
            text = f"key {command.key}"
            text = f"{command.explanation} ({text})" if command.explanation else text
            yield SystemCommand(command.title, text, _runner(app, command))


def help_rows(screen: Screen[Any]) -> list[tuple[str, str]]:
    """Return key and meaning of every active command."""
    return [
        (command.key, f"{command.title}: {command.explanation}" if command.explanation else command.title)
        for command in active_commands(screen)
    ]


def _runner(app: App[Any], command: Command) -> Callable[[], Any]:
    async def run() -> None:
        await app.run_action(command.action, command.node)

    return run
