"""Modes of vehicles over speed: frequency, damping, logarithmic decrement, mode shapes in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.vehicle.dofs import body_and_motion
from railui.vehicle.linear import MIN_ROOT, damping_ratio, state_matrices
from railui.vehicle.model import Model

MIN_SHOWN_MOTION: Final = 0.25  # share of the largest motion of a shape below which a body is not named
EQUAL_MOTION: Final = 0.98  # share of the largest motion from which motions count as equally large
DEFAULT_ARM: Final = 1.0  # m, at which angles are compared with displacements where there is one wheelset


def decrement(root: complex) -> float | None:
    """Return the logarithmic decrement of an oscillation, -2 pi Re/abs(Im); None for a root without oscillation.

    It is ln of the ratio of two successive amplitudes. Source: Keizer, cited by Broersen 1976, 2.1.

    >>> round(decrement(-0.34808 + 30.17447j), 5)
    0.07248
    """
    return float(-2 * np.pi * root.real / abs(root.imag)) if root.imag else None


def modes_at(model: Model, speed: float) -> list[dict[str, Any]]:
    """Return the modes of a vehicle at a speed [m/s], least stable first, one for each pair of eigenvalues.

    Keys: real [1/s], imag [rad/s, >= 0], decrement (None without oscillation), frequency [Hz], damping (ratio), shape.
    """
    return _modes(model, speed, state_matrices(model, model.row[None], np.array([speed]))[0])


def modes_at_speeds(model: Model, speeds: Sequence[float]) -> list[dict[str, Any]]:
    """Return the modes of `modes_at` at every speed [m/s], speed by speed."""
    v = np.asarray(speeds, dtype=float)
    matrices = state_matrices(model, np.repeat(model.row[None], len(v), axis=0), v)
    return [mode for speed, matrix in zip(speeds, matrices, strict=True) for mode in _modes(model, speed, matrix)]


def least_damped_mode(modes: Iterable[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Return the mode with the smallest damping ratio, but for constants; None without any."""
    moving = [mode for mode in modes if abs(complex(mode["real"], mode["imag"])) >= MIN_ROOT]
    return min(moving, key=lambda mode: float(mode["damping"]), default=None)


def _modes(model: Model, speed: float, matrix: FloatArray) -> list[dict[str, Any]]:
    roots, vectors = np.linalg.eig(matrix)
    dofs = model.vehicles().degrees_of_freedom(model.single_batch())
    arm = shape_arm(model)
    modes = []
    for i in np.lexsort((-roots.imag, -roots.real)):
        root = complex(roots[i])
        if root.imag < 0:
            continue
        modes.append(
            {
                "speed": float(speed),
                "real": root.real,
                "imag": root.imag,
                "decrement": decrement(root),
                "frequency": root.imag / (2 * np.pi),
                "damping": float(damping_ratio(np.array(root))),
                "shape": describe_shape(dofs, vectors[: len(dofs), i], arm),
            }
        )
    return modes


def describe_shape(dofs: Sequence[str], vector: ComplexArray, arm: float) -> str:
    """Describe a mode shape in words; angles count by their displacement at `arm` [m].

    >>> describe_shape(["y", "psi", "y1", "psi1", "y2", "psi2"], np.array([1, 0, 0.9, 0.6j, 0.9, 0.6j]), 1.0)
    'frame and wheelsets lateral; wheelsets yaw a quarter ahead'
    """
    motion = relative_motion(dofs, vector, arm)
    if motion is None:
        return "own states of the effects"
    first = int(np.flatnonzero(motion == 1.0)[0])
    groups: dict[tuple[str, int], list[str]] = {}
    for i in [first, *(j for j in np.argsort(-np.round(np.abs(motion), 2), kind="stable") if j != first)]:
        if abs(motion[i]) >= MIN_SHOWN_MOTION:
            body, direction = body_and_motion(dofs[i])
            groups.setdefault((direction, _quarter_periods(motion[i])), []).append(body)
    return "; ".join(
        f"{_join_bodies(bodies)} {direction}{_phase(quarter)}" for (direction, quarter), bodies in groups.items()
    )


def relative_motion(dofs: Sequence[str], vector: ComplexArray, arm: float) -> ComplexArray | None:
    """Return the motion of each degree of freedom relative to the largest one; None if no body moves.

    Angles count by their displacement at `arm` [m]. The first of equally large motions is the reference, so that
    rounding does not select it.

    >>> relative_motion(["y", "psi"], np.array([2j, 1j]), 0.5).round(2).tolist()
    [(1+0j), (0.25+0j)]
    """
    motion = np.array([v if body_and_motion(d)[1] == "lateral" else v * arm for d, v in zip(dofs, vector, strict=True)])
    if not np.any(np.abs(motion) > 0):
        return None
    first = int(np.flatnonzero(np.abs(motion) > EQUAL_MOTION * np.abs(motion).max())[0])
    relative: ComplexArray = motion / motion[first]
    relative[first] = 1.0
    return relative


def shape_arm(model: Model) -> float:
    """Return half the distance [m] of the first two wheelsets, at which angles are compared with displacements."""
    return 0.5 * (model.wheelset_distances()[1:2] or (2.0 * DEFAULT_ARM,))[0]


def _quarter_periods(motion: complex) -> int:
    """Return the phase in quarters of a period: 0 in phase, 1 ahead, -1 behind, 2 opposed."""
    quarter = round(float(np.angle(motion)) / (np.pi / 2))
    return 2 if abs(quarter) == 2 else quarter


def _phase(quarter: int) -> str:
    return {0: "", 1: " a quarter ahead", -1: " a quarter behind", 2: " opposed"}[quarter]


def _join_bodies(bodies: list[str]) -> str:
    """Join names of bodies; two or four wheelsets are all of them and need no numbers."""
    wheelsets = [b for b in bodies if b.startswith("wheelset ")]
    if len(wheelsets) > 1:
        at = bodies.index(wheelsets[0])
        numbers = "" if len(wheelsets) in (2, 4) else " " + ", ".join(b.split()[-1] for b in wheelsets)
        bodies = [b for b in bodies if b not in wheelsets]
        bodies.insert(at, f"wheelsets{numbers}")
    return bodies[0] if len(bodies) == 1 else f"{', '.join(bodies[:-1])} and {bodies[-1]}"
