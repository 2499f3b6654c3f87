"""A form with what is known of the line under its cursor, and the line in which a value is typed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input, Static

from railui.desk.presenters.written import range_text, value_text
from railui.desk.state.draft import Field
from railui.desk.widgets.dialogs import Pick
from railui.desk.widgets.form import Form, Head
from railui.io.number_format import display, pretty


class FormSide(Vertical):
    """Posts Form.Wanted, whether a value was slid or typed; its panel answers with `accepted` or `refused`."""

    def __init__(self, title: str, keys: str, *, id: str | None = None) -> None:
        super().__init__(id=id, classes="form-side")
        self.border_title, self.border_subtitle = title, keys
        self.trouble = ""

    def compose(self) -> ComposeResult:
        yield Form()
        yield Static(classes="about")
        yield Input(classes="entry", compact=True, select_on_focus=False)

    def on_mount(self) -> None:
        self.entry.display = False

    @property
    def form(self) -> Form:
        """The lines."""
        return self.query_one(Form)

    @property
    def entry(self) -> Input:
        """Where a value is typed."""
        return self.query_one(Input)

    def fill(self, rows: Sequence[Head | Field], base: Mapping[str, float]) -> None:
        """The lines anew."""
        self.form.fill(rows, dict(base))
        self._about()

    def accepted(self) -> None:
        """What was wanted is done."""
        self.trouble = ""
        self._put_away()
        self._about()

    def refused(self, reason: str) -> None:
        """What was wanted cannot be: said below the name; what was typed stays there to be mended."""
        self.trouble = reason
        self._about()

    def _about(self) -> None:
        """Three lines on the parameter under the cursor."""
        about, field = self.query_one(".about", Static), self.form.field
        if field is None:
            about.update("", layout=False)
            return
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(field.caption[:1].upper() + field.caption[1:], "bold")
        if self.trouble:
            text.append(f"\n{self.trouble}", "red")
            about.update(text, layout=False)
            return
        told = [range_text(field)]
        base = self.form.base.get(field.path)
        if base is not None and base != field.value:
            told.insert(0, pretty(f"base {display(base, field.unit)}"))
        text.append("\n" + " · ".join(t for t in told if t))
        text.append(f"\nfrom {field.source}" if field.source else "\n", "dim")
        about.update(text, layout=False)

    @on(Form.Selected)
    def _selected(self) -> None:
        self.trouble = ""
        self._about()

    @on(Form.Typing)
    def _typing(self, event: Form.Typing) -> None:
        event.stop()
        field = event.field
        if event.more:
            self._more(event.begin)
            return
        whole = event.begin or ("" if field.value is None else value_text(field))
        if not event.begin and isinstance(field.value, str | bool):
            whole = str(field.value).lower() if isinstance(field.value, bool) else field.value
        self.entry.display = True
        self.entry.value = whole
        self.entry.focus()
        self.entry.cursor_position = len(whole)

    def _more(self, letter: str) -> None:
        """What was typed before the entry had the keys."""
        if letter == "\n":
            self.form.typing = False
            if self.form.field is not None:
                self.post_message(Form.Wanted(self.form.field.path, _given(self.entry.value)))
            return
        self.entry.value += letter
        self.entry.cursor_position = len(self.entry.value)

    @on(Input.Submitted)
    def _typed(self, event: Input.Submitted) -> None:
        event.stop()
        if self.form.field is not None:
            self.post_message(Form.Wanted(self.form.field.path, _given(event.value)))

    def on_key(self, event: Any) -> None:
        if event.key == "escape" and self.entry.has_focus:
            event.stop()
            self.accepted()

    def _put_away(self) -> None:
        self.form.typing = False
        if self.entry.display:
            self.entry.display = False
            self.form.focus()

    @on(Form.Search)
    def _search(self, event: Form.Search) -> None:
        event.stop()
        fields = [row for row in self.form.rows if isinstance(row, Field)]
        choices = [(f.path, f"{f.path:44} {f.caption}") for f in fields]
        self.app.push_screen(Pick("Find a parameter", choices), self._found)

    def _found(self, path: str | None) -> None:
        if path is not None:
            self.form.choose(path)


def _given(text: str) -> Any:
    """What was typed: a number where it is one, else a quantity or a word."""
    try:
        return float(text)
    except ValueError:
        return text.strip()
