"""Messages of a logger (hello, samples, status, mark) and the checks on a hello."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray

MAX_CHANNELS = 256
MAX_PAYLOAD_BYTES = 8192  # of a frame, before COBS
MAX_SAMPLING_RATE = 1e5  # Hz
TYPE_BYTES = {"b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4, "f": 4}  # letters of Python's struct
MARK_SOURCES = ("button", "clock", "trackside")
UNKNOWN_TEMPERATURE, UNKNOWN_BATTERY = -32768, 0
TEXT_PATTERN = re.compile(r"[^\x00-\x1f\x7f,;\[\]#\"]{0,80}")


class CorruptFrame(ValueError):
    """Bytes that are no frame: the framing or the CRC is wrong."""


class InvalidFrame(ValueError):
    """Frame with a correct CRC and an invalid content: a fault of the logger; the message names the remedy."""


class Channel(NamedTuple):
    """Channel of a logger: value = scale x number + offset, in `unit`."""

    name: str
    unit: str
    type: str = "h"
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Hello:
    """Description of a logger and its channels.

    Attributes
    ----------
    layout
        Identifier of this description, the low 16 bits of the CRC-32 of its body.
    number
        Number of the frame.
    boot
        Number that differs after every start of the logger.
    rate
        Sampling rate [Hz].
    device, firmware
        Names of the logger and its firmware.
    channels
        Channels of a sample, in their order.
    """

    layout: int
    number: int
    boot: int
    rate: float
    device: str
    firmware: str
    channels: tuple[Channel, ...]

    @cached_property
    def sample_dtype(self) -> np.dtype[np.void]:
        """Binary layout of one sample in a frame."""
        return np.dtype([(f"c{i}", little_endian(c.type)) for i, c in enumerate(self.channels)])

    @cached_property
    def _common_dtype(self) -> np.dtype[np.generic] | None:
        """Type of all channels, None if they differ."""
        types = {c.type for c in self.channels}
        return np.dtype(little_endian(types.pop())) if len(types) == 1 else None

    def decode_samples(self, data: bytes) -> FloatArray:
        """Decode the bytes of whole samples.

        Returns
        -------
        Values [sample, channel] in the channels' units.

        Raises
        ------
        InvalidFrame
            If the bytes are not a whole number of samples.
        """
        if not data or len(data) % self.sample_dtype.itemsize:
            raise InvalidFrame(f"{len(data)} bytes are not samples of {self.sample_dtype.itemsize} bytes each")
        if self._common_dtype is not None:
            numbers = np.frombuffer(data, self._common_dtype).reshape(-1, len(self.channels)).astype(np.float64)
        else:
            rows = np.frombuffer(data, self.sample_dtype)
            numbers = np.stack([rows[name].astype(np.float64) for name in self.sample_dtype.names or ()], axis=1)
        return self.to_physical(np.asarray(numbers))

    def to_physical(self, numbers: FloatArray) -> FloatArray:
        """Scale numbers [sample, channel] to the channels' units; infinite values become NaN."""
        scale = np.array([c.scale for c in self.channels])
        values: FloatArray = numbers * scale + np.array([c.offset for c in self.channels])
        values[~np.isfinite(values)] = np.nan
        return values


class Samples(NamedTuple):
    """One sample or a block of samples.

    `time` [us, wraps] is that of the first sample; `data` are bytes (binary form) or numbers (text form).
    """

    layout: int
    number: int
    time: int
    sample_count: int
    data: bytes | tuple[float, ...]


class Status(NamedTuple):
    """Status of the logger: samples it missed, temperature [degC] and battery [V], None if unknown."""

    layout: int
    number: int
    time: int
    overruns: int
    temperature: float | None
    battery: float | None


class Mark(NamedTuple):
    """Marked instant: a button, a pulse of a wall clock (utc [s], else 0), a kilometre post."""

    layout: int
    number: int
    time: int
    source: str
    utc: float
    label: str


Frame = Hello | Samples | Status | Mark


def little_endian(letter: str) -> str:
    """Return the little-endian numpy type of a letter of Python's struct.

    >>> little_endian("h"), little_endian("f")
    ('<i2', '<f4')
    """
    return f"<{np.dtype(letter).str[1:]}"


def check_hello(rate: float, device: str, firmware: str, channels: tuple[Channel, ...]) -> None:
    """Check the content of a hello.

    Raises
    ------
    InvalidFrame
        If no run can be recorded with this rate, these texts or these channels.
    """
    if not (math.isfinite(rate) and 0 < rate <= MAX_SAMPLING_RATE):
        raise InvalidFrame(f"the hello states a rate of {rate:g} Hz: allowed are 0 to {MAX_SAMPLING_RATE:g} Hz")
    if not 1 <= len(channels) <= MAX_CHANNELS:
        raise InvalidFrame(f"the hello states {len(channels)} channels: allowed are 1 to {MAX_CHANNELS}")
    for text in (device, firmware, *(c.name for c in channels), *(c.unit for c in channels)):
        if not TEXT_PATTERN.fullmatch(text):
            raise InvalidFrame(f"the hello contains {text[:40]!r}: up to 80 characters without , ; [ ] # and quotes")
    names = [c.name for c in channels]
    if "" in names or "t" in names or len(set(names)) < len(names):
        raise InvalidFrame(f"channel names must be unique, not empty and not t: {', '.join(names)[:200]}")
    for c in channels:
        if c.type not in TYPE_BYTES:
            raise InvalidFrame(f"channel {c.name} has the type {c.type!r}: one of {' '.join(TYPE_BYTES)}")
        if not (math.isfinite(c.scale) and c.scale and math.isfinite(c.offset)):
            raise InvalidFrame(f"channel {c.name} has scale {c.scale:g}, offset {c.offset:g}: finite, scale not 0")


def shortest_decimal(value: float) -> float:
    """Return the shortest decimal number that rounds to a 32-bit float.

    >>> shortest_decimal(float(np.float32(0.001)))
    0.001
    """
    return float(str(np.float32(value)))
