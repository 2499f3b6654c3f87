"""Terminals of simulated loggers: they end without a reader, and leave and refuse the terminals of others."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import serial

from railui.capture.recorder.port import open_port
from railui.capture.simulator.terminal import PseudoTerminal
from tests.capture.ports import running_logger, wait_until
from tests.cli.runner import run


def test_a_logger_ends_once_its_reader_has_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("railui.capture.simulator.terminal.READER_TIMEOUT", 0.3)
    words = ("--seconds", "60", "--pace", "1000", "--once", "--now", "--link", str(tmp_path / "port"))
    done = run("capture", "logger", *words)
    assert done.exit_code == 0 and "ended early: nobody has read" in done.stderr
    assert 0 < json.loads(done.stdout)["samples"] < 60 * 200 and not (tmp_path / "port").is_symlink()


def test_ctrl_c_ends_a_logger_without_a_reader(tmp_path: Path) -> None:
    with running_logger(tmp_path / "port", "--seconds", "60", "--pace", "1000", "--now") as logger:
        time.sleep(0.5)  # the terminal is full
        logger.send_signal(signal.SIGINT)
        assert logger.wait(5.0) == 130
    assert not (tmp_path / "port").is_symlink()


def test_a_logger_leaves_the_name_that_another_has_taken(tmp_path: Path) -> None:
    first, second = PseudoTerminal(tmp_path / "port"), PseudoTerminal(tmp_path / "port")
    first.unplug()
    assert os.path.realpath(tmp_path / "port") == os.ttyname(second.slave)
    second.unplug()
    assert not (tmp_path / "port").is_symlink()


def test_the_terminal_of_a_session_is_no_port(tmp_path: Path) -> None:
    child, master = pty.fork()
    if not child:
        os.execvp("sleep", ["sleep", "60"])
    try:
        wait_until(lambda: b"sleep" in Path(f"/proc/{child}/cmdline").read_bytes())
        name = os.readlink(f"/proc/{child}/fd/0")
        (tmp_path / "logger").symlink_to(name)
        done = run("capture", str(tmp_path / "logger"), "-o", str(tmp_path / "out"), "--seconds", "1")
        assert done.exit_code == 3 and f"is the terminal of process {child} (sleep)" in done.stderr
        assert not (tmp_path / "out").exists()
        checked = run("capture", str(tmp_path / "logger"), "--check")
        assert checked.exit_code == 3 and "is the terminal of process" in checked.stderr
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(master)


def test_a_terminal_without_a_session_is_a_port(tmp_path: Path) -> None:
    terminal = PseudoTerminal(tmp_path / "port")
    open_port(str(terminal.link), 115200, 0.1).close()
    terminal.unplug()
    with pytest.raises(serial.SerialException):
        open_port(str(tmp_path / "port"), 115200, 0.1)


DEMO = """\
import sys, time
from railui.capture.simulator.demo_logger import DemoLogger
with DemoLogger() as logger:
    print(logger._child.pid, flush=True)
    time.sleep(600)
"""


def test_the_demo_logger_ends_with_a_killed_recorder() -> None:
    parent = subprocess.Popen([sys.executable, "-c", DEMO], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    assert Path(f"/proc/{child}").exists()
    parent.kill()
    parent.wait()
    wait_until(lambda: not is_running(child), 20.0)
    parent.stdout.close()


def is_running(process: int) -> bool:
    """Return whether a process still runs; one that ended may wait for its parent."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
