"""The desk in a real terminal: tmux sends the keys and shows the screen."""

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
pytestmark = pytest.mark.skipif(TMUX is None, reason="tmux is not here: apt-get install tmux")


class Terminal:
    """A terminal of 120x40 in which a command runs."""

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
            if text in (seen := self.screen()):
                return seen
            time.sleep(0.2)
        raise AssertionError(f"{text!r} was never seen on\n{self.screen()}")


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    found = Terminal(tmp_path)
    yield found
    subprocess.run([*found.words, "kill-server"], capture_output=True)


def test_a_design_is_changed_and_the_terminal_given_back(terminal: Terminal, bogie: Path) -> None:
    terminal.open(f"{sys.executable} -m railui desk {bogie}")
    terminal.until("SATISFACTORY")
    terminal.keys("/")
    terminal.until("Find a parameter")
    terminal.keys("p", "r", "i", "Enter", "5", "Space", "M", "N", "/", "m", "Enter")
    seen = terminal.until("━━ base")  # it was ridden anew, beside what it is compared with
    assert "displacement spectrum" in seen and "┤" in seen
    terminal.keys("C-s")
    terminal.until("saved")
    terminal.keys("C-q")
    seen = terminal.until("ended 0")
    assert "SATISFACTORY" not in seen  # the screen is the shell's again
    assert "lateral_stiffness: 5 MN/m" in bogie.read_text()


def test_railui_alone_opens_the_desk_on_a_terminal_and_helps_without_one(terminal: Terminal, bogie: Path) -> None:
    terminal.open(f"cd {bogie.parent} && {sys.executable} -m railui")
    terminal.until("Open a design or a campaign")
    terminal.keys("Enter")
    terminal.until("SATISFACTORY")
    terminal.keys("C-q")
    terminal.until("ended 0")
    told = subprocess.run([sys.executable, "-m", "railui"], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert told.returncode == 0 and "Usage: railui" in told.stdout


def test_a_fault_of_our_own_gives_the_terminal_back_and_names_the_log(terminal: Terminal, bogie: Path) -> None:
    broken = bogie.with_name("broken.py")
    broken.write_text(
        "from pathlib import Path\n"
        "import railui.desk.panels.design as design\n"
        "def fails(*_): raise ZeroDivisionError('on purpose')\n"
        "design.DesignPanel.action_base = fails\n"
        "from railui.desk.app import run\n"
        f"raise SystemExit(run(Path({str(bogie)!r})))\n"
    )
    terminal.open(f"{sys.executable} {broken}")
    terminal.until("SATISFACTORY")
    terminal.keys("b")
    seen = terminal.until("ended 1")
    told = seen.replace("\n", "")  # a long path is broken over two lines
    assert "ZeroDivisionError: on purpose" in told and "desk.log" in told
    log = terminal.home / "state/railui/desk.log"
    assert "on purpose" in log.read_text() and os.path.getsize(log) > 200
