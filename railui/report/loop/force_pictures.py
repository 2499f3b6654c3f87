"""Pictures of forces against motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.arrays import FloatArray
from railui.report.figures.drawing import Picture, axis_label, draw_picture
from railui.report.loop.figures import COLOURS, LINES, MAX_LINE_POINTS
from railui.report.loop.force_evaluation import EvaluationWindow, explained_variance, force_word
from railui.report.numbers import display_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from railui.report.loop.law_evidence import LawEvidence

Curves = Mapping[str, tuple[FloatArray, FloatArray]]  # before, after -> motion [n], force [n]
MIN_EXPLAINED_VARIANCE = 0.98  # by the motion, from which a force is drawn as a curve and not as a path
FIGURE_SIZE = (4.7, 3.0)  # inch
MAX_DOTS = 1200
BAND: dict[str, Any] = {"color": COLOURS["after"], "alpha": 0.22, "lw": 0}
POINTS: dict[str, Any] = {"fmt": "o", "ms": 3.5, "color": "#222222", "elinewidth": 0.9, "capsize": 2, "zorder": 3}
MOTION_LABELS = {"z": "displacement z", "v": "speed v", "e": "displacement e relative to the rails"}


@dataclass(frozen=True, eq=False)
class EffectFigure:
    """Figure of an effect: heading, pictures, note, and the lines that need a legend."""

    title: str
    pictures: tuple[Picture, ...]
    note: str
    lines: tuple[str, ...] = ("before", "after")


def suspension_picture(
    evaluation: EvaluationWindow,
    name: str,
    title: str,
    forces: Mapping[str, FloatArray],
    motion: tuple[str, FloatArray],
    at: str,
    evidence: LawEvidence | None = None,
) -> Picture:
    """Draw forces [n] against a motion at a location: z or v, with its values [n]."""
    curves = {model: (motion[1], force) for model, force in forces.items()}
    kind = (motion[0], evaluation.unit(motion[0], at))
    return force_picture(evaluation, name, title, curves, kind, evaluation.unit("F", at), evidence)


def force_picture(
    evaluation: EvaluationWindow,
    name: str,
    title: str,
    curves: Curves,
    motion: tuple[str, str],
    unit: str,
    evidence: LawEvidence | None = None,
) -> Picture:
    """Draw force against motion (z, v or e, and its unit): curves where the motion determines the force, else paths.

    evidence: of the final model's force.
    """
    label = MOTION_LABELS[motion[0]]
    settled = evaluation.settled
    is_function = {
        model: explained_variance(x[settled], y[settled]) >= MIN_EXPLAINED_VARIANCE for model, (x, y) in curves.items()
    }
    shown = settled if all(is_function.values()) else evaluation.path
    covered = next(iter(curves.values()))[0][shown]
    x_scale, x_unit = display_scale(covered, motion[1])
    y_scale, y_unit = display_scale([y[shown] for _, y in curves.values()], unit)

    def draw(ax: Axes) -> None:
        for model, (x, y) in curves.items():
            a, b = x[shown], y[shown]
            if is_function[model]:
                order = np.argsort(a)
                order = order[:: max(1, len(order) // MAX_LINE_POINTS)]
                a, b = a[order], b[order]
                if model == "after" and evidence is not None and evidence.half_width is not None:
                    half = evidence.half_width[shown][order]
                    ax.fill_between(x_scale * a, y_scale * (b - half), y_scale * (b + half), **BAND)
            ax.plot(x_scale * a, y_scale * b, **LINES[model] | {"lw": 1.4})
        if evidence is not None and len(evidence.motion):
            points = x_scale * evidence.motion, y_scale * evidence.force, y_scale * evidence.error
            ax.errorbar(points[0], points[1], yerr=points[2], **POINTS)
        draw_histogram(ax, x_scale * covered)
        ax.set_title(title)
        ax.set_xlabel(axis_label(label, x_unit))
        ax.set_ylabel(axis_label(force_word(unit), y_unit))

    return draw_picture(name, f"{title}: {force_word(unit)} against {label}", FIGURE_SIZE, draw)


def gauge_picture(
    evaluation: EvaluationWindow, name: str, title: str, curves: Curves, gauge: FloatArray, unit: str
) -> Picture:
    """Draw a contact force that e alone does not determine: dots coloured by the gauge deviation [n]."""
    (x, y), (_, before) = curves["after"], curves["before"]
    samples = np.arange(len(x))[evaluation.settled]
    samples = samples[:: max(1, len(x) // MAX_DOTS)]
    order = samples[np.argsort(x[samples])]
    x_scale, x_unit = display_scale(x[samples], "m")
    y_scale, y_unit = display_scale(y[samples], unit)
    g_scale, g_unit = display_scale(gauge[samples], "m")

    def draw(ax: Axes) -> None:
        colours = g_scale * gauge[samples]
        dots = ax.scatter(x_scale * x[samples], y_scale * y[samples], s=5, c=colours, cmap="cividis", lw=0)
        ax.plot(x_scale * x[order], y_scale * before[order], **LINES["before"] | {"lw": 1.4})
        ax.figure.colorbar(dots, ax=ax, label=axis_label("gauge deviation", g_unit), pad=0.03)
        draw_histogram(ax, x_scale * x[samples])
        ax.set_title(title)
        ax.set_xlabel(axis_label(MOTION_LABELS["e"], x_unit))
        ax.set_ylabel(axis_label(force_word(unit), y_unit))

    return draw_picture(name, f"{title} against e, coloured by the gauge", FIGURE_SIZE, draw)


def draw_histogram(ax: Axes, x: FloatArray) -> None:
    """Draw the histogram of a motion in grey at the bottom of the axes."""
    counts, edges = np.histogram(x, bins=60)
    heights = 0.18 * counts / max(counts.max(), 1)
    centres = 0.5 * (edges[1:] + edges[:-1])
    ax.fill_between(centres, heights, color="#dddddd", lw=0, zorder=0, transform=ax.get_xaxis_transform())
    ax.text(0.99, 0.01, "histogram", fontsize=7, color="#777777", ha="right", va="bottom", transform=ax.transAxes)
