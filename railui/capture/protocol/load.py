"""What a logger asks of its line: bytes per second against what the baud rate passes."""

from __future__ import annotations

from dataclasses import dataclass

from railui.capture.protocol.frames import WIDTHS, Channel
from railui.capture.protocol.wire import BLOCKED, CRC, TIMED, sample_size

BAUDS = (9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600, 1000000, 1500000, 2000000, 3000000)
BITS = 10  # per byte: a start bit, eight, a stop bit
FULL, NARROW = 1.0, 0.8
HEAD, BLOCK_HEAD = TIMED.size + CRC.size, BLOCKED.size + CRC.size
DIGITS = 9.0  # characters of a value and its comma, in text
TEXT_HEAD = 40.0  # characters of a line but for its values
EVERY, STATUS = 5.0, 28.0  # s between two hellos; bytes of a status, once a second


@dataclass(frozen=True)
class Load:
    """Bytes per second on the wire, of the bare values, and what passes; `share` of it."""

    needed: float
    values: float
    passes: float

    @property
    def share(self) -> float:
        """What is needed of what passes."""
        return self.needed / self.passes

    @property
    def least_baud(self) -> int | None:
        """The slowest usual rate that leaves a fifth free; None where none does."""
        return next((baud for baud in BAUDS if self.needed * BITS <= NARROW * baud), None)


def link_load(channels: list[Channel], rate: float, baud: int, block: int = 1, form: str = "binary") -> Load:
    """The load of a layout at so many samples per second, `block` of them in a frame.

    >>> load = link_load(channels_of(12, "h"), 500.0, 115200)
    >>> round(load.share, 3), load.values, load.passes
    (1.788, 12000.0, 11520.0)
    """
    size = sample_size(channels)
    names = sum(len(c.name.encode()) + len(c.unit.encode()) for c in channels)
    if form == "text":
        frame, hello = TEXT_HEAD + DIGITS * len(channels), TEXT_HEAD + names + 20.0 * len(channels)
        per_second = rate * frame
    else:
        frame = coded((HEAD if block == 1 else BLOCK_HEAD) + block * size)
        hello = coded(40.0 + names + 11.0 * len(channels))
        per_second = rate / block * frame
    return Load(per_second + hello / EVERY + STATUS, rate * size, baud / BITS)


def coded(payload: float) -> float:
    """Bytes of a payload on the wire: COBS adds one in 254, and there is the delimiter."""
    return payload + 1 + payload // 254 + 1


def channels_of(count: int, letter: str) -> list[Channel]:
    """So many channels of one type, with names of a usual length."""
    if letter not in WIDTHS:
        raise ValueError(f"{letter!r} is no type of a channel: {' '.join(WIDTHS)}")
    return [Channel(f"channel_{i:02d}", "m/s^2", letter) for i in range(count)]
