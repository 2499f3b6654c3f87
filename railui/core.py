"""The door to the kernel: vehicles of one structure, as batches of rows of numbers."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railui import _core
from railui.arrays import FloatArray

Record = dict[str, Any]

LANES: int = _core.LANES
CURVES = ("measured_force", "profile_shape", "rolling_line")  # kinds whose parameters are lists
LINKAGE: int = _core.LINKAGE  # the number of the place between both wheelsets of a bogie
CHOOSING = "measured_force"  # the kind whose curve stands against z, v or s
STEP_LIMIT = 64


@cache
def catalogue() -> tuple[Record, ...]:
    """The records of all effects, in the order of the kernel's list.

    >>> catalogue()[0]["kind"]
    'spring'
    """
    return tuple(_core.catalogue())


@cache
def record(kind: str) -> Record:
    """The record of one effect; raises KeyError for a kind that is not in the catalogue."""
    return {r["kind"]: r for r in catalogue()}[kind]


@cache
def parameters(kind: str) -> tuple[str, ...]:
    """Paths of the numbers that a kind of vehicle ("bogie", "wheelset", "rig") is assembled from.

    >>> parameters("rig")[0]
    'vehicle.rig.mass'
    """
    return tuple(_core.parameters(kind))


def simd() -> str:
    """The SIMD level in use: v4 (AVX-512), v3 (AVX2) or portable."""
    return _core.simd()


def chains(roots: bool, rounds: int) -> int:
    """Run chains of fused products, or of square roots, in registers on this thread; how many, counted per lane.

    >>> chains(False, 200) == 2 * chains(False, 100)
    True
    """
    return _core.chains(roots, rounds)


def sources() -> str:
    """SHA-256 of the sources that this kernel was built from."""
    return _core.sources()


def jobs_or_all(jobs: int | None) -> int:
    """Threads to use: as asked, or all that the machine has."""
    return jobs if jobs else (os.cpu_count() or 1)


@dataclass(frozen=True)
class Placement:
    """An effect at a place; wheelset None: both, or none in particular; against: z, v or s of a curve that asks for it.

    >>> Placement("measured_force", "frame", None, 5) == Placement("measured_force", "frame", None, 5, "z")
    True
    """

    kind: str
    at: str
    wheelset: int | None = None
    count: int = 0
    against: str | None = None

    def __post_init__(self) -> None:
        if not self.count:
            object.__setattr__(self, "count", len(record(self.kind)["parameters"]))
        if self.against is None and self.kind == CHOOSING:
            object.__setattr__(self, "against", "z")


def effect_numbers(kind: str, values: Mapping[str, Any]) -> list[float]:
    """The numbers of one effect in the kernel's order; a parameter left out is its record's default.

    No choice is among them: what a curve stands against belongs to its `Placement`.
    """
    if kind == "profile_shape":
        grid, *curves = (list(values[p["key"]]) for p in record(kind)["parameters"])
        step = (grid[-1] - grid[0]) / (len(grid) - 1)
        return [float(len(grid)), grid[0], step, *(x for curve in curves for x in curve)]
    if kind == "rolling_line":
        return [float(len(values["place"])), *values["place"], *values["offset"]]
    if kind == "measured_force":
        motion, force = list(values["motion"]), list(values["force"])
        return [float(len(motion)), *motion, *force]
    return [float(values.get(p["key"], p["default"])) for p in record(kind)["parameters"]]


Number = list[tuple[float, int]]  # a sum of factor times number of the row; empty: 0
Point = tuple[Number, Number, Number]  # x forward, y right, height above the rails


@dataclass(frozen=True)
class WheelsLayout:
    """What makes a body a wheelset; contact: conicity, creep along and across, gravity, angle, roll."""

    spin_inertia: Number
    half_gauge: Number
    rolling_radius: Number
    wheel_load: Number
    contact: list[Number]
    spin_creep: Number


@dataclass(frozen=True)
class BodyLayout:
    """A rigid body: without a yaw or roll inertia it does not yaw or roll."""

    name: str
    family: str
    number: int
    mass: Number
    yaw_inertia: Number | None
    roll_inertia: Number | None
    x: Number
    height: Number
    wheels: WheelsLayout | None = None


@dataclass(frozen=True)
class JointLayout:
    """What acts between two bodies: (direction, "spring" | "damper" | "series" | "stop", its numbers)."""

    name: str
    number: int
    bodies: tuple[int | None, int | None]
    points: tuple[Point, Point]
    mirrored: bool
    terms: list[tuple[str, str, list[Number]]]
    static_load: Number


@dataclass(frozen=True)
class FloorLayout:
    """A place where comfort is felt."""

    name: str
    body: int
    point: Point


@dataclass(frozen=True)
class Layout:
    """A vehicle of bodies (wheelsets from the front) and what joins them, all numbers by their place in a row."""

    numbers: int
    bodies: list[BodyLayout]
    joints: list[JointLayout]
    floor: list[FloorLayout]


def creep_forces(
    kind: str,
    values: Mapping[str, Any],
    wheel_load: float,
    creep_slopes: tuple[float, float],
    linear: FloatArray,
    speed: float = 0.0,
) -> FloatArray:
    """Creep forces T_x, T_y [n, 2] of a wheel by a law of the catalogue, from those of the linear law.

    linear [n, 3]: t_x, t_y and the spin part of t_y [N]; creep_slopes: kappa_x N, kappa_y N [N]; speed [m/s].
    Raises ValueError for a kind that is no law of creep.

    >>> creep_forces("creep_saturation", {"friction": 0.3}, 1e4, (1e6, 1e6), np.array([[9e3, 0.0, 0.0]]))[0, 0].item()
    3000.0
    """
    rows = np.ascontiguousarray(linear, dtype=float).tolist()
    return np.array(_core.creep_forces(kind, effect_numbers(kind, values), wheel_load, list(creep_slopes), rows, speed))


class Spline:
    """A cubic spline, not-a-knot, through y [n] or [n, columns] at increasing places x [n], n >= 4.

    The numbers of scipy's CubicSpline, which would take a quarter of a second to read. Beyond the ends the first and
    the last cubic go on. Raises ValueError for places that do not increase, and for values that do not fit them.

    >>> Spline(np.arange(5.0), np.arange(5.0) ** 3)(np.array([1.5, 6.0]), derivative=1).round(9).tolist()
    [6.75, 108.0]
    """

    def __init__(self, x: ArrayLike, y: ArrayLike) -> None:
        self.x = np.ascontiguousarray(x, dtype=float)
        columns = np.asarray(y, dtype=float)
        self.shape = columns.shape[1:]
        self._core = _core.Spline(self.x, np.ascontiguousarray(columns.reshape(len(columns), -1)))

    def __call__(self, at: ArrayLike, derivative: Literal[0, 1, 2] = 0) -> FloatArray:
        """Values, first or second derivatives at places [...]: [...] or [..., columns]."""
        places = np.asarray(at, dtype=float)
        return self._core.at(np.ascontiguousarray(places.ravel()), derivative).reshape(places.shape + self.shape)

    @property
    def factors(self) -> FloatArray:
        """Of the powers of the distance from an interval's beginning, highest first: [column, power, interval]."""
        flat = self._core.factors().reshape(len(self.x) - 1, -1, 4)
        return np.ascontiguousarray(flat.transpose(1, 2, 0))


