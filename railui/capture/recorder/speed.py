"""Processor time of a line at full speed: decoding alone, and a whole recording over a pseudo-terminal."""

from __future__ import annotations

import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railui.capture.protocol.load import BITS_PER_BYTE, link_load
from railui.capture.protocol.messages import Channel
from railui.capture.recorder.record import Recorder
from railui.capture.recorder.replay import RAW_FILE, Replay, decode
from railui.capture.simulator.logger import SimulatedLogger
from railui.capture.simulator.terminal import PseudoTerminal

SEND_INTERVAL = 0.01  # s between two writes of the sender
DRAIN_TIME = 0.5  # s for the recorder to read the last bytes


@dataclass(frozen=True)
class ProcessingCost:
    """Received bytes, frames and samples, lost frames, and the processor time of this process [s]."""

    bytes: int
    frames: int
    samples: int
    lost: int
    cpu: float


def simulate_line(baud: int, seconds: float, count: int, block: int) -> bytes:
    """Return the bytes of a logger with `count` 16-bit channels that uses the whole capacity of a line."""
    channels = [Channel(f"channel_{i:02d}", "m/s^2", "h", 0.001) for i in range(count)]
    rate = 1000.0 / link_load(channels, 1000.0, baud, block).utilisation
    samples = int(rate * seconds * 1.1) + block
    random = np.random.default_rng(0)
    series = {c.name: random.normal(0.0, 5.0, samples) for c in channels}
    logger = SimulatedLogger(channels, series, rate, block)
    line = bytearray()
    for _, data in logger.transmit():
        line += data
        if len(line) >= baud / BITS_PER_BYTE * seconds:
            break
    return bytes(line)


def measure_decoding(baud: int, seconds: float, count: int, block: int) -> ProcessingCost:
    """Measure the decoding of a stored line into runs on the disk."""
    with tempfile.TemporaryDirectory(prefix="railui-speed-") as home:
        raw = Path(home) / RAW_FILE
        raw.write_bytes(simulate_line(baud, seconds, count, block))
        before = time.process_time()
        return _cost_of(decode(raw, Path(home) / "runs"), time.process_time() - before)


def measure_recording(baud: int, seconds: float, count: int, block: int) -> ProcessingCost:
    """Measure the recording of a line at its real speed, without the processor time of the sender's thread."""
    data = simulate_line(baud, seconds, count, block)
    with tempfile.TemporaryDirectory(prefix="railui-speed-") as home:
        terminal = PseudoTerminal(Path(home) / "line")
        recorder = Recorder(str(terminal.link), baud, Path(home) / "recording")
        sender_times: list[float] = []

        def send() -> None:
            _send(terminal, data, baud)
            sender_times.append(time.thread_time())
            recorder.stop()

        before = time.process_time()
        sender = threading.Thread(target=send)
        sender.start()
        for _ in recorder.run():
            pass
        sender.join()
        cost = _cost_of(recorder.replay, time.process_time() - before - sender_times[0])
        terminal.unplug()
        return cost


def _send(terminal: PseudoTerminal, data: bytes, baud: int) -> None:
    """Write data to a terminal at the speed of a line."""
    bytes_per_second = baud / BITS_PER_BYTE
    step = round(bytes_per_second * SEND_INTERVAL)
    start = time.monotonic()
    for i in range(0, len(data), step):
        time.sleep(max(start + i / bytes_per_second - time.monotonic(), 0.0))
        terminal.write(data[i : i + step])
    time.sleep(DRAIN_TIME)


def _cost_of(replay: Replay, cpu: float) -> ProcessingCost:
    frames = replay.assembler.link_statistics().frames
    counts = replay.assembler.counts
    return ProcessingCost(replay.position, frames, counts.samples, counts.lost_frames, cpu)
