"""A dask scheduler and workers on loopback, each a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

DASK = [sys.executable, "-m", "dask"]


class Machines:
    """A scheduler, and workers that join it."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.processes: list[subprocess.Popen[bytes]] = []
        file = home / "scheduler.json"
        self.scheduler = self._start(
            *("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)),
            DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0",
        )
        until = time.monotonic() + 60
        while not file.exists() or not file.read_text("utf-8"):
            assert time.monotonic() < until and self.scheduler.poll() is None, "no scheduler"
            time.sleep(0.05)
        self.address = str(json.loads(file.read_text("utf-8"))["address"])

    def _start(self, *words: str, **environment: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [*DASK, *words], env={**os.environ, **environment}, cwd=self.home,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def worker(self, *words: str, nanny: bool = False, **environment: str) -> subprocess.Popen[bytes]:
        """A worker of one thread; with a nanny it is started again where it dies."""
        more = ["--nanny" if nanny else "--no-nanny", "--no-dashboard", "--local-directory", str(self.home), *words]
        return self._start("worker", self.address, "--nthreads", "1", *more, **environment)

    def workers(self, count: int) -> Sequence[subprocess.Popen[bytes]]:
        """Some workers."""
        return [self.worker() for _ in range(count)]

    def stop(self) -> None:
        """Ends all of it."""
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
        for process in self.processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
