"""Saving of the design in the form: file names, and questions before a file is replaced."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from textual.app import App

from railui.desk.state.design_file import CHANGED, FileChanged, PreparedFile, free_path
from railui.desk.state.draft import Draft
from railui.desk.widgets.dialogs import DifferenceDialog, InputDialog
from railui.io.problems import FileProblems


class DesignSaver:
    """One attempt to save a draft, with its dialogs.

    on_change is called after the draft was saved or read again; `then` only once it is saved.
    """

    def __init__(
        self,
        app: App[Any],
        draft: Draft,
        on_change: Callable[[], object],
        then: Callable[[], object] | None = None,
    ) -> None:
        self.app = app
        self.draft = draft
        self.on_change = on_change
        self.then = then

    def save(self) -> None:
        """Save the draft in its file; ask for a file name if it has none."""
        if self.draft.path is None:
            self.save_as()
        else:
            self._attempt(lambda: self._write_or_ask(self.draft.prepare()))

    def save_as(self) -> None:
        """Ask for a file name and save the draft there."""
        path = self.draft.path or free_path(self.draft.new_path)
        self.app.push_screen(InputDialog("Save as", str(path)), self._save_as)

    def _save_as(self, name: str | None) -> None:
        if name is None:
            return
        path = Path(name).expanduser()
        path = path / self.draft.name if path.is_dir() else path
        path = path if path.suffix in (".yaml", ".yml") else path.with_name(f"{path.name}.yaml")
        self._attempt(lambda: self._write_or_ask(self.draft.prepare(path)))

    def _write_or_ask(self, prepared: PreparedFile) -> None:
        if prepared.reasons:
            self._ask(prepared)
        else:
            self._write(prepared)

    def _write(self, prepared: PreparedFile) -> None:
        path = self.draft.write(prepared)
        self.app.notify(f"saved {path}", timeout=3)
        self.on_change()
        if self.then is not None:
            self.then()

    def _attempt(self, action: Callable[[], None]) -> None:
        """Run an action of saving; show why it failed."""
        try:
            action()
        except FileChanged as reason:
            self.app.notify(str(reason), severity="warning")
            if reason.prepared is not None:
                self._ask(reason.prepared)
            else:
                self.save_as()
        except (FileProblems, OSError, RuntimeError) as error:
            self.app.notify(str(error), severity="error", timeout=10)

    def _ask(self, prepared: PreparedFile) -> None:
        """Show what would be replaced, and ask."""
        answers = {"c": "cancel", "n": "save under another name"}
        if CHANGED in prepared.reasons:
            answers["r"] = "read the file again; ctrl+z then returns to this design"
        answers["w"] = "write: the lines marked - are replaced by those marked +"

        def on_answer(answer: str | None) -> None:
            if answer == "w":
                self._attempt(lambda: self._write(prepared))
            elif answer == "n":
                self.save_as()
            elif answer == "r":
                self._attempt(self._read_again)

        question = f"{prepared.path.name} {', and '.join(prepared.reasons)}."
        lines = prepared.difference() or ["the text on disk is the one to be written"]
        self.app.push_screen(DifferenceDialog(question, lines, answers), on_answer)

    def _read_again(self) -> None:
        self.draft.read_again()
        self.on_change()
