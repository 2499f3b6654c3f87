"""The demo logger as a process of its own: a simulated vehicle behind a serial port."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Final, Self

PATIENCE: Final = 60.0  # s until it has opened its port


class DemoLogger:
    """Runs `railui capture logger` as long as it is held; `port` is its name. RuntimeError where it does not start."""

    def __init__(self, seed: int = 0) -> None:
        self.seed, self.port = seed, ""

    def __enter__(self) -> Self:
        self._home = tempfile.TemporaryDirectory(prefix="railui-demo-")
        port = Path(self._home.name) / "logger"
        words = [sys.executable, "-m", "railui", "capture", "logger", "--link", str(port), "-q", "--seed"]
        self._child = subprocess.Popen([*words, str(self.seed)], start_new_session=True, stdin=subprocess.DEVNULL)
        self.port = str(port)
        until = time.monotonic() + PATIENCE
        while not port.exists():
            if self._child.poll() is not None or time.monotonic() > until:
                self.__exit__(None, None, None)
                raise RuntimeError("the demo logger did not start: `railui capture logger` tells why")
            time.sleep(0.05)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._child.terminate()
        self._child.wait()
        self._home.cleanup()
