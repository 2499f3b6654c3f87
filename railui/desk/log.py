"""Where the desk keeps what it needs at its next start, and the traces of its own faults."""

from __future__ import annotations

import json
import os
import time
import traceback
from pathlib import Path
from typing import Any

from railui.io.atomic import write_text


def home() -> Path:
    """The directory of the desk's own files: $XDG_STATE_HOME/railui, or ~/.local/state/railui."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "railui"


def keep_trace(error: BaseException) -> Path:
    """Appends the trace of an error to the log; returns its path, whether or not it could be written."""
    path = home() / "desk.log"
    text = "".join(traceback.format_exception(error))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')}\n{text}\n")
    except OSError:
        pass
    return path


def remembered() -> dict[str, Any]:
    """What the last session left; empty where there is nothing that can be read."""
    try:
        found = json.loads((home() / "desk.json").read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def remember(state: dict[str, Any]) -> None:
    """Keeps it for the next start; a place that cannot be written is no reason to fail."""
    try:
        write_text(home() / "desk.json", json.dumps(state, indent=1) + "\n")
    except OSError:
        return
