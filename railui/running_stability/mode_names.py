"""Short names of modes: hunting, or the bodies that move most and their motion."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.running_stability.modes import relative_motion
from railui.vehicle.dofs import body_and_motion

HUNTING: Final = "hunting"
HUNTING_SLOPE: Final = 0.3  # of ln(frequency) against ln(speed); 1 for pure rolling, near 0 for a body on springs
HUNTING_RANGE: Final = 0.5  # share of the highest speed, above which this slope is taken
NAMED_MOTION: Final = 0.5  # share of the largest motion, below which a body is not in the name
MIN_SLOPE_POINTS: Final = 3


def is_hunting(speeds: FloatArray, frequency: FloatArray) -> bool:
    """True if a frequency [Hz], NaN where the mode does not oscillate, follows the speed as that of rolling does.

    Klingel's frequency is proportional to the speed, that of a body on its springs does not depend on it.

    >>> v = np.linspace(10.0, 50.0, 9)
    >>> is_hunting(v, v / 17.0), is_hunting(v, np.full(9, 1.2))
    (True, False)
    """
    used = (speeds >= HUNTING_RANGE * speeds.max()) & np.isfinite(frequency) & (frequency > 0)
    if np.count_nonzero(used) < MIN_SLOPE_POINTS:
        return False
    return bool(np.polyfit(np.log(speeds[used]), np.log(frequency[used]), 1)[0] > HUNTING_SLOPE)


def shape_name(dofs: Sequence[str], vector: ComplexArray, arm: float) -> str:
    """Name the bodies that move most, in phase or opposed, and their motion.

    Angles count by their displacement at `arm` [m].

    >>> shape_name(["y.frame_1", "y.frame_2", "phi.frame_1"], np.array([1.0, -0.9, 0.2]), 1.0)
    'frames lateral, opposed'
    """
    motion = relative_motion(dofs, vector, arm)
    if motion is None:
        return "effects"
    first = body_and_motion(dofs[int(np.flatnonzero(motion == 1.0)[0])])[1]
    members = [
        (body_and_motion(dof)[0], value)
        for dof, value in zip(dofs, motion, strict=True)
        if body_and_motion(dof)[1] == first and abs(value.real) >= max(NAMED_MOTION, abs(value.imag))
    ]
    kinds = Counter(re.sub(r" \d+$", "", body) for body, _ in members)
    bodies = [f"{kind}s" if count > 1 else kind for kind, count in kinds.items()]
    is_opposed = any(value.real < 0 for _, value in members)
    joined = bodies[0] if len(bodies) == 1 else f"{', '.join(bodies[:-1])} and {bodies[-1]}"
    return f"{joined} {first}{', opposed' if is_opposed else ''}"


def distinct(names: Sequence[str]) -> list[str]:
    """Number names that occur more than once.

    >>> distinct(["hunting", "frame yaw", "hunting"])
    ['hunting', 'frame yaw', 'hunting 2']
    """
    found: Counter[str] = Counter()
    result = []
    for name in names:
        found[name] += 1
        result.append(name if found[name] == 1 else f"{name} {found[name]}")
    return result