def sosfilt(sections: FloatArray, series: FloatArray, memory: FloatArray | None = None) -> FloatArray:
    """Series [..., sample] behind second-order sections [section, 6] (b0 b1 b2 1 a1 a2).

    memory [..., section, 2]: what the sections remember at first, in the transposed form II; nothing where None.

    >>> passed(np.array([[1.0, 0.0, 0.0, 1.0, -0.5, 0.0]]), np.array([1.0, 0.0, 0.0])).tolist()
    [1.0, 0.5, 0.25]
    """
    rows = np.ascontiguousarray(series, dtype=float).reshape(-1, series.shape[-1])
    held = np.zeros((len(rows), 2 * len(sections))) if memory is None else memory.reshape(len(rows), -1)
    return _core.passed(np.ascontiguousarray(sections), np.ascontiguousarray(held), rows).reshape(series.shape)


@dataclass(frozen=True)
class Batch:
    """Vehicles of one structure, a row each.

    numbers [n, parameters of the kind], effects [n, numbers of all placed effects], amounts [n, placed effects],
    speed_scale [n] or None, initial [n, states] or None (at rest).
    """

    numbers: FloatArray
    effects: FloatArray
    amounts: FloatArray
    speed_scale: FloatArray | None = None
    initial: FloatArray | None = None

    @classmethod
    def of(
        cls, numbers: FloatArray, effects: FloatArray | None = None, amounts: FloatArray | None = None, **more: Any
    ) -> Batch:
        """A batch of contiguous arrays; effects and amounts may be absent where nothing is placed."""
        n = len(numbers)
        two = [np.ascontiguousarray(x if x is not None else np.zeros((n, 0))) for x in (effects, amounts)]
        return cls(np.ascontiguousarray(numbers, dtype=float), two[0], two[1], **more)

    def __len__(self) -> int:
        return len(self.numbers)

    def with_initial(self, initial: FloatArray | None) -> Batch:
        """The same vehicles from other initial states, [states] for all or [n, states]."""
        if initial is None:
            return replace(self, initial=None)
        return replace(self, initial=np.ascontiguousarray(np.broadcast_to(initial, (len(self), initial.shape[-1]))))

    def select(self, rows: Any) -> Batch:
        """Some of the vehicles."""
        pick = [None if x is None else np.ascontiguousarray(x[rows]) for x in (self.speed_scale, self.initial)]
        return Batch(
            np.ascontiguousarray(self.numbers[rows]),
            np.ascontiguousarray(self.effects[rows]),
            np.ascontiguousarray(self.amounts[rows]),
            *pick,
        )


