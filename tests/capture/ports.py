"""Simulated loggers on real pseudo-terminals: in a process of their own, or many in one thread."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from railui.capture.protocol.messages import Channel
from railui.capture.simulator.logger import Faults, SimulatedLogger
from railui.capture.simulator.terminal import PseudoTerminal

RAILUI = [sys.executable, "-m", "railui"]
TIMEOUT = 60.0  # s: the machine may be busy


def wait_until(condition: Callable[[], bool], seconds: float = TIMEOUT) -> None:
    """Wait for a condition; fail after a time [s]."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "timeout"
        time.sleep(0.02)


def start_recorder(port: Path, out: Path, *more: str) -> subprocess.Popen[str]:
    """Start `railui capture` in a process; markers may be written to its stdin."""
    words = [*RAILUI, "capture", str(port), "-o", str(out), *more]
    pipe = subprocess.PIPE
    return subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=pipe, text=True)


@contextmanager
def running_logger(port: Path, *more: str) -> Iterator[subprocess.Popen[str]]:
    """Run `railui capture logger` in a process; the context begins when its port exists."""
    words = [*RAILUI, "capture", "logger", "--link", str(port), "-q", *more]
    child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: port.exists() or child.poll() is not None)
        yield child
    finally:
        child.terminate()
        child.communicate()


def counts_sent_by(child: subprocess.Popen[str]) -> dict[str, int]:
    """Return the counts that a logger prints at its end."""
    out, _ = child.communicate(timeout=TIMEOUT)
    counts: dict[str, int] = json.loads(out)
    return counts


def capture_report(directory: Path) -> dict[str, Any]:
    """Return capture.json of a recording."""
    report: dict[str, Any] = json.loads((directory / "capture.json").read_text())
    return report


def small_logger(seconds: float = 3600.0, seed: int = 0, rate: float = 200.0, **faults: float) -> SimulatedLogger:
    """Return a logger of four channels, the first of which counts the samples."""
    channels = (Channel("count", "1", "I"), *(Channel(f"c{i}", "m/s^2", "h", 0.001) for i in range(3)))
    count = round(seconds * rate)
    random = np.random.default_rng(seed)
    series = {"count": np.arange(count, dtype=float), **{c.name: random.normal(size=count) for c in channels[1:]}}
    return SimulatedLogger(channels, series, rate, faults=Faults(seed=seed, **faults), hello_interval=0.5)  # type: ignore[arg-type]


class LoggerPlayer:
    """Player of many loggers, each on its own terminal, in real time from one thread."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.sent: dict[str, tuple[PseudoTerminal, float, Iterator[tuple[float, bytes]]]] = {}
        self.last: dict[str, float] = {}  # s: due time of the newest written frame
        self._next: dict[str, tuple[float, bytes]] = {}
        self._lock, self._stop = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> LoggerPlayer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        for terminal, _, _ in self.sent.values():
            terminal.unplug()

    def add(self, name: str, logger: SimulatedLogger) -> Path:
        """Start a logger; return its port."""
        terminal = PseudoTerminal(self.home / name)
        os.set_blocking(terminal.master, False)
        with self._lock:
            self.sent[name] = (terminal, time.monotonic(), logger.transmit())
        return terminal.link

    def halt(self, name: str) -> tuple[float, int]:
        """Stop a logger; return the due time of its newest frame, and its unread bytes."""
        with self._lock:
            terminal, _, _ = self.sent.pop(name)
        os.set_blocking(terminal.slave, False)
        unread = 0
        with suppress(BlockingIOError):
            while data := os.read(terminal.slave, 65536):
                unread += len(data)
        terminal.unplug()
        return self.last[name], unread

    def _run(self) -> None:
        while not self._stop.wait(0.01):
            with self._lock:
                for name in self.sent:
                    self._play(name)

    def _play(self, name: str) -> None:
        terminal, start, frames = self.sent[name]
        while True:
            when, data = self._next.pop(name, None) or next(frames)
            if start + when > time.monotonic():
                self._next[name] = (when, data)
                return
            with suppress(BlockingIOError):  # no reader yet: a real line loses the data too
                os.write(terminal.master, data)
                self.last[name] = when
