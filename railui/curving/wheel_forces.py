"""Forces between wheels and rails in a curve: guiding forces, wheel loads and Y/Q of every wheel."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.curving.equilibrium import Equilibria, wheel_loads
from railui.ride_quality.guiding_forces import guiding_force_channels
from railui.ride_quality.running_safety import STATIC_LOAD_NOTE
from railui.ride_quality.safety_limits import SafetyLimits
from railui.vehicle.model import Model

SPEED: Final = 1.0  # m/s at which creep laws that depend on the speed are evaluated
INSTANT: Final = 1e-6  # s, interval of the two samples of which the first is read


def wheel_forces(model: Model, equilibria: Equilibria, k: int) -> dict[str, Any]:
    """Return the forces of the wheels in the k-th equilibrium, None where there is none.

    Parameters
    ----------
    model : Model
    equilibria : Equilibria
    k : int
        Index of the vehicle.

    Returns
    -------
    dict
        wheelsets: for each its guiding_force [right, left] in N, outward from the track positive, wheel_load Q in N,
        derailment_quotient Y/Q, None of a wheel that lifts, and wear_number in N; derailment_quotient: the largest, and
        its limit derailment_quotient_limit. Q is static in a model without roll.
    """
    limits = SafetyLimits.of(model)
    result: dict[str, Any] = {"wheelsets": None, "derailment_quotient": None}
    if np.isfinite(equilibria.wear_number[k]):
        Y, Q = _forces(model, equilibria, k)
        quotient = np.where(Q > 0.0, Y / np.where(Q > 0.0, Q, 1.0), np.nan)
        result["wheelsets"] = [
            {
                "guiding_force": Y[i].tolist(),
                "wheel_load": Q[i].tolist(),
                "derailment_quotient": [float(q) if np.isfinite(q) else None for q in quotient[i]],
                "wear_number": equilibria.wheel_wear[k, i].tolist(),
            }
            for i in range(len(Y))
        ]
        result["derailment_quotient"] = float(np.nanmax(quotient)) if np.any(np.isfinite(quotient)) else None
    return result | {"derailment_quotient_limit": limits.quotient, "load_transfer": limits.has_load_transfer}


def quotient_notes(forces: dict[str, Any]) -> list[str]:
    """Return notes on Y/Q beyond its limit, on wheels that lift and on static wheel loads."""
    limit, notes = forces["derailment_quotient_limit"], []
    for i, wheelset in enumerate(forces["wheelsets"] or [], 1):
        for side, quotient in zip(("right", "left"), wheelset["derailment_quotient"], strict=True):
            if quotient is None:
                notes.append(f"the {side} wheel of wheelset {i} lifts")
            elif quotient > limit:
                notes.append(f"Y/Q {quotient:.3g} of the {side} wheel of wheelset {i} exceeds {limit:.3g}")
    return notes if forces["load_transfer"] else [*notes, f"Y/Q: {STATIC_LOAD_NOTE}"]


def _forces(model: Model, equilibria: Equilibria, k: int) -> tuple[FloatArray, FloatArray]:
    """Compute guiding forces Y, outward positive, and wheel loads Q [wheelset, wheel] in N, right and left."""
    loads = wheel_loads(model, model.row[None])[0]
    n = len(loads)
    row = equilibria.table[k].copy()
    row[1] = SPEED
    series, _ = model.vehicles(line=True).simulate(
        equilibria.batch.select([k]), np.tile(row, (3, 1)), INSTANT, 1, guiding_force_channels(model)
    )
    read = series[0, :, 0]
    transfer = read[2 * n :] if len(read) > 2 * n else np.zeros(n)
    return read[: 2 * n].reshape(n, 2) * [1.0, -1.0], loads[:, None] + np.stack([transfer, -transfer], axis=1)