@dataclass(frozen=True)
class Filter:
    """Zero-phase band-pass of second-order sections, cut at both ends, a weight per channel, every n-th sample."""

    sos: FloatArray
    zi: FloatArray
    pad: int
    cut: int
    weights: FloatArray
    every: int = 1

    def kept(self, samples: int) -> int:
        """Samples that remain of so many."""
        return -(-max(samples - 2 * self.cut, 0) // self.every)

    def parts(self) -> tuple[FloatArray, FloatArray, int, int, FloatArray, int]:
        """All of it in the order in which the kernel takes it."""
        return (self.sos, self.zi, self.pad, self.cut, self.weights, self.every)


@dataclass(frozen=True)
class Rides:
    """Statistics of many rides: displacement [n, wheelset, (mean, sd, share of contact)], the others per acceleration.

    rms [n, acceleration, cascade], blocks [n, acceleration, block], diverged [n].
    """

    displacement: FloatArray
    rms: FloatArray
    blocks: FloatArray
    diverged: NDArray[np.int64]


def eigenvalues_of(matrices: FloatArray) -> NDArray[np.complex128]:
    """Eigenvalues [n, state] of matrices [n, state, state], largest real part first; NaN of one that is not finite.

    >>> eigenvalues_of(np.array([[[-3.0, 1.0], [0.0, -2.0]], [[np.inf, 0.0], [0.0, 1.0]]])).real.tolist()
    [[-2.0, -3.0], [nan, nan]]
    """
    found = np.full(matrices.shape[:2], complex(np.nan, np.nan))
    for i in np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2))):
        with contextlib.suppress(np.linalg.LinAlgError):  # no convergence: undefined as well
            found[i] = np.linalg.eigvals(matrices[i])
    order = np.lexsort((-found.imag, -found.real), axis=1)
    return np.asarray(np.take_along_axis(found, order, axis=1))


