"""Form with a description of the field under the cursor and an input for its value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input, Static

from railui.desk.state.form_rows import Field, Heading, range_text, typed_preview, value_text, warning_text
from railui.desk.widgets.dialogs import ChoiceDialog
from railui.desk.widgets.form import Form
from railui.io.number_format import format_quantity, typeset


class FormPane(Vertical):
    """Pane of a form; posts Form.ValueRequested, which the panel answers with `accept` or `reject`."""

    def __init__(self, title: str, keys: str, *, id: str | None = None) -> None:
        super().__init__(id=id, classes="form-side")
        self.border_title = title
        self.border_subtitle = keys
        self.error = ""
        self.rejected_text: str | None = None  # whose error is shown

    def compose(self) -> ComposeResult:
        yield Form()
        yield Static(classes="about")
        yield Input(classes="entry", compact=True, select_on_focus=False)

    def on_mount(self) -> None:
        self.entry.display = False

    @property
    def form(self) -> Form:
        """Rows of the form."""
        return self.query_one(Form)

    @property
    def entry(self) -> Input:
        """Input for a value."""
        return self.query_one(Input)

    def fill(self, rows: Sequence[Heading | Field], base: Mapping[str, float]) -> None:
        """Show rows."""
        self.form.fill(rows, dict(base))
        self._describe()

    def accept(self) -> None:
        """Confirm the requested value."""
        self.error = ""
        self._close_entry()
        self._describe()

    def reject(self, reason: str) -> None:
        """Show why the requested value was rejected; the typed text stays for correction."""
        self.error = reason
        self.rejected_text = self.entry.value
        self._describe()

    def _describe(self) -> None:
        """Show caption, base, range and source of the field under the cursor."""
        about, field = self.query_one(".about", Static), self.form.field
        if field is None:
            about.update("", layout=False)
            return
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(field.caption[:1].upper() + field.caption[1:], "bold")
        if self.error:
            text.append(f"\n{self.error}", "red")
            about.update(text, layout=False)
            return
        if warning := warning_text(field):
            text.append(f"\n{warning}", "yellow")
        else:
            base = self.form.base.get(field.path)
            is_changed = base is not None and base != field.value
            details = [typeset(f"base {format_quantity(base, field.unit)}")] if base is not None and is_changed else []
            text.append("\n" + " · ".join(detail for detail in (*details, range_text(field)) if detail))
        text.append(f"\nsource: {field.source}" if field.source else "\n", "dim")
        about.update(text, layout=False)

    @on(Form.FieldSelected)
    def _selected(self) -> None:
        self.error = ""
        self._describe()

    @on(Form.EntryRequested)
    def _typing(self, event: Form.EntryRequested) -> None:
        event.stop()
        field = event.field
        if event.is_continued:
            self._continue(event.text)
            return
        text = event.text or ("" if field.value is None else value_text(field))
        if not event.text and isinstance(field.value, str | bool):
            text = str(field.value).lower() if isinstance(field.value, bool) else field.value
        self.entry.display = True
        self.entry.value = text
        self.entry.focus()
        self.entry.cursor_position = len(text)

    def _continue(self, character: str) -> None:
        """Append what was typed before the input had the focus."""
        if character == "\n":
            self.form.is_typing = False
            if self.form.field is not None:
                self.post_message(Form.ValueRequested(self.form.field.path, self.form.field.typed(self.entry.value)))
            return
        self.entry.value += character
        self.entry.cursor_position = len(self.entry.value)

    @on(Input.Changed)
    def _preview(self, event: Input.Changed) -> None:
        """Show the typed text as it will be read."""
        event.stop()
        field = self.form.field
        if field is None or not self.entry.display or (self.error and event.value == self.rejected_text):
            return
        self.error = ""
        preview, is_rejected = typed_preview(field, event.value)
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(field.caption[:1].upper() + field.caption[1:], "bold")
        text.append(f"\n{preview}", "red" if is_rejected else "")
        text.append("\nenter sets the value, escape leaves it", "dim")
        self.query_one(".about", Static).update(text, layout=False)

    @on(Input.Submitted)
    def _typed(self, event: Input.Submitted) -> None:
        event.stop()
        if self.form.field is not None:
            self.post_message(Form.ValueRequested(self.form.field.path, self.form.field.typed(event.value)))

    def on_key(self, event: Any) -> None:
        if event.key == "escape" and self.entry.has_focus:
            event.stop()
            self.accept()

    def _close_entry(self) -> None:
        self.form.is_typing = False
        if self.entry.display:
            self.entry.display = False
            self.form.focus()

    @on(Form.SearchRequested)
    def _search(self, event: Form.SearchRequested) -> None:
        event.stop()
        fields = [row for row in self.form.rows if isinstance(row, Field)]
        choices = [(f.path, f"{f.path:44} {f.caption}") for f in fields]
        self.app.push_screen(ChoiceDialog("Find a parameter", choices), self._on_parameter_chosen)

    def _on_parameter_chosen(self, path: str | None) -> None:
        if path is not None:
            self.form.select(path)
