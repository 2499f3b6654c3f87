"""The text form: one line per frame, fields with commas, `*` and the CRC-32 in hexadecimal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from zlib import crc32

from railui.capture.protocol.frames import (
    MOST_CHANNELS,
    SOURCES,
    Channel,
    Damaged,
    Frame,
    Hello,
    Mark,
    Refused,
    Samples,
    Status,
    check_hello,
)

DELIMITER = b"\n"
MOST_LINE = 16384


# -- to the wire


def line(text: str) -> bytes:
    """A line with its CRC.

    >>> line("S,1a2b,7,350000,0.12,-3.4")
    b'S,1a2b,7,350000,0.12,-3.4*b826fd8e\\n'
    """
    data = text.encode()
    return data + b"*%08x\n" % crc32(data)


def hello_text(boot: int, rate: float, device: str, firmware: str, channels: Sequence[Channel]) -> str:
    """What the layout is the hash of."""
    listed = ",".join(f"{c.name};{c.unit};{c.scale:.9g};{c.offset:.9g}" for c in channels)
    return f"{boot},{rate:.9g},{device},{firmware},{len(channels)},{listed}"


def layout_of(text: str) -> int:
    """The name of a hello: the low 16 bits of the CRC of its text."""
    return crc32(text.encode()) & 0xFFFF


def hello(number: int, text: str) -> bytes:
    """A hello line."""
    return line(f"H,{layout_of(text):04x},{number},{text}")


def sample(layout: int, number: int, time: int, values: Sequence[float]) -> bytes:
    """A line of one sample at `time` [us]."""
    listed = ",".join(f"{x:.9g}" for x in values)
    return line(f"S,{layout:04x},{number},{time & 0xFFFFFFFF},{listed}")


def status(
    layout: int, number: int, time: int, overruns: int, temperature: float | None = None, battery: float | None = None
) -> bytes:
    """A status line; temperature [degC], battery [V], empty where unknown."""
    known = ",".join("" if x is None else f"{x:.4g}" for x in (temperature, battery))
    return line(f"I,{layout:04x},{number},{time & 0xFFFFFFFF},{overruns},{known}")


def mark(layout: int, number: int, time: int, source: str = "button", utc: float = 0.0, label: str = "") -> bytes:
    """A mark line; utc [s since 1970], 0 where unknown."""
    return line(f"M,{layout:04x},{number},{time & 0xFFFFFFFF},{source},{utc:.6f},{label}")


# -- from the wire


def decode(data: bytes) -> Frame:
    """The frame of a line; Damaged where bytes were lost or changed, Refused where it makes no sense."""
    body, star, check = data.removesuffix(b"\r").rpartition(b"*")
    try:
        fits = star and check == b"%08x" % crc32(body)
        text = body.decode() if fits else ""
    except ValueError:
        fits = False
    if not fits:
        raise Damaged("the CRC does not fit")
    kind, *fields = text.split(",")
    try:
        layout, number = int(fields[0], 16), _counter(fields[1])
        return _frame(kind, layout, number, fields[2:], text)
    except (ValueError, IndexError) as error:
        if isinstance(error, Refused):
            raise
        raise Refused(f"the line {text[:60]!r} does not hold what it should: {error}") from None


def _frame(kind: str, layout: int, number: int, fields: list[str], text: str) -> Frame:
    if kind == "S":
        return Samples(layout, number, _counter(fields[0]), 1, tuple(_value(x) for x in fields[1:]))
    if kind == "H":
        return _hello(layout, number, fields, text.split(",", 3)[3])
    if kind == "I":
        temperature, battery = (float(x) if x else None for x in fields[2:4])
        return Status(layout, number, _counter(fields[0]), _counter(fields[1]), temperature, battery)
    if kind == "M":
        if fields[1] not in SOURCES:
            raise Refused(f"a mark of source {fields[1]!r}: {', '.join(SOURCES)}")
        return Mark(layout, number, _counter(fields[0]), fields[1], float(fields[2]), ",".join(fields[3:]))
    raise Refused(f"a line that begins with {kind[:10]!r}: H, S, I or M")


def _hello(layout: int, number: int, fields: list[str], text: str) -> Hello:
    boot, rate, device, firmware, count = _counter(fields[0]), float(fields[1]), fields[2], fields[3], int(fields[4])
    if count != len(fields) - 5 or count > MOST_CHANNELS:
        raise Refused(f"a hello that claims {count} channels and names {len(fields) - 5}: {MOST_CHANNELS} are the most")
    if layout != layout_of(text):
        raise Refused(
            f"a hello of layout {layout:04x} whose text has {layout_of(text):04x}: the low 16 bits of its CRC"
        )
    channels = []
    for name, unit, scale, offset in (field.split(";") for field in fields[5:]):
        channels.append(Channel(name, unit, "f", float(scale), float(offset)))
    check_hello(rate, device, firmware, tuple(channels))
    return Hello(layout, number, boot, rate, device, firmware, tuple(channels))


def _counter(text: str) -> int:
    number = int(text)
    if not 0 <= number < 2**32:
        raise Refused(f"{text[:20]} is no counter of 32 bits")
    return number


def _value(text: str) -> float:
    value = float(text) if text else math.nan
    return value if math.isfinite(value) else math.nan
