"""The ports that the desk can record: the demo logger, and the serial ports of this machine."""

from __future__ import annotations

from typing import Final

DEMO: Final = "demo"


def ports() -> list[tuple[str, str]]:
    """The demo logger and the serial ports of this machine: name, line to show."""
    from serial.tools.list_ports import comports

    found = [(DEMO, "demo             a simulated vehicle with sensors, in a process of its own")]
    return found + [(p.device, f"{p.device:16} {p.description}") for p in sorted(comports(), key=lambda p: p.device)]
