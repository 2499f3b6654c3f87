"""The heartbeat of the desk: how long the screen was ever kept waiting."""

from __future__ import annotations

import asyncio
import time
from typing import Final

BEAT: Final = 0.010  # s


class Heartbeat:
    """Beats every 10 ms in the screen's own loop; `longest` is the longest gap between two beats [s]."""

    def __init__(self) -> None:
        self.longest, self.own = 0.0, 0.0  # own: the longest that the screen itself computed between two beats
        self.beats = 0

    def reset(self) -> None:
        """From now on."""
        self.longest, self.own, self.beats = 0.0, 0.0, 0

    async def beat(self) -> None:
        """Beats until it is cancelled."""
        last, used = time.perf_counter(), time.thread_time()
        while True:
            await asyncio.sleep(BEAT)
            now, computed = time.perf_counter(), time.thread_time()
            self.longest, self.own = max(self.longest, now - last), max(self.own, computed - used)
            self.beats, last, used = self.beats + 1, now, computed
