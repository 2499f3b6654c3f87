"""Simulated logger: transmits series as a real logger would, with the faults that are requested."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from cobs import cobs

from railui.arrays import FloatArray
from railui.capture.protocol import text, wire
from railui.capture.protocol.messages import Channel, little_endian

HELLO_INTERVAL = 5.0  # s
STATUS_INTERVAL = 1.0  # s
INTEGER_RANGES = {"b": (-128, 127), "B": (0, 255), "h": (-32768, 32767), "H": (0, 65535), "i": (-(2**31), 2**31 - 1)}
UINT32_RANGE = (0, 2**32 - 1)
DEMO_DEVICE = "railui demo"  # name of the simulated logger
RANDOM_STREAM = 8  # separates the faults from other random numbers of the same seed
MAX_JUNK_BYTES = 40
SINGLE_FAULTS = ("restart", "relayout", "unplug", "pause", "huge_hello", "garble")
TimedBytes = tuple[float, bytes]  # s, frame


@dataclass(frozen=True)
class Faults:
    """Deliberate faults: shares of the frames, and times [s] of single faults; 0 means never.

    Attributes
    ----------
    drop, damage, junk, repeat
        Shares of frames that are not sent, sent with changed bytes, preceded by junk, sent twice.
    restart, relayout, unplug, pause
        Times of a restart, other channels, an unplugged cable, a second without samples.
    huge_hello
        Time of a hello that claims 65535 channels.
    garble
        Time from which all bytes are wrong, as at a wrong baud rate.
    seed
        Seed of the random faults.
    """

    drop: float = 0.0
    damage: float = 0.0
    junk: float = 0.0
    repeat: float = 0.0
    restart: float = 0.0
    relayout: float = 0.0
    unplug: float = 0.0
    pause: float = 0.0
    huge_hello: float = 0.0
    garble: float = 0.0
    seed: int = 0


@dataclass
class SentCounts:
    """Counts of the transmission."""

    frames: int = 0
    samples: int = 0
    dropped: int = 0
    damaged: int = 0
    repeated: int = 0
    restarts: int = 0
    unplugged: int = 0


@dataclass
class _Transmission:
    """State of a transmission: next sample, its time [s], clock origin [us], times of hello and status [s]."""

    sample: int
    time: float
    origin: int
    last_hello: float
    last_status: float
    is_garbled: bool = False


@dataclass
class SimulatedLogger:
    """Logger in software.

    Parameters
    ----------
    channels
        Channels of a sample.
    series
        Values [n] by channel.
    rate
        Sampling rate [Hz].
    block
        Samples in a frame.
    form
        "binary" or "text".
    faults
        Deliberate faults.
    drift
        Relative error of the logger's clock.
    start
        First time stamp [us]; lets the 32 bits wrap early.
    device
        Name of the logger.
    hello_interval
        Time between two hellos [s].
    sent_counts
        Counts of the transmission, updated by `transmit`.
    """

    channels: Sequence[Channel]
    series: Mapping[str, FloatArray]
    rate: float
    block: int = 1
    form: str = "binary"
    faults: Faults = field(default_factory=Faults)
    drift: float = 0.0
    start: int = 0
    device: str = DEMO_DEVICE
    hello_interval: float = HELLO_INTERVAL
    sent_counts: SentCounts = field(default_factory=SentCounts)

    def __post_init__(self) -> None:
        self._random = np.random.default_rng([self.faults.seed, RANDOM_STREAM])
        self._boot = int(self._random.integers(1, 2**32))
        self.next_frame_number = 0
        self._configure(self.channels)

    def _configure(self, channels: Sequence[Channel]) -> None:
        """Set the channels, the hello and the raw numbers of the samples."""
        self._configured = tuple(channels)
        description = (self._boot, self.rate, self.device, "1.0", self._configured)
        if self.form == "text":
            self._hello_text = text.hello_text(*description)
            self._layout = text.layout_hash(self._hello_text)
            return
        self._body = wire.hello_body(*description)
        self._layout = wire.layout_hash(self._body)
        columns = [self.series[c.name] for c in self._configured]
        dtype = np.dtype([(f"c{i}", little_endian(c.type)) for i, c in enumerate(self._configured)])
        self._rows = np.zeros(len(columns[0]), dtype)
        for i, (c, column) in enumerate(zip(self._configured, columns, strict=True)):
            raw = (column - c.offset) / c.scale
            is_float = c.type == "f"
            self._rows[f"c{i}"] = raw if is_float else np.clip(np.rint(raw), *INTEGER_RANGES.get(c.type, UINT32_RANGE))

    def __len__(self) -> int:
        return len(next(iter(self.series.values())))

    def transmit(self) -> Iterator[TimedBytes]:
        """Yield (time [s], bytes) in order, faults included; b"" is a cable unplugged and plugged in again."""
        state = _Transmission(0, 0.0, self.start, -self.hello_interval, -STATUS_INTERVAL)
        remaining = {name: getattr(self.faults, name) for name in SINGLE_FAULTS}
        while state.sample < len(self):
            state.time = state.sample / self.rate
            for name in [name for name, at in remaining.items() if at and state.time >= at]:
                del remaining[name]
                yield from self._inject(name, state)
            if state.time - state.last_hello >= self.hello_interval:
                state.last_hello = state.time
                yield from self._send(state.time, self._hello(), state.is_garbled, is_protected=True)
            clock = state.origin + round(state.time * 1e6 * (1.0 + self.drift))
            if state.time - state.last_status >= STATUS_INTERVAL:
                state.last_status = state.time
                yield from self._send(state.time, self._status(clock), state.is_garbled)
            count = min(self.block, len(self) - state.sample) if self.form == "binary" else 1
            self.sent_counts.samples += count
            end = state.time + (count - 1) / self.rate
            yield from self._send(end, self._samples(state.sample, count, clock), state.is_garbled)
            state.sample += count

    def _inject(self, name: str, state: _Transmission) -> Iterator[TimedBytes]:
        """Apply a single fault."""
        if name == "restart":
            self._restart()
            state.origin = -round(state.time * 1e6)
            state.last_hello = -self.hello_interval
        elif name == "relayout":
            self._configure([rescaled(c) if i else c for i, c in enumerate(self.channels[:-1])])
            state.last_hello = -self.hello_interval
        elif name == "unplug":
            self.sent_counts.unplugged += 1
            yield state.time, b""
        elif name == "pause":
            state.sample += round(self.rate)
            state.time = state.sample / self.rate
        elif name == "huge_hello":
            yield state.time, self._huge_hello()
        elif name == "garble":
            state.is_garbled = True

    def _send(self, time: float, frame: bytes, is_garbled: bool, is_protected: bool = False) -> Iterator[TimedBytes]:
        """Yield a frame with its random faults: dropped, preceded by junk, damaged, garbled or repeated."""
        self.next_frame_number += 1
        faults = self.faults
        chance = np.ones(4) if is_protected else self._random.random(4)
        if chance[0] < faults.drop:
            self.sent_counts.dropped += 1
            return
        if chance[1] < faults.junk:
            junk = self._random.bytes(int(self._random.integers(1, MAX_JUNK_BYTES)))
            yield time, junk.replace(b"\n", b"!") + self._delimiter()
        if chance[2] < faults.damage:
            self.sent_counts.damaged += 1
            frame = damage_frame(frame, self._random, self._delimiter())
        if is_garbled:
            frame = bytes(self._random.integers(128, 255, len(frame), dtype=np.uint8))
        self.sent_counts.frames += 1
        yield time, frame
        if chance[3] < faults.repeat:
            self.sent_counts.repeated += 1
            yield time, frame

    def _restart(self) -> None:
        self.sent_counts.restarts += 1
        self._boot = (self._boot + 1) % 2**32
        self.next_frame_number = 0
        self._configure(self._configured)

    def _hello(self) -> bytes:
        """Encode a hello after a delimiter, which ends any junk on the line."""
        if self.form == "text":
            return self._delimiter() + text.encode_hello(self.next_frame_number, self._hello_text)
        return self._delimiter() + wire.encode_hello(self.next_frame_number, self._body)

    def _huge_hello(self) -> bytes:
        """Encode a hello that claims far more channels than it names, with a correct CRC."""
        if self.form == "text":
            return text.encode_line(f"H,0000,0,{self._boot},{self.rate},x,y,1000000,a;m;1;0")
        body = bytearray(self._body)
        at = self._body.index(self._configured[0].name.encode()) - wire.CHANNEL_HEADER.size - 3
        body[at : at + 2] = b"\xff\xff"
        return wire.encode_hello(self.next_frame_number, bytes(body))

    def _status(self, clock: int) -> bytes:
        encode = text.encode_status if self.form == "text" else wire.encode_status
        return encode(self._layout, self.next_frame_number, clock, 0, 21.5, 12.4)

    def _samples(self, first: int, count: int, clock: int) -> bytes:
        if self.form == "text":
            values = [(float(self.series[c.name][first]) - c.offset) / c.scale for c in self._configured]
            return text.encode_sample(self._layout, self.next_frame_number, clock, values)
        data = self._rows[first : first + count].tobytes()
        if self.block == 1:
            return wire.encode_sample(self._layout, self.next_frame_number, clock, data)
        return wire.encode_block(self._layout, self.next_frame_number, clock, count, data)

    def _delimiter(self) -> bytes:
        return text.DELIMITER if self.form == "text" else wire.DELIMITER


def rescaled(channel: Channel) -> Channel:
    """Return the channel with twice the scale and no offset, as after a change of configuration."""
    return channel._replace(offset=0.0, scale=channel.scale * 2.0)


def damage_frame(frame: bytes, random: np.random.Generator, end: bytes = wire.DELIMITER) -> bytes:
    """Damage a frame: flip bits, delete or insert a byte, truncate or overwrite it; keep its delimiter."""
    body = bytearray(frame[: -len(end)])
    original = _received(bytes(body), end)
    while _received(bytes(body), end) == original:
        kind = int(random.integers(5))
        at = int(random.integers(len(body)))
        if kind == 0:
            for position in random.integers(len(body), size=int(random.integers(1, 5))):
                body[int(position)] ^= 1 << int(random.integers(8))
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


def _received(body: bytes, end: bytes) -> bytes:
    """Return the content that a receiver decodes; some changes of the bytes do not affect it."""
    if end != wire.DELIMITER:
        return body.removesuffix(b"\r")
    try:
        return bytes(cobs.decode(body))
    except cobs.DecodeError:
        return body
