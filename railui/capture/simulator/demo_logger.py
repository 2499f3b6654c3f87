"""Demo logger in a process of its own: a simulated vehicle behind a serial port."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Final, Self

START_TIMEOUT: Final = 60.0  # s until the port is open
POLL_INTERVAL: Final = 0.05  # s


class DemoLogger:
    """Context in which `railui capture logger` runs; `port` is the name of its port.

    The logger holds a pipe from this process and ends when that closes, also by the sudden end of this process.

    Raises
    ------
    RuntimeError
        If the logger does not start.
    """

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed
        self.port = ""

    def __enter__(self) -> Self:
        self._home = tempfile.TemporaryDirectory(prefix="railui-demo-")
        port = Path(self._home.name) / "logger"
        words = [
            sys.executable,
            "-m",
            "railui",
            "capture",
            "logger",
            "--link",
            str(port),
            "-q",
            "--until-eof",
            "--seed",
        ]
        null = subprocess.DEVNULL
        self._child = subprocess.Popen(
            [*words, str(self.seed)], start_new_session=True, stdin=subprocess.PIPE, stdout=null, stderr=null
        )
        self.port = str(port)
        deadline = time.monotonic() + START_TIMEOUT
        while not port.exists():
            if self._child.poll() is not None or time.monotonic() > deadline:
                self.__exit__(None, None, None)
                raise RuntimeError("the demo logger did not start: run `railui capture logger` to see why")
            time.sleep(POLL_INTERVAL)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._child.terminate()
        self._child.wait()
        if self._child.stdin is not None:
            self._child.stdin.close()
        self._home.cleanup()
