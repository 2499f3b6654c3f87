"""Limits of laws: an effect gives way to a law of fewer parameters that it has become, where that one fits as well.

Friction that never yields is a spring, a damper on a mounting that hardly moves is a plain one. Near such a limit the
score of the simpler law may be low: the estimated parameters have absorbed more of it than of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from railui import core
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.elimination import effect_index
from railui.identification.structure.locations import candidate_locations, estimated_elements, joint_key
from railui.identification.structure.refit import Refit, cross_validation_errors
from railui.identification.structure.stage import SelectionStep, Stage
from railui.identification.structure.substitution import fit_in_place, substitute
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

Limit = tuple[str, Callable[[Mapping[str, float]], float]]
# the linear law that another becomes in a limit, and its number from those of the other
LIMITS: Final[Mapping[str, tuple[Limit, ...]]] = {
    "maxwell_damper": (("viscous_damper", lambda p: p["damping"]), ("spring", lambda p: p["stiffness"])),
    "hysteresis": (("spring", lambda p: p["stiffness"]),),
    "bump_stop": (("spring", lambda p: p["stiffness"]),),  # without a gap
    "dry_friction": (("viscous_damper", lambda p: p["force"] / p["slip_speed"]),),  # F tanh(v/v_0) below v_0
}


def replace_by_limits(
    context: Context, final: Stage, steps: list[SelectionStep], finish: Callable[[Fit], Fit]
) -> Stage:
    """Replace each effect by the linear law that it has become, where the misfit stays the same; updates `steps`.

    finish: fits a model to the end.
    """
    ratio = context.settings.selection.simpler_misfit_ratio
    return substitute(context, final, steps, finish, lambda fit, i: _limiting_refit(context, fit, steps[i]), ratio)


def _limiting_refit(context: Context, fit: Fit, step: SelectionStep) -> Refit | None:
    """Return the refit of the limiting law of an effect whose misfit is as low as that of the effect; None: none."""
    candidate = None if step.added is None else step.added.candidate
    index = None if candidate is None else effect_index(fit.model, candidate)
    if index is None:
        return None
    refits, ratio = [], context.settings.selection.simpler_misfit_ratio
    for effect in limiting_effects(context, fit.model, fit.model.effects[index]):
        candidate = Candidate(effect.kind, effect.at, effect.wheelset)
        is_new = effect_index(fit.model, candidate) is None
        found = fit_in_place(context, fit, index, effect, ratio) if is_new else None
        if found is not None:
            refits.append(Refit(candidate, found, cross_validation_errors(context.settings.refit, found)))
    return min(refits, key=lambda r: r.rss, default=None)


def limiting_effects(context: Context, model: Model, effect: PlacedEffect) -> Sequence[PlacedEffect]:
    """List the linear laws that an effect becomes in a limit, at its joint, unless they are estimated parameters."""
    joint = joint_key(model, effect.at)
    estimated = estimated_elements(model, context.campaign.estimated_parameters)
    found = []
    for kind, number in LIMITS.get(effect.kind, ()):
        record = core.effect_record(kind)
        places = [at for at, _ in candidate_locations(model, record) if joint_key(model, at) == joint]
        key = str(Candidate(kind, effect.at, None).strength)
        if places and not (effect.wheelset is None and (kind, joint) in estimated):
            at = effect.at if effect.at in places else places[0]
            parameters = {k: float(x) for k, x in effect.parameters.items() if not isinstance(x, tuple)}
            found.append(PlacedEffect(kind, at, effect.wheelset, {key: number(parameters)}))
    return found
