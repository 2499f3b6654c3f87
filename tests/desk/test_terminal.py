"""Desk in a real terminal: tmux sends the keys and captures the screen."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

TMUX = shutil.which("tmux")
pytestmark = pytest.mark.skipif(TMUX is None, reason="tmux is not installed: apt-get install tmux")


class Terminal:
    """Terminal of 120x40 cells that runs a command."""

    def __init__(self, home: Path) -> None:
        self.words = [str(TMUX), "-S", str(home / "tmux")]
        self.home = home

    def tmux(self, *words: str) -> str:
        return subprocess.run([*self.words, *words], capture_output=True, text=True, check=True).stdout

    def open(self, command: str) -> None:
        environment = f"env -u COLUMNS -u LINES XDG_STATE_HOME={self.home}/state LANG=C.UTF-8 TERM=tmux-256color"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", "120", "-y", "40", f"{environment} sh")
        self.tmux("send-keys", f"{command}; echo ended $?", "Enter")

    def keys(self, *keys: str) -> None:
        for key in keys:
            self.tmux("send-keys", key)
            time.sleep(0.1)

    def screen(self) -> str:
        return self.tmux("capture-pane", "-p")

    def until(self, text: str, seconds: float = 40.0) -> str:
        for _ in range(int(seconds / 0.2)):
            if text in (screen := self.screen()):
                return screen
            time.sleep(0.2)
        raise AssertionError(f"{text!r} is not on\n{self.screen()}")


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    opened = Terminal(tmp_path)
    yield opened
    subprocess.run([*opened.words, "kill-server"], capture_output=True)


def test_a_design_is_edited_and_the_terminal_restored(terminal: Terminal, bogie: Path) -> None:
    text = bogie.read_text()
    line = next(i for i, one in enumerate(text.splitlines(), 1) if "mass: 2900" in one)
    bogie.write_text(text.replace("mass: 2900", "mass: 2900 N"))
    editor = bogie.with_name("editor")
    editor.write_text(f"#!/bin/sh\necho $@ > {bogie.parent}/words\nsed -i 's/2900 N/2900/' $2\n")
    editor.chmod(0o755)
    terminal.open(f"EDITOR={editor} {sys.executable} -m railui desk {bogie}")
    terminal.until("e edit")
    terminal.keys("e")  # the editor takes the terminal, mends the file and gives the terminal back
    terminal.until("SATISFACTORY")
    assert bogie.with_name("words").read_text() == f"+{line} {bogie}\n"
    terminal.keys("/")
    terminal.until("Find a parameter")
    terminal.keys("p", "r", "i")
    terminal.until("   pri ")
    terminal.keys("Enter")
    terminal.until("▸lateral stiffness")
    terminal.keys("5", "Space", "M", "N", "/", "m", "Enter")
    screen = terminal.until("━━ base")  # the design was evaluated again
    assert "displacement spectrum" in screen and "┤" in screen
    terminal.keys("C-s")
    terminal.until("saved")
    terminal.keys("C-q")
    screen = terminal.until("ended 0")
    assert "SATISFACTORY" not in screen  # the screen belongs to the shell again
    assert "lateral_stiffness: 5 MN/m" in bogie.read_text()


def test_railui_opens_the_desk_on_a_terminal_and_shows_help_without_one(terminal: Terminal, bogie: Path) -> None:
    terminal.open(f"cd {bogie.parent} && {sys.executable} -m railui")
    terminal.until("Open a design, campaign, study or fleet")
    terminal.keys("Enter")
    terminal.until("SATISFACTORY")
    terminal.keys("C-q")
    terminal.until("ended 0")
    process = subprocess.run([sys.executable, "-m", "railui"], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert process.returncode == 0 and "Usage: railui" in process.stdout


def test_an_internal_error_restores_the_terminal_and_names_the_log(terminal: Terminal, bogie: Path) -> None:
    broken = bogie.with_name("broken.py")
    broken.write_text(
        "from pathlib import Path\n"
        "import railui.desk.panels.design as design\n"
        "def fails(*_): raise ZeroDivisionError('on purpose')\n"
        "design.DesignPanel.action_add = fails\n"
        "from railui.desk.app import run\n"
        f"raise SystemExit(run(Path({str(bogie)!r})))\n"
    )
    terminal.open(f"{sys.executable} {broken}")
    terminal.until("SATISFACTORY")
    terminal.keys("a")
    text = terminal.until("ended 1").replace("\n", "")  # a long path is wrapped
    assert "ZeroDivisionError: on purpose" in text and "desk.log" in text
    log = terminal.home / "state/railui/desk.log"
    assert "on purpose" in log.read_text() and os.path.getsize(log) > 200
