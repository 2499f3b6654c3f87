"""Figure of an assessed track: geometry, score and flange contact along it, the worst sections marked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.report.figures.drawing import BLUE, GREY, ORANGE, stacked_axes
from railui.track import Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKED_SEGMENTS = 3  # worst ones
MAX_LINE_POINTS = 4000  # of a line


# panels over the sections: key, factor from SI, label
PANELS: Final = (
    ("sd_yw", 1e3, "sd yw, 3-25 m [mm]"),
    ("score", 1.0, "score"),
    ("flange_fraction", 100.0, "flange contact [%]"),
)


def draw_assessment(result: Mapping[str, Any], track: Track, path: str | Path) -> None:
    """Write a figure of line, geometry, score and flange contact along the track (svg, png, pdf)."""
    with stacked_axes(path, 4, 1.6) as axes:
        every = max(1, len(track) // MAX_LINE_POINTS)
        axes[0].plot(track.s[::every], 1e3 * track.yw[::every], color=GREY, lw=0.6)
        axes[0].set_ylabel("yw [mm]")
        mark_worst(axes[0], result, with_rank=True)
        for ax, (key, _, _) in zip(axes[1:], PANELS, strict=True):
            draw_sections(ax, result, key)
        axes[-1].set_xlabel("s [m]")


def draw_sections(ax: Axes, result: Mapping[str, Any], key: str) -> None:
    """Draw a result of the track sections along the track: sd_yw, score or flange_fraction; the worst marked."""
    factor, label = next((factor, label) for name, factor, label in PANELS if name == key)
    sections = sorted(result["stretches"], key=lambda section: float(section["from"]))
    edges = np.array([*(section["from"] for section in sections), sections[-1]["to"]])
    values = [np.nan if section[key] is None else factor * section[key] for section in sections]
    ax.stairs(values, edges, color=BLUE, fill=True, alpha=0.35)
    ax.stairs(values, edges, color=BLUE, lw=1.0)
    ax.set_ylabel(label)
    ax.set_ylim(0.0, _top(key, values))
    mark_worst(ax, result)
    if key == "sd_yw":
        worst = min(sections, key=lambda section: int(section["rank_geometry"]))
        at = (0.5 * (worst["from"] + worst["to"]), factor * worst[key])
        ax.annotate("worst geometry", at, ha="center", va="bottom", fontsize=8, color=GREY)


def _top(key: str, values: list[float]) -> float:
    """Return the upper end of the ordinate of a panel."""
    largest = max((x for x in values if x == x), default=0.0)
    return {"sd_yw": 1.25 * largest or 1.0, "score": 100.0, "flange_fraction": max(1.0, 1.1 * largest)}[key]


def mark_worst(ax: Axes, result: Mapping[str, Any], *, with_rank: bool = False) -> None:
    """Mark the worst sections."""
    for rank, section in enumerate(result["stretches"][:MARKED_SEGMENTS]):
        ax.axvspan(section["from"], section["to"], color=ORANGE, alpha=0.10, lw=0)
        if with_rank:
            at: Any = {"xycoords": ("data", "axes fraction"), "ha": "center", "va": "bottom", "color": ORANGE}
            ax.annotate(f"worst {rank + 1}", (0.5 * (section["from"] + section["to"]), 1.0), fontsize=8, **at)
