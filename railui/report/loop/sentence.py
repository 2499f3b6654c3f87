"""The verdict of the loop in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from railui import core
from railui.campaign.corrections.correction import Correction, Corrections, yaml_line
from railui.identification.result import LoopResult
from railui.identification.unmodelled.discrepancy import Discrepancy
from railui.identification.unmodelled.run_dependence import RunDependence
from railui.io.number_format import format_quantity
from railui.report.loop.catalogued_effects import catalogued_effects
from railui.report.loop.conditions import MAX_NAMED, depending_parameters
from railui.report.loop.noise import known_noise_text
from railui.report.loop.stop_positions import position_texts
from railui.report.loop.wording import effect_title, joint_phrases, location_phrase, unit_location
from railui.report.numbers import quantity_with_sd
from railui.vehicle.effects import PlacedEffect, parameter_unit
from railui.vehicle.model import TURN
from railui.vehicle.multibody import Structure

FAILED_FIT = (
    "The calibration without effects failed: worse on the validation runs than the nominal one, which takes its place."
)
UNEXPLAINED_DIFFERENCE = "the vehicle is not the same from run to run, and no single parameter explains the difference"
EFFECT_GROUPS = ("effects", "sensors")  # of the paths of parameters
PARAMETER_NAMES = {"half_width": "half-width"}


def sentence(result: LoopResult) -> str:
    """Return the verdict with its evidence: effect or location, validation error, error expected from noise."""
    text = _VERDICT_TEXTS[result.verdict](result)
    if result.verdict != "none" and _has_remainder(result):
        text = f"{text}{_vibration_text(result)}"
    if result.verdict == "partial" and result.test is not None and result.test.is_contradicted:
        errors = f"{_short(result.test.nrmse_before)} -> {_short(result.test.nrmse_after)}"
        text = f"{text} The independent test contradicts the effects: its error rises, {errors}."
    if result.is_failed_fit:
        text = f"{text} {FAILED_FIT}"
    if _has_remainder(result) and result.dataset.hum:
        text = f"{text} {_hum_text(result.dataset.hum)}"
    return f"The time budget ended before the search: best answer so far. {text}" if result.is_out_of_time else text


def _hum_text(hum: Mapping[tuple[str, str], float]) -> str:
    """Return which channels contain mains hum, and the line that removes it."""
    channels: dict[str, list[float]] = {}
    for (_, channel), frequency in hum.items():
        channels.setdefault(channel, []).append(frequency)
    means = {channel: sum(found) / len(found) for channel, found in channels.items()}
    frequencies = " and ".join(dict.fromkeys(f"{mean:.4g} Hz" for mean in means.values()))
    line = yaml_line(Corrections(tuple(Correction(c, hum=round(mean, 4)) for c, mean in means.items())))
    verb = "contains" if len(means) == 1 else "contain"
    return f"{' and '.join(means)} {verb} mains hum of {frequencies}, which counts in the error; `{line}` removes it."


def _none_text(result: LoopResult) -> str:
    found = "No unmodelled effect detected"
    if result.is_out_of_time:
        found = f"{found}, but not all effects were tested"
    text = f"{found}{_conditions(result)}. Validation error {_final_error(result)}; {_noise(result)}."
    if _has_remainder(result):
        if result.remainder.surface is not None:
            return f"{text} {remainder_text(result)}"
        if result.remainder.candidate is not None:
            text = f"{text} {remainder_text(result)} That effect gains too little to count."
        return (
            f"{text} The residual is {result.error_to_noise:.1f} times the noise floor and coherent with no motion: "
            f"the noise is larger than {known_noise_text(result.noise_floor.source)}."
        )
    return text


def _effect_text(result: LoopResult) -> str:
    effects = effects_text(result)
    noun = "effects" if "; and " in effects else "effect"
    share = f" ({_explained_share(result)} of the error beyond noise)" if _is_explained_by_part(result) else ""
    text = f"Most likely unmodelled {noun}: {effects}{_conditions(result)}. "
    text += f"Validation error {_errors(result)}{share}; {_noise(result)}."
    return f"{text} {remainder_text(result)}" if _has_remainder(result) else text


def _partial_text(result: LoopResult) -> str:
    return (
        f"Part of the discrepancy identified: {effects_text(result)}{_conditions(result)}. "
        f"Validation error {_errors(result)}: "
        f"{_explained_share(result)} of the error beyond noise explained; {_noise(result)}. {remainder_text(result)}"
    )


def _outside_text(result: LoopResult) -> str:
    discrepancy = result.discrepancy
    if result.sensitive_motion is not None:
        return (
            "Motion that is sensitive to its start, so that no simulation follows it over whole runs; its equation of "
            f"motion holds with {_name(result, result.sensitive_motion.effect)}. Validation error "
            f"{_error(result, 'after')}, which decides on no law; {_noise(result)}."
        )
    if discrepancy is None:
        return _without_discrepancy(result)
    text = f"Discrepancy that no effect of the catalogue explains, {_location(result)}"
    if discrepancy.run_dependence is not None:
        dependence = run_dependence_text(result, discrepancy.run_dependence)
        return f"{text}: {dependence}. Validation error {_error(result, 'after')}; {_noise(result)}."
    if discrepancy.is_unexplained_difference:
        error = f"Validation error {_error(result, 'after')}"
        return f"{text}: {UNEXPLAINED_DIFFERENCE}. {error}; {_noise(result)}."
    if not discrepancy.lowers_error:
        error = f"{_error(result, 'after')}, which {_model(discrepancy)} does not lower"
        text = f"{text}. Validation error {error}; {_noise(result)}."
        return f"{text} What is left of the force {surface}" if (surface := surface_text(result)) else text
    return f"{text}. Validation error {_errors(result)} with {_model(discrepancy)}; {_noise(result)}."


def _course(discrepancy: Discrepancy | None) -> str:
    is_in_time = discrepancy is not None and discrepancy.curve.against == "t"
    return "with time" if is_in_time else "along the track"


def _without_discrepancy(result: LoopResult) -> str:
    freed, error = result.freed, f"Validation error {_final_error(result)}"
    if result.is_by_condition:
        found = f"Part of the error depends on the conditions of the runs{_conditions(result)}"
        return f"{found}. {error}; {_noise(result)}. What is left exceeds noise; its cause is unknown."
    if diverged := result.validations["after"].diverged:
        files = " and ".join(dict.fromkeys(file for file, _ in diverged))
        found = f"The calibrated model diverges on {files}, so that it does not describe the vehicle there"
        return f"{found}. {error}; {_noise(result)}."
    if freed.validation is None:
        cause = "was not looked for to the end" if result.is_out_of_time else "is unknown"
        return f"The residual exceeds noise; its cause {cause}. {error}; {_noise(result)}."
    paths = ", ".join(group.path for group in freed.groups if group.is_heterogeneous)
    return (
        f"Joints or wheelsets differ in {paths}. {error} with common numbers, {_short(freed.validation.nrmse)} with "
        f"separate ones; {_noise(result)}."
    )


_VERDICT_TEXTS: dict[str, Callable[[LoopResult], str]] = {
    "none": _none_text,
    "effect": _effect_text,
    "partial": _partial_text,
    "outside": _outside_text,
}


def remainder_text(result: LoopResult) -> str:
    """Return what the final model leaves: how much, where it acts, and which effect it resembles."""
    remainder = result.remainder
    ratio = "" if remainder.ratio is None else f" ({format_share(remainder.ratio)} of the error beyond noise)"
    if result.sensitive_motion is not None:
        return (
            f"The remainder{ratio} is of a motion sensitive to its start, which no simulation follows over whole runs."
        )
    drift = result.discrepancy and result.discrepancy.lowers_error and result.discrepancy.drift
    if drift:
        varying = f"a variation of {drift.path} {_course(result.discrepancy)}"
        return f"Of the remainder{ratio} {varying} explains {format_share(drift.share)} on the estimation runs."
    if surface := surface_text(result):
        return f"The remainder{ratio} {surface}"
    discrepancy = result.discrepancy
    resembled = _resembled(result)
    if discrepancy is not None and (result.verdict == "partial" or discrepancy.lowers_error):
        law = f"resembles {resembled} most" if resembled else "in no law of the catalogue"
        if discrepancy.is_unexplained_difference:
            law = UNEXPLAINED_DIFFERENCE
        return f"The remainder{ratio} is {_location(result)} and {law}."
    if resembled:
        return f"The remainder{ratio} resembles {resembled}."
    coherence = "with the motion, but" if remainder.coherent else "with no motion and"
    if result.is_by_condition:  # the score test is of the residual with common parameters
        return f"The remainder{ratio} is coherent {coherence.partition(' motion')[0]} motion."
    return f"The remainder{ratio} is coherent {coherence} resembles no effect of the catalogue."


def _resembled(result: LoopResult) -> str:
    """Return the effect that correlates most with the residual, with its location; empty without structure."""
    if result.remainder.candidate is None:
        return ""
    kind, at, wheelset = result.remainder.candidate
    return f"{effect_title(kind)} in {location_phrase(at, wheelset, _structure(result))}"


def _vibration_text(result: LoopResult) -> str:
    """Return the frequency about which the residual of a rig vibrates, and that of the rig; empty without one."""
    frequency = result.remainder.vibration
    if frequency is None:
        return ""
    model, own = result.after.model, ""
    mass, stiffness = (model.value(f"vehicle.rig.{key}") for key in ("mass", "stiffness"))
    if mass > 0.0 and stiffness > 0.0:
        own = f"; the natural frequency of the rig without added effects is {_hertz((stiffness / mass) ** 0.5 / TURN)}"
    return f" What is left is largest about {_hertz(frequency)}{own}."


def _hertz(frequency: float) -> str:
    return f"{frequency:.3g} Hz"


def surface_text(result: LoopResult) -> str:
    """Return on what the force that is left of a component depends; empty where on no motion, or on a sum of two."""
    surface = result.remainder.surface
    if surface is None:
        return ""
    return (
        "depends on displacement and velocity together, as does friction that grows with the deflection: "
        f"{format_share(surface.interaction)} of it on the validation runs, beyond a function of each."
    )


def format_share(share: float) -> str:
    """Format a share in per cent, small ones with two digits.

    >>> format_share(0.71), format_share(0.00058), format_share(0.999)
    ('71 %', '0.058 %', '99.9 %')
    """
    percent = 100.0 * share
    if percent >= 99.0:
        return f"{min(percent, 99.95):.1f} %" if percent < 99.95 else "100 %"
    return f"{percent:.0f} %" if percent >= 9.5 else f"{percent:.2g} %"


def _explained_share(result: LoopResult) -> str:
    explained = result.explained
    if explained is None:
        return "an unknown share"
    spread = "" if explained.standard_error is None else f" +/- {format_share(explained.standard_error)}"
    return f"{format_share(explained.value)}{spread}"


def _is_explained_by_part(result: LoopResult) -> bool:
    """True where the added effects leave more than noise."""
    return _has_remainder(result) and result.explained is not None


def _has_remainder(result: LoopResult) -> bool:
    return bool(result.error_to_noise > result.context.settings.selection.unexplained_ratio)


def _noise(result: LoopResult) -> str:
    floor = result.noise_floor.nrmse
    return f"expected from noise alone {_short(floor) if np.isfinite(floor) else 'unknown'}"


def _error(result: LoopResult, model: str) -> str:
    error = result.validations[model].nrmse
    return _short(error) if np.isfinite(error) else "undefined"


def _final_error(result: LoopResult) -> str:
    """Return the error of the final model, on which the verdict rests: with parameters by condition where these do."""
    if result.conditions is None or not result.is_by_condition:
        return _error(result, "after")
    separate, common = (_short(x) for x in (result.conditions.separate_nrmse, result.conditions.common_nrmse))
    return f"{separate} with parameters by {result.conditions.name}, {common} with common ones"


def _errors(result: LoopResult) -> str:
    return f"{_error(result, 'before')} -> {_final_error(result)}"


def _conditions(result: LoopResult) -> str:
    """Return the parameters that depend on the condition, but for those of effects; empty where these do not decide."""
    values = depending_parameters(result)
    named = [f"{path} {text}" for path, text in values.items() if path.partition(".")[0] not in EFFECT_GROUPS]
    if result.conditions is None or not named:
        return ""
    return f"; {result.conditions.name} changes {'; '.join(named[:MAX_NAMED])}"


def _short(error: float) -> str:
    """Format an error with three decimals, a small one with two digits."""
    return f"{error:.3f}" if not error < 0.0095 else f"{error:.2g}"


def effects_text(result: LoopResult) -> str:
    """Return the effects that were added to the nominal model, with their parameters and standard deviations."""
    sd = dict(zip(result.after.free.paths, result.after.sd.tolist(), strict=True))
    by_condition, texts = depending_parameters(result), []
    for group, i, effect in catalogued_effects(result):
        path, unit_at = f"{group}.{i}", unit_location(result, effect.at)
        positions = position_texts(result, effect, path)
        parameters = _parameters(effect, path, sd, unit_at, by_condition, positions)
        texts.append(", ".join([_name(result, effect), *parameters]) + _mounting(result, effect))
    return "; and ".join(texts)


def _mounting(result: LoopResult, effect: PlacedEffect) -> str:
    """Return that a mounting in series would delay the force of a component alike, where more than noise is left."""
    is_late_force = (effect.kind, effect.at) == ("sensor_delay", "F") and float(effect.parameters["delay"]) > 0.0  # type: ignore[arg-type]
    is_bench = is_late_force and result.nominal.design.form == "bench"
    text = " (or a mounting in series, which these runs do not distinguish)"
    return text if is_bench and _has_remainder(result) else ""


def _parameters(
    effect: PlacedEffect,
    path: str,
    sd: Mapping[str, float],
    at: str,
    by_condition: Mapping[str, str],
    positions: Mapping[str, str],
) -> list[str]:
    """Return the parameters of an effect in the units of a location; the standard deviations are those of its path.

    by_condition: values of those that depend on a condition, by path.
    positions: where a gap ends on the record, by key.
    """
    texts = []
    for p in core.effect_record(effect.kind)["parameters"]:
        key, value = p["key"], effect.parameters.get(p["key"])
        if isinstance(value, float) and p["role"] != "run":
            name = PARAMETER_NAMES.get(key, key.replace("_", " "))
            common = quantity_with_sd(value, sd.get(f"{path}.{key}"), parameter_unit(p, at))
            quantity = by_condition.get(f"{path}.{key}", common)
            texts.append(f"{name} {quantity}{positions.get(key, '')}")
    return texts


def run_dependence_text(result: LoopResult, dependence: RunDependence) -> str:
    """Return a parameter that differs from run to run, with its value on every run."""
    model = result.after.model
    unit = model.design.unit(dependence.path)
    runs_by_value: dict[float, list[str]] = {}
    for run in dependence.runs:
        speed = f" ({format_quantity(run.speed, 'm/s', 3)})" if model.design.is_on_track else ""
        runs_by_value.setdefault(run.value, []).append(f"{run.file}{speed}")
    values = [f"{format_quantity(value, unit)} on {', '.join(runs)}" for value, runs in runs_by_value.items()]
    others = [path for path in dependence.ratios if path != dependence.path]
    proportional = f" ({', '.join(others)} in proportion)" if others else ""
    group, *rest = dependence.path.split(".")
    name = dependence.path
    if group == "effects":
        name = f"{rest[1].replace('_', ' ')} of the {_name(result, model.effects[int(rest[0])])}"
    return f"the vehicle is not the same from run to run, {name}{proportional} would be {' and '.join(values)}"


def _name(result: LoopResult, effect: PlacedEffect) -> str:
    where = location_phrase(effect.at, effect.wheelset, _structure(result))
    return f"{effect_title(effect.kind)} in {where}"


def _structure(result: LoopResult) -> Structure | None:
    return result.nominal.design.structure


def _location(result: LoopResult) -> str:
    discrepancy = result.discrepancy
    if discrepancy is None:
        return "not located"
    if discrepancy.is_located(result.context.settings.verdict):
        coupling = f" (a coupling of {discrepancy.coupling.text})" if discrepancy.coupling else ""
        return f"acting at {location_phrase(discrepancy.at, discrepancy.wheelset, _structure(result))}{coupling}"
    locations = [at for at, _, _ in discrepancy.locations(result.context.settings.verdict)]
    if not locations:
        return "not located"
    joints = " or at ".join(joint_phrases(locations, _structure(result)))
    return f"acting at {joints}, which these signals do not distinguish"


def _model(discrepancy: Discrepancy | None) -> str:
    if discrepancy is not None and discrepancy.drift is not None:
        return f"{discrepancy.drift.path} varying {_course(discrepancy)}"
    return "the identified force curve"
