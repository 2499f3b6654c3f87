"""Signals that end the desk: termination, and a closed terminal."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

EXIT_SECONDS: Final = 3.0  # s for a desk to end after a signal; a computation may not reach a checkpoint in this time


def handle_signals(on_signal: Callable[[int], None]) -> None:
    """Call a function in the running event loop on SIGTERM and SIGHUP; on its main thread only."""
    loop = asyncio.get_running_loop()
    for number in (signal.SIGTERM, signal.SIGHUP):
        with suppress(ValueError, RuntimeError, NotImplementedError):
            loop.add_signal_handler(number, on_signal, int(number))


def force_exit_later(code: int) -> None:
    """End the process after EXIT_SECONDS, however busy its threads are."""

    def wait_and_exit() -> None:
        time.sleep(EXIT_SECONDS)
        os._exit(code)

    threading.Thread(target=wait_and_exit, name="exit", daemon=True).start()
