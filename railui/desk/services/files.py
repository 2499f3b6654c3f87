"""Files of the desk: session state, error log, kinds of the files to open."""

from __future__ import annotations

import json
import os
import time
import traceback
from pathlib import Path
from typing import Any, Final

from railui.io.atomic import write_text
from railui.io.problems import FileProblems
from railui.io.schema_line import document_kind
from railui.io.yaml_document import load_yaml as load_yaml

OPENED_KINDS: Final = ("campaign", "study", "fleet")  # besides designs


def state_directory() -> Path:
    """Return the directory of the desk's own files: $XDG_STATE_HOME/railui, or ~/.local/state/railui."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "railui"


def log_traceback(error: BaseException) -> Path:
    """Append the traceback of an error to the log and return its path, even if it could not be written."""
    path = state_directory() / "desk.log"
    text = "".join(traceback.format_exception(error))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')}\n{text}\n")
    except OSError:
        pass
    return path


def failure_text(error: Exception) -> str:
    """Return the text of an error that ended a computation; an internal one is logged, and the desk continues."""
    if isinstance(error, ValueError | RuntimeError | OSError | ArithmeticError):
        return str(error)
    return f"{type(error).__name__}: {error} (traceback in {log_traceback(error)})"


def load_state() -> dict[str, Any]:
    """Load the state of the last session; an empty dictionary if there is none that can be read."""
    try:
        state = json.loads((state_directory() / "desk.json").read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return state if isinstance(state, dict) else {}


def save_state(state: dict[str, Any]) -> None:
    """Save the state for the next session; a directory that cannot be written is ignored."""
    try:
        write_text(state_directory() / "desk.json", json.dumps(state, indent=1) + "\n")
    except OSError:
        return


def file_kind(path: Path) -> str:
    """Return the kind of a file: campaign (also for a directory), study, fleet or design.

    Files that cannot be read count as designs: reading them as such reports their problems.
    """
    if path.is_dir():
        return "campaign"
    try:
        kind = document_kind(load_yaml(path).value)
    except (FileProblems, OSError):
        return "design"
    return kind if kind in OPENED_KINDS else "design"
