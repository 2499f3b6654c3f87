"""The heartbeat of the desk: how long the screen was ever kept waiting."""

from __future__ import annotations

import asyncio
import time
from typing import Final

BEAT: Final = 0.010  # s


class Heartbeat:
    """Beats every 10 ms in the screen's own loop; `longest` is the longest gap between two beats [s]."""

    def __init__(self) -> None:
        self.longest = 0.0
        self.beats = 0

    def reset(self) -> None:
        """From now on."""
        self.longest, self.beats = 0.0, 0

    async def beat(self) -> None:
        """Beats until it is cancelled."""
        last = time.perf_counter()
        while True:
            await asyncio.sleep(BEAT)
            now = time.perf_counter()
            self.longest, self.beats = max(self.longest, now - last), self.beats + 1
            last = now
