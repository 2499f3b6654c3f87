"""Bytes to frames: cut at delimiters, checked, counted; which form a logger speaks is heard from its first frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from railui.capture.protocol import text, wire
from railui.capture.protocol.frames import Damaged, Frame, Refused

MOST_REASONS = 20


@dataclass
class Heard:
    """What came over a link: whole frames, damaged ones, refused ones with the first reasons."""

    frames: int = 0
    crc_errors: int = 0
    refused: int = 0
    cut: int = 0
    reasons: list[str] = field(default_factory=list)

    def refuse(self, reason: str) -> None:
        """A frame that is whole and makes no sense."""
        self.refused += 1
        if reason not in self.reasons and len(self.reasons) < MOST_REASONS:
            self.reasons.append(reason)

    def add(self, other: Heard) -> None:
        """Takes over the counts of a link that was closed."""
        self.frames += other.frames
        self.crc_errors += other.crc_errors
        self.refused += other.refused
        self.cut += other.cut
        self.reasons += [r for r in other.reasons if r not in self.reasons][: MOST_REASONS - len(self.reasons)]


class Cutter:
    """Cuts bytes at a delimiter and reads what lies between; holds `most` bytes at most."""

    def __init__(self, delimiter: bytes, most: int, read: Callable[[bytes], Frame]) -> None:
        self.delimiter, self.most, self.read = delimiter, most, read
        self.heard = Heard()
        self._rest = b""
        self._overlong = False

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that these bytes complete."""
        parts = data.split(self.delimiter)
        parts[0] = self._rest + parts[0]
        self._rest = parts.pop()
        found: list[Frame] = []
        heard, read, most = self.heard, self.read, self.most
        for part in parts:
            if self._overlong or len(part) > most:
                self._overlong = False
                heard.crc_errors += 1
                continue
            if not part or part == b"\r":
                continue
            try:
                found.append(read(part))
            except Damaged:
                heard.crc_errors += 1
            except Refused as error:
                heard.refuse(str(error))
        if len(self._rest) > most:
            self._rest, self._overlong = b"", True
        heard.frames += len(found)
        return found

    def close(self) -> None:
        """The link ends: a frame under way is cut."""
        self.heard.cut += bool(self._rest) or self._overlong
        self._rest, self._overlong = b"", False


class Link:
    """One connection to a logger, in binary or text form: the first whole frame decides."""

    def __init__(self) -> None:
        self._forms = {
            "binary": Cutter(wire.DELIMITER, wire.MOST_CODED, wire.decode),
            "text": Cutter(text.DELIMITER, text.MOST_LINE, text.decode),
        }

    @property
    def form(self) -> str | None:
        """binary or text; None before the first whole frame."""
        return next(iter(self._forms)) if len(self._forms) == 1 else None

    @property
    def heard(self) -> Heard:
        """The counts so far; before the form is known those of the form that heard more."""
        return min((cutter.heard for cutter in self._forms.values()), key=lambda h: (-h.frames, -h.crc_errors))

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that these bytes complete; how the bytes are cut into calls makes no difference."""
        if len(self._forms) == 1:
            return next(iter(self._forms.values())).feed(data)
        found: list[Frame] = []
        for part in data.splitlines(keepends=True) if len(self._forms) > 1 else [data]:
            found += self._decide(part)
        return found

    def _decide(self, data: bytes) -> list[Frame]:
        if len(self._forms) == 1:
            return next(iter(self._forms.values())).feed(data)
        for name, cutter in self._forms.items():
            if frames := cutter.feed(data):
                self._forms = {name: cutter}
                return frames
        return []

    def close(self) -> Heard:
        """The connection ends; returns its counts."""
        heard = self.heard
        for cutter in self._forms.values():
            cutter.close()
        return heard
