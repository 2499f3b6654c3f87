"""Figures of stability and curving: root locus, bifurcation diagram, curves against radius."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.report.figures.drawing import BLUE, GREEN, GREY, ORANGE, stacked_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ABOVE: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}


def draw_stability(result: Mapping[str, Any], path: str | Path) -> None:
    """Write a figure of damping and frequency against speed and, where computed, the bifurcation diagram."""
    rows = 3 if result["fold"] and result["fold"]["diagram"] else 2
    with stacked_axes(path, rows, 2.3) as axes:
        draw_damping(axes[0], result)
        draw_frequencies(axes[1], result)
        if rows == 3:
            draw_bifurcation(axes[2], result)
        for ax in axes:
            draw_critical_speeds(ax, result)
        if axes[0].get_legend_handles_labels()[0]:
            axes[0].legend(frameon=False, fontsize=8, ncols=3, **ABOVE)
        axes[-1].set_xlabel("speed [m/s]")


def _oscillations(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the oscillations below 30 Hz."""
    return [m for m in result["modes"] if m["imag"] > 0 and m["damping"] < 0.9 and m["frequency"] < 30]


def draw_damping(ax: Axes, result: Mapping[str, Any]) -> None:
    """Draw the damping ratios of the oscillations below 30 Hz against speed."""
    modes = _oscillations(result)
    ax.scatter([m["speed"] for m in modes], [m["damping"] for m in modes], s=9, c=BLUE, lw=0)
    ax.axhline(0.0, color="#444444", lw=0.7)
    ax.set_ylabel("damping ratio")


def draw_frequencies(ax: Axes, result: Mapping[str, Any]) -> None:
    """Draw the frequencies of the oscillations below 30 Hz against speed, and that of a free wheelset (Klingel)."""
    modes = _oscillations(result)
    ax.scatter([m["speed"] for m in modes], [m["frequency"] for m in modes], s=9, c=BLUE, lw=0)
    if result["klingel_wavelength"]:
        v = np.array([min(result["speeds"]), max(result["speeds"])])
        ax.plot(v, v / result["klingel_wavelength"], color=GREY, lw=0.8, ls=(0, (1, 2)))
        ax.annotate(
            "Klingel", (v[1], v[1] / result["klingel_wavelength"]), fontsize=8, color=GREY, ha="right", va="bottom"
        )
    ax.set_ylabel("frequency [Hz]")


def draw_bifurcation(ax: Axes, result: Mapping[str, Any]) -> None:
    """Draw the amplitudes of limit cycles against speed."""
    fold = result["fold"]
    rows = fold["diagram"]

    def line(key: str) -> tuple[list[float], list[float]]:
        points = [(r["speed"], 1e3 * r[key]) for r in rows if r.get(key) is not None]
        return [v for v, _ in points], [a for _, a in points]

    ax.plot(*line("from_below"), color=BLUE, marker="^", ms=4.5, lw=0, label="from a small initial offset")
    ax.plot(*line("from_above"), color=ORANGE, marker="v", ms=3.5, lw=1.2, label="limit cycle, speed decreasing")
    label: str | None = "unstable limit cycle"
    for first, second in pairwise(fold["branch"]):
        is_unstable = max(first["multiplier"], second["multiplier"]) > 1
        dash: Any = (0, (3, 2)) if is_unstable else "-"
        ends = [first["speed"], second["speed"]], [1e3 * first["amplitude"], 1e3 * second["amplitude"]]
        ax.plot(*ends, color=GREY, ls=dash, lw=1.1, label=label if is_unstable else None, zorder=1)
        label = None if is_unstable else label
    ax.axhline(1e3 * fold["clearance"], color="#bbbbbb", lw=0.8, ls=(0, (1, 2)))
    ax.annotate(
        "flange clearance",
        (0.01, 1e3 * fold["clearance"]),
        xycoords=("axes fraction", "data"),
        fontsize=8,
        color=GREY,
        va="bottom",
    )
    ax.set_ylim(bottom=0.0)
    ax.set_ylabel("amplitude of e [mm]")
    ax.legend(frameon=False, fontsize=8, ncols=3, **ABOVE)


def draw_critical_speeds(ax: Axes, result: Mapping[str, Any]) -> None:
    """Draw the critical speeds as vertical lines."""
    named = (
        ("linear", "linear_critical_speed", BLUE),
        ("nonlinear", "fold_speed", ORANGE),
        ("ride criteria", "practical_critical_speed", GREEN),
    )
    for name, key, colour in named:
        if result[key]:
            ax.axvline(result[key], color=colour, lw=0.9, ls=(0, (4, 2)), label=f"{name} {result[key]:.2f} m/s")


# panels of curves: key of a case, factor from SI, label
CURVE_PANELS: Final = (
    ("displacement", 1e3, "e [mm]"),
    ("angle_of_attack", 1e3, "angle of attack [mrad]"),
    ("guiding_force", 1e-3, "force of the rails [kN]"),
    ("wear_number", 1.0, "wear number [N]"),
)


def draw_curves(cases: Sequence[Mapping[str, Any]], path: str | Path) -> None:
    """Write a figure of displacement, angle of attack, force of the rails and wear number against radius."""
    with stacked_axes(path, len(CURVE_PANELS), 1.7) as axes:
        for ax, (key, _, _) in zip(axes, CURVE_PANELS, strict=True):
            draw_curve_panel(ax, cases, key)
        axes[-1].set_xlabel("radius [m]")
        if axes[0].get_legend_handles_labels()[0]:
            axes[0].legend(frameon=False, fontsize=8, ncols=4, **ABOVE)


def draw_curve_panel(ax: Axes, cases: Sequence[Mapping[str, Any]], key: str) -> None:
    """Draw a result of curves against radius, a line for each wheelset; the wear number is that of the vehicle."""
    factor, label = next((factor, label) for name, factor, label in CURVE_PANELS if name == key)
    drawn = [case for case in cases if case["displacement"] is not None]
    radii = np.array([abs(case["radius"]) for case in drawn])
    ax.set_ylabel(label)
    if not drawn:
        ax.annotate("no equilibrium", (0.5, 0.5), xycoords="axes fraction", ha="center", va="center", color=GREY)
        return
    if key == "wear_number":
        ax.plot(radii, [case[key] for case in drawn], color=BLUE, lw=1.2)
        ax.set_ylim(0.0, 1.05 * ax.dataLim.y1)
        return
    for i, values in enumerate(np.array([case[key] for case in drawn]).reshape(len(drawn), -1).T):
        dash: Any = ("-", (0, (4, 2)), (0, (1, 1)), "-.")[i % 4]
        colour = (BLUE, ORANGE, GREEN, GREY)[i % 4]
        ax.plot(radii, factor * values, lw=1.2, label=f"wheelset {i + 1}", color=colour, ls=dash)
    ax.axhline(0.0, color="#444444", lw=0.7)
