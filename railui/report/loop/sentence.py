"""The verdict of the loop in words."""

from __future__ import annotations

from collections.abc import Mapping

from railui import core
from railui.identification.estimation.fit import Fit
from railui.identification.loop import LoopResult
from railui.identification.unmodelled.locate import Discrepancy
from railui.identification.unmodelled.run_dependence import RunDependence
from railui.io.number_format import format_quantity
from railui.report.loop.wording import effect_title, location_phrase
from railui.report.numbers import quantity_with_sd
from railui.vehicle.effects import PlacedEffect, parameter_unit

PARAMETER_NAMES = {"half_width": "half-width"}


def sentence(result: LoopResult) -> str:
    """Return the verdict with its evidence: effect or location, validation error, error expected from noise."""
    before, after = result.validations["before"].nrmse, result.validations["after"].nrmse
    noise = f"expected from noise alone {result.noise_floor.nrmse:.3f}"
    if result.verdict == "none":
        text = f"No unmodelled effect detected. Validation error {after:.3f}; {noise}."
    elif result.verdict == "effect":
        effects = effects_text(result.after)
        noun = "effects" if "; and " in effects else "effect"
        text = f"Most likely unmodelled {noun}: {effects}. Validation error {before:.3f} -> {after:.3f}; {noise}."
    else:
        text = f"Discrepancy that no effect of the catalogue explains, {_location(result.discrepancy)}"
        if result.discrepancy is not None and result.discrepancy.run_dependence is not None:
            dependence = run_dependence_text(result, result.discrepancy.run_dependence)
            text += f": {dependence}. Validation error {after:.3f}; {noise}."
        else:
            text += f". Validation error {before:.3f} -> {after:.3f} with {_model(result.discrepancy)}; {noise}."
    if result.error_to_noise > result.context.settings.selection.unexplained_ratio:
        ratio = f"{result.error_to_noise:.1f} times the noise floor"
        return f"The stated noise does not explain the residual ({ratio}). {text}"
    return text


def effects_text(fit: Fit) -> str:
    """Return the effects of a fitted model with their parameters and standard deviations."""
    sd = dict(zip(fit.free.paths, fit.sd.tolist(), strict=True))
    groups = (("effects", fit.model.design.effects), ("sensors", fit.model.sensors))
    return "; and ".join(
        ", ".join([_name(effect), *_parameters(effect, f"{group}.{i}", sd)])
        for group, effects in groups
        for i, effect in enumerate(effects)
        if effect.kind not in core.CURVE_KINDS
    )


def _parameters(effect: PlacedEffect, path: str, sd: Mapping[str, float]) -> list[str]:
    """Return the parameters of an effect, whose standard deviations are those of its path."""
    texts = []
    for p in core.effect_record(effect.kind)["parameters"]:
        key, value = p["key"], effect.parameters.get(p["key"])
        if isinstance(value, float) and p["role"] != "run":
            name = PARAMETER_NAMES.get(key, key.replace("_", " "))
            quantity = quantity_with_sd(value, sd.get(f"{path}.{key}"), parameter_unit(p, effect.at))
            texts.append(f"{name} {quantity}")
    return texts


def run_dependence_text(result: LoopResult, dependence: RunDependence) -> str:
    """Return a parameter that differs from run to run, with its value on every run."""
    model = result.after.model
    unit = model.design.unit(dependence.path)
    runs_by_value: dict[float, list[str]] = {}
    for run in dependence.runs:
        runs_by_value.setdefault(run.value, []).append(f"{run.file} ({format_quantity(run.speed, 'm/s', 3)})")
    values = [f"{format_quantity(value, unit)} on {', '.join(runs)}" for value, runs in runs_by_value.items()]
    others = [path for path in dependence.ratios if path != dependence.path]
    proportional = f" ({', '.join(others)} in proportion)" if others else ""
    group, *rest = dependence.path.split(".")
    name = dependence.path
    if group == "effects":
        name = f"{rest[1].replace('_', ' ')} of the {_name(model.effects[int(rest[0])])}"
    return f"the vehicle is not the same from run to run, {name}{proportional} would be {' and '.join(values)}"


def _name(effect: PlacedEffect) -> str:
    return f"{effect_title(effect.kind)} in {location_phrase(effect.at, effect.wheelset)}"


def _location(discrepancy: Discrepancy | None) -> str:
    if discrepancy is None or not discrepancy.at:
        return "at an unknown location"
    coupling = f" (a coupling of {discrepancy.coupling.text})" if discrepancy.coupling else ""
    return f"acting at {location_phrase(discrepancy.at, discrepancy.wheelset)}{coupling}"


def _model(discrepancy: Discrepancy | None) -> str:
    if discrepancy is not None and discrepancy.drift is not None:
        return "a parameter that varies along the track"
    return "the identified force curve"
