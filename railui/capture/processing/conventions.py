"""What is positive: the axes of programs and standards, each quantity's sign beside railui's."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Convention:
    """Axes, and the sign that turns a lateral, yaw and roll quantity into railui's (x forward, y right, z down)."""

    name: str
    axes: str
    lateral: int
    yaw: int
    roll: int

    def sign(self, kind: str) -> int:
        """The factor for lateral, yaw, roll; 1 for what has no direction.

        >>> CONVENTIONS["ISO 8855"].sign("yaw"), CONVENTIONS["ISO 8855"].sign("roll")
        (-1, 1)
        """
        return int(getattr(self, kind)) if kind in ("lateral", "yaw", "roll") else 1


DOWN = "x forward, y right, z down; cross-level positive where the left rail is higher"
# left and up: turned by half a turn round x, so y, z and rotations round them change sign, roll does not
UP = "x forward, y left, z up; roll positive where the right side is lower"
CONVENTIONS = {
    c.name: c
    for c in (
        Convention("railui", DOWN, 1, 1, 1),
        Convention("EN 13848", DOWN, 1, 1, 1),
        Convention("SIMPACK", DOWN, 1, 1, 1),
        Convention("GENSYS", DOWN, 1, 1, 1),
        Convention("VAMPIRE", DOWN, 1, 1, 1),
        Convention("ISO 8855", UP, -1, -1, 1),
    )
}
