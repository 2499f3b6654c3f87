"""Ride quality against speed with the range over random track seeds, and its plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.desk.presenters.critical_speeds import critical_key, critical_lines
from railui.desk.presenters.design_results import DesignResults
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import Band, LimitLine, Line, PlotData

BAND_SPEEDS: Final = np.arange(20.0, 86.0, 5.0)  # m/s
SEED_COUNT: Final = 5
QUANTITIES: Final = {
    "weighted_acceleration": Axis("weighted acceleration", "m/s²"),
    "score": Axis("score"),
    "flange_margin": Axis("flange margin", "sd"),
    "safety_share": Axis("share of safety limit"),
}
PLOT_TITLES: Final = {
    "weighted_acceleration": "Weighted acceleration",
    "score": "Score",
    "flange_margin": "Flange margin",
    "safety_share": "Share of the safety limit",
}
LIMITS: Final[Mapping[str, Sequence[LimitLine]]] = {"safety_share": [LimitLine(1.0, "limit")]}


@dataclass
class SpeedBand:
    """Rides of one design over speeds, track seed by track seed.

    values: [seed, speed] by quantity, NaN where a ride diverges or gives no value; is_complete: all seeds are there.
    """

    speeds: FloatArray
    values: dict[str, list[FloatArray]] = field(default_factory=lambda: {key: [] for key in QUANTITIES})
    is_complete: bool = False

    @property
    def count(self) -> int:
        """Number of seeds so far."""
        return len(next(iter(self.values.values())))

    def add(self, rides: Sequence[Mapping[str, Any]]) -> None:
        """Add the rides of a seed, one per speed."""
        for key, rows in self.values.items():
            rows.append(np.array([np.nan if ride[key] is None else float(ride[key]) for ride in rides]))

    def statistics(self, key: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return mean, lowest and highest value [speed] of a quantity; NaN where any seed has none."""
        rows = np.array(self.values[key])
        return np.mean(rows, axis=0), np.min(rows, axis=0), np.max(rows, axis=0)


def band_plot(
    key: str,
    current: SpeedBand | None,
    base: SpeedBand | None,
    known: Mapping[str, Mapping[str, Any]],
    speed: float,
) -> PlotData:
    """Plot a quantity against speed: mean and range over the seeds, of the base and of the design."""
    lines, bands = [], []
    for band, name in ((base, "base"), (current, "current")):
        if band is None or not band.count:
            continue
        mean, low, high = band.statistics(key)
        if band.count > 1:
            bands.append(Band(band.speeds, low, high, f"{band.count} seeds" if name == "current" else "", name))
        lines.append(Line(band.speeds, mean, name, name))
    limits = [*LIMITS.get(key, ()), *critical_lines(known), LimitLine(speed, f"V {speed:.4g}", True)]
    return PlotData(Axis("V", "m/s"), QUANTITIES[key], lines, limits, placeholder="simulating", bands=bands)


def band_text(key: str, band: SpeedBand, speed: float) -> str:
    """Return mean and range of a quantity at a speed [m/s], or an empty text."""
    if not band.count:
        return ""
    mean, low, high = (float(np.interp(speed, band.speeds, x, np.nan, np.nan)) for x in band.statistics(key))
    if not np.isfinite(mean):
        return f"no value at {speed:.4g} m/s"
    spread = f", {low:.3g} to {high:.3g}" if band.count > 1 else ""
    return f"{speed:.4g} m/s: {mean:.3g}{spread}"


def band_key(results: DesignResults) -> str:
    """Return the key of everything that determines the band of a design."""
    return critical_key(results.design, results.conditions.track)
