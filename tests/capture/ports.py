"""Loggers behind real pseudo-terminals: in a process of their own, or many in one thread."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from railui.capture.protocol.frames import Channel
from railui.capture.simulator.logger import Faults, Logger
from railui.capture.simulator.terminal import Terminal

RAILUI = [sys.executable, "-m", "railui"]
PATIENCE = 60.0  # s: this machine may be busy


def until(true: Any, seconds: float = PATIENCE) -> None:
    """Waits for a condition; fails where it does not come."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not come to pass"
        time.sleep(0.02)


def recorder(port: Path, out: Path, *more: str) -> subprocess.Popen[str]:
    """`railui capture` in a process of its own; markers may be written to its stdin."""
    words = [*RAILUI, "capture", str(port), "-o", str(out), *more]
    pipe = subprocess.PIPE
    return subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=pipe, text=True)


@contextmanager
def demo_logger(port: Path, *more: str) -> Iterator[subprocess.Popen[str]]:
    """`railui capture logger` in a process of its own, there when its port is."""
    words = [*RAILUI, "capture", "logger", "--link", str(port), "-q", *more]
    child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        until(lambda: port.exists() or child.poll() is not None)
        yield child
    finally:
        child.terminate()
        child.communicate()


def truth_of(child: subprocess.Popen[str]) -> dict[str, int]:
    """What a demo logger says that it sent."""
    out, _ = child.communicate(timeout=PATIENCE)
    found: dict[str, int] = json.loads(out)
    return found


def told(directory: Path) -> dict[str, Any]:
    """What a recording says of itself."""
    found: dict[str, Any] = json.loads((directory / "capture.json").read_text())
    return found


def small_logger(seconds: float = 3600.0, seed: int = 0, rate: float = 200.0, **faults: float) -> Logger:
    """Four channels whose first counts the samples."""
    channels = (Channel("count", "1", "I"), *(Channel(f"c{i}", "m/s^2", "h", 0.001) for i in range(3)))
    count = round(seconds * rate)
    random = np.random.default_rng(seed)
    series = {"count": np.arange(count, dtype=float), **{c.name: random.normal(size=count) for c in channels[1:]}}
    return Logger(channels, series, rate, faults=Faults(seed=seed, **faults), hello_every=0.5)  # type: ignore[arg-type]


class Feeder:
    """Plays many loggers, each on a terminal of its own, in real time from one thread."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.sent: dict[str, tuple[Terminal, float, Iterator[tuple[float, bytes]]]] = {}
        self.last: dict[str, float] = {}  # s: when the newest frame was due that was written
        self._next: dict[str, tuple[float, bytes]] = {}
        self._lock, self._stop = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Feeder:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        for terminal, _, _ in self.sent.values():
            terminal.unplug()

    def add(self, name: str, logger: Logger) -> Path:
        """A new logger, which begins now; returns its port."""
        terminal = Terminal(self.home / name)
        os.set_blocking(terminal.master, False)
        with self._lock:
            self.sent[name] = (terminal, time.monotonic(), logger.sent())
        return terminal.link

    def halt(self, name: str) -> tuple[float, int]:
        """Stops one logger: when its newest frame was due, and the bytes of it that nobody has read."""
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
        terminal, begun, frames = self.sent[name]
        while True:
            when, data = self._next.pop(name, None) or next(frames)
            if begun + when > time.monotonic():
                self._next[name] = (when, data)
                return
            with suppress(BlockingIOError):  # nobody reads yet: a real line loses it too
                os.write(terminal.master, data)
                self.last[name] = when
