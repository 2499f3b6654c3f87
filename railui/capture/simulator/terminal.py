"""A pseudo-terminal as a serial port: a software logger plays on it, its cable can be pulled out and put in again."""

from __future__ import annotations

import fcntl
import os
import sys
import termios
import time
import tty
from collections.abc import Callable
from pathlib import Path

from railui.capture.simulator.logger import Logger

LOOK, LOOKS = 0.02, 10  # s between two looks at a terminal, and as many in a row must find it empty
LEAVE = 30.0  # s for a reader to take the last bytes


class Terminal:
    """A pseudo-terminal under a name that stays while the cable is pulled and put in again."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.master = self.slave = -1
        self.plug()

    def plug(self) -> None:
        """Opens it and lays the name to it."""
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        beside = self.link.with_name(f".{self.link.name}.new")
        beside.unlink(missing_ok=True)
        beside.symlink_to(os.ttyname(self.slave))
        beside.replace(self.link)

    def unplug(self) -> None:
        """Takes the name away and hangs up."""
        self.link.unlink(missing_ok=True)
        os.close(self.slave)
        os.close(self.master)

    def await_reader(self, delimiter: bytes) -> None:
        """Returns once somebody has opened the port, set it up and reads: it takes two delimiters.

        What is there while a port is opened is thrown away, so the first may be lost.
        """
        own = termios.tcgetattr(self.slave)
        while termios.tcgetattr(self.slave) == own:
            time.sleep(LOOK)
        for _ in range(2):
            self.write(delimiter)
            self.await_empty()

    def unread(self) -> int:
        """Bytes that wait for the reader."""
        return int.from_bytes(fcntl.ioctl(self.slave, termios.FIONREAD, bytes(4)), sys.byteorder)

    def await_empty(self, seconds: float = float("inf")) -> None:
        """Gives the reader so much time to take what was written.

        The system refills the reader's queue from its own a moment after it was emptied: one look would not do.
        """
        until, empty = time.monotonic() + seconds, 0
        while time.monotonic() < until and empty < LOOKS:
            empty = 0 if self.unread() else empty + 1
            time.sleep(LOOK)

    def write(self, data: bytes) -> None:
        """All of it, as fast as the reader takes it."""
        while data:
            data = data[os.write(self.master, data) :]


def play(
    logger: Logger, terminal: Terminal, pace: float = 1.0, unplugged: float = 1.0, go: Callable[[], bool] = lambda: True
) -> None:
    """Sends it all, `pace` times as fast as it was; unplugged for so many seconds; ends early where `go` says so."""
    begun = time.monotonic()
    for when, data in logger.sent():
        ahead = begun + when / pace - time.monotonic()
        if ahead > 0.005:
            time.sleep(ahead)
        if not go():
            return
        if data:
            terminal.write(data)
        else:
            terminal.unplug()
            time.sleep(unplugged)
            terminal.plug()
