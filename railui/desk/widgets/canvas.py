"""Canvas of character cells with styles and braille dots."""

from __future__ import annotations

from dataclasses import dataclass

from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from railui.desk.widgets.braille import BLANK_CODE_POINT

# characters for a cell with dots in neither, its upper, its lower, or both halves, without braille
PLAIN_DOTS = (" ", "'", ".", ":")


@dataclass(frozen=True)
class Frame:
    """Area of the lines inside a plot, in cells."""

    left: int
    top: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """First column beyond the frame."""
        return self.left + self.width

    @property
    def foot(self) -> int:
        """First row below the frame."""
        return self.top + self.height

    def row(self, position: float) -> int:
        """Return the row of a position on the vertical axis."""
        return self.top + min(self.height - 1, max(0, int((1 - position) * self.height)))

    def column(self, position: float) -> int:
        """Return the column of a position on the horizontal axis."""
        return self.left + min(self.width - 1, max(0, int(position * self.width)))


class Canvas:
    """Cells with a character and a style each; dots in the same cell are combined."""

    def __init__(self, width: int, height: int, style: Style) -> None:
        self.width, self.height, self.blank = width, height, style
        self.characters = [[" "] * width for _ in range(height)]
        self.styles = [[style] * width for _ in range(height)]

    def put(self, x: int, y: int, character: str, style: Style, over: bool = True) -> None:
        """Put a character into a cell; `over`: also over dots."""
        if 0 <= x < self.width and 0 <= y < self.height and (over or not self._has_dots(x, y)):
            self.characters[y][x], self.styles[y][x] = character, style

    def write(self, x: int, y: int, text: str, style: Style) -> None:
        """Write a text from a cell on, cut at the edge."""
        for i, character in enumerate(text):
            self.put(x + i, y, character, style)

    def dots(self, x: int, y: int, bits: int, style: Style) -> None:
        """Add dots to a cell; the cell takes the new style."""
        if 0 <= x < self.width and 0 <= y < self.height:
            old = ord(self.characters[y][x]) - BLANK_CODE_POINT if self._has_dots(x, y) else 0
            self.characters[y][x], self.styles[y][x] = chr(BLANK_CODE_POINT + (old | bits)), style

    def replace_dots(self) -> None:
        """Replace dots by ASCII characters."""
        for row in self.characters:
            for i, character in enumerate(row):
                if BLANK_CODE_POINT < ord(character) < BLANK_CODE_POINT + 256:
                    bits = ord(character) - BLANK_CODE_POINT
                    row[i] = PLAIN_DOTS[bool(bits & 0b00011011) + 2 * bool(bits & 0b11100100)]

    def strips(self) -> list[Strip]:
        """Return the rows; neighbours of the same style are joined."""
        return [
            self._strip(characters, styles) for characters, styles in zip(self.characters, self.styles, strict=True)
        ]

    def _strip(self, characters: list[str], styles: list[Style]) -> Strip:
        segments, start = [], 0
        for i in range(1, self.width + 1):
            if i == self.width or styles[i] is not styles[start]:
                segments.append(Segment("".join(characters[start:i]), styles[start]))
                start = i
        return Strip(segments, self.width)

    def _has_dots(self, x: int, y: int) -> bool:
        return BLANK_CODE_POINT < ord(self.characters[y][x]) < BLANK_CODE_POINT + 256
