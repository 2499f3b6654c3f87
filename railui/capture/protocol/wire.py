"""Binary form of the protocol: fields, CRC-32, COBS; encoding for loggers written in Python, decoding."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from zlib import crc32

from cobs import cobs

from railui.capture.protocol.messages import (
    MARK_SOURCES,
    MAX_CHANNELS,
    MAX_PAYLOAD_BYTES,
    TYPE_BYTES,
    UNKNOWN_BATTERY,
    UNKNOWN_TEMPERATURE,
    Channel,
    CorruptFrame,
    Frame,
    Hello,
    InvalidFrame,
    Mark,
    Samples,
    Status,
    check_hello,
    shortest_decimal,
)

DELIMITER = b"\0"
MAX_ENCODED_BYTES = MAX_PAYLOAD_BYTES + MAX_PAYLOAD_BYTES // 254 + 1
VERSION = 1
HELLO, SAMPLE, BLOCK, STATUS, MARK = range(1, 6)
HEADER = struct.Struct("<BHI")  # kind, layout, number
SAMPLE_HEADER = struct.Struct("<BHII")  # HEADER and the time of the sample
BLOCK_HEADER = struct.Struct("<BHIIB")  # HEADER, the time of the first sample, the number of samples
STATUS_BODY = struct.Struct("<IIhH")  # time, overruns, temperature [0.1 degC], battery [mV]
MARK_BODY = struct.Struct("<IBII")  # time, source, UTC [s], UTC [us]
HELLO_HEAD = struct.Struct("<BIf")  # version, boot, rate
CHANNEL_HEADER = struct.Struct("<cff")  # type, scale, offset
CRC = struct.Struct("<I")
# CRC-32 of any data followed by its own CRC (little-endian) is one constant, so the check needs no slice
CRC_RESIDUE = crc32(CRC.pack(crc32(b"")))


# -- encoding


def encode_frame(payload: bytes) -> bytes:
    """Encode a payload and its CRC in COBS and append the delimiter."""
    return bytes(cobs.encode(payload + CRC.pack(crc32(payload)))) + DELIMITER


def hello_body(boot: int, rate: float, device: str, firmware: str, channels: Sequence[Channel]) -> bytes:
    """Return the body of a hello, of which the layout is the hash."""
    parts = [HELLO_HEAD.pack(VERSION, boot, rate), _encode_text(device), _encode_text(firmware)]
    parts.append(struct.pack("<H", len(channels)))
    for c in channels:
        parts += [CHANNEL_HEADER.pack(c.type.encode(), c.scale, c.offset), _encode_text(c.name), _encode_text(c.unit)]
    return b"".join(parts)


def layout_hash(body: bytes) -> int:
    """Return the layout of a hello: the low 16 bits of the CRC of its body."""
    return crc32(body) & 0xFFFF


def encode_hello(number: int, body: bytes) -> bytes:
    """Encode a hello frame."""
    return encode_frame(HEADER.pack(HELLO, layout_hash(body), number) + body)


def encode_sample(layout: int, number: int, time: int, data: bytes) -> bytes:
    """Encode a frame of one sample at `time` [us]."""
    return encode_frame(SAMPLE_HEADER.pack(SAMPLE, layout, number, time & 0xFFFFFFFF) + data)


def encode_block(layout: int, number: int, time: int, count: int, data: bytes) -> bytes:
    """Encode a frame of `count` samples, the first at `time` [us]."""
    return encode_frame(BLOCK_HEADER.pack(BLOCK, layout, number, time & 0xFFFFFFFF, count) + data)


def encode_status(
    layout: int, number: int, time: int, overruns: int, temperature: float | None = None, battery: float | None = None
) -> bytes:
    """Encode a status frame; temperature [degC], battery [V]."""
    tenths = UNKNOWN_TEMPERATURE if temperature is None else round(10 * temperature)
    millivolts = UNKNOWN_BATTERY if battery is None else round(1000 * battery)
    body = STATUS_BODY.pack(time & 0xFFFFFFFF, overruns & 0xFFFFFFFF, tenths, millivolts)
    return encode_frame(HEADER.pack(STATUS, layout, number) + body)


def encode_mark(
    layout: int, number: int, time: int, source: str = "button", utc: float = 0.0, label: str = ""
) -> bytes:
    """Encode a mark frame; utc [s since 1970] is 0 if unknown."""
    seconds = int(utc)
    body = MARK_BODY.pack(time & 0xFFFFFFFF, MARK_SOURCES.index(source), seconds, round(1e6 * (utc - seconds)))
    return encode_frame(HEADER.pack(MARK, layout, number) + body + _encode_text(label))


def sample_size(channels: Sequence[Channel]) -> int:
    """Return the bytes of one sample's values."""
    return sum(TYPE_BYTES[c.type] for c in channels)


