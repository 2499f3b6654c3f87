"""Vehicles of one structure in the kernel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from railui import _core
from railui.arrays import ComplexArray, FloatArray
from railui.core.alignment import kernel_array
from railui.core.batch import Batch, RideStatistics, ZeroPhaseFilter
from railui.core.catalogue import Placement
from railui.core.layout import Layout
from railui.core.machine import resolve_thread_count
from railui.core.numerics import matrix_eigenvalues

MAX_STEPS_PER_SAMPLE = 64


class Vehicles:
    """Structure of vehicles: a kind, placed effects, and the measured coach forces that act on them.

    Parameters
    ----------
    kind : str
    placed : sequence of Placement
    measured : sequence of str
        Columns of the input table with measured forces of the coach.
    layout : Layout, optional
        Bodies and elements of a multibody vehicle, instead of a kind built into the kernel.
    rig_input : str, optional
        Input of a rig: force (the default), base_displacement or base_acceleration.
    channel_names : mapping, optional
        Channels of the kernel by the names that sensors have in the runs, as far as these differ.
    line : bool
        True on a line with curves: the input table has the columns of `railui.track.line_geometry`.

    Raises
    ------
    ValueError
        If an effect does not fit its location, or two effects supersede the same term.
    """

    def __init__(
        self,
        kind: str,
        placed: Sequence[Placement] = (),
        measured: Sequence[str] = (),
        layout: Layout | None = None,
        rig_input: str | None = None,
        channel_names: Mapping[str, str] | None = None,
        line: bool = False,
    ) -> None:
        self.kind = kind
        self._channel_names = channel_names or {}
        self.placements = tuple(replace(p, at=self._channel_names.get(p.at, p.at)) for p in placed)
        self.measured = tuple(measured)
        self._core = _core.Vehicle(
            kind,
            [(p.kind, p.at, p.wheelset or 0, p.parameter_count, p.against) for p in self.placements],
            list(measured),
            None if layout is None else layout.json,
            rig_input,
            line,
        )

    def simulate(
        self,
        batch: Batch,
        table: FloatArray,
        dt: float,
        steps: int,
        channels: Sequence[str],
        *,
        filter: ZeroPhaseFilter | None = None,
        jobs: int | None = 1,
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """Simulate vehicles along an input table.

        Parameters
        ----------
        batch : Batch
        table : array
            Input table, see `railui.track.input_table`.
        dt : float
            Sampling interval [s].
        steps : int
            RK4 steps per sample.
        channels : sequence of str
        filter : ZeroPhaseFilter, optional
            Filter of the channels.
        jobs : int or None
            Threads; None for all.

        Returns
        -------
        array [vehicle, channel, sample]
        array [vehicle]
            Sample at which each vehicle diverged, -1 if it did not.
        """
        filter_arguments = filter.kernel_arguments() if filter else None
        threads = resolve_thread_count(jobs)
        names = self.kernel_names(channels)
        flat, diverged = self._core.simulate(batch, kernel_array(table), dt, steps, names, filter_arguments, threads)
        return flat.reshape(len(batch), len(channels), -1), np.array(diverged)

    def ride_statistics(
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
    ) -> RideStatistics:
        """Simulate vehicles and accumulate statistics during the simulation.

        Parameters
        ----------
        batch, table, dt, steps, jobs
            As for `simulate`.
        channels : sequence of str
            The first `wheelsets` channels are displacements, the others accelerations.
        clearance : array [n]
            Flange clearance [m].
        cascades : sequence of array [vehicle, section, 6]
            Filters, each of which is applied to every acceleration.
        block : int
            Samples of a block, over which the rms of the first cascade is taken.
        wheelsets : int
        """
        arguments = (block, resolve_thread_count(jobs), wheelsets)
        displacement, rms, block_rms, diverged = self._core.score(
            batch,
            kernel_array(table),
            dt,
            steps,
            list(channels),
            kernel_array(clearance),
            [kernel_array(cascade) for cascade in cascades],
            *arguments,
        )
        n, accelerations = len(batch), max(len(channels) - wheelsets, 0)
        return RideStatistics(
            displacement.reshape(n, min(wheelsets, len(channels)), 3),
            rms.reshape(n, accelerations, len(cascades)),
            block_rms.reshape(n, accelerations, -1 if accelerations else 0),
            np.array(diverged),
        )

    def form(self, batch: Batch, *, level: bool = False) -> str:
        """Return the form that the kernel's rate of change takes on a track with cross-level, or `level`."""
        return self._core.form(batch, level)

    def structure_file(self, batch: Batch) -> str | None:
        """Return the file of `rust_core/structures` for the rows of these vehicles; None in forms without rows."""
        return self._core.structure_file(batch)

    def required_steps(
        self,
        batch: Batch,
        slowest: float,
        fastest: float,
        dt: float,
        *,
        damped_mode_step: float = 1.0,
        limit: int = MAX_STEPS_PER_SAMPLE,
    ) -> list[int]:
        """Compute the number of RK4 steps per sample of each vehicle between two speeds.

        Parameters
        ----------
        batch : Batch
        slowest, fastest : float
            Speeds [m/s].
        dt : float
            Sampling interval [s].
        damped_mode_step : float
            Largest abs(lambda) h of linear modes with a damping ratio of 0.7 and more; that of all others is 1.
        limit : int
            Largest accepted number.

        Raises
        ------
        NoResultError
            Where a vehicle needs more than `limit`.
        """
        return self._core.steps(batch, (slowest, fastest), dt, damped_mode_step, limit)

    def eigenvalues(self, batch: Batch, speed: float) -> ComplexArray:
        """Return the eigenvalues [vehicle, state] of the linear vehicles, largest real part first.

        NaN for a vehicle whose state matrix is not finite.
        """
        rows = self._core.eigenvalues(batch, speed)
        if all(rows):
            return np.array([[complex(*z) for z in row] for row in rows])
        return np.array(
            [
                [complex(*z) for z in row] if row else self._lapack_eigenvalues(batch.select([i]), speed)
                for i, row in enumerate(rows)
            ]
        )

    def _lapack_eigenvalues(self, vehicle: Batch, speed: float) -> ComplexArray:
        """Return the eigenvalues of a vehicle for which the kernel's iteration did not converge."""
        scale = 1.0 if vehicle.speed_scale is None else float(vehicle.speed_scale[0])
        return np.asarray(matrix_eigenvalues(self.state_matrix(vehicle, speed * scale))[0])

    def local_stiffness_and_damping(self, batch: Batch) -> dict[tuple[str, int], tuple[float, float]]:
        """Return (stiffness, damping) at every (location, wheelset or 0) of the first vehicle."""
        return self._core.sites(batch)

    def state_matrix(self, batch: Batch, speed: float) -> FloatArray:
        """Return A [vehicle, state, state] of x' = A x, the linear vehicles at a speed [m/s] without effects.

        x: the degrees of freedom, their velocities, then the forces of springs and dampers in series.
        """
        flat = self._core.state_matrix(batch, speed)
        size = round(float(np.sqrt(flat.size / len(batch))))
        return flat.reshape(len(batch), size, size)

    def state_derivatives(self, batch: Batch, row: FloatArray, states: FloatArray) -> FloatArray:
        """Return the derivatives [vehicle, state] of states [vehicle, state] under one row of the input table.

        All effects are included, as a static solution and a linearisation require.
        """
        flat = self._core.rates(batch, kernel_array(row), kernel_array(states))
        return flat.reshape(len(batch), -1)

    def jacobians(self, batch: Batch, row: FloatArray) -> FloatArray:
        """Return the derivatives [vehicle, state, state] of `state_derivatives` at rest, to rounding.

        The kernel evaluates them by dual numbers. At a kink of a law the derivative is the mean of both sides.
        """
        flat = self._core.jacobians(batch, kernel_array(row))
        size = round(float(np.sqrt(flat.size / len(batch))))
        return flat.reshape(len(batch), size, size)

    def degrees_of_freedom(self, batch: Batch) -> list[str]:
        """Return the names of the degrees of freedom: y1, psi1, or y.frame, phi.body of multibody vehicles."""
        return self._core.freedoms(batch)

    def line_positions(self, batch: Batch) -> list[list[float]]:
        """Return the distances [m] of the positions of each vehicle behind its first wheelset, the middle last."""
        return self._core.positions(batch)

    def column_count(self) -> int:
        """Return the number of columns of the input table."""
        return self._core.columns()

    def static_forces(self, batch: Batch, rows: FloatArray, curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the forces on vehicles at rest in a curve at the states of `batch.initial`; velocities are ignored.

        Parameters
        ----------
        batch : Batch
        rows : array [n, column]
            Rows of the input table: the curve under the positions of the bodies.
        curvature : array [n]
            1/m, with the centre at +y.

        Returns
        -------
        array [n, state]
            Forces on the degrees of freedom, then derivatives of the states of effects.
        array [n, wheelset, 9]
            e, psi, Q_y, u_x of wheel 2, T_x1, T_x2, T_y1, T_y2 of the treads, friction times creepage
            at the flange [N].
        """
        forces, wheels = self._core.statics(batch, kernel_array(rows), kernel_array(curvature))
        n = len(batch)
        return forces.reshape(n, -1), wheels.reshape(n, -1, 9)

    def inertias(self, batch: Batch) -> dict[str, float]:
        """Return masses and inertias of the first vehicle by degree of freedom, in their order."""
        return dict(self._core.bodies(batch))

    def kernel_names(self, channels: Sequence[str]) -> list[str]:
        """Return channels by the names of the kernel."""
        return [self._channel_names.get(c, c) for c in channels]

    def channel_names(self, batch: Batch) -> list[str]:
        """Return the channels of the first vehicle; `state.K` and `rate.K` of its K-th state exist as well."""
        return self._core.channels(batch)

    def state_count(self, batch: Batch) -> int:
        """Return the number of states, including those of effects, which come last."""
        return self._core.states(batch)
