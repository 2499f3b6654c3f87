"""Bytes to frames: split at delimiters, checked, counted; the first valid frame shows binary or text form."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from railui.capture.protocol import text, wire
from railui.capture.protocol.messages import CorruptFrame, Frame, InvalidFrame

MAX_REASONS = 20
LINES = re.compile(rb"[^\n]*\n+|[^\n]+\Z")  # with all their line feeds: a row of them costs no time


@dataclass
class LinkStatistics:
    """Frames received on a link: valid, corrupt, invalid (with the first reasons) and truncated ones.

    undecoded: bytes since the last frame with a correct CRC; longest_undecoded: the most so far.
    """

    frames: int = 0
    crc_errors: int = 0
    refused: int = 0
    truncated: int = 0
    reasons: list[str] = field(default_factory=list)
    undecoded: int = 0
    longest_undecoded: int = 0

    def add_refusal(self, reason: str) -> None:
        """Count an invalid frame."""
        self.refused += 1
        if reason not in self.reasons and len(self.reasons) < MAX_REASONS:
            self.reasons.append(reason)

    def add(self, other: LinkStatistics) -> None:
        """Add the counts of another link."""
        self.frames += other.frames
        self.crc_errors += other.crc_errors
        self.refused += other.refused
        self.truncated += other.truncated
        self.undecoded = other.undecoded
        self.longest_undecoded = max(self.longest_undecoded, other.longest_undecoded)
        self.reasons += [r for r in other.reasons if r not in self.reasons][: MAX_REASONS - len(self.reasons)]


class FrameSplitter:
    """Splitter of a byte stream at a delimiter; decodes the parts and buffers at most `max_bytes`."""

    def __init__(self, delimiter: bytes, max_bytes: int, decode: Callable[[bytes], Frame]) -> None:
        self.delimiter = delimiter
        self.max_bytes = max_bytes
        self.decode = decode
        self.statistics = LinkStatistics()
        self._pending = b""
        self._is_overlong = False
        self._corrupt_bytes = 0  # of corrupt and overlong frames since the last intact one

    @property
    def pending_bytes(self) -> int:
        """Bytes of an incomplete frame in memory."""
        return len(self._pending)

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that these bytes complete."""
        parts = data.split(self.delimiter)
        parts[0] = self._pending + parts[0]
        self._pending = parts.pop()
        frames: list[Frame] = []
        # local names: this loop runs once per frame of a line at full speed
        statistics, decode, max_bytes = self.statistics, self.decode, self.max_bytes
        for part in parts:
            if self._is_overlong or len(part) > max_bytes:
                self._is_overlong = False
                self._count_corrupt(len(part))
                statistics.crc_errors += 1
                continue
            if not part or part == b"\r":
                continue
            try:
                frames.append(decode(part))
            except CorruptFrame:
                self._count_corrupt(len(part))
                statistics.crc_errors += 1
                continue
            except InvalidFrame as error:
                statistics.add_refusal(str(error))
            self._corrupt_bytes = 0
        if len(self._pending) > max_bytes:
            self._count_corrupt(len(self._pending))
            self._pending = b""
            self._is_overlong = True
        statistics.frames += len(frames)
        statistics.undecoded = self._corrupt_bytes + len(self._pending)
        return frames

    def _count_corrupt(self, size: int) -> None:
        """Count bytes of a corrupt frame."""
        self._corrupt_bytes += size
        self.statistics.longest_undecoded = max(self.statistics.longest_undecoded, self._corrupt_bytes)

    def close(self) -> None:
        """End the stream; an incomplete frame counts as truncated."""
        self.statistics.truncated += bool(self._pending) or self._is_overlong
        self._count_corrupt(len(self._pending))
        self._pending = b""
        self._is_overlong = False


class Link:
    """Connection to a logger in binary or text form; the first valid frame decides which."""

    def __init__(self) -> None:
        self._splitters = {
            "binary": FrameSplitter(wire.DELIMITER, wire.MAX_ENCODED_BYTES, wire.decode),
            "text": FrameSplitter(text.DELIMITER, text.MAX_LINE_BYTES, text.decode),
        }

    @property
    def form(self) -> str | None:
        """Form of the frames, binary or text; None before the first valid frame."""
        return next(iter(self._splitters)) if len(self._splitters) == 1 else None

    @property
    def statistics(self) -> LinkStatistics:
        """Counts so far; before the form is known, those of the form with more frames."""
        counts = (splitter.statistics for splitter in self._splitters.values())
        return min(counts, key=lambda s: (-s.frames, -s.crc_errors))

    @property
    def pending_bytes(self) -> int:
        """Bytes of incomplete frames in memory."""
        return sum(splitter.pending_bytes for splitter in self._splitters.values())

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that these bytes complete; the division of the bytes into calls has no influence."""
        if len(self._splitters) == 1:
            return next(iter(self._splitters.values())).feed(data)
        frames: list[Frame] = []
        for part in LINES.findall(data):
            frames += self._feed_part(part)
        return frames

    def _feed_part(self, data: bytes) -> list[Frame]:
        """Return the frames of a part; keep the splitter that decodes a valid frame first."""
        for name, splitter in self._splitters.items():
            if frames := splitter.feed(data):
                self._splitters = {name: splitter}
                return frames
        return []

    def close(self) -> LinkStatistics:
        """End the connection and return its counts."""
        statistics = self.statistics
        for splitter in self._splitters.values():
            splitter.close()
        return statistics
