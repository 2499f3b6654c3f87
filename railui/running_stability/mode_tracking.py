"""Modes of a vehicle followed over speed by their roots and shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from railui.arrays import ComplexArray, FloatArray
from railui.running_stability.mode_names import HUNTING, distinct, is_hunting, shape_name
from railui.running_stability.modes import describe_shape, shape_arm
from railui.vehicle.linear import MIN_ROOT, damping_ratio, state_matrices
from railui.vehicle.model import Model

MIN_OSCILLATION: Final = 0.5  # rad/s, from which a root counts as an oscillation
EXPANSION_TOLERANCE: Final = 1e-8  # relative to the largest entry, of the state matrix as a function of speed
MIN_SHARE: Final = 0.02  # of the speeds at which a mode must oscillate to be reported
SMALL_ROOT: Final = 1.0  # 1/s added to the size of a root to which a distance is related


@dataclass(frozen=True, eq=False)
class TrackedMode:
    """Mode of a vehicle over speed.

    Attributes
    ----------
    name : str
        Hunting, or the bodies that move most and their motion, in the middle of the speeds.
    speeds : FloatArray
        Speeds [m/s].
    roots : ComplexArray
        Eigenvalue [1/s] at each speed; without a positive imaginary part where the mode does not oscillate.
    vectors : ComplexArray
        Motion [speed, degree of freedom] at each speed.
    dofs : tuple of str
        Names of the degrees of freedom.
    arm : float
        Distance [m] at which angles are compared with displacements.
    """

    name: str
    speeds: FloatArray
    roots: ComplexArray
    vectors: ComplexArray
    dofs: tuple[str, ...]
    arm: float

    @property
    def oscillates(self) -> NDArray[np.bool_]:
        """True where the root is that of an oscillation."""
        return np.asarray(self.roots.imag > MIN_OSCILLATION)

    @property
    def is_unstable(self) -> NDArray[np.bool_]:
        """True where the root grows, but for the constant of a law with memory."""
        return np.asarray(self.roots.real > MIN_ROOT)

    @property
    def frequency(self) -> FloatArray:
        """Frequency [Hz]; NaN without oscillation."""
        return np.where(self.oscillates, self.roots.imag / (2 * np.pi), np.nan)

    @property
    def damping(self) -> FloatArray:
        """Damping ratio; NaN without oscillation."""
        return np.where(self.oscillates, damping_ratio(self.roots), np.nan)

    def shape_at(self, speed: float) -> str:
        """Return the mode shape in words at the speed [m/s] next to a given one."""
        return describe_shape(self.dofs, self.vectors[int(np.argmin(np.abs(self.speeds - speed)))], self.arm)


def track_modes(model: Model, speeds: FloatArray) -> list[TrackedMode]:
    """Follow the oscillating modes of a vehicle over speed, least damped first.

    From one speed to the next, each mode goes to the root whose relative distance and whose difference of shape,
    1 - MAC, have the least sum over all modes.

    Parameters
    ----------
    model : Model
        Vehicle.
    speeds : FloatArray
        Speeds [m/s], increasing, in steps of at most some m/s.

    Returns
    -------
    list of TrackedMode

    Raises
    ------
    ValueError
        For a state matrix that is not finite.

    Examples
    --------
    >>> from railui.vehicle.resolve import resolve_model
    >>> modes = track_modes(resolve_model("designs/check_bogie.yaml"), np.linspace(5.0, 100.0, 96))
    >>> [mode.name for mode in modes[:3]]
    ['hunting', 'frame yaw', 'frame lateral']
    """
    matrices = matrices_over_speed(model, speeds)
    if not np.isfinite(matrices).all():
        raise ValueError("the state matrix of this vehicle is not finite: give its masses and inertias usual values")
    roots, vectors = _followed(*np.linalg.eig(matrices))
    return _named(model, speeds, roots, vectors)


def matrices_over_speed(model: Model, speeds: FloatArray) -> FloatArray:
    """Return the state matrices [speed, state, state] of a vehicle.

    Creep forces depend on 1/V and gyroscopic moments on V, so that three matrices give all others; where a fourth
    contradicts, all are computed.
    """
    low, high = float(speeds.min()), float(speeds.max())
    known = np.array([low, np.sqrt(low * high), high, 0.4 * low + 0.6 * high])
    samples = state_matrices(model, np.repeat(model.row[None], len(known), axis=0), known)
    basis = np.stack([np.ones_like(known), 1.0 / known, known], axis=1)
    if high > low:
        parts = np.linalg.solve(basis[:3], samples[:3].reshape(3, -1))
        error = np.abs(basis[3] @ parts - samples[3].ravel()).max()
        if error <= EXPANSION_TOLERANCE * np.abs(samples).max():
            powers = np.stack([np.ones_like(speeds), 1.0 / speeds, speeds], axis=1)
            return np.asarray((powers @ parts).reshape(-1, *samples.shape[1:]))
    return state_matrices(model, np.repeat(model.row[None], len(speeds), axis=0), speeds)


def _followed(roots: ComplexArray, vectors: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return roots [speed, mode] and vectors [speed, state, mode] in the order of the first speed."""
    roots, vectors = roots.copy(), vectors.copy()
    for k in range(1, len(roots)):
        distance = np.abs(roots[k - 1][:, None] - roots[k][None]) / (np.abs(roots[k - 1])[:, None] + SMALL_ROOT)
        likeness = np.abs(vectors[k - 1].conj().T @ vectors[k]) ** 2
        order = linear_sum_assignment(distance + 1.0 - likeness)[1]
        order = _upper_first(order, roots[k], roots[:k])
        roots[k], vectors[k] = roots[k][order], vectors[k][:, order]
    return roots, vectors


def _upper_first(order: NDArray[np.intp], roots: ComplexArray, before: ComplexArray) -> NDArray[np.intp]:
    """Return the order in which, of two real roots that become a pair, the mode that oscillated before oscillates."""
    order = order.copy()
    begins = np.flatnonzero((np.abs(before[-1].imag) <= MIN_OSCILLATION) & (np.abs(roots[order].imag) > 0))
    for i in begins[roots[order[begins]].imag < 0]:
        partners = begins[roots[order[begins]] == np.conj(roots[order[i]])]
        for j in partners[:1]:
            oscillated = [bool(np.any(before[:, member].imag > MIN_OSCILLATION)) for member in (i, j)]
            if oscillated[0] > oscillated[1] or (oscillated[0] == oscillated[1] and i < j):
                order[[i, j]] = order[[j, i]]
    return order


def _named(model: Model, speeds: FloatArray, roots: ComplexArray, vectors: ComplexArray) -> list[TrackedMode]:
    dofs = model.vehicles().degrees_of_freedom(model.single_batch())
    arm, count = shape_arm(model), len(dofs)
    oscillates = roots.imag > MIN_OSCILLATION
    members = np.flatnonzero(oscillates.mean(axis=0) > MIN_SHARE)
    damping = np.where(oscillates, damping_ratio(roots), np.inf)
    order = sorted(members, key=lambda i: float(damping[:, i].min()))
    names = []
    for i in order:
        frequency = np.where(oscillates[:, i], roots[:, i].imag / (2 * np.pi), np.nan)
        found = np.flatnonzero(oscillates[:, i])
        middle = vectors[found[len(found) // 2], :count, i]
        names.append(HUNTING if is_hunting(speeds, frequency) else shape_name(dofs, middle, arm))
    return [
        TrackedMode(
            name,
            speeds,
            roots[:, i],
            vectors[:, :count, i],
            tuple(dofs),
            arm,
        )
        for name, i in zip(distinct(names), order, strict=True)
    ]
