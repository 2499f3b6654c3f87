"""Figure of an assessed track: geometry, score and flange contact along it, the worst sections marked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railui.report.figures.drawing import BLUE, GREY, ORANGE, stacked_axes
from railui.track import Track

MARKED_SEGMENTS = 3  # worst ones
MAX_LINE_POINTS = 4000  # of a line


def draw_assessment(result: Mapping[str, Any], track: Track, path: str | Path) -> None:
    """Write a figure of line, geometry, score and flange contact along the track (svg, png, pdf)."""
    ranked = result["stretches"]
    sections = sorted(ranked, key=lambda section: float(section["from"]))
    edges = np.array([*(section["from"] for section in sections), sections[-1]["to"]])
    with stacked_axes(path, 4, 1.6) as axes:
        every = max(1, len(track) // MAX_LINE_POINTS)
        axes[0].plot(track.s[::every], 1e3 * track.yw[::every], color=GREY, lw=0.6)
        axes[0].set_ylabel("yw [mm]")
        rows = (
            (axes[1], "sd_yw", 1e3, "sd yw, 3-25 m [mm]", BLUE),
            (axes[2], "score", 1.0, "score", BLUE),
            (axes[3], "flange_fraction", 100.0, "flange contact [%]", BLUE),
        )
        for ax, key, factor, label, colour in rows:
            values = [np.nan if section[key] is None else factor * section[key] for section in sections]
            ax.stairs(values, edges, color=colour, fill=True, alpha=0.35)
            ax.stairs(values, edges, color=colour, lw=1.0)
            ax.set_ylabel(label)
            ax.set_ylim(bottom=0.0)
        axes[2].set_ylim(0.0, 100.0)
        for rank, section in enumerate(ranked[:MARKED_SEGMENTS]):
            for ax in axes:
                ax.axvspan(section["from"], section["to"], color=ORANGE, alpha=0.10, lw=0)
            axes[0].annotate(
                f"worst {rank + 1}",
                (0.5 * (section["from"] + section["to"]), 1.0),
                xycoords=("data", "axes fraction"),
                ha="center",
                va="bottom",
                fontsize=8,
                color=ORANGE,
            )
        worst = min(sections, key=lambda section: int(section["rank_geometry"]))
        axes[1].annotate(
            "worst geometry",
            (0.5 * (worst["from"] + worst["to"]), 1e3 * worst["sd_yw"]),
            ha="center",
            va="bottom",
            fontsize=8,
            color=GREY,
        )
        axes[1].set_ylim(0.0, 1.25e3 * max(section["sd_yw"] for section in sections) or 1.0)
        axes[3].set_ylim(0.0, max(1.0, 110.0 * max(section["flange_fraction"] or 0.0 for section in sections)))
        axes[-1].set_xlabel("s [m]")
