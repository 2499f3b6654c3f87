"""Computations that the tests run in processes of their own; this module imports little, so that they start at once."""

from __future__ import annotations

import os
import signal
import time

from railui.progress import Progress


def count(progress: Progress, number: int) -> int:
    """Count up to a number."""
    for each in range(number):
        progress.event(each)
    progress.message("counted")
    return number


def fail(progress: Progress, name: str) -> None:
    """Fail, or end the process."""
    progress.message(name)
    if name == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    raise FileNotFoundError(f"no {name}")


def wait_for_ever(progress: Progress) -> None:
    """Compute without a checkpoint."""
    progress.message("waiting")
    time.sleep(1000.0)
