"""Figure of a map of responses over two parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.io.number_format import typeset_unit
from railui.optimisation.response_keys import MAX_SPEED
from railui.report.figures.drawing import axis_label, figure_file
from railui.report.numbers import readable_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_SIZE: Final = (5.6, 4.2)  # inch
CONTOURS: Final = 8
MIN_CONTOUR_VALUES: Final = 3  # of an axis


def draw_map(document: Mapping[str, Any], path: str | Path) -> None:
    """Write a figure with one panel per key (svg, png, pdf): colours, contours, and the design as a star."""
    keys = list(document["of"])
    with figure_file(path, PANEL_SIZE[0], PANEL_SIZE[1] * len(keys)) as figure:
        axes = figure.subplots(len(keys), 1, squeeze=False)[:, 0]
        for ax, key in zip(axes, keys, strict=True):
            draw_map_panel(ax, document, key)


def draw_map_panel(ax: Axes, document: Mapping[str, Any], key: str) -> None:
    """Draw one result over both parameters, with its colour bar."""
    one = document["of"][key]
    values = np.array([[np.nan if v is None else v for v in row] for row in one["values"]], dtype=float)
    factor, unit = readable_scale(values[np.isfinite(values)], one["unit"])
    scaled = factor * values
    scales = [readable_scale(document[name]["values"], document[name]["unit"]) for name in "xy"]
    x, y = (s * np.asarray(document[name]["values"]) for name, (s, _) in zip("xy", scales, strict=True))
    ax.set_facecolor("#cccccc")  # where a vehicle has no value
    ax.grid(visible=False)
    mesh = ax.pcolormesh(x, y, np.ma.masked_invalid(scaled), cmap="viridis", shading="nearest", rasterized=True)
    finite = scaled[np.isfinite(scaled)]
    if min(scaled.shape) >= MIN_CONTOUR_VALUES and finite.size and np.ptp(finite) > 0:
        lines = ax.contour(x, y, np.ma.masked_invalid(scaled), CONTOURS, colors="white", linewidths=0.7)
        ax.clabel(lines, fontsize=7)
    own = [document[name]["baseline"] for name in "xy"]
    if None not in own and _inside(own[0], document["x"]) and _inside(own[1], document["y"]):
        at = (scales[0][0] * own[0], scales[1][0] * own[1])
        ax.plot(*at, "*", color="black", ms=11, mec="white", mew=0.7, label="design", clip_on=False)
        ax.legend(frameon=True, fontsize=8, loc="best")
    label = axis_label(key.replace("_", " "), "" if unit == "1" else typeset_unit(unit))
    ax.figure.colorbar(mesh, ax=ax, label=label)
    labels = [
        axis_label(document[name]["name"], "" if shown == "1" else typeset_unit(shown))
        for name, (_, shown) in zip("xy", scales, strict=True)
    ]
    ax.set_xlabel(labels[0])
    ax.set_ylabel(labels[1])
    # "nearest" draws whole cells, half of which lie beyond the first and the last value
    for limits, ends in ((ax.set_xlim, x), (ax.set_ylim, y)):
        if ends[-1] > ends[0]:
            limits(ends[0], ends[-1])
    if not np.isfinite(values).all():
        ax.set_title(f"grey: {missing_text(document, key)}", fontsize=8)


def missing_text(document: Mapping[str, Any], key: str) -> str:
    """Return in words why vehicles of a map have no value of a key."""
    one = document["of"][key]
    missing = sum(value is None or not np.isfinite(value) for row in one["values"] for value in row)
    if not one.get("beyond"):
        return "no value"
    return f"none up to {MAX_SPEED:g} m/s" + (", or no value" if missing > one["beyond"] else "")


def _inside(value: float, axis: Mapping[str, Any]) -> bool:
    return bool(axis["values"][0] <= value <= axis["values"][-1])
