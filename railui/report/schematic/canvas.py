"""Drawing area of a plan view: scale, and the boxes that symbols fill."""

from __future__ import annotations

from dataclasses import dataclass, field

SCALE = 100.0  # px per m


@dataclass(frozen=True)
class Box:
    """Box by its centre and half sizes [px]."""

    x: float
    y: float
    half_width: float
    half_height: float

    def shifted(self, dx: float, dy: float = 0.0) -> Box:
        """Return the box at another place."""
        return Box(self.x + dx, self.y + dy, self.half_width, self.half_height)

    def overlaps(self, other: Box) -> bool:
        """True if the boxes have an area in common."""
        return (
            abs(self.x - other.x) < self.half_width + other.half_width
            and abs(self.y - other.y) < self.half_height + other.half_height
        )


@dataclass
class Canvas:
    """Map from metres to pixels, y to the right of the vehicle downwards; `occupied` grows as symbols are placed."""

    left: float  # m, drawn x at pixel 0
    middle: float  # px, of y = 0
    occupied: list[Box] = field(default_factory=list)

    def x(self, drawn: float) -> float:
        """Return the pixel of a drawn position along the vehicle."""
        return (drawn - self.left) * SCALE

    def y(self, lateral: float) -> float:
        """Return the pixel of a lateral position."""
        return self.middle + lateral * SCALE

    def is_occupied(self, box: Box) -> bool:
        """True if a symbol covers part of a box."""
        return any(box.overlaps(other) for other in self.occupied)

    def free_place(self, x: float, y: float, half: float) -> Box:
        """Return a place near a point where a square covers no symbol, along the vehicle rather than across it."""
        steps = [(i * 7.0, j * 7.0) for i in range(-9, 10) for j in range(-9, 10)]
        for dx, dy in sorted(steps, key=lambda d: (d[0] ** 2 + 4.0 * d[1] ** 2, d)):
            box = Box(x + dx, y + dy, half, half)
            if not self.is_occupied(box):
                return box
        return Box(x, y, half, half)
