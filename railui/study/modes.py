"""Modes against speed: frequency, damping, decrement, shapes in words, and the linear critical speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.study.linear import eigenvalues, state_matrices
from railui.study.model import Model

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

SLOWEST: Final = 1.0  # m/s from which a vehicle is looked at, whatever the range
SPACING: Final = 1.0  # m/s between two looks for a crossing, at most
CLOSE: Final = 1e-9  # m/s of a crossing
GROWS: Final = 1e-8  # 1/s, above which a root grows; a free co-ordinate has 0 and rounding
SEEN: Final = 0.25  # of the largest motion of a shape: what is smaller is not told
TOGETHER: Final = 16  # speeds looked at in one call
MOTIONS: Final = {"y": "lateral", "psi": "yaw", "phi": "roll"}


def damping_ratio(roots: Complexes) -> Floats:
    """-Re(s)/abs(s) of eigenvalues 1/s: 0 at the critical speed, negative above, 1 without oscillation."""
    size = np.abs(roots)
    return np.asarray(-roots.real / np.where(size > 0, size, 1.0))


def decrement(root: complex) -> float | None:
    """Logarithmic decrement of an oscillation, ln of two successive amplitudes: -2 pi Re/abs(Im); None without one.

    Source: Keizer, as Broersen 1976, 2.1, cites him.

    >>> round(decrement(-0.34808 + 30.17447j), 5)
    0.07248
    """
    return float(-2 * np.pi * root.real / abs(root.imag)) if root.imag else None


def klingel_wavelength(half_gauge: float, rolling_radius: float, conicity: float) -> float | None:
    """L = 2 pi sqrt(b r/lambda) [m] of a free wheelset's kinematic motion; None where the conicity is not positive.

    >>> round(klingel_wavelength(0.75, 0.46, 0.1), 3)
    11.67
    """
    return float(2 * np.pi * np.sqrt(half_gauge * rolling_radius / conicity)) if conicity > 0 else None


@dataclass(frozen=True)
class Critical:
    """Where a vehicle loses its stability: speed [m/s] and the root [1/s] that crosses."""

    speed: float
    root: complex

    @property
    def frequency(self) -> float:
        """Frequency [Hz] of what grows there; 0 where it does not oscillate."""
        return abs(self.root.imag) / (2 * np.pi)


def critical_speeds(
    model: Model, rows: Floats, highest: float, *, at_rest: bool = False, spacing: float = SPACING
) -> list[Critical | None]:
    """The lowest speed at which each of n vehicles [n, row] loses stability, None up to `highest` [m/s].

    Looked for from 1 m/s in steps of at most `spacing`, then by bisection of all at once. A vehicle that is
    unstable at 1 m/s has the speed 0.

    >>> from railui.study.ride import model_of
    >>> model = model_of("designs/check_bogie.yaml")
    >>> round(critical_speeds(model, model.row[None], 90.0)[0].speed, 5)
    61.64024
    """
    grid = np.linspace(SLOWEST, max(highest, SLOWEST), max(2, int(np.ceil((highest - SLOWEST) / spacing)) + 1))
    low, high = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    open_ = np.ones(len(rows), dtype=bool)
    for k in range(0, len(grid), TOGETHER):
        here, near = np.flatnonzero(open_), grid[k : k + TOGETHER]
        if not here.size:
            break
        each = _largest(model, np.repeat(rows[here], len(near), axis=0), np.tile(near, here.size), at_rest)
        grows = each.real.reshape(here.size, len(near)) > GROWS
        found, first = here[grows.any(axis=1)], k + grows.argmax(axis=1)[grows.any(axis=1)]
        high[found], low[found], open_[found] = grid[first], np.where(first, grid[first - 1], 0.0), False
    some = np.flatnonzero(~open_ & (low > 0))
    while some.size and np.max(high[some] - low[some]) > CLOSE:
        middle = 0.5 * (low[some] + high[some])
        grows = _largest(model, rows[some], middle, at_rest).real > GROWS
        high[some], low[some] = np.where(grows, middle, high[some]), np.where(grows, low[some], middle)
    at = np.where(np.isfinite(high), high, highest)
    roots = _largest(model, rows, at, at_rest)
    speeds = np.where(low > 0, 0.5 * (low + high), 0.0)
    return [None if o else Critical(float(v), complex(s)) for o, v, s in zip(open_, speeds, roots, strict=True)]


def _largest(model: Model, rows: Floats, speeds: Floats, at_rest: bool) -> Complexes:
    return eigenvalues(model, rows, speeds, at_rest=at_rest)[:, 0]


def linear_many(model: Model, rows: Floats, speeds: Sequence[float]) -> dict[str, Floats]:
    """What a search asks of n vehicles [n, row] at once: the linear keys of `railui stability`, arrays [n].

    linear_critical_speed [m/s] (infinite where none up to the highest speed), linear_critical_frequency
    [Hz] (then NaN), linear_damping (least damping ratio over the speeds), klingel_wavelength [m] (NaN where the
    conicity is not positive).

    >>> from railui.study.ride import model_of
    >>> model = model_of("designs/check_bogie.yaml")
    >>> found = linear_many(model, model.row[None], [20.0, 60.0])
    >>> round(float(found["linear_damping"][0]), 4)
    0.0115
    """
    critical = critical_speeds(model, rows, max(speeds))
    each = [damping_ratio(eigenvalues(model, rows, np.full(len(rows), v))) for v in speeds]
    return {
        "linear_critical_speed": np.array([np.inf if c is None else c.speed for c in critical]),
        "linear_critical_frequency": np.array([np.nan if c is None else c.frequency for c in critical]),
        "linear_damping": np.min(each, axis=(0, 2)),
        "klingel_wavelength": np.array([klingel_of(model, row) or np.nan for row in rows]),
    }


def klingel_of(model: Model, row: Floats) -> float | None:
    """Klingel's wavelength [m] of one vehicle, with the mean conicity of its wheelsets."""

    def mean(key: str) -> float:
        return float(np.mean([row[i] for path, i in model.columns.items() if path.rpartition(".")[2] == key]))

    return klingel_wavelength(mean("half_gauge"), mean("rolling_radius"), mean("conicity"))


# modes and their shapes


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


def _modes(model: Model, speed: float, matrix: Floats) -> list[dict[str, Any]]:
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


def shape_in_words(dofs: Sequence[str], vector: Complexes, arm: float) -> str:
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


def part_of(dof: str) -> tuple[str, str]:
    """Body and motion of a degree of freedom: y1 is wheelset 1 lateral, y_c coach lateral, phi.frame frame roll."""
    motion, _, body = dof.partition(".")
    if not body:
        motion = next((m for m in ("psi", "phi", "y") if dof.startswith(m)), dof)
        rest = dof[len(motion) :].lstrip("_")
        body = {"": "frame", "c": "coach"}.get(rest, f"wheelset_{rest}")
    return body.replace("_", " "), MOTIONS.get(motion, motion)


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
