"""Figure of a linear response: transfer functions and spectral densities of the channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.io.number_format import typeset_unit
from railui.report.figures.drawing import BLUE, GREEN, GREY, ORANGE, axis_label, figure_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: Final = (BLUE, ORANGE, GREEN, GREY)
MAX_ROWS: Final = 12  # rows of the figure
ROW_HEIGHT: Final = 1.9  # inch
SHOWN_RANGE: Final = 1e8  # of a density, from its largest value down


def draw_response(result: Mapping[str, Any], path: str | Path) -> None:
    """Write a figure with one row per quantity: magnitudes against frequency and, with a track, densities."""
    groups = channel_groups(list(result["channels"]))[:MAX_ROWS]
    columns = [*result["irregularities"], *(["psd"] if result["stationary"] else [])]
    size = (0.6 + 3.0 * len(columns), ROW_HEIGHT * len(groups) + 0.5)
    with figure_file(path, *size) as figure:
        axes = figure.subplots(len(groups), len(columns), sharex=True, squeeze=False)
        for row, names in zip(axes, groups, strict=True):
            for ax, column in zip(row, columns, strict=True):
                draw_channels(ax, result, names, column)
        for ax in axes[-1]:
            ax.set_xlabel("frequency [Hz]")
        figure.align_ylabels()


def channel_groups(names: Sequence[str]) -> list[list[str]]:
    """Return channels by quantity, those of all wheelsets together.

    >>> channel_groups(["e1", "ayf", "e2", "floor.middle", "floor.front"])
    [['e1', 'e2'], ['ayf'], ['floor.middle', 'floor.front']]
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(name.partition(".")[0].rstrip("0123456789"), []).append(name)
    return list(groups.values())


def draw_channels(ax: Axes, result: Mapping[str, Any], names: Sequence[str], column: str) -> None:
    """Draw magnitudes from an irregularity, or densities, of channels of one quantity."""
    unit = result["channels"][names[0]]["unit"]
    largest = 0.0
    for i, name in enumerate(names):
        if column == "psd":
            one, label = result["stationary"][name]["psd"], f"{name}: {result['stationary'][name]['rms']:.3g}"
        else:
            one, label = result["transfer"][name][column]["magnitude"], name
        values = np.asarray(one)
        if np.any(values > 0):
            drawn = np.where(values > 0, values, np.nan)
            ax.plot(result["frequencies"], drawn, color=COLOURS[i % len(COLOURS)], lw=1.0, label=label)
            largest = max(largest, float(values.max()))
    if column == "psd":
        quantity, shown = "PSD", f"{unit}^2/Hz" if unit.isalpha() else f"({unit})^2/Hz"
    else:
        quantity, shown = f"from {column}", result["transfer"][names[0]][column]["unit"]
    _logarithmic(ax, largest)
    ax.set_ylabel(axis_label(quantity, typeset_unit(shown)), fontsize=8)
    if largest:
        title = f"rms [{typeset_unit(unit)}]" if column == "psd" else None
        ax.legend(frameon=False, fontsize=7, title=title, title_fontsize=7, loc="best")


def _logarithmic(ax: Axes, largest: float) -> None:
    """Set logarithmic axes with ticks at decades only, which take a fraction of the time of all."""
    from matplotlib.ticker import NullLocator

    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_locator(NullLocator())
    if largest:
        ax.set_ylim(bottom=max(ax.get_ylim()[0], largest / SHOWN_RANGE))
