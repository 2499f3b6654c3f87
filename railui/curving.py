"""Quasi-static curving: equilibrium of a vehicle in a curve of constant radius, by a damped Newton method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, Vehicles
from railui.track.line_geometry import ACCELERATION, GRAVITY, POSITION_COLUMNS, steady_row
from railui.vehicle.design_reader import Design
from railui.vehicle.dofs import is_lateral
from railui.vehicle.grouping import group_by_structure
from railui.vehicle.model import Model
from railui.vehicle.on_track import half_gauges, line_positions
from railui.vehicle.resolve import resolve_model

RESIDUAL_TOLERANCE: Final = 1e-10  # of the wheel load
MAX_ITERATIONS: Final = 80
MAX_DAMPING: Final = 1e9  # of the Levenberg-Marquardt step, above which the iteration has failed
LOAD_STEPS: Final = (1, 4, 16)  # in which the curvature is applied, more if the iteration fails with fewer
MIN_SHORTFALL: Final = 1e-3  # of the guiding force, from which a note reports it
PERTURBATION: Final = 1e-7  # m, rad, for the differences of the Jacobian
FORCELESS_AT_REST: Final = {"dry_friction", "hysteresis"}  # their force at rest is undetermined: see `notes`

DesignLike = Design | Model | str | Path


@dataclass(frozen=True, eq=False)
class Equilibria:
    """Equilibria of n vehicles; NaN where the iteration found none.

    displacement [n, wheelset] in m, angle_of_attack [n, wheelset] in rad, guiding_force [n, wheelset] in N (of the
    rails on a wheelset), wear_number [n] in N, residual [n]: largest unbalanced force in wheel loads, shortfall [n] in
    N: outward less guiding forces, which laws at the wheelsets of a vehicle that rolls add through their roll.
    """

    displacement: FloatArray
    angle_of_attack: FloatArray
    guiding_force: FloatArray
    wear_number: FloatArray
    residual: FloatArray
    shortfall: FloatArray


def curve(design: DesignLike, radius: float, cant_deficiency: float = 0.0) -> dict[str, Any]:
    """Compute the quasi-static equilibrium of a design in a curve.

    Parameters
    ----------
    design : Design, Model or path
        Vehicle.
    radius : float
        Radius [m], positive for a centre at +y (right-hand curve), negative for a left-hand curve.
    cant_deficiency : float
        Cant deficiency d [m]: the force m g d/(2 b) acts outward on every body; on the frames also that of the load
        that the wheels carry beyond the vehicle's own bodies.

    Returns
    -------
    dict
        displacement e_i [m], angle_of_attack psi_i [rad], guiding_force Q_yi [N] (of the rails on a wheelset),
        wear_number [N] (sum over wheels of abs(T_x u_x) + abs(T_y u_y)), flange_contact (abs(e_i) >= clearance),
        notes. None if the iteration finds no equilibrium.

    Raises
    ------
    ValueError
        For a radius that is 0 or not finite.

    References
    ----------
    docs/theory.md, after Broersen 1976, (3.1) to (3.10).

    Examples
    --------
    >>> result = curve("designs/check_bogie.yaml", 600.0)
    >>> [round(1e3 * e, 3) for e in result["displacement"]]
    [-10.94, -3.289]
    """
    return curve_many([design], radius, cant_deficiency)[0]


def curve_many(designs: Sequence[DesignLike], radius: float, cant_deficiency: float = 0.0) -> list[dict[str, Any]]:
    """Return `curve` of many designs, in their order; those of one structure are solved in SIMD batches."""
    models = [resolve_model(design) for design in designs]
    results: dict[int, dict[str, Any]] = {}
    for members in group_by_structure(models):
        n = len(members)
        rows = np.stack([models[i].row for i in members])
        equilibria = solve_equilibria(models[members[0]], rows, np.full(n, radius), np.full(n, cant_deficiency))
        results |= {i: result_dict(models[i], equilibria, k, radius, cant_deficiency) for k, i in enumerate(members)}
    return [results[i] for i in range(len(models))]


def curves(design: DesignLike, radii: Sequence[float], cant_deficiency: float = 0.0) -> list[dict[str, Any]]:
    """Return `curve` of one design at many radii [m]."""
    model = resolve_model(design)
    rows = np.repeat(model.row[None], len(radii), axis=0)
    equilibria = solve_equilibria(model, rows, np.array(radii), np.full(len(radii), cant_deficiency))
    return [result_dict(model, equilibria, k, float(radius), cant_deficiency) for k, radius in enumerate(radii)]


def result_dict(model: Model, equilibria: Equilibria, k: int, radius: float, cant_deficiency: float) -> dict[str, Any]:
    """Return the k-th equilibrium with the keys of `curve`."""
    is_solved = bool(np.isfinite(equilibria.wear_number[k]))
    e = equilibria.displacement[k]
    clearance = model.design.value("contact.flange_clearance")
    touching = [bool(abs(x) >= clearance) for x in e] if is_solved else None
    return {
        "radius": radius,
        "cant_deficiency": cant_deficiency,
        "displacement": e.tolist() if is_solved else None,
        "angle_of_attack": equilibria.angle_of_attack[k].tolist() if is_solved else None,
        "guiding_force": equilibria.guiding_force[k].tolist() if is_solved else None,
        "wear_number": float(equilibria.wear_number[k]) if is_solved else None,
        "flange_contact": touching,
        "notes": _notes(model, equilibria, k, touching),
    }


def _notes(model: Model, equilibria: Equilibria, k: int, touching: list[bool] | None) -> list[str]:
    """Return notes on undetermined forces, a failed iteration, missing flanges and the shortfall."""
    kinds = {effect.kind for effect in model.effects}
    notes = [f"{kind}: without force where nothing moves" for kind in sorted(kinds & FORCELESS_AT_REST)]
    if touching is None:
        notes.append(f"no equilibrium found, forces of {equilibria.residual[k]:.3g} wheel loads are left over")
        return notes
    if any(touching) and "flange_contact" not in kinds:
        notes.append("e is beyond the flange clearance and the design has no flange_contact: nothing holds it there")
    shortfall = float(equilibria.shortfall[k])
    if abs(shortfall) > MIN_SHORTFALL * float(np.abs(equilibria.guiding_force[k]).max()):
        notes.append(f"guiding_force: without {shortfall:.4g} N in all that laws at rolling wheelsets add")
    return notes


def solve_equilibria(model: Model, rows: FloatArray, radius: FloatArray, cant_deficiency: FloatArray) -> Equilibria:
    """Solve the equilibria of n vehicles of one structure.

    `rows`: parameters [n, row]; `radius` and `cant_deficiency` [n] in m. Raises ValueError for a radius that is 0 or
    not finite.
    """
    if not np.all(np.isfinite(radius)) or np.any(radius == 0):
        raise ValueError(f"a radius must be a number other than 0: {radius[~(np.abs(radius) > 0)][0]:g} m")
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
    return _equilibria(equations.forces(x, curvature, 1.0)[1], outward, residual)


def _equilibria(wheelsets: FloatArray, outward: FloatArray, residual: FloatArray) -> Equilibria:
    """Return displacements, forces and wear numbers from the wheelset results [n, wheelset, 9] of the kernel."""
    yaw, tx, ty = wheelsets[:, :, 1], wheelsets[:, :, 4:6], wheelsets[:, :, 6:8]
    wear = np.abs(np.nan_to_num(tx * wheelsets[:, :, 3:4])) + np.abs(ty * yaw[:, :, None])
    is_unsolved = ~(residual <= RESIDUAL_TOLERANCE)
    wheelsets[is_unsolved] = np.nan
    wear_number = np.where(is_unsolved, np.nan, wear.sum(axis=(1, 2)) + wheelsets[:, :, 8].sum(axis=1))
    shortfall = -outward - wheelsets[:, :, 2].sum(axis=1)
    displacement, angle, force = (wheelsets[:, :, i] for i in range(3))
    return Equilibria(displacement, angle, force, wear_number, residual, shortfall)


def wheel_loads(model: Model, rows: FloatArray) -> FloatArray:
    """Return the static load [n, wheelset] in N of each wheel."""
    structure = model.design.structure
    if structure is None:
        return np.repeat(rows[:, model.columns["vehicle.wheel_load"]][:, None], 2, axis=1)
    return np.stack([rows[:, model.columns[w.part.number_path("wheel_load")]] for w in structure.wheelsets], axis=1)


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
        n = self.dofs
        states = np.concatenate([x[:, :n], np.zeros((len(x), n)), x[:, n:]], axis=1)
        batch = self.batch.with_initial_states(states)
        forces, wheelsets = self.vehicles.static_forces(batch, fraction * self.table, fraction * curvature)
        return forces / self.scale, wheelsets

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
    return np.asarray(np.linalg.solve(damped, right)[:, :, 0])
