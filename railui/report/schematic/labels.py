"""Labels in the margin of a drawing, each with a leader line to its place; no two overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

CHARACTER = 6.4  # px, mean width of a character of a label
BOLD = 1.08  # wider than plain text
ROW = 17.0  # px, distance of the rows of labels
GAP = 10.0  # px, between a label and the next leader line
MIN_DISTANCE = 13.0  # px, of two leader lines


@dataclass(frozen=True)
class Label:
    """Text with the point that it names [px], and its style class."""

    text: str
    x: float
    y: float
    style: str

    @property
    def width(self) -> float:
        """Estimated width [px]."""
        return text_width(self.text) * (BOLD if self.style == "effect" else 1.0)


@dataclass(frozen=True)
class PlacedLabel:
    """Label with the x of its leader line and its row, 0 next to the drawing."""

    label: Label
    x: float
    row: int


def text_width(text: str) -> float:
    """Return the estimated width of a text [px]."""
    return CHARACTER * len(text) + 4.0


def place_labels(labels: Sequence[Label]) -> list[PlacedLabel]:
    """Place labels in rows of a margin, so that neither texts nor leader lines cross a text.

    Every text begins at its leader line. A leader line passes all rows between its text and the drawing, hence a text
    that reaches over the leader line of another lies in a row further out.
    """
    ordered = sorted(labels, key=lambda label: (label.x, label.text))
    lines: list[float] = []
    for label in ordered:
        lines.append(max(label.x, lines[-1] + MIN_DISTANCE) if lines else label.x)
    placed: list[PlacedLabel] = []
    for label, x in zip(reversed(ordered), reversed(lines), strict=True):
        below = [other.row for other in placed if other.x < x + label.width + GAP]
        placed.append(PlacedLabel(label, x, 1 + max(below, default=-1)))
    return placed[::-1]
