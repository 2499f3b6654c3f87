"""Editor of the user in the place of the desk, at the line of a fault or of a value."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from textual.app import App, SuspendNotSupported

from railui.desk.services.editor import run_editor
from railui.desk.widgets.dialogs import ProblemsDialog
from railui.io.problems import FileProblems


def edit_file(app: App[Any], path: Path, line: int) -> bool:
    """Suspend the desk while the user edits a file; return False with a message if that is not possible."""
    try:
        with app.suspend():
            run_editor(path, line)
    except SuspendNotSupported:
        app.notify("an editor needs the terminal of the desk: edit the file elsewhere, r reads it again")
        return False
    except (ValueError, OSError) as error:
        app.notify(str(error), severity="error")
        return False
    return True


def show_problems(app: App[Any], path: Path, problems: FileProblems, read_again: Callable[[], object]) -> None:
    """Show the problems of a file; read it again when the user asks for it, or has edited it."""

    def on_answer(answer: str | None) -> None:
        if answer == "again":
            read_again()
        elif answer == "edit":
            first = next(problem for problem in problems.problems if problem.line)
            if edit_file(app, Path(first.file), first.line):
                read_again()
            else:
                show_problems(app, path, problems, read_again)

    app.push_screen(ProblemsDialog(str(path), problems), on_answer)
