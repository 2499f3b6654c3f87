"""Dialogs: questions, text input, choices, problems of a file, help."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from rich.markup import escape
from rich.segment import Segment
from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.await_complete import AwaitComplete
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.events import Click, Key
from textual.screen import ModalScreen
from textual.strip import Strip
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from railui.desk.widgets.cursor import CURSOR_STYLE
from railui.io.problems import FileProblems

MAX_OPTIONS = 400
BACK = "dismiss(None)"
BOX_SHARE = 0.9  # of the height of the screen that a dialog takes at most, as in desk.tcss
SCROLL_KEYS = "page up, page down scroll"
DIFFERENCE_STYLES = {"+": "green", "-": "red"}


class Options(OptionList):
    """List of options whose cursor line is visible in every theme and without colours."""

    def render_line(self, y: int) -> Strip:
        strip = super().render_line(y)
        line = y + int(self.scroll_offset.y)
        if self.highlighted is None or line >= len(self._lines) or self._lines[line][0] != self.highlighted:
            return strip
        segments = [Segment(s.text, (s.style or Style()) + CURSOR_STYLE, s.control) for s in strip]
        return Strip(segments, strip.cell_length)


class Dialog(ModalScreen[str | None]):
    """Dialog with at most one answer, also if keys are pressed in quick succession."""

    is_answered = False
    typed_ahead = ""  # before the input has the focus

    def on_key(self, event: Key) -> None:
        """Keep characters that are typed before the input of the dialog has the focus."""
        if self.focused is None and (event.is_printable or event.key == "enter"):
            self.typed_ahead += "\n" if event.key == "enter" else event.character or ""

    def insert_typed_ahead(self) -> None:
        """Focus the input and insert what was typed before."""
        entry = self.query_one(Input)
        self.set_focus(entry)
        text, enter, _ = self.typed_ahead.partition("\n")
        if text:
            entry.insert_text_at_cursor(text)
        if enter:
            self.call_after_refresh(entry.action_submit)

    def on_click(self, event: Click) -> None:
        """Close the dialog without an answer by a click outside of it."""
        if event.widget is self:
            self.dismiss(None)

    def dismiss(self, result: str | None = None) -> AwaitComplete:
        """Close the dialog with an answer; later answers are ignored."""
        if self.is_answered:
            return AwaitComplete()
        self.is_answered = True
        return super().dismiss(result)


class DialogKeys(Static):
    """Line of keys of a dialog that also answer to the mouse."""

    def __init__(self, actions: Mapping[str, str]) -> None:
        """Create the line; actions: action of the dialog by its key and name."""
        markup = " · ".join(f"[@click=screen.{action}]{escape(text)}[/]" for text, action in actions.items())
        super().__init__(markup, classes="dialog-keys")


class QuestionDialog(Dialog):
    """Question with a key for each answer; escape closes it without an answer."""

    # before those of the list of answers, which is too short for pages
    BINDINGS: ClassVar[list[Any]] = [
        Binding("escape", "dismiss(None)", "Back"),
        Binding("pageup", "page(-1)", show=False, priority=True),
        Binding("pagedown", "page(1)", show=False, priority=True),
    ]

    def __init__(self, question: str, answers: Mapping[str, str]) -> None:
        super().__init__()
        self.question, self.answers = question, answers

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog") as box:
            box.border_title = "?"
            with VerticalScroll(classes="question", can_focus=False):
                yield Static(self.question, markup=False)
            yield Options(*self._options(), compact=True)

    def on_mount(self) -> None:
        self.call_after_refresh(self._limit_question)

    def on_resize(self) -> None:
        self.call_after_refresh(self._limit_question)

    def _limit_question(self) -> None:
        """Give the question the lines that the answers leave; a longer one is scrolled."""
        box, question, answers = self.query_one(".dialog"), self.query_one(".question"), self.query_one(Options)
        taken = answers.get_content_height(self.size, self.size, box.content_size.width)
        lines = max(1, int(BOX_SHARE * self.size.height) - box.gutter.height - taken)
        question.styles.max_height = lines
        box.border_subtitle = SCROLL_KEYS if question.virtual_size.height + question.gutter.height > lines else ""

    def action_page(self, by: int) -> None:
        """Scroll the question by a page."""
        question = self.query_one(".question")
        question.scroll_relative(y=by * max(1, question.scrollable_content_region.height - 1), animate=False)

    def _options(self) -> list[Option]:
        return [Option(f"[b]{escape(key)}[/]  {escape(text)}", id=key) for key, text in self.answers.items()]

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(event.option.id)

    def key_any(self, key: str) -> None:
        if key in self.answers:
            self.dismiss(key)

    def on_key(self, event: Any) -> None:
        if event.character in self.answers:
            event.stop()
            self.dismiss(event.character)


class DifferenceDialog(QuestionDialog):
    """Question about a difference of texts, which is shown above the answers."""

    def __init__(self, question: str, lines: Sequence[str], answers: Mapping[str, str]) -> None:
        """Create the dialog; lines: those of a unified diff."""
        super().__init__(question, answers)
        self.lines = lines

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog wide") as box:
            box.border_title = "?"
            with VerticalScroll(classes="question", can_focus=False):
                yield Static(self.question, markup=False)
                yield Static(self._text(), classes="difference")
            yield Options(*self._options(), compact=True)

    def _text(self) -> Text:
        text = Text(no_wrap=True, overflow="ellipsis")
        for line in self.lines:
            text.append(f"{line}\n", DIFFERENCE_STYLES.get(line[:1], "dim"))
        text.rstrip()
        return text


class InputDialog(Dialog):
    """Input of one line of text."""

    BINDINGS: ClassVar[list[Any]] = [Binding("escape", "dismiss(None)", "Back")]

    def __init__(self, question: str, text: str = "") -> None:
        super().__init__()
        self.question = question
        self.text = text

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog") as box:
            box.border_title = self.question
            yield Input(self.text, select_on_focus=False)
            yield DialogKeys({"enter accept": "accept", "esc back": BACK})

    def on_mount(self) -> None:
        self.insert_typed_ahead()

    async def action_accept(self) -> None:
        """Take the text as it stands."""
        await self.query_one(Input).action_submit()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        self.dismiss(event.value.strip() or None)


class ChoiceDialog(Dialog):
    """Choice from a list that is filtered by typing."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("escape", "dismiss(None)", "Back"),
        Binding("down", "go(1)", show=False),
        Binding("up", "go(-1)", show=False),
    ]

    def __init__(self, title: str, choices: Sequence[tuple[str, str]], free: bool = False) -> None:
        """Create the dialog; choices: (answer, text); free: typed text is an answer too."""
        super().__init__()
        self.heading, self.choices, self.free = title, list(choices), free

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog tall") as box:
            box.border_title = self.heading
            yield Input(placeholder="type to filter")
            yield Options(compact=True)
            yield DialogKeys({"enter take": "accept", "esc back": BACK})

    def on_mount(self) -> None:
        self._filter("")
        self.insert_typed_ahead()

    async def action_accept(self) -> None:
        """Take the highlighted entry, or the text as it stands."""
        await self.query_one(Input).action_submit()

    def _filter(self, text: str) -> None:
        words = text.lower().split()
        matches = [(key, shown) for key, shown in self.choices if all(w in shown.lower() for w in words)]
        matches.sort(key=lambda match: _distance(words, match[1].lower()))
        options = self.query_one(OptionList)
        options.clear_options()
        options.add_options([Option(Text(shown), id=key) for key, shown in matches[:MAX_OPTIONS]])
        options.highlighted = 0 if matches else None

    def on_input_changed(self, event: Input.Changed) -> None:
        self._filter(event.value)

    def action_go(self, by: int) -> None:
        options = self.query_one(OptionList)
        if options.option_count:
            options.highlighted = ((options.highlighted or 0) + by) % options.option_count

    def on_input_submitted(self, event: Input.Submitted) -> None:
        options = self.query_one(OptionList)
        typed = event.value.strip()
        if self.free and typed and (Path(typed).expanduser().exists() or not options.option_count):
            self.dismiss(typed)
        elif options.highlighted is not None:
            self.dismiss(options.get_option_at_index(options.highlighted).id)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(event.option.id)


