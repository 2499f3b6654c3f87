"""Figures of the identified effects: force against the motion of the validation run, calibrated and with the effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.identification.component_force import elements_at_port, restoring_force
from railui.identification.result import LoopResult
from railui.report.figures.drawing import Picture, axis_label, draw_picture
from railui.report.loop.catalogued_effects import catalogued_effects
from railui.report.loop.discrepancy_figures import discrepancy_figure
from railui.report.loop.figures import LINES, Window
from railui.report.loop.force_evaluation import (
    EvaluationWindow,
    explained_variance,
    force_word,
    forces_on_fixed_wheelsets,
    gauge_at_wheelset,
    most_active_port,
    rms,
    total_force,
    total_force_title,
)
from railui.report.loop.force_pictures import (
    FIGURE_SIZE,
    MIN_EXPLAINED_VARIANCE,
    Curves,
    EffectFigure,
    force_picture,
    gauge_picture,
    suspension_picture,
)
from railui.report.loop.law_evidence import LawEvidence, effect_force, law_evidence
from railui.report.loop.wording import VERDICT_LABELS, effect_title, location_text
from railui.report.numbers import display_scale
from railui.vehicle.effects import PlacedEffect, unit_at
from railui.vehicle.model import Model
from railui.vehicle.track_geometry import track_geometry

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MIN_RELATIVE_CHANGE = 0.5  # of the largest relative change of a contact force, from which a force is drawn
MIN_RELATIVE_DIFFERENCE = 0.01  # from which the force of the effect is drawn next to the total force
TURNS = 4  # of the wheelset, drawn of a force against distance


class SuspensionForces(NamedTuple):
    """Forces [n] at the most active port of an effect over the motion of a run.

    total: before and after. own: of the effect alone. main_motion: "z" or "v", and the series that explains own better.
    """

    port: int
    z: FloatArray
    total: Mapping[str, FloatArray]
    own: FloatArray
    main_motion: tuple[str, FloatArray]
    is_only_element: bool
    evidence: LawEvidence


class EffectForces(NamedTuple):
    """Evaluation of the final model, and the forces of effects at suspensions by number, or why there are none."""

    evaluation: EvaluationWindow
    at_suspensions: Mapping[int, SuspensionForces | ValueError]


def compute_effect_forces(result: LoopResult, window: Window) -> EffectForces:
    """Compute the forces that the figures of effects show, which takes longer than to draw them."""
    evaluation = EvaluationWindow.of(result, result.after.model, window)
    forces: dict[int, SuspensionForces | ValueError] = {}
    for i, (_, _, effect) in enumerate(catalogued_effects(result)):
        record = core.effect_record(effect.kind)
        if record["acts"] != "sensor" and "rig" in record["at"]:
            try:
                forces[i] = _suspension_forces(evaluation, effect)
            except ValueError as error:  # too stiff to be integrated, or diverged
                forces[i] = error
    return EffectForces(evaluation, forces)


def _suspension_forces(evaluation: EvaluationWindow, effect: PlacedEffect) -> SuspensionForces:
    at, (w, z) = effect.at, most_active_port(evaluation, effect.at, effect.wheelset)
    settled = evaluation.settled
    total, v = total_force(evaluation, at, w, z)
    index = evaluation.model.design.effects.index(effect)
    own = effect_force(evaluation.model, index, w, z, v, evaluation.segment.dt)
    by_speed, by_displacement = (explained_variance(x[settled], own[settled]) for x in (v, z))
    main_motion = ("v", v) if by_speed > by_displacement else ("z", z)
    is_only_element = bool(np.std(own - total["after"]) < MIN_RELATIVE_DIFFERENCE * np.std(own))
    rest = total["after"] - own if is_only_element else np.zeros_like(own)
    evidence = law_evidence(evaluation, index, w, z, v, main_motion[0], rest)
    return SuspensionForces(w, z, total, own, main_motion, is_only_element, evidence)


def effect_figures(
    result: LoopResult, report: Mapping[str, Any], window: Window, forces: EffectForces
) -> list[EffectFigure]:
    """Draw the figure of a discrepancy outside the catalogue, then one for every effect of the model."""
    figures = []
    if result.discrepancy is not None:
        figures.append(_discrepancy_figure(result, result.discrepancy.fit.model, report["outside"], window))
    for i, (_, _, effect) in enumerate(catalogued_effects(result)):
        figures.append(_effect_figure(forces, effect, i))
    return figures


def _discrepancy_figure(result: LoopResult, model: Model, outside: Mapping[str, Any], window: Window) -> EffectFigure:
    try:
        return discrepancy_figure(EvaluationWindow.of(result, model, window), outside)
    except ValueError as error:  # too stiff to be integrated, or diverged
        return EffectFigure(VERDICT_LABELS["outside"], (), f"Not drawn: {error}.", ())


def _effect_figure(forces: EffectForces, effect: PlacedEffect, number: int) -> EffectFigure:
    evaluation, at_suspension = forces.evaluation, forces.at_suspensions.get(number)
    record, name = core.effect_record(effect.kind), f"law-{number}"
    structure = evaluation.model.design.structure
    title = f"{effect_title(effect.kind)}: {location_text(effect.at, effect.wheelset, structure)}"
    draw: Callable[[EvaluationWindow, PlacedEffect, str, str], EffectFigure] = _external_force
    if record["acts"] == "sensor":
        draw = _sensor
    elif record["acts"] == "body":
        draw = _carbody
    elif effect.at in ("contact", "track"):
        draw = _contact
    try:
        if isinstance(at_suspension, ValueError):
            raise at_suspension
        if at_suspension is not None:
            return _suspension(evaluation, effect, at_suspension, name, title)
        return draw(evaluation, effect, name, title)
    except ValueError as error:  # too stiff to be integrated, or diverged
        return EffectFigure(title, (), f"Not drawn: {error}.", ())


def _suspension(
    evaluation: EvaluationWindow, effect: PlacedEffect, forces: SuspensionForces, name: str, title: str
) -> EffectFigure:
    """Draw the total force at the location against displacement, and that of the effect against its main motion."""
    at, total, motion, evidence = effect.at, forces.total, forces.main_motion, forces.evidence
    heading = total_force_title(evaluation, at, forces.port)
    note = f"Force that resists the motion, over the motion of the validation run. {_evidence_note(evidence)}".strip()
    if forces.is_only_element:
        picture = suspension_picture(evaluation, f"{name}-whole", heading, total, motion, at, evidence)
        return EffectFigure(title, (picture,), note)
    whole = suspension_picture(evaluation, f"{name}-whole", heading, total, ("z", forces.z), at)
    own = {"after": forces.own}
    single = suspension_picture(evaluation, f"{name}-own", "the effect alone", own, motion, at, evidence)
    return EffectFigure(title, (whole, single), note)


def _evidence_note(evidence: LawEvidence) -> str:
    """Return the legend of the band and of the points."""
    band = "" if evidence.half_width is None else "Blue area: 95 % band of the law, from the covariance. "
    if not len(evidence.motion):
        return f"{band}No nonparametric estimate: the runs do not determine a free force curve here."
    return (
        f"{band}Dots: nonparametric estimate, a free force curve fitted to the estimation runs in place of the effect, "
        "with 95 % intervals; all other parameters as identified."
    )


def _contact(evaluation: EvaluationWindow, effect: PlacedEffect, name: str, title: str) -> EffectFigure:
    """Draw lateral force and yaw moment of the contact on a fixed wheelset against e."""
    w, model = effect.wheelset or 1, evaluation.model
    e = evaluation.motion([f"e{w}"])[0]
    others = Model(model.design.with_effects(x for x in model.design.effects if x is not effect))
    after, before, without = (
        forces_on_fixed_wheelsets(evaluation, m, True) for m in (model, evaluation.before, others)
    )
    change = {key: rms(after[key] - without[key]) / rms(without[key]) for key in (f"Y{w}", f"M{w}")}
    gauge, is_colored = gauge_at_wheelset(evaluation, w), False
    pictures: list[Picture] = []
    for key, unit, force in ((f"Y{w}", "N", "lateral force"), (f"M{w}", "N*m", "yaw moment")):
        if change[key] < MIN_RELATIVE_CHANGE * max(change.values()):
            continue
        curves = {"before": (e, before[key]), "after": (e, after[key])}
        heading = f"{force} of the rails on wheelset {w}"
        is_colored = gauge is not None and _needs_gauge(evaluation, curves)
        if is_colored and gauge is not None:
            pictures.append(gauge_picture(evaluation, f"{name}-{key}", heading, curves, gauge, unit))
        else:
            pictures.append(force_picture(evaluation, f"{name}-{key}", heading, curves, ("e", "m"), unit))
    note = "The rails are moved under a fixed wheelset by the relative motion of the run."
    if is_colored:
        note += " Dots: with the effect, coloured by the gauge deviation."
        return EffectFigure(title, tuple(pictures), note, ("before",))
    return EffectFigure(title, tuple(pictures), note)


def _needs_gauge(evaluation: EvaluationWindow, curves: Curves) -> bool:
    """Return True if the displacement explains the force of the calibrated model but not that with the effect."""
    settled = evaluation.settled
    is_function = {
        model: explained_variance(x[settled], f[settled]) >= MIN_EXPLAINED_VARIANCE for model, (x, f) in curves.items()
    }
    return is_function["before"] and not is_function["after"]


def _external_force(evaluation: EvaluationWindow, effect: PlacedEffect, name: str, title: str) -> EffectFigure:
    """Draw a force that depends on distance alone, on a fixed wheelset."""
    w, key, unit = effect.wheelset or 1, "M" if effect.at.endswith("_yaw") else "Y", unit_at("F", effect.at)
    word = force_word(unit)
    if not effect.at.startswith("wheelset"):
        return EffectFigure(title, (), "A constant: there is no curve to draw.", ())
    model = Model(evaluation.model.design.with_effects([effect]))
    force = forces_on_fixed_wheelsets(evaluation, model, False)[f"{key}{w}"]
    s = evaluation.segment.columns["s"][evaluation.piece]
    radius = track_geometry(evaluation.model.design).rolling_radius
    shown = s <= s[0] + TURNS * 2 * np.pi * radius
    factor, printed_unit = display_scale(force, unit)

    def draw(ax: Axes) -> None:
        ax.plot(s[shown], factor * force[evaluation.piece][shown], **LINES["after"] | {"lw": 1.4})
        ax.margins(x=0)
        ax.set_title(f"{word} on wheelset {w}")
        ax.set_xlabel("distance [m]")
        ax.set_ylabel(axis_label(word, printed_unit))

    picture = draw_picture(name, f"{title}: {word} against distance", FIGURE_SIZE, draw)
    return EffectFigure(title, (picture,), "Four turns of the wheelset.", ("after",))


def _carbody(evaluation: EvaluationWindow, effect: PlacedEffect, name: str, title: str) -> EffectFigure:
    """Draw the force between frame and carbody against the frame's motion, from the balance of the frame."""
    model = evaluation.model
    y, a = evaluation.motion(["z.frame.0", "ayf"])
    mass, dt = model.design.values["vehicle.frame.mass"], evaluation.segment.dt
    primary = np.zeros_like(y)
    for w, z in zip((1, 2), evaluation.motion(["z.primary_lateral.1", "z.primary_lateral.2"]), strict=True):
        primary = primary + restoring_force(z, dt, *elements_at_port(model, "primary_lateral", w))[0]
    before, _ = restoring_force(y, dt, *elements_at_port(evaluation.before, "secondary_lateral", 0))
    forces = {"before": before, "after": primary - mass * a}
    heading = "force between frame and carbody"
    picture = suspension_picture(evaluation, name, heading, forces, ("z", y), "secondary_lateral")
    note = "Force that resists the motion of the frame; the carbody moves with it."
    return EffectFigure(title, (picture,), note)


def _sensor(evaluation: EvaluationWindow, effect: PlacedEffect, name: str, title: str) -> EffectFigure:
    """Draw the signal of a sensor against the motion of the vehicle."""
    channel, segment, piece = effect.at, evaluation.segment, evaluation.piece
    true = evaluation.motion([channel], Model(evaluation.model.design))[0][piece]
    simulated = evaluation.motion([channel])[0][piece]
    measured = segment.columns[channel][piece]
    factor, unit = display_scale(measured, evaluation.units[channel])

    def draw(ax: Axes) -> None:
        ax.plot(factor * true, factor * measured, **LINES["measured"] | {"lw": 1.4})
        ax.plot(factor * true, factor * true, **LINES["before"])
        ax.plot(factor * true, factor * simulated, **LINES["after"])
        ax.set_xlabel(axis_label(f"{channel} of the vehicle", unit))
        ax.set_ylabel(axis_label(f"{channel} of the sensor", unit))

    picture = draw_picture(name, f"{title}: sensor signal against the motion of the vehicle", FIGURE_SIZE, draw)
    return EffectFigure(title, (picture,), "Grey: measured; dashed: ideal sensor; blue: sensor as identified.", ())
