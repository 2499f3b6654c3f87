"""What a full line costs in processor time: decoding alone, and a whole recording over a pseudo-terminal."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railui.capture.protocol.frames import Channel
from railui.capture.protocol.load import BITS, link_load
from railui.capture.recorder.record import Recorder
from railui.capture.recorder.replay import RAW, Replay, decode
from railui.capture.simulator.logger import Logger
from railui.capture.simulator.terminal import Terminal


@dataclass(frozen=True)
class Cost:
    """What came through, and the processor time of this process [s]."""

    bytes: int
    frames: int
    samples: int
    lost: int
    cpu: float


def line_bytes(baud: int, seconds: float, count: int, block: int) -> bytes:
    """What a logger of so many 16-bit channels sends on a full line."""
    channels = [Channel(f"channel_{i:02d}", "m/s^2", "h", 0.001) for i in range(count)]
    rate = 1000.0 / link_load(channels, 1000.0, baud, block).share
    samples = int(rate * seconds * 1.1) + block
    random = np.random.default_rng(0)
    series = {c.name: random.normal(0.0, 5.0, samples) for c in channels}
    logger = Logger(channels, series, rate, block)
    found = bytearray()
    for _, data in logger.sent():
        found += data
        if len(found) >= baud / BITS * seconds:
            break
    return bytes(found)


def decoding_cost(baud: int, seconds: float, count: int, block: int) -> Cost:
    """Decodes a stored line into runs on the disk."""
    with tempfile.TemporaryDirectory(prefix="railui-speed-") as home:
        raw = Path(home) / RAW
        raw.write_bytes(line_bytes(baud, seconds, count, block))
        before = time.process_time()
        return _cost(decode(raw, Path(home) / "runs"), time.process_time() - before)


def recording_cost(baud: int, seconds: float, count: int, block: int) -> Cost:
    """Records the line at its pace; what the sender costs is measured by its thread and taken off."""
    data = line_bytes(baud, seconds, count, block)
    with tempfile.TemporaryDirectory(prefix="railui-speed-") as home:
        terminal = Terminal(Path(home) / "line")
        recorder = Recorder(str(terminal.link), baud, Path(home) / "recording")
        spent: list[float] = []

        def send() -> None:
            step = round(baud / BITS * 0.01)
            begun = time.monotonic()
            for i in range(0, len(data), step):
                time.sleep(max(begun + i / (baud / BITS) - time.monotonic(), 0.0))
                os.write(terminal.master, data[i : i + step])
            time.sleep(0.5)
            spent.append(time.thread_time())
            recorder.stop()

        before = time.process_time()
        sender = threading.Thread(target=send)
        sender.start()
        for _ in recorder.run():
            pass
        sender.join()
        cost = _cost(recorder.replay, time.process_time() - before - spent[0])
        terminal.unplug()
        return cost


def _cost(replay: Replay, cpu: float) -> Cost:
    heard, counts = replay.assembly.total(), replay.assembly.counts
    return Cost(replay.at, heard.frames, counts.samples, counts.lost, cpu)
