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


class LocalCluster:
    """A scheduler and its workers."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.processes: list[subprocess.Popen[bytes]] = []
        file = directory / "scheduler.json"
        self.scheduler = self._start(
            *("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)),
            DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0",
        )
        deadline = time.monotonic() + 60
        while not file.exists() or not file.read_text("utf-8"):
            assert time.monotonic() < deadline and self.scheduler.poll() is None, "no scheduler"
            time.sleep(0.05)
        self.address = str(json.loads(file.read_text("utf-8"))["address"])

    def _start(self, *arguments: str, **environment: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [*DASK, *arguments],
            env={**os.environ, **environment},
            cwd=self.directory,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.processes.append(process)
        return process

    def start_worker(self, *options: str, nanny: bool = False, **environment: str) -> subprocess.Popen[bytes]:
        """Start a worker with one thread; a nanny restarts it when it dies."""
        common = ["--nanny" if nanny else "--no-nanny", "--no-dashboard", "--local-directory", str(self.directory)]
        return self._start("worker", self.address, "--nthreads", "1", *common, *options, **environment)

    def start_workers(self, count: int) -> Sequence[subprocess.Popen[bytes]]:
        """Start so many workers."""
        return [self.start_worker() for _ in range(count)]

    def stop(self) -> None:
        """Stop all processes."""
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
        for process in self.processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
