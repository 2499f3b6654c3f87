"""Modes against speed: frequency, damping, decrement, shapes in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.vehicle.dofs import part_of
from railui.vehicle.linear import damping_ratio, state_matrices
from railui.vehicle.model import Model

SEEN: Final = 0.25  # of the largest motion of a shape: what is smaller is not told


def decrement(root: complex) -> float | None:
    """Logarithmic decrement of an oscillation, ln of two successive amplitudes: -2 pi Re/abs(Im); None without one.

    Source: Keizer, as Broersen 1976, 2.1, cites him.

    >>> round(decrement(-0.34808 + 30.17447j), 5)
    0.07248
    """
    return float(-2 * np.pi * root.real / abs(root.imag)) if root.imag else None


def modes_at(model: Model, speed: float) -> list[dict[str, Any]]:
    """The modes of a vehicle at a speed [m/s], least damped first, one for each pair of eigenvalues.

    real [1/s], imag [rad/s, >= 0], decrement (None without oscillation), frequency [Hz], damping (ratio), shape.
    """
    return _modes(model, speed, state_matrices(model, model.row[None], np.array([speed]))[0])


def modes_over(model: Model, speeds: Sequence[float]) -> list[dict[str, Any]]:
    """The modes of `modes_at` at every speed, one after the other."""
    v = np.asarray(speeds, dtype=float)
    matrices = state_matrices(model, np.repeat(model.row[None], len(v), axis=0), v)
    return [mode for speed, matrix in zip(speeds, matrices, strict=True) for mode in _modes(model, speed, matrix)]


def _modes(model: Model, speed: float, matrix: FloatArray) -> list[dict[str, Any]]:
    roots, vectors = np.linalg.eig(matrix)
    dofs = model.vehicles().freedoms(model.single())
    arm = 0.5 * (model.behind()[1:2] or (2.0,))[0]
    found = []
    for i in np.lexsort((-roots.imag, -roots.real)):
        root = complex(roots[i])
        if root.imag < 0:
            continue
        told = {"speed": float(speed), "real": root.real, "imag": root.imag, "decrement": decrement(root)}
        told |= {"frequency": root.imag / (2 * np.pi), "damping": float(damping_ratio(np.array(root)))}
        found.append(told | {"shape": shape_in_words(dofs, vectors[: len(dofs), i], arm)})
    return found


def shape_in_words(dofs: Sequence[str], vector: ComplexArray, arm: float) -> str:
    """A mode shape as an engineer would say it; angles count by their path at `arm` [m].

    >>> shape_in_words(["y", "psi", "y1", "psi1", "y2", "psi2"], np.array([1, 0, 0.9, 0.6j, 0.9, 0.6j]), 1.0)
    'frame and wheelsets lateral; wheelsets yaw a quarter ahead'
    """
    path = np.array([v if part_of(d)[1] == "lateral" else v * arm for d, v in zip(dofs, vector, strict=True)])
    if not np.any(np.abs(path) > 0):
        return "own states of the effects"
    # the first of the largest leads, so that rounding does not choose
    first = int(np.flatnonzero(np.abs(path) > 0.98 * np.abs(path).max())[0])
    path = path / path[first]
    groups: dict[tuple[str, int], list[str]] = {}
    for i in [first, *(j for j in np.argsort(-np.round(np.abs(path), 2), kind="stable") if j != first)]:
        if abs(path[i]) >= SEEN:
            body, motion = part_of(dofs[i])
            groups.setdefault((motion, _turned(path[i])), []).append(body)
    return "; ".join(f"{_together(bodies)} {motion}{_phase(phase)}" for (motion, phase), bodies in groups.items())


def _turned(motion: complex) -> int:
    """Phase in quarters of a period: 0 in phase, 1 ahead, -1 behind, 2 opposed."""
    quarter = round(float(np.angle(motion)) / (np.pi / 2))
    return 2 if abs(quarter) == 2 else quarter


def _phase(quarter: int) -> str:
    return {0: "", 1: " a quarter ahead", -1: " a quarter behind", 2: " opposed"}[quarter]


def _together(bodies: list[str]) -> str:
    wheelsets = [b for b in bodies if b.startswith("wheelset ")]
    if len(wheelsets) > 1:
        at = bodies.index(wheelsets[0])
        numbers = "" if len(wheelsets) in (2, 4) else " " + ", ".join(b.split()[-1] for b in wheelsets)
        bodies = [b for b in bodies if b not in wheelsets]
        bodies.insert(at, f"wheelsets{numbers}")
    return bodies[0] if len(bodies) == 1 else f"{', '.join(bodies[:-1])} and {bodies[-1]}"
