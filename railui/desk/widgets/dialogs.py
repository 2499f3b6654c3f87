"""What the desk asks: a choice, a name, a file; and what it says: help, the faults of a file where they stand."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from rich.markup import escape
from rich.text import Text
from textual.app import ComposeResult
from textual.await_complete import AwaitComplete
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from railui.io.problems import FileProblems

MOST_SHOWN = 400


class Dialog(ModalScreen[str | None]):
    """A question that is answered once, however quickly keys follow one another."""

    answered = False

    def dismiss(self, result: str | None = None) -> AwaitComplete:
        """Answers, and goes away; a second answer is none."""
        if self.answered:
            return AwaitComplete()
        self.answered = True
        return super().dismiss(result)


class Ask(Dialog):
    """A question with a few answers, each by its key; escape answers nothing."""

    BINDINGS: ClassVar[list[Any]] = [Binding("escape", "dismiss(None)", "Back")]

    def __init__(self, question: str, answers: Mapping[str, str]) -> None:
        super().__init__()
        self.question, self.answers = question, answers

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog") as box:
            box.border_title = "?"
            yield Static(self.question, markup=False, classes="said")
            options = [Option(f"[b]{escape(key)}[/]  {escape(told)}", id=key) for key, told in self.answers.items()]
            yield OptionList(*options, compact=True)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(event.option.id)

    def key_any(self, key: str) -> None:
        if key in self.answers:
            self.dismiss(key)

    def on_key(self, event: Any) -> None:
        if event.character in self.answers:
            event.stop()
            self.dismiss(event.character)


class Name(Dialog):
    """A line to type."""

    BINDINGS: ClassVar[list[Any]] = [Binding("escape", "dismiss(None)", "Back")]

    def __init__(self, question: str, begin: str = "") -> None:
        super().__init__()
        self.question, self.begin = question, begin

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog") as box:
            box.border_title = self.question
            yield Input(self.begin, select_on_focus=False)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        self.dismiss(event.value.strip() or None)


class Pick(Dialog):
    """One of a list, narrowed by typing."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("escape", "dismiss(None)", "Back"),
        Binding("down", "go(1)", show=False),
        Binding("up", "go(-1)", show=False),
    ]

    def __init__(self, title: str, choices: Sequence[tuple[str, str]], free: bool = False) -> None:
        """choices: what is answered, what is shown; free: what was typed is an answer too."""
        super().__init__()
        self.heading, self.choices, self.free = title, list(choices), free

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog tall") as box:
            box.border_title = self.heading
            box.border_subtitle = "type to narrow · ↑↓ · enter · esc"
            yield Input(placeholder="type to narrow")
            yield OptionList(compact=True)

    def on_mount(self) -> None:
        self._narrow("")

    def _narrow(self, text: str) -> None:
        words = text.lower().split()
        fits = [(key, shown) for key, shown in self.choices if all(w in shown.lower() for w in words)]
        fits.sort(key=lambda fit: _distance(words, fit[1].lower()))
        found = self.query_one(OptionList)
        found.clear_options()
        found.add_options([Option(Text(shown), id=key) for key, shown in fits[:MOST_SHOWN]])
        found.highlighted = 0 if fits else None

    def on_input_changed(self, event: Input.Changed) -> None:
        self._narrow(event.value)

    def action_go(self, by: int) -> None:
        found = self.query_one(OptionList)
        if found.option_count:
            found.highlighted = ((found.highlighted or 0) + by) % found.option_count

    def on_input_submitted(self, event: Input.Submitted) -> None:
        found = self.query_one(OptionList)
        typed = event.value.strip()
        if self.free and typed and (Path(typed).expanduser().exists() or not found.option_count):
            self.dismiss(typed)
        elif found.highlighted is not None:
            self.dismiss(found.get_option_at_index(found.highlighted).id)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(event.option.id)


class Faults(Dialog):
    """The faults of a file, each beside the line where it stands. r reads the file again."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("escape,q", "dismiss(None)", "Back"),
        Binding("r", "dismiss('again')", "Read again"),
        Binding("c", "copy", "Copy"),
    ]

    def __init__(self, path: str, problems: FileProblems) -> None:
        super().__init__()
        self.path, self.problems = path, problems

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog tall wide") as box:
            count = len(self.problems.problems)
            box.border_title = Content(f"{Path(self.path).name}: {count} fault{'s' if count != 1 else ''}")
            box.border_subtitle = "r read again · c copy · esc back"
            with VerticalScroll():
                yield Static(self._text())

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()

    def _text(self) -> Text:
        text = Text()
        lines: dict[str, list[str]] = {}
        for p in self.problems.problems:
            if p.file not in lines:
                try:
                    lines[p.file] = Path(p.file).read_text("utf-8").splitlines()
                except (OSError, UnicodeDecodeError):
                    lines[p.file] = []
            place = f":{p.line}:{p.column}" if p.line else ""
            text.append(f"{Path(p.file).name}{place}", "bold")
            text.append(f"  {p.key}\n" if p.key else "\n", "italic")
            if 0 < p.line <= len(lines[p.file]):
                line, begin = lines[p.file][p.line - 1], max(0, p.column - 30)
                text.append(f"  {line[begin : begin + 68]}\n", "dim")
                text.append(" " * (2 + p.column - 1 - begin) + "^\n", "bold red")
            text.append(f"  {p.message}")
            text.append(f"\n  {p.remedy}\n\n" if p.remedy else "\n\n", "green")
        return text

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(str(self.problems))
        self.notify("copied the faults")


class Help(Dialog):
    """What can be done here: the panel, the part that has the keys, all keys."""

    BINDINGS: ClassVar[list[Any]] = [Binding("escape,q,f1,enter", "dismiss(None)", "Back")]

    def __init__(self, texts: Sequence[str], keys: Sequence[tuple[str, str]]) -> None:
        super().__init__()
        self.texts, self.keys = texts, keys

    def compose(self) -> ComposeResult:
        from textual.widgets import Markdown

        with Vertical(classes="dialog tall wide") as box:
            box.border_title = "Help"
            box.border_subtitle = "↑↓ · esc"
            with VerticalScroll():
                for text in self.texts:
                    yield Markdown(text.strip())
                table = Text()
                for key, told in self.keys:
                    table.append(f"  {key:>14}  ", "bold")
                    table.append(f"{told}\n")
                yield Static(table)

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()


def _distance(words: Sequence[str], shown: str) -> int:
    """How far from its beginning a line has the words; where they begin no word there, farther than all others."""
    found = [re.search(rf"(?<![a-z]){re.escape(word)}", shown) for word in words]
    return sum(match.start() if match else 1000 for match in found)
