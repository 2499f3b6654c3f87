"""Editor of the user: the command that opens a file at a line."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Final

EDITOR_VARIABLES: Final = ("VISUAL", "EDITOR")
FALLBACKS: Final = ("sensible-editor", "nano", "vi")
LINE_WITH_PATH: Final = {"hx": "", "helix": "", "subl": "", "zed": "", "code": "-g", "codium": "-g"}  # PATH:LINE
WITHOUT_WAIT: Final = {"code": "--wait", "codium": "--wait", "subl": "--wait", "zed": "--wait"}


def editor_command(path: Path, line: int, environment: Mapping[str, str] = os.environ) -> list[str]:
    """Return the command that opens a file at a line, 0 for none.

    The editor is $VISUAL, else $EDITOR, else one that is installed.

    Raises
    ------
    ValueError
        If there is no editor.

    Examples
    --------
    >>> editor_command(Path("a.yaml"), 7, {"EDITOR": "nvim -R"})
    ['nvim', '-R', '+7', 'a.yaml']
    >>> editor_command(Path("a.yaml"), 7, {"EDITOR": "code"})
    ['code', '--wait', '-g', 'a.yaml:7']
    """
    text = next((environment[name] for name in EDITOR_VARIABLES if environment.get(name)), None)
    words = shlex.split(text) if text else [name for name in FALLBACKS if shutil.which(name)][:1]
    if not words:
        raise ValueError("no editor: set EDITOR, for example EDITOR=nano")
    name = Path(words[0]).name
    if name in WITHOUT_WAIT and WITHOUT_WAIT[name] not in words:
        words.append(WITHOUT_WAIT[name])
    if line <= 0:
        return [*words, str(path)]
    if name in LINE_WITH_PATH:
        option = LINE_WITH_PATH[name]
        return [*words, *([option] if option else []), f"{path}:{line}"]
    return [*words, f"+{line}", str(path)]


def run_editor(path: Path, line: int) -> None:
    """Run the editor until it ends; raise ValueError without one, OSError if it cannot be run."""
    subprocess.run(editor_command(path, line), check=False)
