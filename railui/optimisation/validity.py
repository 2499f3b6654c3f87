"""Limits of what the responses of a study say: curves without a flange, linear keys without nonlinear effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.curving.equilibrium import solve_equilibria
from railui.optimisation.objectives import required_keys
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study
from railui.vehicle.linear import linearisation_notes
from railui.vehicle.model import Model

LINEAR_KEYS: Final = ("linear_damping", "linear_critical_speed")
NO_FLANGE: Final = (
    "beyond the flange clearance without flange_contact: nothing holds the wheelset, and results of the curve are not "
    "credible"
)


def linear_notes(study: Study) -> list[str]:
    """Return notes on the effects that linear objectives and constraints of a study lack."""
    keys = [key for key in LINEAR_KEYS if key in required_keys(study)]
    return [f"{', '.join(keys)}: {note}" for note in linearisation_notes(Model(study.design))] if keys else []


def flange_warnings(study: Study, vehicles: Mapping[str, Sequence[tuple[Model, FloatArray]]]) -> list[str]:
    """Return a warning where wheelsets leave the clearance in the curve of a study.

    Parameters
    ----------
    study : Study
    vehicles : mapping of str to sequence of (Model, array)
        By name of a design its models with their rows [n, row]; "" for a design without a name.
    """
    is_in_curve = any(RESPONSE_KEYS[key].analysis == "curve" for key in required_keys(study))
    if not is_in_curve or any(effect.kind == "flange_contact" for effect in study.design.effects):
        return []
    beyond = [name for name, some in vehicles.items() if any(_leave_clearance(study, *each) for each in some)]
    if not beyond:
        return []
    curve = f"radius {study.cases.radius:g} m, cant deficiency {1e3 * study.cases.cant_deficiency:g} mm"
    of = "" if beyond == [""] else f" of the {' and the '.join(beyond)}"
    return [f"e{of} in the curve ({curve}) is {NO_FLANGE}"]


def _leave_clearance(study: Study, model: Model, rows: FloatArray) -> bool:
    """True if any of some vehicles [n, row] does."""
    radius, deficiency = np.full(len(rows), study.cases.radius), np.full(len(rows), study.cases.cant_deficiency)
    displacement = solve_equilibria(model, rows, radius, deficiency).displacement
    return bool(np.any(np.abs(displacement) >= rows[:, [model.columns["contact.flange_clearance"]]]))
