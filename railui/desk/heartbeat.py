"""Heartbeat of the interface: the longest delay that the desk itself caused."""

from __future__ import annotations

import asyncio
import gc
import sys
import time
from typing import Final

BEAT_INTERVAL: Final = 0.010  # s
THREAD_SWITCH_INTERVAL: Final = 0.001  # s, bounds the delay of a key by a computing thread
GC_THRESHOLDS: Final = (20_000, 20, 20)  # objects, and collections of the younger generations


class Heartbeat:
    """Heartbeat of 10 ms in the event loop; `longest_gap` is the longest gap between two beats [s].

    Of a gap, only the processor time of the desk (all threads) counts: while other programs use the processor, no
    interface can draw.
    """

    def __init__(self) -> None:
        self.longest_gap = 0.0
        self.beats = 0

    def reset(self) -> None:
        """Restart the measurement."""
        self.longest_gap = 0.0
        self.beats = 0

    async def beat(self) -> None:
        """Beat until the task is cancelled."""
        last = time.perf_counter(), time.process_time()
        while True:
            await asyncio.sleep(BEAT_INTERVAL)
            now = time.perf_counter(), time.process_time()
            gap = min(now[0] - last[0], BEAT_INTERVAL + now[1] - last[1])
            self.longest_gap = max(self.longest_gap, gap)
            self.beats += 1
            last = now


def tune_interpreter() -> None:
    """Set thread switching and garbage collection so that neither delays the interface."""
    sys.setswitchinterval(THREAD_SWITCH_INTERVAL)
    gc.set_threshold(*GC_THRESHOLDS)


def freeze_startup_objects() -> None:
    """Exclude the objects of the opened desk from garbage collection; a full collection takes about 0.2 s."""
    gc.freeze()
