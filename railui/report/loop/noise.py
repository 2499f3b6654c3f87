"""Noise of the columns in the loop report: rows of data, rows of the page, and notes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui.campaign.noise.model import ESTIMATED, STATED, NoiseModel
from railui.report.numbers import DASH, format_number
from railui.runs.columns import COLUMNS

NOTABLE_RATIO = 1.5  # of the noise used to the stated one, or its inverse
NOTABLE_SHARE = 0.2  # of the variance that is coloured


def noise_rows(noise: NoiseModel) -> dict[str, dict[str, Any]]:
    """Return level, colour and source of the noise of every column, in SI units or those of a rig's run."""
    return {
        name: {
            "stated": c.stated,
            "estimated": c.estimated,
            "sd": None if c.estimated is None or c.estimated_log_sd is None else c.estimated * c.estimated_log_sd,
            "used": c.used,
            "colour": {
                "white": c.spectrum.white,
                "coloured": [{"corner_hz": corner, "sd": sd} for corner, sd in c.spectrum.coloured],
                "share": c.coloured_share,
            },
            "source": c.source,
        }
        for name, c in noise.columns.items()
    }


def noise_table(rows: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str]]:
    """Return the rows of the page's table from those of the report."""
    return [
        {
            "name": name,
            "unit": COLUMNS[name].unit if name in COLUMNS else "",
            "stated": _number(row["stated"]),
            "estimated": _number(row["estimated"]),
            "sd": _number(row["sd"]),
            "used": _number(row["used"]),
            "coloured": f"{100.0 * row['colour']['share']:.0f} %",
            "source": row["source"],
        }
        for name, row in rows.items()
    ]


def known_noise_text(source: str) -> str:
    """Return what a noise floor of this source rests on, to compare a residual with."""
    return "estimated from the runs" if source == ESTIMATED else "stated"


def noise_notes(noise: NoiseModel) -> list[str]:
    """Return a note on every column whose noise is not as stated, and on coloured noise."""
    notes = []
    for name, c in noise.columns.items():
        ratio = c.ratio_to_stated
        if c.source != STATED and ratio is not None and not 1.0 / NOTABLE_RATIO < ratio < NOTABLE_RATIO:
            notes.append(f"the noise of {name} is {ratio:.2g} times the stated one")
    notes += [
        f"the noise of {name} estimated from the runs is {c.excess:.2g} times the residual of the model, which bounds "
        "it: the noise floor is an upper bound, and an error of its size does not confirm the model"
        for name, c in noise.columns.items()
        if c.excess is not None
    ]
    coloured = [
        f"{name} ({100.0 * c.coloured_share:.0f} %)"
        for name, c in noise.columns.items()
        if c.coloured_share >= NOTABLE_SHARE
    ]
    if coloured:
        notes.append(f"noise that is not white, with its share of the variance: {', '.join(coloured)}")
    return notes


def _number(value: float | None) -> str:
    return DASH if value is None else format_number(value)
