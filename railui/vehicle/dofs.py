"""Names of degrees of freedom."""

from __future__ import annotations

from typing import Final

MOTIONS: Final = {"y": "lateral", "psi": "yaw", "phi": "roll"}


def body_and_motion(dof: str) -> tuple[str, str]:
    """Return body and motion of a degree of freedom.

    >>> body_and_motion("y1"), body_and_motion("y_c"), body_and_motion("phi.frame")
    (('wheelset 1', 'lateral'), ('coach', 'lateral'), ('frame', 'roll'))
    """
    motion, _, body = dof.partition(".")
    if not body:
        motion = next((m for m in ("psi", "phi", "y") if dof.startswith(m)), dof)
        rest = dof[len(motion) :].lstrip("_")
        body = {"": "frame", "c": "coach"}.get(rest, f"wheelset_{rest}")
    return body.replace("_", " "), MOTIONS.get(motion, motion)


def is_lateral(dof: str) -> bool:
    """True if a degree of freedom is a lateral displacement.

    >>> [is_lateral(dof) for dof in ("y", "y1", "y_c", "y.frame", "psi1", "phi.frame")]
    [True, True, True, True, False, False]
    """
    return dof.startswith("y")
