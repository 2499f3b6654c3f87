"""A canvas of character cells: letters with styles, dots that add to dots, rows as strips."""

from __future__ import annotations

from dataclasses import dataclass

from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip

from railui.desk.widgets.braille import BLANK

# what a cell of dots looks like where there are letters only: by which of its halves hold dots
PLAIN = (" ", "'", ".", ":")


@dataclass(frozen=True)
class Frame:
    """Where the lines stand inside a plot, in cells."""

    left: int
    top: int
    width: int
    height: int

    def row(self, place: float) -> int:
        """The row of a place on the vertical axis."""
        return self.top + min(self.height - 1, max(0, int((1 - place) * self.height)))


class Canvas:
    """Cells with a letter and a style each; dots add to dots."""

    def __init__(self, width: int, height: int, style: Style) -> None:
        self.width, self.height, self.blank = width, height, style
        self.letters = [[" "] * width for _ in range(height)]
        self.styles = [[style] * width for _ in range(height)]

    def put(self, x: int, y: int, letter: str, style: Style, over: bool = True) -> None:
        """One letter; not over dots unless `over`."""
        if 0 <= x < self.width and 0 <= y < self.height and (over or not self._dotted(x, y)):
            self.letters[y][x], self.styles[y][x] = letter, style

    def write(self, x: int, y: int, text: str, style: Style) -> None:
        """A text from a cell on, cut at the edge."""
        for i, letter in enumerate(text):
            self.put(x + i, y, letter, style)

    def dots(self, x: int, y: int, bits: int, style: Style) -> None:
        """Dots of a line in a cell; those that stand there stay, in the new colour."""
        if 0 <= x < self.width and 0 <= y < self.height:
            old = ord(self.letters[y][x]) - BLANK if self._dotted(x, y) else 0
            self.letters[y][x], self.styles[y][x] = chr(BLANK + (old | bits)), style

    def flatten(self) -> None:
        """Dots as letters that every terminal has."""
        for row in self.letters:
            for i, letter in enumerate(row):
                if BLANK < ord(letter) < BLANK + 256:
                    bits = ord(letter) - BLANK
                    row[i] = PLAIN[bool(bits & 0b00011011) + 2 * bool(bits & 0b11100100)]

    def strips(self) -> list[Strip]:
        """The rows, neighbours of one style joined."""
        return [self._strip(letters, styles) for letters, styles in zip(self.letters, self.styles, strict=True)]

    def _strip(self, letters: list[str], styles: list[Style]) -> Strip:
        segments, start = [], 0
        for i in range(1, self.width + 1):
            if i == self.width or styles[i] is not styles[start]:
                segments.append(Segment("".join(letters[start:i]), styles[start]))
                start = i
        return Strip(segments, self.width)

    def _dotted(self, x: int, y: int) -> bool:
        return BLANK < ord(self.letters[y][x]) < BLANK + 256
