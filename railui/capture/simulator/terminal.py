"""Pseudo-terminal as a serial port of a simulated logger, with a cable that can be unplugged and plugged in."""

from __future__ import annotations

import fcntl
import os
import select
import sys
import termios
import time
import tty
from collections.abc import Callable
from pathlib import Path

from railui.capture.simulator.logger import SimulatedLogger

POLL_INTERVAL = 0.02  # s
EMPTY_POLLS = 10  # consecutive polls that must find the terminal empty
DRAIN_TIMEOUT = 30.0  # s for a reader to take the last bytes
READER_TIMEOUT = 10.0  # s in which a reader takes nothing before it counts as absent
MIN_SLEEP = 0.005  # s


class ReaderAbsent(Exception):
    """No reader has taken bytes for the given time."""


class PseudoTerminal:
    """Pseudo-terminal under a name (symbolic link) that stays the same when the cable is plugged in again."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.master = self.slave = -1
        self.plug()

    def plug(self) -> None:
        """Open the terminal and link its name to it."""
        self.master, self.slave = os.openpty()
        os.set_blocking(self.master, False)
        tty.setraw(self.slave)
        new_link = self.link.with_name(f".{self.link.name}.new")
        new_link.unlink(missing_ok=True)
        new_link.symlink_to(os.ttyname(self.slave))
        new_link.replace(self.link)

    def unplug(self) -> None:
        """Remove the name, unless another logger has taken it, and close the terminal."""
        if self.link.is_symlink() and os.readlink(self.link) == os.ttyname(self.slave):
            self.link.unlink(missing_ok=True)
        os.close(self.slave)
        os.close(self.master)

    def await_reader(self, delimiter: bytes) -> None:
        """Wait until a reader has opened the port, set it up and taken two delimiters.

        The system discards what arrives while a port is opened, so the first delimiter may be lost.
        """
        settings = termios.tcgetattr(self.slave)
        while termios.tcgetattr(self.slave) == settings:
            time.sleep(POLL_INTERVAL)
        for _ in range(2):
            self.write(delimiter)
            self.await_empty()

    def unread_bytes(self) -> int:
        """Return the bytes that wait for the reader."""
        return int.from_bytes(fcntl.ioctl(self.slave, termios.FIONREAD, bytes(4)), sys.byteorder)

    def await_empty(self, seconds: float = float("inf")) -> None:
        """Wait until the reader has taken everything, at most for a time [s].

        The system refills the reader's queue a moment after it was emptied, so one poll is not enough.
        """
        deadline = time.monotonic() + seconds
        empty_polls = 0
        while time.monotonic() < deadline and empty_polls < EMPTY_POLLS:
            empty_polls = 0 if self.unread_bytes() else empty_polls + 1
            time.sleep(POLL_INTERVAL)

    def write(self, data: bytes, timeout: float = float("inf")) -> None:
        """Write all data, waiting while the reader is behind; ReaderAbsent if it takes nothing for a time [s]."""
        deadline = time.monotonic() + timeout
        while data:
            try:
                data = data[os.write(self.master, data) :]
                deadline = time.monotonic() + timeout
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise ReaderAbsent from None
                select.select([], [self.master], [], POLL_INTERVAL)


def _always() -> bool:
    """Continue to the end."""
    return True


def play(
    logger: SimulatedLogger,
    terminal: PseudoTerminal,
    pace: float = 1.0,
    unplugged_seconds: float = 1.0,
    should_continue: Callable[[], bool] = _always,
    reader_timeout: float = float("inf"),
) -> None:
    """Send everything a logger transmits.

    Parameters
    ----------
    logger
        Logger to play.
    terminal
        Terminal that it writes to.
    pace
        Speed relative to real time.
    unplugged_seconds
        Time between unplugging the cable and plugging it in [s].
    should_continue
        Function that ends the transmission early by returning False.
    reader_timeout
        Time without a reader after which the transmission ends [s].

    Raises
    ------
    ReaderAbsent
        If no reader takes bytes for that time.
    """
    start = time.monotonic()
    for when, data in logger.transmit():
        ahead = start + when / pace - time.monotonic()
        if ahead > MIN_SLEEP:
            time.sleep(ahead)
        if not should_continue():
            return
        if data:
            terminal.write(data, reader_timeout)
        else:
            terminal.unplug()
            time.sleep(unplugged_seconds)
            terminal.plug()
