"""Serial port of a recording: opened exclusively, and refused where it is the terminal of a session."""

from __future__ import annotations

import os
from pathlib import Path

import serial

PROCESSES = Path("/proc")


def open_port(name: str, baud: int, timeout: float) -> serial.Serial:
    """Open a port for reading within a time [s].

    Raises
    ------
    serial.SerialException
        If it does not open, or is the controlling terminal of a session: reading it would take what is typed there.
    """
    if (process := session_on(name)) is not None:
        raise serial.SerialException(f"it is the terminal of process {process}, not a logger")
    return serial.Serial(name, baud, timeout=timeout, exclusive=True)


def session_on(name: str) -> str | None:
    """Return number and name of a process whose controlling terminal is this port, as far as the system shows it."""
    try:
        device = os.stat(name).st_rdev
        processes = [each for each in PROCESSES.iterdir() if each.name.isdigit()]
    except OSError:
        return None
    for each in processes if device else ():
        try:
            head, _, fields = (each / "stat").read_text().rpartition(")")
        except OSError:  # it has ended
            continue
        if _device(int(fields.split()[4])) == device:
            return f"{each.name} ({head.partition('(')[2]})"
    return None


def _device(number: int) -> int:
    """Return the device of a terminal's number in /proc/PID/stat: minor in bits 0 to 7 and 20 to 31, major between."""
    return os.makedev(number >> 8 & 0xFFF, (number & 0xFF) | (number >> 12 & 0xFFF00))
