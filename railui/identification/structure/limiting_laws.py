"""Limits of laws: an effect gives way to a law of fewer parameters that it has become, where that one fits as well.

Friction that never yields is a spring, a damper on a mounting that hardly moves is a plain one. Near such a limit the
score of the simpler law may be low: the estimated parameters have absorbed more of it than of the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from railui import core
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import MAX_ITERATIONS
from railui.identification.estimation.problem import adapt_to_model, drop_states
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.elimination import effect_index, refit_text
from railui.identification.structure.locations import candidate_locations, estimated_elements, joint_key
from railui.identification.structure.refit import Refit, cross_validation_errors
from railui.identification.structure.screening import fit_with_effects
from railui.identification.structure.stage import SelectionStep, Stage, validated_stage
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
    if final.fit.slips or any(t.is_window for t in final.fit.segments):
        return final
    for i in [i for i, s in enumerate(steps) if s.added]:
        current = steps[i].added
        refit = None if context.is_out_of_time else _limiting_refit(context, final.fit, current)
        stage = None if refit is None else _validated(context, refit, finish)
        if refit is None or stage is None:
            continue
        text = f"{refit_text(refit)} in place of {refit_text(current)}"
        context.progress.message(f"  {text}: NRMSE {stage.validation.nrmse:.4f}")
        if stage.validation.nrmse <= context.settings.selection.simpler_misfit_ratio * final.validation.nrmse:
            errors = cross_validation_errors(context.settings.refit, stage.fit)
            added = replace(refit, fit=stage.fit, block_errors=errors)
            steps[i], final = replace(steps[i], added=added, refits=(*steps[i].refits, added)), stage
    return final


def _limiting_refit(context: Context, fit: Fit, current: Refit | None) -> Refit | None:
    """Return the refit of the limiting law of an effect whose misfit is as low as that of the effect; None: none."""
    candidate = None if current is None else current.candidate
    index = None if candidate is None else effect_index(fit.model, candidate)
    if index is None:
        return None
    refits = []
    for effect in limiting_effects(context, fit.model, fit.model.effects[index]):
        candidate = Candidate(effect.kind, effect.at, effect.wheelset)
        found = _fit_in_place(context, fit, index, effect) if effect_index(fit.model, candidate) is None else None
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


def _fit_in_place(context: Context, fit: Fit, index: int, effect: PlacedEffect) -> Fit | None:
    """Fit the model with another effect in place of one, a few iterations and then to the end while it fits as well."""
    quiet = context.in_background(context.jobs)
    settings = context.settings
    model = fit.model.without_effect(index)
    segments = drop_states(quiet, fit.model, model, fit.segments)
    model, found = model.with_effect(effect), None
    for iterations, ratio in (
        (settings.refit.first_iterations, settings.refit.converged_ratio),
        (MAX_ITERATIONS, settings.selection.simpler_misfit_ratio),
    ):
        try:
            adapted = adapt_to_model(quiet, model, segments)
        except ValueError:
            return None  # far from this limit the law is too stiff to be simulated
        paths = [*context.campaign.estimated_parameters, *model.effect_paths()]
        found = fit_with_effects(
            quiet, model, adapted, paths, tolerance=settings.refit.comparison_tolerance, max_iterations=iterations
        )
        if found is None or found.normal.rss > ratio * fit.normal.rss:
            return None
        model = found.model
    return found


def _validated(context: Context, refit: Refit, finish: Callable[[Fit], Fit]) -> Stage | None:
    """Fit a model to the end and validate it; None where it diverges."""
    try:
        return validated_stage(context, finish(refit.fit))
    except ValueError:
        return None
