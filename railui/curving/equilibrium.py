"""Quasi-static curving: equilibrium of a vehicle in a curve of constant radius, by a damped Newton method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, NoResultError, Vehicles
from railui.ride_quality.guiding_forces import wheel_load_paths
from railui.track.line_geometry import ACCELERATION, GRAVITY, POSITION_COLUMNS, steady_row
from railui.vehicle.dofs import is_lateral
from railui.vehicle.model import Model
from railui.vehicle.on_track import half_gauges, line_positions

RESIDUAL_TOLERANCE: Final = 1e-10  # of the wheel load
MAX_ITERATIONS: Final = 80
MAX_DAMPING: Final = 1e9  # of the Levenberg-Marquardt step, above which the iteration has failed
LOAD_STEPS: Final = (1, 4, 16)  # in which the curvature is applied, more if the iteration fails with fewer
PERTURBATION: Final = 1e-7  # m, rad, for the differences of the Jacobian


@dataclass(frozen=True, eq=False)
class Equilibria:
    """Equilibria of n vehicles; NaN where the iteration found none.

    displacement [n, wheelset] in m, angle_of_attack [n, wheelset] in rad, guiding_force [n, wheelset] in N (of the
    rails on a wheelset, positive to the right), wear_number [n] in N: the sum over the wheels, wheel_wear [n, wheelset,
    wheel] in N: that of each, right and left, residual [n]: largest unbalanced force in wheel loads, shortfall [n] in
    N: outward less guiding forces, which laws at the wheelsets of a vehicle that rolls add through their roll.
    batch: the vehicles, at rest in the curve; table [n, column]: rows of the input table.
    """

    displacement: FloatArray
    angle_of_attack: FloatArray
    guiding_force: FloatArray
    wear_number: FloatArray
    wheel_wear: FloatArray
    residual: FloatArray
    shortfall: FloatArray
    batch: Batch
    table: FloatArray


def solve_equilibria(model: Model, rows: FloatArray, radius: FloatArray, cant_deficiency: FloatArray) -> Equilibria:
    """Solve the equilibria of n vehicles of one structure.

    `rows`: parameters [n, row]; `radius` and `cant_deficiency` [n] in m. Raises ValueError for a radius that is 0 or
    not finite.
    """
    is_faulty = ~np.isfinite(radius) | (radius == 0)
    if np.any(is_faulty):
        raise ValueError(f"a radius must be a number other than 0: {radius[is_faulty][0]:g} m")
    vehicles, batch = model.vehicles(line=True), model.batch(rows)
    states, dofs = vehicles.state_count(batch), vehicles.degrees_of_freedom(batch)
    unknowns = states - len(dofs)
    curvature = 1.0 / radius
    table = steady_rows(model, rows, vehicles, curvature, cant_deficiency)
    scale = np.repeat(wheel_loads(model, rows).mean(axis=1)[:, None], unknowns, axis=1)
    equations = _StaticEquations(vehicles, batch, len(dofs), table, scale)
    x, residual = np.zeros((len(rows), unknowns)), np.full(len(rows), np.inf)
    for count in LOAD_STEPS:
        unsolved = np.flatnonzero(~(residual <= RESIDUAL_TOLERANCE))
        if not unsolved.size:
            break
        selected, x[unsolved] = equations.select(unsolved), 0.0
        for step in range(1, count + 1):
            x[unsolved], residual[unsolved] = selected.solve(x[unsolved], curvature[unsolved], step / count)
    outward = outward_force(model, rows, model.vehicles(), batch, table, model.vehicles().degrees_of_freedom(batch))
    wheelsets = equations.forces(x, curvature, 1.0)[1]
    yaw, tx, ty = wheelsets[:, :, 1], wheelsets[:, :, 4:6], wheelsets[:, :, 6:8]
    tread_wear = np.abs(np.nan_to_num(tx * wheelsets[:, :, 3:4])) + np.abs(ty * yaw[:, :, None])
    is_unsolved = ~(residual <= RESIDUAL_TOLERANCE)
    wheelsets[is_unsolved] = np.nan
    displacement, angle, force = (wheelsets[:, :, i] for i in range(3))
    flange_wear = wheelsets[:, :, 8, None] * np.stack([displacement > 0.0, displacement <= 0.0], axis=2)
    return Equilibria(
        displacement=displacement,
        angle_of_attack=angle,
        guiding_force=force,
        wear_number=np.where(is_unsolved, np.nan, tread_wear.sum(axis=(1, 2)) + wheelsets[:, :, 8].sum(axis=1)),
        wheel_wear=tread_wear + flange_wear,
        residual=residual,
        shortfall=-outward - force.sum(axis=1),
        batch=equations.at_rest(x),
        table=table,
    )


def wheel_loads(model: Model, rows: FloatArray) -> FloatArray:
    """Return the static load [n, wheelset] in N of each wheel."""
    return rows[:, [model.columns[path] for path in wheel_load_paths(model)]]


def steady_rows(
    model: Model, rows: FloatArray, vehicles: Vehicles, curvature: FloatArray, cant_deficiency: FloatArray
) -> FloatArray:
    """Return rows [n, column] of the input table: the curve, and g d/(2 b) on every body, away from the centre.

    The carbody above springs to the ground, or else the frames, also carry the load of the wheels beyond the vehicle's
    own bodies.
    """
    acceleration = np.sign(curvature) * GRAVITY * cant_deficiency / (2 * half_gauges(model, rows))
    places = line_positions(model, rows)
    columns = vehicles.column_count()
    return np.stack([steady_row(columns, *each) for each in zip(places, curvature, acceleration, strict=True)])


def outward_force(
    model: Model, rows: FloatArray, vehicles: Vehicles, batch: Batch, table: FloatArray, dofs: Sequence[str]
) -> FloatArray:
    """Return the force [n] in N on all bodies in a curve and on the load of the wheels beyond these, to the right."""
    acceleration = table[:, ACCELERATION - len(POSITION_COLUMNS)]
    if not np.any(acceleration):
        return np.zeros(len(rows))
    carried = 2 * wheel_loads(model, rows).sum(axis=1) / GRAVITY
    lateral = [i for i, dof in enumerate(dofs) if is_lateral(dof)]
    masses = [list(vehicles.inertias(batch.select([k])).values()) for k in range(len(rows))]
    own = np.array(masses)[:, lateral].sum(axis=1)
    return np.asarray(-np.maximum(carried, own) * acceleration)


@dataclass(frozen=True, eq=False)
class _StaticEquations:
    """Static equations of n vehicles; unknowns are positions and the own states of the effects."""

    vehicles: Vehicles
    batch: Batch
    dofs: int
    table: FloatArray
    scale: FloatArray

    def select(self, rows: NDArray[np.int64]) -> _StaticEquations:
        """Return the equations of some of the vehicles."""
        return _StaticEquations(self.vehicles, self.batch.select(rows), self.dofs, self.table[rows], self.scale[rows])

    def forces(self, x: FloatArray, curvature: FloatArray, fraction: float) -> tuple[FloatArray, FloatArray]:
        """Return unbalanced forces [n, unknown] in wheel loads and wheelset results at a fraction of the curvature."""
        table, curvature = fraction * self.table, fraction * curvature
        forces, wheelsets = self.vehicles.static_forces(self.at_rest(x), table, curvature)
        return forces / self.scale, wheelsets

    def at_rest(self, x: FloatArray) -> Batch:
        """Return the vehicles at rest in the states of unknowns [n, unknown]."""
        n = self.dofs
        return self.batch.with_initial_states(np.concatenate([x[:, :n], np.zeros((len(x), n)), x[:, n:]], axis=1))

    def jacobian(self, x: FloatArray, curvature: FloatArray, fraction: float) -> FloatArray:
        """Return d forces/d unknown [n, force, unknown] by central differences."""
        n, m = x.shape
        perturbations = PERTURBATION * np.concatenate([np.eye(m), -np.eye(m)])
        perturbed = (x[:, None] + perturbations).reshape(n * 2 * m, m)
        repeated = self.select(np.repeat(np.arange(n), 2 * m))
        forces = repeated.forces(perturbed, np.repeat(curvature, 2 * m), fraction)[0].reshape(n, 2, m, m)
        return np.swapaxes((forces[:, 0] - forces[:, 1]) / (2 * PERTURBATION), 1, 2)

    def solve(self, x: FloatArray, curvature: FloatArray, fraction: float) -> tuple[FloatArray, FloatArray]:
        """Return unknowns [n, unknown] and residuals [n] in wheel loads after Levenberg-Marquardt steps from x.

        The damping copes with the corners of clearances and flanges, and with motions that a clearance leaves free.
        """
        x, residual, mu = x.copy(), np.full(len(x), np.inf), np.full(len(x), 1e-6)
        f = self.forces(x, curvature, fraction)[0]
        for _ in range(MAX_ITERATIONS):
            residual = np.abs(f).max(axis=1)
            active = np.flatnonzero((residual > RESIDUAL_TOLERANCE) & (mu < MAX_DAMPING))
            if not active.size:
                break
            selected, c = self.select(active), curvature[active]
            step = _damped_step(selected.jacobian(x[active], c, fraction), f[active], mu[active])
            f_new = selected.forces(x[active] + step, c, fraction)[0]
            is_better = np.linalg.norm(f_new, axis=1) < np.linalg.norm(f[active], axis=1)
            x[active[is_better]], f[active[is_better]] = (x[active] + step)[is_better], f_new[is_better]
            mu[active] = np.where(is_better, np.maximum(0.1 * mu[active], 1e-15), 8 * np.maximum(mu[active], 1e-9))
        return x, residual


def _damped_step(jacobian: FloatArray, f: FloatArray, mu: FloatArray) -> FloatArray:
    """Return Levenberg-Marquardt steps [n, unknown] for damping mu [n], relative to the diagonal of J^T J."""
    squares = np.swapaxes(jacobian, 1, 2) @ jacobian
    weights = np.einsum("nii->ni", squares)
    weights = weights + 1e-12 * weights.max(axis=1, keepdims=True)
    damped = squares + mu[:, None, None] * weights[:, :, None] * np.eye(f.shape[1])
    right = -np.einsum("nij,ni->nj", jacobian, f)[:, :, None]
    try:
        return np.asarray(np.linalg.solve(damped, right)[:, :, 0])
    except np.linalg.LinAlgError:
        raise NoResultError("the static equations in the curve are singular") from None
