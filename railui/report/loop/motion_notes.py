"""Notes of the loop report on the motion: not reached by the estimation runs, sensitive, as slow as a law saturates."""

from __future__ import annotations

import numpy as np

from railui import core
from railui.identification.estimation.modulating_functions import TERMS
from railui.identification.result import LoopResult
from railui.report.loop.catalogued_effects import catalogued_effects
from railui.report.loop.force_evaluation import ports_at
from railui.report.loop.sentence import format_share
from railui.report.loop.wording import effect_title, location_phrase, unit_location
from railui.report.numbers import quantity_with_sd
from railui.vehicle.effects import PlacedEffect, parameter_unit

DISPLACEMENTS = ("e1", "e2", "d1", "d2", "z")


def unreached_motion_notes(result: LoopResult) -> list[str]:
    """Return a note where the validation runs move beyond the motion of the estimation runs and something is left."""
    if result.verdict not in ("outside", "partial"):
        return []
    notes, ratio = [], result.context.settings.notes.unreached_motion_ratio
    for channel in sorted({c for s in result.dataset.selection for c in s.channels if c in DISPLACEMENTS}):
        adjusted, validated = (
            max((float(np.ptp(s.columns[channel])) / 2 for s in segments if channel in s.columns), default=0.0)
            for segments in (result.dataset.estimation, result.dataset.selection)
        )
        if 0.0 < ratio * adjusted < validated:
            notes.append(
                f"{channel} moves by {1e3 * validated:.3g} mm on the validation runs, by {1e3 * adjusted:.3g} mm at "
                "most on the estimation runs: a law that acts only beyond is not estimated; give a run that reaches it "
                "the role adjust"
            )
    return notes


def sensitive_motion_notes(result: LoopResult) -> list[str]:
    """Return a note where the equation of motion of a rig holds with a law, but no simulation follows its motion."""
    found = result.sensitive_motion
    if found is None:
        return []
    effect = found.effect
    numbers = ", ".join(
        f"{p['key'].replace('_', ' ')} about {effect.parameters[p['key']]:.3g}"
        for p in core.effect_record(effect.kind)["parameters"]
        if p["key"] in effect.parameters
    )
    rig = ", ".join(
        f"{path.rpartition('.')[2]} {found.model.value(path):.3g}"
        for path in result.dataset.campaign.estimated_parameters
        if path.rpartition(".")[2] in TERMS
    )
    where = location_phrase(effect.at, effect.wheelset, result.nominal.design.structure)
    return [
        f"the motion is sensitive to its start: with {effect_title(effect.kind)} in {where} ({numbers}; {rig}) the "
        f"equation of motion leaves {format_share(found.share)} of the squared error without it, and simulations over "
        f"{found.seconds:.2g} s an NRMSE of {found.window_nrmse:.2g}, but over whole runs two simulations part from a "
        f"small difference by a factor of {found.growth:.1g}, so that their errors decide on no law. These are start "
        "values, not estimates with a spread: record runs with a smaller drive, where the motion is not sensitive"
    ]


def gradual_slip_notes(result: LoopResult) -> list[str]:
    """Return a note on every added effect whose force saturates at a speed near that of the motion there."""
    ratio, notes = result.context.settings.notes.gradual_slip_ratio, []
    for _, _, effect in catalogued_effects(result):
        for parameter in core.effect_record(effect.kind)["parameters"]:
            if parameter["unit"] == "v":
                speed, rms = float(effect.parameters[parameter["key"]]), _rms_speed(result, effect)  # type: ignore[arg-type]
                if speed > ratio * rms > 0.0:
                    unit = parameter_unit(parameter, unit_location(result, effect.at))
                    where = location_phrase(effect.at, effect.wheelset, result.nominal.design.structure)
                    name = f"{parameter['key'].replace('_', ' ')} of {quantity_with_sd(speed, None, unit)}"
                    notes.append(_gradual_slip_text(effect_title(effect.kind), where, name, speed / rms))
    return notes


def _gradual_slip_text(title: str, where: str, speed: str, ratio: float) -> str:
    return (
        f"{title} in {where}: the {speed} is {100.0 * ratio:.0f} % of the rms speed there. A damper whose force "
        "saturates, as with a blow-off valve, has the same law; between sliding surfaces the force changes its sign at "
        "once"
    )


def _rms_speed(result: LoopResult, effect: PlacedEffect) -> float:
    """Rms speed at the ports of an effect over the estimation runs; zero where the final model diverges."""
    model = result.after.model
    names = [f"v.{effect.at}.{w}" for w in ports_at(model, effect.at, effect.wheelset)]
    series = [target.motion_predictor(model).simulate(names) for target in result.after.segments] if names else []
    squares = [np.mean(s.series[0] ** 2) for s in series if s.diverged[0] < 0]
    return float(np.sqrt(np.mean(squares))) if squares else 0.0