class ProblemsDialog(Dialog):
    """Problems of a file, each with the line of the file; r reads the file again, e edits it at the first one."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("escape,q", "dismiss(None)", "Back"),
        Binding("r", "dismiss('again')", "Read again"),
        Binding("e", "dismiss('edit')", "Edit"),
        Binding("c", "copy", "Copy"),
    ]

    def __init__(self, path: str, problems: FileProblems) -> None:
        super().__init__()
        self.path, self.problems = path, problems

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog tall wide") as box:
            count = len(self.problems.problems)
            box.border_title = Content(f"{Path(self.path).name}: {count} problem{'s' if count != 1 else ''}")
            edit = {"e edit": "dismiss('edit')"} if self.has_line else {}
            with VerticalScroll():
                yield Static(self.text())
            yield DialogKeys(edit | {"r read again": "dismiss('again')", "c copy": "copy", "esc back": BACK})

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()

    @property
    def has_line(self) -> bool:
        """True if a problem stands in a line of a file."""
        return any(problem.line and Path(problem.file).is_file() for problem in self.problems.problems)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        return self.has_line if parameters == ("edit",) else super().check_action(action, parameters)

    def text(self) -> Text:
        """Return the problems as text."""
        text = Text()
        lines: dict[str, list[str]] = {}
        for p in self.problems.problems:
            if p.file not in lines:
                try:
                    lines[p.file] = Path(p.file).read_text("utf-8").splitlines()
                except (OSError, UnicodeDecodeError):
                    lines[p.file] = []
            location = f":{p.line}:{p.column}" if p.line else ""
            text.append(f"{Path(p.file).name}{location}", "bold")
            text.append(f"  {p.key}\n" if p.key else "\n", "italic")
            if 0 < p.line <= len(lines[p.file]):
                line = lines[p.file][p.line - 1]
                begin = max(0, p.column - 30)
                text.append(f"  {line[begin : begin + 68]}\n", "dim")
                text.append(" " * (2 + p.column - 1 - begin) + "^\n", "bold red")
            text.append(f"  {p.message}")
            text.append(f"\n  {p.remedy}\n\n" if p.remedy else "\n\n", "green")
        return text

    def action_copy(self) -> None:
        self.app.copy_to_clipboard(str(self.problems))
        self.notify("problems copied")


class HelpDialog(Dialog):
    """Help for the panel and the focused widget, and the active keys."""

    BINDINGS: ClassVar[list[Any]] = [Binding("escape,q,f1,enter", "dismiss(None)", "Back")]

    def __init__(self, texts: Sequence[str], keys: Sequence[tuple[str, str]]) -> None:
        super().__init__()
        self.texts, self.keys = texts, keys

    def compose(self) -> ComposeResult:
        from textual.widgets import Markdown

        with Vertical(classes="dialog tall wide") as box:
            box.border_title = "Help"
            with VerticalScroll():
                for text in self.texts:
                    yield Markdown(text.strip())
                table = Text()
                for key, description in self.keys:
                    table.append(f"  {key:>14}  ", "bold")
                    table.append(f"{description}\n")
                yield Static(table)
            yield DialogKeys({"esc back": BACK})

    def on_mount(self) -> None:
        self.query_one(VerticalScroll).focus()


def _distance(words: Sequence[str], shown: str) -> int:
    """Return a sort key: the sum of the positions of the words in a text; 1000 for one inside another word."""
    matches = [re.search(rf"(?<![a-z]){re.escape(word)}", shown) for word in words]
    return sum(match.start() if match else 1000 for match in matches)
