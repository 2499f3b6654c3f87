"""What a logger says: hello, samples, status, mark; and which of it is accepted."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray

MOST_CHANNELS = 256
MOST_BODY = 8192  # bytes of a frame, before COBS
FASTEST = 1e5  # samples per second
WIDTHS = {"b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4, "f": 4}  # letters of Python's struct
SOURCES = ("button", "clock", "trackside")
UNKNOWN_TEMPERATURE, UNKNOWN_BATTERY = -32768, 0
WORD = re.compile(r"[^\x00-\x1f\x7f,;\[\]#\"]{0,80}")


class Damaged(ValueError):
    """Bytes that are no frame: the framing or the CRC does not fit."""


class Refused(ValueError):
    """A frame that arrived whole and makes no sense: a fault of the logger, told with its remedy."""


class Channel(NamedTuple):
    """One channel: value = scale x number + offset, in `unit`."""

    name: str
    unit: str
    type: str = "h"
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Hello:
    """What a logger is: `boot` differs after every start, `rate` [Hz], `layout` names this very hello."""

    layout: int
    number: int
    boot: int
    rate: float
    device: str
    firmware: str
    channels: tuple[Channel, ...]

    @cached_property
    def row(self) -> np.dtype[np.void]:
        """One sample as it lies in a frame."""
        return np.dtype([(f"c{i}", f"<{np.dtype(c.type).str[1:]}") for i, c in enumerate(self.channels)])

    @cached_property
    def _common(self) -> np.dtype[np.generic] | None:
        """The type of all channels, where they have one."""
        types = {c.type for c in self.channels}
        return np.dtype(f"<{np.dtype(types.pop()).str[1:]}") if len(types) == 1 else None

    def values(self, data: bytes) -> FloatArray:
        """Values [sample, channel] in the channels' units; Refused where the bytes are no whole samples."""
        if not data or len(data) % self.row.itemsize:
            raise Refused(f"{len(data)} bytes are no samples of {self.row.itemsize} bytes: does the layout fit?")
        if self._common is not None:
            numbers = np.frombuffer(data, self._common).reshape(-1, len(self.channels)).astype(np.float64)
        else:
            rows = np.frombuffer(data, self.row)
            numbers = np.stack([rows[name].astype(np.float64) for name in self.row.names or ()], axis=1)
        return self.scaled(np.asarray(numbers))

    def scaled(self, numbers: FloatArray) -> FloatArray:
        """Numbers [sample, channel] in the channels' units; what is not finite is NaN."""
        scale = np.array([c.scale for c in self.channels])
        found: FloatArray = numbers * scale + np.array([c.offset for c in self.channels])
        found[~np.isfinite(found)] = np.nan
        return found


class Samples(NamedTuple):
    """One sample or a block: `time` [us, wraps] of the first; `data` as bytes, or as numbers (text form)."""

    layout: int
    number: int
    time: int
    held: int  # samples of a block, 1 of a single one
    data: bytes | tuple[float, ...]


class Status(NamedTuple):
    """How the logger is: samples it lost itself, temperature [degC] and battery [V], None where unknown."""

    layout: int
    number: int
    time: int
    overruns: int
    temperature: float | None
    battery: float | None


class Mark(NamedTuple):
    """An instant: a button, a pulse of a wall clock (utc [s], else 0), a kilometre post."""

    layout: int
    number: int
    time: int
    source: str
    utc: float
    label: str


Frame = Hello | Samples | Status | Mark


def check_hello(rate: float, device: str, firmware: str, channels: tuple[Channel, ...]) -> None:
    """Raises Refused for a hello that no run could be made of."""
    if not (math.isfinite(rate) and 0 < rate <= FASTEST):
        raise Refused(f"the hello states a rate of {rate:g} Hz: 0 to {FASTEST:g} Hz")
    if not 1 <= len(channels) <= MOST_CHANNELS:
        raise Refused(f"the hello claims {len(channels)} channels: 1 to {MOST_CHANNELS}")
    for text in (device, firmware, *(c.name for c in channels), *(c.unit for c in channels)):
        if not WORD.fullmatch(text):
            raise Refused(f"the hello holds {text[:40]!r}: up to 80 characters without , ; [ ] # and quotes")
    names = [c.name for c in channels]
    if "" in names or "t" in names or len(set(names)) < len(names):
        raise Refused(f"channels need names of their own, none of them t: {', '.join(names)[:200]}")
    for c in channels:
        if c.type not in WIDTHS:
            raise Refused(f"channel {c.name} has the type {c.type!r}: one of {' '.join(WIDTHS)}")
        if not (math.isfinite(c.scale) and c.scale and math.isfinite(c.offset)):
            raise Refused(f"channel {c.name} has scale {c.scale:g}, offset {c.offset:g}: finite, scale not 0")


def short(value: float) -> float:
    """A 32-bit float as the decimal number that was meant.

    >>> short(float(np.float32(0.001)))
    0.001
    """
    return float(str(np.float32(value)))
