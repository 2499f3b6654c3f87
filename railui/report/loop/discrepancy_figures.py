"""Figures of a discrepancy outside the catalogue: identified force curve, parameter that differs between runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.arrays import FloatArray
from railui.report.figures.drawing import axis_label, draw_picture
from railui.report.loop.figures import COLOURS
from railui.report.loop.force_evaluation import (
    EvaluationWindow,
    force_word,
    most_active_port,
    total_force,
    total_force_title,
)
from railui.report.loop.force_pictures import (
    FIGURE_SIZE,
    MOTION_LABELS,
    EffectFigure,
    draw_histogram,
    suspension_picture,
)
from railui.report.loop.wording import ROLE_LABELS, joint_phrases, location_text
from railui.report.numbers import display_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from railui.report.figures.drawing import Picture

ERROR_BAR: dict[str, Any] = {"ecolor": "#444444", "elinewidth": 0.9}
ABSCISSA_LABELS = MOTION_LABELS | {"s": "distance s", "t": "time t"}


def discrepancy_figure(evaluation: EvaluationWindow, outside: Mapping[str, Any]) -> EffectFigure:
    """Return the figure of the key `outside` of a report."""
    if outside.get("differs"):
        note = "The residual of the validation runs locates it; no curve is fitted to these runs."
        return EffectFigure(f"difference between runs: {_where(outside)}", (), note, ())
    return _run_dependence(outside) if "runs" in outside else _identified_curve(evaluation, outside)


def _identified_curve(evaluation: EvaluationWindow, outside: Mapping[str, Any]) -> EffectFigure:
    """Draw the identified curve with error bars, and the total force at its location over the motion of the run."""
    parameter, abscissa = outside.get("parameter"), outside["against"]
    rows = [row for row in zip(outside["motion"], outside["force"], outside["sd"], strict=True) if None not in row[:2]]
    x, y, sd = np.array([[row[0], row[1], row[2] or 0.0] for row in rows]).T
    sign = 1.0 if parameter else -1.0
    x_scale, x_unit = display_scale(x, outside["motion_unit"])
    y_scale, y_unit = display_scale(y, outside["force_unit"])
    pictures, motion = _total_force_pictures(evaluation, abscissa)

    def draw(ax: Axes) -> None:
        style: dict[str, Any] = {"color": COLOURS["after"], "lw": 1.2, "marker": "o", "ms": 4, "capsize": 3}
        ax.errorbar(x_scale * x, sign * y_scale * y, yerr=2 * y_scale * sd, **style, **ERROR_BAR)
        if motion is not None:
            draw_histogram(ax, x_scale * motion)
        ax.set_title("the curve alone")
        ax.set_xlabel(axis_label(ABSCISSA_LABELS[abscissa], x_unit))
        ax.set_ylabel(axis_label(parameter or force_word(outside["force_unit"]), y_unit))

    where = _where(outside)
    pictures.append(draw_picture("outside", f"Identified curve, {where}", FIGURE_SIZE, draw))
    note = "Bars: two standard deviations."
    if not parameter:
        note += " Force that resists the motion: the negative of F in the files."
    lines = ("before", "after") if len(pictures) > 1 else ()
    title = f"identified curve of {parameter}" if parameter else "identified force curve"
    return EffectFigure(f"{title}: {where}", tuple(pictures), note, lines)


def _where(outside: Mapping[str, Any]) -> str:
    if outside["at"]:
        return location_text(outside["at"], outside["wheelset"])
    if outside["against"] == "s" and not outside.get("differs"):
        return "along the track"
    return " or ".join(joint_phrases(o["at"] for o in outside.get("locations", ()))) or "not located"


def _total_force_pictures(evaluation: EvaluationWindow, abscissa: str) -> tuple[list[Picture], FloatArray | None]:
    """Draw the total force at the location of the curve against displacement; return it and the motion [n]."""
    effects = evaluation.model.design.effects
    curve = effects[-1] if effects else None
    if curve is None or curve.kind != "measured_force" or abscissa not in ("z", "v"):
        return [], None
    w, z = most_active_port(evaluation, curve.at, curve.wheelset)
    forces, v = total_force(evaluation, curve.at, w, z)
    heading = total_force_title(evaluation, curve.at, w)
    picture = suspension_picture(evaluation, "outside-whole", heading, forces, ("z", z), curve.at)
    return [picture], (z if abscissa == "z" else v)[evaluation.settled]


def _run_dependence(outside: Mapping[str, Any]) -> EffectFigure:
    """Draw a parameter on every run: as calibrated, and as estimated on each validation run."""
    runs = outside["runs"]
    factor, unit = display_scale([run["value"] for run in runs], outside["force_unit"])

    def draw(ax: Axes) -> None:
        for role, colour, marker in (("adjust", COLOURS["before"], "s"), ("validate", COLOURS["after"], "o")):
            numbered = [(i, run) for i, run in enumerate(runs) if run["role"] == role]
            positions = [i for i, _ in numbered]
            values = [factor * run["value"] for _, run in numbered]
            bars = [2 * factor * (run["sd"] or 0.0) for _, run in numbered]
            ax.errorbar(positions, values, yerr=bars, color=colour, fmt=marker, ms=6, capsize=4, **ERROR_BAR)
        is_on_track = outside["against"] == "s"
        speeds = [f", {run['speed']:.3g} m/s" if is_on_track else "" for run in runs]
        labels = [f"{run['file']}\n{ROLE_LABELS[run['role']]}{v}" for run, v in zip(runs, speeds, strict=True)]
        ax.set_xticks(range(len(runs)), labels)
        ax.set_xlim(-0.5, len(runs) - 0.5)
        ax.set_ylabel(axis_label(outside["parameter"], unit))

    where = _where(outside)
    picture = draw_picture("outside", f"{outside['parameter']} on every run", FIGURE_SIZE, draw, bottom=0.5)
    is_apart = len({run["value"] for run in runs if run["role"] == "adjust"}) > 1
    note = (
        "Square: as estimated on that run; round: of the model that holds on that run; bars: two standard deviations. "
        f"With these models the error on the validation runs is {outside['nrmse']:.3f}."
        if is_apart
        else "Square: as calibrated; round: as estimated on that run with all else as calibrated; bars: two standard "
        f"deviations. With these values the error on the validation runs would be {outside['nrmse']:.3f}. It is not "
        "the error of the table above, because no parameter of the reported model is fitted to these runs."
    )
    return EffectFigure(f"parameter that differs from run to run: {where}", (picture,), note, ())
