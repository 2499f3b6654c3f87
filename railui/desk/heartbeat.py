"""The heartbeat of the desk: the longest that the desk itself ever kept its screen waiting."""

from __future__ import annotations

import asyncio
import gc
import sys
import time
from typing import Final

BEAT: Final = 0.010  # s
SWITCH: Final = 0.001  # s: a key waits no longer than this for a thread that computes
COLLECT: Final = (20_000, 20, 20)  # objects, and rounds of the younger, until the garbage collector looks


class Heartbeat:
    """Beats every 10 ms in the screen's own loop; `longest` is the longest gap between two beats [s].

    Of a gap only as much counts as the desk itself computed, on all its threads: while other programs have the
    processor, no desk can draw.
    """

    def __init__(self) -> None:
        self.longest, self.beats = 0.0, 0

    def reset(self) -> None:
        """From now on."""
        self.longest, self.beats = 0.0, 0

    async def beat(self) -> None:
        """Beats until it is cancelled."""
        last = time.perf_counter(), time.process_time()
        while True:
            await asyncio.sleep(BEAT)
            now = time.perf_counter(), time.process_time()
            gap = min(now[0] - last[0], BEAT + now[1] - last[1])
            self.longest, self.beats, last = max(self.longest, gap), self.beats + 1, now


def unhindered() -> None:
    """Lets neither threads nor the garbage collector hold the screen; `settled` belongs to it."""
    sys.setswitchinterval(SWITCH)
    gc.set_threshold(*COLLECT)


def settled() -> None:
    """What is there once the desk is open stays: a collection that looks through it all takes some 0.2 s."""
    gc.freeze()
