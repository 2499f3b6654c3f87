"""A logger in software: plays series as a real one would send them, and misbehaves where it is told to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from cobs import cobs

from railui.arrays import FloatArray
from railui.capture.protocol import text, wire
from railui.capture.protocol.frames import Channel

HELLO_EVERY, STATUS_EVERY = 5.0, 1.0  # s
RANGES = {"b": (-128, 127), "B": (0, 255), "h": (-32768, 32767), "H": (0, 65535), "i": (-(2**31), 2**31 - 1)}


@dataclass(frozen=True)
class Faults:
    """What goes wrong on purpose: shares of the frames, and times [s] of what happens once; 0: never."""

    drop: float = 0.0
    damage: float = 0.0
    junk: float = 0.0
    repeat: float = 0.0
    restart: float = 0.0
    relayout: float = 0.0
    unplug: float = 0.0
    pause: float = 0.0
    huge_hello: float = 0.0
    garble: float = 0.0  # as at a wrong baud rate, from then on
    seed: int = 0


@dataclass
class Truth:
    """What was really sent."""

    frames: int = 0
    samples: int = 0
    dropped: int = 0
    damaged: int = 0
    repeated: int = 0
    restarts: int = 0
    unplugged: int = 0


@dataclass
class Logger:
    """Series by channel [n] as a logger of a `rate` [Hz] sends them, `block` samples in a frame.

    Time runs `drift` faster on its clock than here; `start` [us] lets the 32 bits wrap early.
    """

    channels: Sequence[Channel]
    series: Mapping[str, FloatArray]
    rate: float
    block: int = 1
    form: str = "binary"
    faults: Faults = field(default_factory=Faults)
    drift: float = 0.0
    start: int = 0
    device: str = "railui demo"
    hello_every: float = HELLO_EVERY
    truth: Truth = field(default_factory=Truth)

    def __post_init__(self) -> None:
        self._random = np.random.default_rng([self.faults.seed, 8])
        self._boot = int(self._random.integers(1, 2**32))
        self._number = 0
        self._lay_out(self.channels)

    def _lay_out(self, channels: Sequence[Channel]) -> None:
        self._now = tuple(channels)
        about = (self._boot, self.rate, self.device, "1.0", self._now)
        if self.form == "text":
            self._hello_text = text.hello_text(*about)
            self._layout = text.layout_of(self._hello_text)
            return
        self._body = wire.hello_body(*about)
        self._layout = wire.layout_of(self._body)
        columns = [self.series[c.name] for c in self._now]
        dtype = np.dtype([(f"c{i}", f"<{np.dtype(c.type).str[1:]}") for i, c in enumerate(self._now)])
        self._rows = np.zeros(len(columns[0]), dtype)
        for i, (c, column) in enumerate(zip(self._now, columns, strict=True)):
            raw = (column - c.offset) / c.scale
            self._rows[f"c{i}"] = raw if c.type == "f" else np.clip(np.rint(raw), *RANGES.get(c.type, (0, 2**32 - 1)))

    def __len__(self) -> int:
        return len(next(iter(self.series.values())))

    def sent(self) -> Iterator[tuple[float, bytes]]:
        """(when [s], bytes) in order, faults included; b"" is the cable that is pulled out and put in again."""
        f, told, state = self.faults, -self.hello_every, -STATUS_EVERY
        once = {name: getattr(f, name) for name in ("restart", "relayout", "unplug", "pause", "huge_hello", "garble")}
        garbled, origin = False, self.start
        first = 0
        while first < len(self):
            when = first / self.rate
            due = [name for name, at in once.items() if at and when >= at]
            for name in due:
                del once[name]
                if name == "restart":
                    self._restart()
                    origin, told = -round(when * 1e6), -self.hello_every
                elif name == "relayout":
                    self._lay_out([replace_name(c) if i else c for i, c in enumerate(self.channels[:-1])])
                    told = -self.hello_every
                elif name == "unplug":
                    self.truth.unplugged += 1
                    yield when, b""
                elif name == "pause":
                    first += round(self.rate)
                    when = first / self.rate
                elif name == "huge_hello":
                    yield when, self._huge()
                elif name == "garble":
                    garbled = True
            if when - told >= self.hello_every:
                told = when
                yield from self._leave(when, self._hello(), garbled, spare=True)
            micros = origin + round(when * 1e6 * (1.0 + self.drift))
            if when - state >= STATUS_EVERY:
                state = when
                yield from self._leave(when, self._status(micros), garbled)
            count = min(self.block, len(self) - first) if self.form == "binary" else 1
            self.truth.samples += count
            yield from self._leave(when + (count - 1) / self.rate, self._samples(first, count, micros), garbled)
            first += count

    def _leave(self, when: float, frame: bytes, garbled: bool, spare: bool = False) -> Iterator[tuple[float, bytes]]:
        """A frame as it leaves: whole, not at all, changed, twice, or with junk ahead of it."""
        self._number += 1
        f, chance = self.faults, self._random.random(4) if not spare else np.ones(4)
        if chance[0] < f.drop:
            self.truth.dropped += 1
            return
        if chance[1] < f.junk:
            yield when, self._random.bytes(int(self._random.integers(1, 40))).replace(b"\n", b"!") + self._end()
        if chance[2] < f.damage:
            self.truth.damaged += 1
            frame = damaged(frame, self._random, self._end())
        if garbled:
            frame = bytes(self._random.integers(128, 255, len(frame), dtype=np.uint8))
        self.truth.frames += 1
        yield when, frame
        if chance[3] < f.repeat:
            self.truth.repeated += 1
            yield when, frame

    def _restart(self) -> None:
        self.truth.restarts += 1
        self._boot = (self._boot + 1) % 2**32
        self._number = 0
        self._lay_out(self._now)

    def _hello(self) -> bytes:
        """A hello with a delimiter ahead of it: junk on the line before it costs nothing then."""
        if self.form == "text":
            return self._end() + text.hello(self._number, self._hello_text)
        return self._end() + wire.hello(self._number, self._body)

    def _huge(self) -> bytes:
        """A hello that claims far more channels than it names, with a CRC that fits."""
        if self.form == "text":
            return text.line(f"H,0000,0,{self._boot},{self.rate},x,y,1000000,a;m;1;0")
        body = bytearray(self._body)
        at = self._body.index(self._now[0].name.encode()) - wire.PER_CHANNEL.size - 3
        body[at : at + 2] = b"\xff\xff"
        return wire.hello(self._number, bytes(body))

    def _status(self, micros: int) -> bytes:
        status = text.status if self.form == "text" else wire.status
        return status(self._layout, self._number, micros, 0, 21.5, 12.4)

    def _samples(self, first: int, count: int, micros: int) -> bytes:
        if self.form == "text":
            values = [(float(self.series[c.name][first]) - c.offset) / c.scale for c in self._now]
            return text.sample(self._layout, self._number, micros, values)
        data = self._rows[first : first + count].tobytes()
        if self.block == 1:
            return wire.sample(self._layout, self._number, micros, data)
        return wire.block(self._layout, self._number, micros, count, data)

    def _end(self) -> bytes:
        return text.DELIMITER if self.form == "text" else wire.DELIMITER


def replace_name(channel: Channel) -> Channel:
    """The channel after somebody gave the logger another configuration."""
    return channel._replace(offset=0.0, scale=channel.scale * 2.0)


def damaged(frame: bytes, random: np.random.Generator, end: bytes = wire.DELIMITER) -> bytes:
    """A frame with flipped bits, a byte lost, a byte too many, cut off or overwritten; its delimiter stays."""
    body = bytearray(frame[: -len(end)])
    before = _said(bytes(body), end)
    while _said(bytes(body), end) == before:
        kind, at = int(random.integers(5)), int(random.integers(len(body)))
        if kind == 0:
            for place in random.integers(len(body), size=int(random.integers(1, 5))):
                body[int(place)] ^= 1 << int(random.integers(8))
        elif kind == 1:
            del body[at]
        elif kind == 2:
            body.insert(at, int(random.integers(256)))
        elif kind == 3:
            del body[max(at, 1) :]
        else:
            body[at : at + 8] = random.bytes(min(8, len(body) - at))
        body = bytearray(b for b in body if b != end[0]) or bytearray(b"\x01")
    return bytes(body) + end


def _said(body: bytes, end: bytes) -> bytes:
    """What a receiver reads in a frame: some changes leave it as it was."""
    if end != wire.DELIMITER:
        return body.removesuffix(b"\r")
    try:
        return bytes(cobs.decode(body))
    except cobs.DecodeError:
        return body
