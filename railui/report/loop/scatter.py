"""Simulated against measured values of every channel on the validation runs, before and after the effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.identification.result import LoopResult
from railui.report.figures.drawing import Drawing, axis_label, draw_pictures
from railui.report.loop.figures import COLOURS, Window, compared_series, units_of
from railui.report.loop.wording import MODEL_LABELS
from railui.report.numbers import display_scale, format_number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_POINTS: Final = 500  # of a model in a picture
MARGIN: Final = 1.05  # of the axes beyond the largest value
SIZE: Final = (2.4, 2.16)  # inch, with square axes inside the margins
MARKERS: Final[Mapping[str, Mapping[str, Any]]] = {
    "before": {"marker": "+", "ms": 4.0, "mew": 0.8, "color": COLOURS["before"]},
    "after": {"marker": "o", "ms": 2.2, "mew": 0.0, "color": COLOURS["after"]},
}


@dataclass(frozen=True, eq=False)
class ChannelPairs:
    """Pairs of a channel over the validation runs: measured [n], and simulated [n] by model."""

    name: str
    measured: FloatArray
    simulated: Mapping[str, FloatArray]

    def slope(self, model: str) -> float:
        """Return the slope of measured over simulated values, 1 of a correct model; NaN without motion."""
        x = self.simulated[model]
        power = float(x @ x)
        return float(x @ self.measured) / power if power > 0.0 else float("nan")


def channel_pairs(result: LoopResult, channels: Sequence[str]) -> list[ChannelPairs]:
    """Return the pairs of channels in the comparison band; a model that diverged on a run has none of that run."""
    segments = result.dataset.validation
    series = [compared_series(result, i) for i in range(len(segments))]
    models = [model for model in MARKERS if all(model in one for one in series)]
    pairs = []
    for name in channels:
        rows = [(one, s.channels.index(name)) for one, s in zip(series, segments, strict=True) if name in s.channels]
        values = {key: np.concatenate([one[key][row] for one, row in rows]) for key in ("measured", *models)}
        pairs.append(ChannelPairs(name, values.pop("measured"), values))
    return pairs


def scatter_rows(result: LoopResult, window: Window, channels: Sequence[str]) -> list[dict[str, Any]]:
    """Return name, picture and slopes of every channel; none where no model could be simulated."""
    pairs = [one for one in channel_pairs(result, channels) if one.simulated]
    units = units_of(result, window.segment)
    pictures = draw_pictures((_drawing(one, units[one.name]) for one in pairs), SIZE, 0.08)
    return [
        {"name": one.name, "picture": picture, "slopes": _slope_text(one)}
        for one, picture in zip(pairs, pictures, strict=True)
    ]


def _slope_text(pairs: ChannelPairs) -> str:
    return ", ".join(f"{format_number(pairs.slope(model))} {MODEL_LABELS[model]}" for model in pairs.simulated)


def _drawing(pairs: ChannelPairs, unit: str) -> tuple[str, str, Any]:
    factor, shown_unit = display_scale(pairs.measured, unit)
    step = max(1, len(pairs.measured) // MAX_POINTS)
    largest = MARGIN * factor * max(float(np.abs(x).max()) for x in (pairs.measured, *pairs.simulated.values()))

    def draw(ax: Axes) -> None:
        for model, x in pairs.simulated.items():
            ax.plot(factor * x[::step], factor * pairs.measured[::step], ls="none", **MARKERS[model])
        ax.plot([-largest, largest], [-largest, largest], color="#444444", lw=0.7)
        ax.set_xlim(-largest, largest)
        ax.set_ylim(-largest, largest)
        ax.set_xlabel(axis_label("simulated", shown_unit))
        ax.set_ylabel(axis_label("measured", shown_unit))

    drawing: Drawing = (f"scatter-{pairs.name}", f"{pairs.name}: measured against simulated values", draw)
    return drawing
