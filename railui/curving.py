"""Quasi-static curving: where a vehicle stands in a curve of constant radius, by Newton with its effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, Vehicles
from railui.vehicle.design_reader import Design
from railui.vehicle.dofs import body_and_motion, is_lateral
from railui.vehicle.grouping import group_by_structure
from railui.vehicle.model import Model
from railui.vehicle.multibody_reader import position_terms
from railui.vehicle.resolve import resolve_model
from railui.vehicle.wheel_loads import GRAVITY

CLOSE: Final = 1e-10  # of the wheel load: forces that are left
ITERATIONS: Final = 80
STUCK: Final = 1e9  # damping of a step that leads nowhere
PARTS: Final = (1, 4, 16)  # of the curvature: a curve too sharp for one step is entered in more
LACKING: Final = 1e-3  # of the guiding force, from which a shortfall is told
NUDGE: Final = 1e-7  # m, rad: of the slopes
NO_FORCE: Final = {"dry_friction", "hysteresis"}  # at rest they hold anything or nothing: see `notes`


@dataclass(frozen=True, eq=False)
class Equilibria:
    """Where n vehicles stand: displacement, angle_of_attack, guiding_force [n, wheelset], wear_number [n].

    NaN where no equilibrium was found; residual [n]: the largest force left over, of the wheel load; shortfall [n] N:
    what the guiding forces lack of the outward forces: what load transfer adds on inclined contacts of a vehicle
    that rolls.
    """

    displacement: FloatArray
    angle_of_attack: FloatArray
    guiding_force: FloatArray
    wear_number: FloatArray
    residual: FloatArray
    shortfall: FloatArray


def curve(design: Design | Model | str | Path, radius: float, cant_deficiency: float = 0.0) -> dict[str, Any]:
    """The quasi-static curve of radius [m] (centre at +y: a right-hand curve; negative: left) of a design.

    displacement e_i [m], angle_of_attack psi_i [rad], guiding_force Q_yi [N] (of the rails on a wheelset),
    wear_number [N] (sum over wheels of abs(T_x u_x) + abs(T_y u_y)), flange_contact (does abs(e_i) reach the
    clearance?), notes. `cant_deficiency` d [m]: every body feels m g d/(2 b) outwards, and the frame what the
    wheels carry beyond the vehicle's own bodies. None where no equilibrium is found. Raises ValueError for a
    radius that is not a number or 0. Source: docs/theory.md, after Broersen 1976, (3.1) to (3.10).

    >>> found = curve("designs/check_bogie.yaml", 600.0)
    >>> [round(1e3 * e, 3) for e in found["displacement"]]
    [-10.94, -3.289]
    """
    return curve_many([design], radius, cant_deficiency)[0]


def curve_many(
    designs: Sequence[Design | Model | str | Path], radius: float, cant_deficiency: float = 0.0
) -> list[dict[str, Any]]:
    """`curve` of many designs, in their order; those of one structure are solved side by side."""
    models = [resolve_model(design) for design in designs]
    found: dict[int, dict[str, Any]] = {}
    for members in group_by_structure(models):
        first = models[members[0]]
        n = len(members)
        rows = np.stack([models[i].row for i in members])
        stands = solve_equilibria(first, rows, np.full(n, radius), np.full(n, cant_deficiency))
        found |= {i: result_dict(models[i], stands, k, radius, cant_deficiency) for k, i in enumerate(members)}
    return [found[i] for i in range(len(models))]


def curves(
    design: Design | Model | str | Path, radii: Sequence[float], cant_deficiency: float = 0.0
) -> list[dict[str, Any]]:
    """`curve` of one design at many radii [m]."""
    model = resolve_model(design)
    rows = np.repeat(model.row[None], len(radii), axis=0)
    stands = solve_equilibria(model, rows, np.array(radii), np.full(len(radii), cant_deficiency))
    return [result_dict(model, stands, k, float(radius), cant_deficiency) for k, radius in enumerate(radii)]


def result_dict(model: Model, stands: Equilibria, k: int, radius: float, cant_deficiency: float) -> dict[str, Any]:
    """The k-th of many stands as the keys of `curve`."""
    clearance = model.design.value("contact.flange_clearance")
    found = bool(np.isfinite(stands.wear_number[k]))
    e = stands.displacement[k]
    touching = [bool(abs(x) >= clearance) for x in e] if found else None
    kinds = {effect.kind for effect in model.effects}
    notes = [f"{kind}: without force where nothing moves" for kind in sorted(kinds & NO_FORCE)]
    if not found:
        notes.append(f"no equilibrium found, forces of {stands.residual[k]:.3g} wheel loads are left over")
    elif any(touching or ()) and "flange_contact" not in kinds:
        notes.append("e is beyond the flange clearance and the design has no flange_contact: nothing holds it there")
    short = float(stands.shortfall[k])
    if found and abs(short) > LACKING * float(np.abs(stands.guiding_force[k]).max()):
        notes.append(f"guiding_force: without {short:.4g} N in all that load transfer adds on inclined contacts")
    return {
        "radius": radius,
        "cant_deficiency": cant_deficiency,
        "displacement": e.tolist() if found else None,
        "angle_of_attack": stands.angle_of_attack[k].tolist() if found else None,
        "guiding_force": stands.guiding_force[k].tolist() if found else None,
        "wear_number": float(stands.wear_number[k]) if found else None,
        "flange_contact": touching,
        "notes": notes,
    }


def solve_equilibria(model: Model, rows: FloatArray, radius: FloatArray, cant_deficiency: FloatArray) -> Equilibria:
    """Where n vehicles of one structure, rows [n, row], stand in curves of radius [n] m, deficiency [n] m."""
    if not np.all(np.isfinite(radius)) or np.any(radius == 0):
        raise ValueError(f"a radius must be a number other than 0: {radius[~(np.abs(radius) > 0)][0]:g} m")
    vehicles, batch = model.vehicles(), model.batch(rows)
    states, dofs = vehicles.state_count(batch), vehicles.degrees_of_freedom(batch)
    curvature = 1.0 / radius
    ahead = positions(model, rows, dofs)
    loads = outward(model, rows, dofs, cant_deficiency, np.sign(radius))
    scale = np.repeat(wheel_loads(model, rows).mean(axis=1)[:, None], states - len(dofs), axis=1)
    newton = _Newton(vehicles, batch, dofs, ahead, loads, scale)
    x, left = np.zeros((len(rows), states - len(dofs))), np.full(len(rows), np.inf)
    for parts in PARTS:
        open_ = np.flatnonzero(~(left <= CLOSE))
        if not open_.size:
            break
        here, x[open_] = newton.of(open_), 0.0
        for part in range(1, parts + 1):
            x[open_], left[open_] = here.solved(x[open_], curvature[open_], part / parts)
    wheels = newton.forces(x, curvature, 1.0)[1]
    yaw, tx, ty = wheels[:, :, 1], wheels[:, :, 4:6], wheels[:, :, 6:8]
    wear = np.abs(np.nan_to_num(tx * wheels[:, :, 3:4])) + np.abs(ty * yaw[:, :, None])
    lost = ~(left <= CLOSE)
    wheels[lost] = np.nan
    total = np.where(lost, np.nan, wear.sum(axis=(1, 2)))
    shortfall = -loads.sum(axis=1) - wheels[:, :, 2].sum(axis=1)
    return Equilibria(wheels[:, :, 0], wheels[:, :, 1], wheels[:, :, 2], total, left, shortfall)


def positions(model: Model, rows: FloatArray, dofs: Sequence[str]) -> FloatArray:
    """How far ahead of the middle of its wheelsets each degree of freedom is [n, dofs], in m."""
    structure, zero = model.design.structure, np.zeros(len(rows))
    if structure is None:
        a = rows[:, model.columns["vehicle.geometry.half_wheelbase"]]
        return np.stack([a * {"1": 1.0, "2": -1.0}.get(dof[-1], 0.0) for dof in dofs], axis=1)
    at = {
        name: sum((f * rows[:, model.columns[path]] for f, path in position_terms(structure, member)), zero)
        for name, member in structure.members.items()
    }
    middle = np.mean([at[wheelset.name] for wheelset in structure.wheelsets], axis=0)
    return np.stack([at[dof.partition(".")[2]] - middle for dof in dofs], axis=1)


def wheel_loads(model: Model, rows: FloatArray) -> FloatArray:
    """N [n, wheelset] of each wheel."""
    structure = model.design.structure
    if structure is None:
        return np.repeat(rows[:, model.columns["vehicle.wheel_load"]][:, None], 2, axis=1)
    return np.stack([rows[:, model.columns[w.part.number_path("wheel_load")]] for w in structure.wheelsets], axis=1)


def outward(
    model: Model, rows: FloatArray, dofs: Sequence[str], cant_deficiency: FloatArray, side: FloatArray
) -> FloatArray:
    """Forces [n, dofs] of the cant deficiency d [n] m: m g d/(2 b) on each body, from the centre of the curve.

    The frames also feel what the wheels carry beyond the vehicle's own bodies: a coach that is not modelled.
    """
    vehicles, found = model.vehicles(), np.zeros((len(rows), len(dofs)))
    lateral = [i for i, dof in enumerate(dofs) if is_lateral(dof)]
    carrying = [k for k, i in enumerate(lateral) if "wheelset" not in body_and_motion(dofs[i])[0]]
    frames = [k for k in carrying if body_and_motion(dofs[lateral[k]])[0].startswith("frame")] or carrying[:1]
    gauges = [i for path, i in model.columns.items() if path.endswith(".half_gauge")]
    for k, row in enumerate(rows):
        if cant_deficiency[k]:
            masses = np.array(list(vehicles.inertias(model.batch(row[None])).values()))[lateral]
            beyond = 2 * wheel_loads(model, row[None]).sum() / GRAVITY - masses.sum()
            masses[frames] += max(0.0, float(beyond)) / len(frames)
            found[k, lateral] = -side[k] * masses * GRAVITY * cant_deficiency[k] / (2 * np.mean(row[gauges]))
    return found


@dataclass(frozen=True, eq=False)
class _Newton:
    """The static equations of n vehicles; unknown are positions and the effects' own states."""

    vehicles: Vehicles
    batch: Batch
    dofs: list[str]
    ahead: FloatArray
    loads: FloatArray
    scale: FloatArray

    def of(self, rows: NDArray[np.int64]) -> _Newton:
        """Some of the vehicles."""
        parts = (self.ahead[rows], self.loads[rows], self.scale[rows])
        return _Newton(self.vehicles, self.batch.select(rows), self.dofs, *parts)

    def forces(self, x: FloatArray, curvature: FloatArray, part: float) -> tuple[FloatArray, FloatArray]:
        """Forces left over [n, unknown] in wheel loads, and what is told of the wheelsets, in a part of the curve."""
        n, dofs = len(self.dofs), self.dofs
        shift = np.zeros_like(self.ahead)
        for i, dof in enumerate(dofs):  # what the suspension sees: the curve against the tangent in the middle
            along = self.ahead[:, i]
            shift[:, i] = along * curvature if dof.startswith("psi") else 0.5 * along**2 * curvature
            shift[:, i] *= is_lateral(dof) or dof.startswith("psi")
        states = np.concatenate([x[:, :n], np.zeros((len(x), n)), x[:, n:]], axis=1)
        found, wheels = self.vehicles.static_forces(self.batch.with_initial_states(states), part * shift, part * curvature)
        found[:, :n] += part * self.loads
        return found / self.scale, wheels

    def slopes(self, x: FloatArray, curvature: FloatArray, part: float) -> FloatArray:
        """d forces/d unknown [n, force, unknown] by central differences."""
        n, m = x.shape
        nudges = NUDGE * np.concatenate([np.eye(m), -np.eye(m)])
        moved = (x[:, None] + nudges).reshape(n * 2 * m, m)
        many = self.of(np.repeat(np.arange(n), 2 * m))
        found = many.forces(moved, np.repeat(curvature, 2 * m), part)[0].reshape(n, 2, m, m)
        return np.swapaxes((found[:, 0] - found[:, 1]) / (2 * NUDGE), 1, 2)

    def solved(self, x: FloatArray, curvature: FloatArray, part: float) -> tuple[FloatArray, FloatArray]:
        """Levenberg and Marquardt's steps from x until nothing is left over; and what is, [n] wheel loads.

        They bear the corners of plays and flanges, and motions that a play leaves free.
        """
        x, left, mu = x.copy(), np.full(len(x), np.inf), np.full(len(x), 1e-6)
        f = self.forces(x, curvature, part)[0]
        for _ in range(ITERATIONS):
            left = np.abs(f).max(axis=1)
            go = np.flatnonzero((left > CLOSE) & (mu < STUCK))
            if not go.size:
                break
            here, c = self.of(go), curvature[go]
            slopes = here.slopes(x[go], c, part)
            squares = np.swapaxes(slopes, 1, 2) @ slopes
            weights = np.einsum("nii->ni", squares)
            weights = weights + 1e-12 * weights.max(axis=1, keepdims=True)
            damped = squares + mu[go, None, None] * weights[:, :, None] * np.eye(x.shape[1])
            step = np.linalg.solve(damped, -np.einsum("nij,ni->nj", slopes, f[go])[:, :, None])[:, :, 0]
            f_tried = here.forces(x[go] + step, c, part)[0]
            better = np.linalg.norm(f_tried, axis=1) < np.linalg.norm(f[go], axis=1)
            x[go[better]], f[go[better]] = (x[go] + step)[better], f_tried[better]
            mu[go] = np.where(better, np.maximum(0.1 * mu[go], 1e-15), 8 * np.maximum(mu[go], 1e-9))
        return x, left
