"""Millions of damaged frames: none may be accepted as valid.  python -m tests.capture.soak --frames 1000000"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railui.capture.protocol import text, wire
from railui.capture.protocol.messages import Channel, CorruptFrame, Frame, InvalidFrame
from railui.capture.simulator.logger import damage_frame

CHANNELS = tuple(Channel(f"c{i}", "m/s^2", "h", 0.001) for i in range(6))


@dataclass
class SoakResult:
    """Counts of damaged frames."""

    frames: int = 0
    refused: int = 0
    wrong: int = 0


def soak(frames: int, seed: int) -> SoakResult:
    """Damage frames of all kinds and both forms; `wrong` counts those accepted with another content."""
    random = np.random.default_rng(seed)
    description = (7, 200.0, "logger", "1.0", CHANNELS)
    body, line = wire.hello_body(*description), text.hello_text(*description)
    layout, lines = wire.layout_hash(body), text.layout_hash(line)
    result = SoakResult()
    for number in range(frames):
        data = random.bytes(12)
        values = [float(x) for x in random.normal(size=6)]
        choices: list[tuple[Callable[[bytes], Frame], bytes]] = [
            (wire.decode, wire.encode_sample(layout, number, 5000 * number, data)),
            (wire.decode, wire.encode_block(layout, number, 5000 * number, 4, 4 * data)),
            (text.decode, text.encode_sample(lines, number, 5000 * number, values)),
            (wire.decode, wire.encode_status(layout, number, 5000 * number, 0, 20.0, 12.0)),
            (wire.decode, wire.encode_hello(number, body)),
            (text.decode, text.encode_hello(number, line)),
        ]
        decode, frame = choices[int(random.choice(6, p=(0.5, 0.2, 0.2, 0.04, 0.03, 0.03)))]
        end = wire.DELIMITER if decode is wire.decode else text.DELIMITER
        for part in damage_frame(frame, random, end).split(end)[:-1]:
            result.frames += 1
            try:
                decoded = decode(part)
            except (CorruptFrame, InvalidFrame):
                result.refused += 1
                continue
            result.wrong += decoded != decode(frame[: -len(end)])
    return result


def main() -> None:
    """Run the soak test from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    start = time.perf_counter()
    result = soak(arguments.frames, arguments.seed)
    print(f"{result.frames} damaged frames, {result.refused} refused, {result.wrong} wrong ones accepted", end="")
    print(f", {time.perf_counter() - start:.0f} s")
    raise SystemExit(1 if result.wrong else 0)


if __name__ == "__main__":
    main()
