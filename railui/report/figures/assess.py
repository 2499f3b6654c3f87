"""Figure of an assessed track: geometry, score and flange contact along it, the worst stretches marked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railui.report.figures.drawing import BLUE, GREY, ORANGE, stacked
from railui.track import Track

MARKED = 3  # worst stretches
POINTS = 4000  # of a line


def draw_assessment(found: Mapping[str, Any], track: Track, path: str | Path) -> None:
    """Writes line, geometry, score and flange share along the track (svg, png, pdf)."""
    worst_first = found["stretches"]
    along = sorted(worst_first, key=lambda one: float(one["from"]))
    edges = np.array([*(one["from"] for one in along), along[-1]["to"]])
    with stacked(path, 4, 1.6) as axes:
        every = max(1, len(track) // POINTS)
        axes[0].plot(track.s[::every], 1e3 * track.yw[::every], color=GREY, lw=0.6)
        axes[0].set_ylabel("yw [mm]")
        rows = (
            (axes[1], "sd_yw", 1e3, "sd yw, 3-25 m [mm]", BLUE),
            (axes[2], "score", 1.0, "score", BLUE),
            (axes[3], "flange_fraction", 100.0, "flange contact [%]", BLUE),
        )
        for ax, key, factor, label, colour in rows:
            values = [np.nan if one[key] is None else factor * one[key] for one in along]
            ax.stairs(values, edges, color=colour, fill=True, alpha=0.35)
            ax.stairs(values, edges, color=colour, lw=1.0)
            ax.set_ylabel(label)
            ax.set_ylim(bottom=0.0)
        axes[2].set_ylim(0.0, 100.0)
        for place, one in enumerate(worst_first[:MARKED]):
            for ax in axes:
                ax.axvspan(one["from"], one["to"], color=ORANGE, alpha=0.10, lw=0)
            axes[0].annotate(
                f"worst {place + 1}", (0.5 * (one["from"] + one["to"]), 1.0), xycoords=("data", "axes fraction"),
                ha="center", va="bottom", fontsize=8, color=ORANGE,
            )  # fmt: skip
        worst = min(along, key=lambda one: int(one["rank_geometry"]))
        axes[1].annotate(
            "worst geometry", (0.5 * (worst["from"] + worst["to"]), 1e3 * worst["sd_yw"]), ha="center", va="bottom",
            fontsize=8, color=GREY,
        )  # fmt: skip
        axes[1].set_ylim(0.0, 1.25e3 * max(one["sd_yw"] for one in along) or 1.0)
        axes[3].set_ylim(0.0, max(1.0, 110.0 * max(one["flange_fraction"] or 0.0 for one in along)))
        axes[-1].set_xlabel("s [m]")