class Vehicles:
    """Vehicles of one structure: a kind, placed effects, and the measured forces of the coach that drive them.

    A `layout` describes vehicles of bodies and elements, in the place of a kind that the kernel knows. rig_input, of a
    rig alone: force (the default), base_displacement or base_acceleration.

    Raises ValueError for an effect at a place where it cannot stand, or two that supersede the same term.
    """

    def __init__(
        self,
        kind: str,
        placed: Sequence[Placement] = (),
        measured: Sequence[str] = (),
        layout: Layout | None = None,
        rig_input: str | None = None,
    ) -> None:
        self.kind = kind
        self.placed = tuple(placed)
        self.measured = tuple(measured)
        self._core = _core.Vehicle(
            kind,
            [(p.kind, p.at, p.wheelset or 0, p.count, p.against) for p in self.placed],
            list(measured),
            layout,
            rig_input,
        )

    def simulate(
        self,
        batch: Batch,
        table: FloatArray,
        dt: float,
        steps: int,
        channels: Sequence[str],
        *,
        filter: Filter | None = None,
        jobs: int | None = 1,
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """Series [vehicle, channel, sample] and the sample at which each vehicle diverged (-1: never).

        table: see `railui.track.input_table`; dt [s] between samples; steps of RK4 per sample.
        """
        flat, lost = self._core.simulate(
            batch, table, dt, steps, list(channels), filter.parts() if filter else None, jobs_or_all(jobs)
        )
        return flat.reshape(len(batch), len(channels), -1), np.array(lost)

    def score(
        self,
        batch: Batch,
        table: FloatArray,
        dt: float,
        steps: int,
        channels: Sequence[str],
        clearance: FloatArray,
        cascades: Sequence[FloatArray] = (),
        *,
        block: int = 0,
        jobs: int | None = 1,
        wheelsets: int = 2,
    ) -> Rides:
        """Statistics that stream with the steps.

        Of the channels the first `wheelsets` are displacements, the others accelerations, each behind all cascades
        [vehicle, section, 6]; blocks are those of the first cascade.
        """
        n, points = len(batch), max(len(channels) - wheelsets, 0)
        e, rms, blocks, lost = self._core.score(
            batch, table, dt, steps, list(channels), clearance, list(cascades), block, jobs_or_all(jobs), wheelsets
        )
        shape = (n, points, len(cascades))
        shares = e.reshape(n, min(wheelsets, len(channels)), 3)
        return Rides(shares, rms.reshape(shape), blocks.reshape(n, points, -1 if points else 0), np.array(lost))

    def steps(self, batch: Batch, slowest: float, fastest: float, dt: float) -> list[int]:
        """RK4 steps per sample that each vehicle needs between two speeds [m/s]; ValueError where too many."""
        return self._core.steps(batch, slowest, fastest, dt, STEP_LIMIT)

    def eigenvalues(self, batch: Batch, speed: float) -> NDArray[np.complex128]:
        """Eigenvalues [vehicle, 2 x degrees of freedom] of the linear vehicles, largest real part first.

        NaN where a vehicle has none: its state matrix is not finite.
        """
        found = self._core.eigenvalues(batch, speed)
        if all(found):
            return np.array([[complex(*z) for z in row] for row in found])
        # the kernel's iteration did not end: on a finite matrix that of LAPACK may
        return np.array(
            [
                [complex(*z) for z in row] if row else self._eigenvalues_of(batch.select([i]), speed)
                for i, row in enumerate(found)
            ]
        )

    def _eigenvalues_of(self, one: Batch, speed: float) -> NDArray[np.complex128]:
        share = 1.0 if one.speed_scale is None else float(one.speed_scale[0])
        return np.asarray(eigenvalues_of(self.state_matrix(one, speed * share))[0])

    def sites(self, batch: Batch) -> dict[tuple[str, int], tuple[float, float]]:
        """Linear (stiffness, damping) at every (place, wheelset) of the first vehicle; wheelset 0: none."""
        return self._core.sites(batch)

    def state_matrix(self, batch: Batch, speed: float) -> FloatArray:
        """A [vehicle, state, state] of x' = A x, the linear vehicles at a speed [m/s] without their effects.

        x: the degrees of freedom (`freedoms`), their rates, then the forces of springs and dampers in series.
        """
        flat = self._core.state_matrix(batch, speed)
        size = round(float(np.sqrt(flat.size / len(batch))))
        return flat.reshape(len(batch), size, size)

    def rates(self, batch: Batch, row: FloatArray, states: FloatArray) -> FloatArray:
        """Rate of change [vehicle, state] in given states [vehicle, state] under one row of the input table.

        Everything acts, effects too: what a static solution or a linearisation about one needs.
        """
        flat = self._core.rates(batch, np.ascontiguousarray(row), np.ascontiguousarray(states))
        return flat.reshape(len(batch), -1)

    def freedoms(self, batch: Batch) -> list[str]:
        """Names of the degrees of freedom, such as y1, psi1, or y.frame, phi.body of bodies and elements."""
        return self._core.freedoms(batch)

    def statics(self, batch: Batch, offsets: FloatArray, curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Forces on vehicles that stand in a curve at the states of `batch.initial`, velocities not looked at.

        offsets [n, dofs]: what the suspension sees of the curve; curvature [n] 1/m, the centre at +y. Returns
        forces on the degrees of freedom and rates of the effects' own states [n, states - dofs], and per
        wheelset [n, wheelset, 8] e, psi, Q_y, u_x of wheel 2, T_x1, T_x2, T_y1, T_y2.
        """
        forces, told = self._core.statics(batch, np.ascontiguousarray(offsets), np.ascontiguousarray(curvature))
        n = len(batch)
        return forces.reshape(n, -1), told.reshape(n, -1, 8)

    def bodies(self, batch: Batch) -> dict[str, float]:
        """Masses and inertias of the first vehicle by the names of its degrees of freedom, in their order."""
        return dict(self._core.bodies(batch))

    def channels(self, batch: Batch) -> list[str]:
        """Names of the channels of the first vehicle; beside them `state.K` and `rate.K` of its K-th state."""
        return self._core.channels(batch)

    def states(self, batch: Batch) -> int:
        """Number of states, those of the effects last."""
        return self._core.states(batch)
