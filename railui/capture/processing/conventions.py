"""Sign conventions: axes of programs and standards, and the signs that convert them to railui's."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Convention:
    """Axes, and the signs that convert lateral, yaw and roll quantities to x forward, y right, z down."""

    name: str
    axes: str
    lateral: int
    yaw: int
    roll: int

    def sign(self, kind: str) -> int:
        """Return the factor of a lateral, yaw or roll quantity; 1 for a quantity without direction.

        >>> CONVENTIONS["ISO 8855"].sign("yaw"), CONVENTIONS["ISO 8855"].sign("roll")
        (-1, 1)
        """
        return int(getattr(self, kind)) if kind in ("lateral", "yaw", "roll") else 1


AXES_DOWN = "x forward, y right, z down; cross-level positive where the left rail is higher"
# rotated by 180 degrees about x: y, z and rotations about them change sign, roll does not
AXES_UP = "x forward, y left, z up; roll positive where the right side is lower"
CONVENTIONS = {
    c.name: c
    for c in (
        Convention("railui", AXES_DOWN, 1, 1, 1),
        Convention("EN 13848", AXES_DOWN, 1, 1, 1),
        Convention("SIMPACK", AXES_DOWN, 1, 1, 1),
        Convention("GENSYS", AXES_DOWN, 1, 1, 1),
        Convention("VAMPIRE", AXES_DOWN, 1, 1, 1),
        Convention("ISO 8855", AXES_UP, -1, -1, 1),
    )
}
