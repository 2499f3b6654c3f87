"""Quasi-static curves of designs: displacements, guiding forces, Y/Q and wear."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui import core
from railui.curving.equilibrium import Equilibria, solve_equilibria
from railui.curving.wheel_forces import quotient_notes, wheel_forces
from railui.ride_quality.running_safety import friction_notes
from railui.vehicle.design_reader import Design
from railui.vehicle.grouping import group_by_structure
from railui.vehicle.model import Model
from railui.vehicle.resolve import resolve_model

MIN_SHORTFALL: Final = 1e-3  # of the guiding force, from which a note reports it

DesignLike = Design | Model | str | Path


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
        displacement e_i [m], angle_of_attack psi_i [rad], guiding_force Q_yi [N] (lateral, of the rails on a wheelset,
        positive to the right), wear_number [N] (sum over all wheels of abs(T_x u_x) + abs(T_y u_y), and of the
        flanges, without the spin moment), flange_contact (abs(e_i) >= clearance), wheelsets (forces, Y/Q and wear
        number of the wheels, see `wheel_forces`), derailment_quotient (the
        largest of them), notes. None if the iteration finds no equilibrium.

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
    forces = wheel_forces(model, equilibria, k)
    return {
        "radius": radius,
        "cant_deficiency": cant_deficiency,
        "displacement": e.tolist() if is_solved else None,
        "angle_of_attack": equilibria.angle_of_attack[k].tolist() if is_solved else None,
        "guiding_force": equilibria.guiding_force[k].tolist() if is_solved else None,
        "wear_number": float(equilibria.wear_number[k]) if is_solved else None,
        "flange_contact": touching,
        **forces,
        "notes": _notes(model, equilibria, k, touching) + quotient_notes(forces) + friction_notes(model),
    }


def _notes(model: Model, equilibria: Equilibria, k: int, touching: list[bool] | None) -> list[str]:
    """Return notes on undetermined forces, a failed iteration, missing flanges and the shortfall."""
    kinds = {effect.kind for effect in model.effects}
    undetermined = (kind for kind in sorted(kinds) if core.effect_record(kind)["undetermined_at_rest"])
    notes = [f"{kind}: without force where nothing moves" for kind in undetermined]
    if touching is None:
        notes.append(f"no equilibrium found, forces of {equilibria.residual[k]:.3g} wheel loads are left over")
        return notes
    if any(touching) and "flange_contact" not in kinds:
        beyond = "e is beyond the flange clearance and the design has no flange_contact"
        notes.append(f"{beyond}: nothing holds the wheelset, these results are not credible; add the effect")
    shortfall = float(equilibria.shortfall[k])
    if abs(shortfall) > MIN_SHORTFALL * float(np.abs(equilibria.guiding_force[k]).max()):
        notes.append(f"guiding_force: without {shortfall:.4g} N in all that laws at rolling wheelsets add")
    return notes
