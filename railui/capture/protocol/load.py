"""Load of a serial line: bytes per second of a logger against the capacity of the baud rate."""

from __future__ import annotations

from dataclasses import dataclass

from railui.capture.protocol.messages import TYPE_BYTES, Channel
from railui.capture.protocol.wire import BLOCK_HEADER, CRC, SAMPLE_HEADER, sample_size

BAUD_RATES = (9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600, 1000000, 1500000, 2000000, 3000000)
BITS_PER_BYTE = 10  # a start bit, eight data bits, a stop bit
MAX_UTILISATION = 1.0
WARNING_UTILISATION = 0.8
SAMPLE_OVERHEAD = SAMPLE_HEADER.size + CRC.size  # bytes of a payload without its values
BLOCK_OVERHEAD = BLOCK_HEADER.size + CRC.size
HELLO_OVERHEAD, HELLO_CHANNEL = 40.0, 11.0  # bytes of a hello without its texts, and of each channel
TEXT_OVERHEAD = 40.0  # characters of a line without its values
TEXT_VALUE = 9.0  # characters of a value and its comma
TEXT_CHANNEL = 20.0  # characters of a channel in a hello, without name and unit
HELLO_INTERVAL = 5.0  # s
STATUS_BYTES = 28.0  # per second, one status a second


@dataclass(frozen=True)
class LineLoad:
    """Required bytes per second, those of the bare values, and the capacity of the line [bytes/s]."""

    required: float
    values: float
    capacity: float

    @property
    def utilisation(self) -> float:
        """Required share of the capacity."""
        return self.required / self.capacity

    @property
    def min_baud(self) -> int | None:
        """Lowest usual baud rate with a fifth of its capacity free; None if there is none."""
        required_bits = self.required * BITS_PER_BYTE
        return next((baud for baud in BAUD_RATES if required_bits <= WARNING_UTILISATION * baud), None)


def link_load(channels: list[Channel], rate: float, baud: int, block: int = 1, form: str = "binary") -> LineLoad:
    """Compute the load of a line.

    Parameters
    ----------
    channels
        Channels of a sample.
    rate
        Sampling rate [Hz].
    baud
        Baud rate [bit/s].
    block
        Samples per frame.
    form
        "binary" or "text".

    Examples
    --------
    >>> load = link_load(example_channels(12, "h"), 500.0, 115200)
    >>> round(load.utilisation, 3), load.values, load.capacity
    (1.788, 12000.0, 11520.0)
    """
    size = sample_size(channels)
    names = sum(len(c.name.encode()) + len(c.unit.encode()) for c in channels)
    if form == "text":
        hello = TEXT_OVERHEAD + names + TEXT_CHANNEL * len(channels)
        per_second = rate * (TEXT_OVERHEAD + TEXT_VALUE * len(channels))
    else:
        hello = encoded_size(HELLO_OVERHEAD + names + HELLO_CHANNEL * len(channels))
        per_second = rate / block * encoded_size((SAMPLE_OVERHEAD if block == 1 else BLOCK_OVERHEAD) + block * size)
    return LineLoad(per_second + hello / HELLO_INTERVAL + STATUS_BYTES, rate * size, baud / BITS_PER_BYTE)


def encoded_size(payload: float) -> float:
    """Return the bytes of a payload on the wire: COBS adds one in 254, and one is the delimiter."""
    return payload + 1 + payload // 254 + 1


def example_channels(count: int, letter: str) -> list[Channel]:
    """Return channels of one type with names of a usual length."""
    if letter not in TYPE_BYTES:
        raise ValueError(f"{letter!r} is not the type of a channel: {' '.join(TYPE_BYTES)}")
    return [Channel(f"channel_{i:02d}", "m/s^2", letter) for i in range(count)]