def _encode_text(text: str) -> bytes:
    data = text.encode()
    return bytes([len(data)]) + data


# -- decoding


def decode(coded: bytes) -> Frame:
    """Decode the bytes between two delimiters.

    Raises
    ------
    CorruptFrame
        If the framing or the CRC is wrong: bytes were lost or changed.
    InvalidFrame
        If the CRC is right and the content invalid.
    """
    try:
        payload = cobs.decode(coded)
    except cobs.DecodeError as error:
        raise CorruptFrame(str(error)) from None
    if len(payload) < HEADER.size + CRC.size or crc32(payload) != CRC_RESIDUE:
        raise CorruptFrame("the CRC is wrong")
    kind, layout, number = HEADER.unpack_from(payload)
    if kind == SAMPLE and len(payload) > SAMPLE_HEADER.size + CRC.size:
        return Samples(
            layout, number, SAMPLE_HEADER.unpack_from(payload)[3], 1, payload[SAMPLE_HEADER.size : -CRC.size]
        )
    if kind == BLOCK and len(payload) > BLOCK_HEADER.size + CRC.size:
        *_, time, count = BLOCK_HEADER.unpack_from(payload)
        if not count:
            raise InvalidFrame("a block of 0 samples")
        return Samples(layout, number, time, count, payload[BLOCK_HEADER.size : -CRC.size])
    return _decode_other(kind, layout, number, payload[HEADER.size : -CRC.size])


def _decode_other(kind: int, layout: int, number: int, body: bytes) -> Frame:
    """Decode a hello, status or mark."""
    try:
        if kind == HELLO:
            return _decode_hello(layout, number, body)
        if kind == STATUS:
            return _decode_status(layout, number, body)
        if kind == MARK:
            time, source, seconds, micros = MARK_BODY.unpack_from(body)
            label = _FieldReader(body, MARK_BODY.size).last_text()
            return Mark(layout, number, time, MARK_SOURCES[source], seconds + 1e-6 * micros, label)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise InvalidFrame(f"a frame of kind {kind} has missing or invalid fields: {error}") from None
    raise InvalidFrame(f"a frame of kind {kind} and {len(body)} bytes: kinds are 1 to 5")


def _decode_status(layout: int, number: int, body: bytes) -> Status:
    time, overruns, tenths, millivolts = STATUS_BODY.unpack(body)
    temperature = None if tenths == UNKNOWN_TEMPERATURE else tenths / 10
    battery = None if millivolts == UNKNOWN_BATTERY else millivolts / 1000
    return Status(layout, number, time, overruns, temperature, battery)


def _decode_hello(layout: int, number: int, body: bytes) -> Hello:
    if layout != layout_hash(body):
        raise InvalidFrame(
            f"a hello of layout {layout:04x} whose body has {layout_hash(body):04x}: the low 16 bits of its CRC"
        )
    version, boot, rate = HELLO_HEAD.unpack_from(body)
    if version != VERSION:
        raise InvalidFrame(f"a hello of version {version}: supported is version {VERSION}")
    reader = _FieldReader(body, HELLO_HEAD.size)
    device = reader.text()
    firmware = reader.text()
    count = reader.uint16()
    if count > MAX_CHANNELS or count * (CHANNEL_HEADER.size + 2) > len(body) - reader.offset:
        raise InvalidFrame(f"a hello that claims {count} channels in {len(body)} bytes: the maximum is {MAX_CHANNELS}")
    channels = tuple(reader.channel() for _ in range(count))
    if reader.offset != len(body):
        raise InvalidFrame(f"a hello with {len(body) - reader.offset} bytes after its last channel")
    check_hello(rate, device, firmware, channels)
    return Hello(layout, number, boot, shortest_decimal(rate), device, firmware, channels)


class _FieldReader:
    """Reader of texts and channels in a body."""

    def __init__(self, body: bytes, offset: int) -> None:
        self.body = body
        self.offset = offset

    def uint16(self) -> int:
        (number,) = struct.unpack_from("<H", self.body, self.offset)
        self.offset += 2
        return int(number)

    def text(self) -> str:
        size = self.body[self.offset]
        data = self.body[self.offset + 1 : self.offset + 1 + size]
        if len(data) != size:
            raise IndexError("a text is longer than its frame")
        self.offset += 1 + size
        return data.decode()

    def last_text(self) -> str:
        text = self.text()
        if self.offset != len(self.body):
            raise IndexError("bytes after the last text")
        return text

    def channel(self) -> Channel:
        letter, scale, offset = CHANNEL_HEADER.unpack_from(self.body, self.offset)
        self.offset += CHANNEL_HEADER.size
        name = self.text()
        unit = self.text()
        return Channel(name, unit, letter.decode("latin-1"), shortest_decimal(scale), shortest_decimal(offset))
