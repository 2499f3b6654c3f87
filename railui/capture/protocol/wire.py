"""The binary form: fields, CRC-32, COBS; encoding for loggers that are written in Python, decoding."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from zlib import crc32

from cobs import cobs

from railui.capture.protocol.frames import (
    MOST_BODY,
    MOST_CHANNELS,
    SOURCES,
    UNKNOWN_BATTERY,
    UNKNOWN_TEMPERATURE,
    WIDTHS,
    Channel,
    Damaged,
    Frame,
    Hello,
    Mark,
    Refused,
    Samples,
    Status,
    check_hello,
    short,
)

DELIMITER = b"\0"
MOST_CODED = MOST_BODY + MOST_BODY // 254 + 1
VERSION = 1
HELLO, SAMPLE, BLOCK, STATUS, MARK = range(1, 6)
HEAD = struct.Struct("<BHI")  # kind, layout, number
TIMED = struct.Struct("<BHII")  # and the time of the first sample
BLOCKED = struct.Struct("<BHIIB")  # and how many
STATE = struct.Struct("<IIhH")
INSTANT = struct.Struct("<IBII")
CRC = struct.Struct("<I")
ABOUT, PER_CHANNEL = struct.Struct("<BIf"), struct.Struct("<cff")


# -- to the wire


def framed(payload: bytes) -> bytes:
    """A payload with its CRC, in COBS, between its delimiter and the next."""
    return bytes(cobs.encode(payload + CRC.pack(crc32(payload)))) + DELIMITER


def hello_body(boot: int, rate: float, device: str, firmware: str, channels: Sequence[Channel]) -> bytes:
    """What the layout is the hash of."""
    parts = [ABOUT.pack(VERSION, boot, rate), _packed(device), _packed(firmware), struct.pack("<H", len(channels))]
    for c in channels:
        parts += [PER_CHANNEL.pack(c.type.encode(), c.scale, c.offset), _packed(c.name), _packed(c.unit)]
    return b"".join(parts)


def layout_of(body: bytes) -> int:
    """The name of a hello: the low 16 bits of the CRC of its body."""
    return crc32(body) & 0xFFFF


def hello(number: int, body: bytes) -> bytes:
    """A hello frame."""
    return framed(HEAD.pack(HELLO, layout_of(body), number) + body)


def sample(layout: int, number: int, time: int, data: bytes) -> bytes:
    """A frame of one sample at `time` [us]."""
    return framed(TIMED.pack(SAMPLE, layout, number, time & 0xFFFFFFFF) + data)


def block(layout: int, number: int, time: int, count: int, data: bytes) -> bytes:
    """A frame of `count` samples, the first at `time` [us]."""
    return framed(BLOCKED.pack(BLOCK, layout, number, time & 0xFFFFFFFF, count) + data)


def status(
    layout: int, number: int, time: int, overruns: int, temperature: float | None = None, battery: float | None = None
) -> bytes:
    """A status frame; temperature [degC], battery [V]."""
    tenths = UNKNOWN_TEMPERATURE if temperature is None else round(10 * temperature)
    millivolts = UNKNOWN_BATTERY if battery is None else round(1000 * battery)
    return framed(
        HEAD.pack(STATUS, layout, number) + STATE.pack(time & 0xFFFFFFFF, overruns & 0xFFFFFFFF, tenths, millivolts)
    )


def mark(layout: int, number: int, time: int, source: str = "button", utc: float = 0.0, label: str = "") -> bytes:
    """A mark frame; utc [s since 1970], 0 where unknown."""
    seconds = int(utc)
    instant = INSTANT.pack(time & 0xFFFFFFFF, SOURCES.index(source), seconds, round(1e6 * (utc - seconds)))
    return framed(HEAD.pack(MARK, layout, number) + instant + _packed(label))


def _packed(text: str) -> bytes:
    data = text.encode()
    return bytes([len(data)]) + data


# -- from the wire


def decode(coded: bytes) -> Frame:
    """The frame between two delimiters; Damaged where bytes were lost or changed, Refused where it makes no sense."""
    try:
        payload = cobs.decode(coded)
    except cobs.DecodeError as error:
        raise Damaged(str(error)) from None
    if len(payload) < HEAD.size + CRC.size or crc32(payload) != RESIDUE:
        raise Damaged("the CRC does not fit")
    kind, layout, number = HEAD.unpack_from(payload)
    if kind == SAMPLE and len(payload) > TIMED.size + CRC.size:
        return Samples(layout, number, TIMED.unpack_from(payload)[3], 1, payload[TIMED.size : -CRC.size])
    if kind == BLOCK and len(payload) > BLOCKED.size + CRC.size:
        *_, time, count = BLOCKED.unpack_from(payload)
        if not count:
            raise Refused("a block of 0 samples")
        return Samples(layout, number, time, count, payload[BLOCKED.size : -CRC.size])
    return _rare(kind, layout, number, payload[HEAD.size : -CRC.size])


# crc32 of anything followed by its own CRC, little-endian: one number, so the check needs no slice
RESIDUE = crc32(CRC.pack(crc32(b"")))


def _rare(kind: int, layout: int, number: int, body: bytes) -> Frame:
    try:
        if kind == HELLO:
            return _hello(layout, number, body)
        if kind == STATUS:
            time, overruns, tenths, millivolts = STATE.unpack(body)
            return Status(
                layout, number, time, overruns,
                None if tenths == UNKNOWN_TEMPERATURE else tenths / 10,
                None if millivolts == UNKNOWN_BATTERY else millivolts / 1000,
            )  # fmt: skip
        if kind == MARK:
            time, source, seconds, micros = INSTANT.unpack_from(body)
            label = _Reader(body, INSTANT.size).last()
            return Mark(layout, number, time, SOURCES[source], seconds + 1e-6 * micros, label)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise Refused(f"a frame of kind {kind} does not hold what it should: {error}") from None
    raise Refused(f"a frame of kind {kind} and {len(body)} bytes: kinds are 1 to 5")


def _hello(layout: int, number: int, body: bytes) -> Hello:
    if layout != layout_of(body):
        raise Refused(
            f"a hello of layout {layout:04x} whose body has {layout_of(body):04x}: the low 16 bits of its CRC"
        )
    version, boot, rate = ABOUT.unpack_from(body)
    if version != VERSION:
        raise Refused(f"a hello of version {version}: this reads version {VERSION}")
    reader = _Reader(body, ABOUT.size)
    device, firmware = reader.word(), reader.word()
    (count,) = struct.unpack_from("<H", body, reader.at)
    reader.at += 2
    if count > MOST_CHANNELS or count * (PER_CHANNEL.size + 2) > len(body) - reader.at:
        raise Refused(f"a hello that claims {count} channels in {len(body)} bytes: {MOST_CHANNELS} are the most")
    channels = tuple(reader.channel() for _ in range(count))
    if reader.at != len(body):
        raise Refused(f"a hello with {len(body) - reader.at} bytes behind its last channel")
    check_hello(rate, device, firmware, channels)
    return Hello(layout, number, boot, short(rate), device, firmware, channels)


class _Reader:
    """Takes texts and channels from a body."""

    def __init__(self, body: bytes, at: int) -> None:
        self.body, self.at = body, at

    def word(self) -> str:
        size = self.body[self.at]
        data = self.body[self.at + 1 : self.at + 1 + size]
        if len(data) != size:
            raise IndexError("a text is longer than its frame")
        self.at += 1 + size
        return data.decode()

    def last(self) -> str:
        text = self.word()
        if self.at != len(self.body):
            raise IndexError("bytes behind the last text")
        return text

    def channel(self) -> Channel:
        letter, scale, offset = PER_CHANNEL.unpack_from(self.body, self.at)
        self.at += PER_CHANNEL.size
        return Channel(self.word(), self.word(), letter.decode("latin-1"), short(scale), short(offset))


def sample_size(channels: Sequence[Channel]) -> int:
    """Bytes of one sample's values."""
    return sum(WIDTHS[c.type] for c in channels)
