"""The demo logger as a process of its own, and what can be heard of the ports of this machine."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Final, Self

DEMO: Final = "demo"
PATIENCE: Final = 60.0  # s until the demo logger has opened its port


class DemoLogger:
    """A simulated vehicle behind a serial port. RuntimeError where it does not start."""

    def __enter__(self) -> Self:
        self._home = tempfile.TemporaryDirectory(prefix="railui-demo-")
        port = Path(self._home.name) / "logger"
        words = [sys.executable, "-m", "railui", "capture", "logger", "--link", str(port), "-q"]
        self._child = subprocess.Popen(words, start_new_session=True, stdin=subprocess.DEVNULL)
        self.port = str(port)
        until = time.monotonic() + PATIENCE
        while not port.exists():
            if self._child.poll() is not None or time.monotonic() > until:
                self.__exit__(None, None, None)
                raise RuntimeError("the demo logger did not start")
            time.sleep(0.05)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._child.terminate()
        self._child.wait()
        self._home.cleanup()


def ports() -> list[tuple[str, str]]:
    """The demo logger and the serial ports of this machine: name, line to show."""
    from serial.tools.list_ports import comports

    found = [(DEMO, "demo             a simulated vehicle with sensors, in a process of its own")]
    return found + [(p.device, f"{p.device:16} {p.description}") for p in sorted(comports(), key=lambda p: p.device)]
