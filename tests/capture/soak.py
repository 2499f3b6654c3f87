"""Damaged frames by the million: none may be taken for a whole one.  python -m tests.capture.soak --frames 1000000"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railui.capture.protocol import text, wire
from railui.capture.protocol.frames import Channel, Damaged, Frame, Refused
from railui.capture.simulator.logger import damaged

CHANNELS = tuple(Channel(f"c{i}", "m/s^2", "h", 0.001) for i in range(6))


@dataclass
class Soaked:
    """What became of damaged frames."""

    frames: int = 0
    refused: int = 0
    wrong: int = 0


def soak(frames: int, seed: int) -> Soaked:
    """Damages as many frames of all kinds and both forms; `wrong` were read as something else than was sent."""
    random = np.random.default_rng(seed)
    about = (7, 200.0, "logger", "1.0", CHANNELS)
    body, line = wire.hello_body(*about), text.hello_text(*about)
    layout, lines = wire.layout_of(body), text.layout_of(line)
    found = Soaked()
    for number in range(frames):
        data = random.bytes(12)
        values = [float(x) for x in random.normal(size=6)]
        kinds: list[tuple[Callable[[bytes], Frame], bytes]] = [
            (wire.decode, wire.sample(layout, number, 5000 * number, data)),
            (wire.decode, wire.block(layout, number, 5000 * number, 4, 4 * data)),
            (text.decode, text.sample(lines, number, 5000 * number, values)),
            (wire.decode, wire.status(layout, number, 5000 * number, 0, 20.0, 12.0)),
            (wire.decode, wire.hello(number, body)),
            (text.decode, text.hello(number, line)),
        ]
        read, frame = kinds[int(random.choice(6, p=(0.5, 0.2, 0.2, 0.04, 0.03, 0.03)))]
        end = wire.DELIMITER if read is wire.decode else text.DELIMITER
        for part in damaged(frame, random, end).split(end)[:-1]:
            found.frames += 1
            try:
                got = read(part)
            except (Damaged, Refused):
                found.refused += 1
                continue
            found.wrong += got != read(frame[: -len(end)])
    return found


def main() -> None:
    """The command line."""
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--frames", type=int, default=1_000_000)
    p.add_argument("--seed", type=int, default=0)
    given = p.parse_args()
    begun = time.perf_counter()
    found = soak(given.frames, given.seed)
    print(f"{found.frames} damaged frames, {found.refused} refused, {found.wrong} wrong ones accepted", end="")
    print(f", {time.perf_counter() - begun:.0f} s")
    raise SystemExit(1 if found.wrong else 0)


if __name__ == "__main__":
    main()
