"""Degrees of freedom: the part and the motion that each belongs to."""

from __future__ import annotations

from typing import Final

MOTIONS: Final = {"y": "lateral", "psi": "yaw", "phi": "roll"}


def part_of(dof: str) -> tuple[str, str]:
    """Body and motion of a degree of freedom: y1 is wheelset 1 lateral, y_c coach lateral, phi.frame frame roll."""
    motion, _, body = dof.partition(".")
    if not body:
        motion = next((m for m in ("psi", "phi", "y") if dof.startswith(m)), dof)
        rest = dof[len(motion) :].lstrip("_")
        body = {"": "frame", "c": "coach"}.get(rest, f"wheelset_{rest}")
    return body.replace("_", " "), MOTIONS.get(motion, motion)
