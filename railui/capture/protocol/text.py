"""Text form of the protocol: one line per frame, fields with commas, `*` and the CRC-32 in hexadecimal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from zlib import crc32

from railui.capture.protocol.messages import (
    MARK_SOURCES,
    MAX_CHANNELS,
    Channel,
    CorruptFrame,
    Frame,
    Hello,
    InvalidFrame,
    Mark,
    Samples,
    Status,
    check_hello,
)

DELIMITER = b"\n"
MAX_LINE_BYTES = 16384


# -- encoding


def encode_line(text: str) -> bytes:
    """Append the CRC and the line feed to the text of a line.

    >>> encode_line("S,1a2b,7,350000,0.12,-3.4")
    b'S,1a2b,7,350000,0.12,-3.4*b826fd8e\\n'
    """
    data = text.encode()
    return data + b"*%08x\n" % crc32(data)


def hello_text(boot: int, rate: float, device: str, firmware: str, channels: Sequence[Channel]) -> str:
    """Return the part of a hello line from `boot` on, of which the layout is the hash."""
    fields = ",".join(f"{c.name};{c.unit};{c.scale:.9g};{c.offset:.9g}" for c in channels)
    return f"{boot},{rate:.9g},{device},{firmware},{len(channels)},{fields}"


def layout_hash(text: str) -> int:
    """Return the layout of a hello: the low 16 bits of the CRC of its text."""
    return crc32(text.encode()) & 0xFFFF


def encode_hello(number: int, text: str) -> bytes:
    """Encode a hello line."""
    return encode_line(f"H,{layout_hash(text):04x},{number},{text}")


def encode_sample(layout: int, number: int, time: int, values: Sequence[float]) -> bytes:
    """Encode a line of one sample at `time` [us]."""
    fields = ",".join(f"{x:.9g}" for x in values)
    return encode_line(f"S,{layout:04x},{number},{time & 0xFFFFFFFF},{fields}")


def encode_status(
    layout: int, number: int, time: int, overruns: int, temperature: float | None = None, battery: float | None = None
) -> bytes:
    """Encode a status line; temperature [degC] and battery [V] are empty if unknown."""
    fields = ",".join("" if x is None else f"{x:.4g}" for x in (temperature, battery))
    return encode_line(f"I,{layout:04x},{number},{time & 0xFFFFFFFF},{overruns},{fields}")


def encode_mark(
    layout: int, number: int, time: int, source: str = "button", utc: float = 0.0, label: str = ""
) -> bytes:
    """Encode a mark line; utc [s since 1970] is 0 if unknown."""
    return encode_line(f"M,{layout:04x},{number},{time & 0xFFFFFFFF},{source},{utc:.6f},{label}")


# -- decoding


def decode(data: bytes) -> Frame:
    """Decode a line without its line feed.

    Raises
    ------
    CorruptFrame
        If the CRC is wrong: bytes were lost or changed.
    InvalidFrame
        If the CRC is right and the content invalid.
    """
    body, star, check = data.removesuffix(b"\r").rpartition(b"*")
    try:
        is_whole = bool(star) and check == b"%08x" % crc32(body)
        text = body.decode() if is_whole else ""
    except ValueError:
        is_whole = False
    if not is_whole:
        raise CorruptFrame("the CRC is wrong")
    kind, *fields = text.split(",")
    try:
        layout = int(fields[0], 16)
        number = _parse_counter(fields[1])
        return _parse_frame(kind, layout, number, fields[2:], text)
    except (ValueError, IndexError) as error:
        if isinstance(error, InvalidFrame):
            raise
        raise InvalidFrame(f"the line {text[:60]!r} has missing or invalid fields: {error}") from None


def _parse_frame(kind: str, layout: int, number: int, fields: list[str], text: str) -> Frame:
    if kind == "S":
        return Samples(layout, number, _parse_counter(fields[0]), 1, tuple(_parse_value(x) for x in fields[1:]))
    if kind == "H":
        return _parse_hello(layout, number, fields, text.split(",", 3)[3])
    if kind == "I":
        temperature, battery = (float(x) if x else None for x in fields[2:4])
        return Status(layout, number, _parse_counter(fields[0]), _parse_counter(fields[1]), temperature, battery)
    if kind == "M":
        if fields[1] not in MARK_SOURCES:
            raise InvalidFrame(f"a mark of source {fields[1]!r}: {', '.join(MARK_SOURCES)}")
        return Mark(layout, number, _parse_counter(fields[0]), fields[1], float(fields[2]), ",".join(fields[3:]))
    raise InvalidFrame(f"a line that begins with {kind[:10]!r}: H, S, I or M")


def _parse_hello(layout: int, number: int, fields: list[str], text: str) -> Hello:
    boot = _parse_counter(fields[0])
    rate = float(fields[1])
    device, firmware = fields[2:4]
    count = int(fields[4])
    if count != len(fields) - 5 or count > MAX_CHANNELS:
        raise InvalidFrame(
            f"a hello that claims {count} channels and names {len(fields) - 5}: the maximum is {MAX_CHANNELS}"
        )
    if layout != layout_hash(text):
        raise InvalidFrame(
            f"a hello of layout {layout:04x} whose text has {layout_hash(text):04x}: the low 16 bits of its CRC"
        )
    channels = []
    for name, unit, scale, offset in (field.split(";") for field in fields[5:]):
        channels.append(Channel(name, unit, "f", float(scale), float(offset)))
    check_hello(rate, device, firmware, tuple(channels))
    return Hello(layout, number, boot, rate, device, firmware, tuple(channels))


def _parse_counter(text: str) -> int:
    number = int(text)
    if not 0 <= number < 2**32:
        raise InvalidFrame(f"{text[:20]} is not a 32-bit counter")
    return number


def _parse_value(text: str) -> float:
    """Return a value; NaN if it is empty or not finite."""
    value = float(text) if text else math.nan
    return value if math.isfinite(value) else math.nan
