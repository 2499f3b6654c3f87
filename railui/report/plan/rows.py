"""Rows of a plan's tables: minimum detectable effects, parameters and confounded effects in readable units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from railui import core
from railui.report.loop.wording import common_rows, effect_title, location_text
from railui.report.numbers import DASH, format_number, readable_scale
from railui.vehicle.multibody import Structure

Document = Mapping[str, Any]
Row = dict[str, Any]

CONFOUNDED: Final = "*"
MARKS: Final = {
    CONFOUNDED: "detected there before it can be separated from another effect",
    DASH: "no size found that would be detected there",
}


def effect_name(row: Document, structure: Structure | None = None) -> str:
    """Return an effect with its location, such as `clearance, lateral primary suspension`."""
    return f"{effect_title(row['kind'])}, {location_text(row['at'], row['wheelset'], structure)}"


def effect_rows(
    document: Document, *, groups_only: bool = True, only_common: bool = False, structure: Structure | None
) -> list[Row]:
    """Return a row of texts for every effect: selection, everything, each run alone.

    Parameters
    ----------
    groups_only
        Leave out effects of single wheelsets or joints.
    only_common
        Leave out effects other than the common ones.
    """
    rows = [r for r in document["detectable"] if not (groups_only and r["wheelset"] is not None)]
    return [_effect_row(r, structure) for r in (common_rows(rows) if only_common else rows)]


def _effect_row(row: Document, structure: Structure | None) -> Row:
    values = [row["value"], row["with_everything"], *row["per_run"], *row["per_step"]]
    shown = 2 + len(row["per_run"])
    factor, unit = readable_scale(values, row["unit"])
    suffix = "" if unit in ("", "1") else f" [{unit}]"
    confounded = [row["confounded"], row["confounded_with_everything"], *row["confounded_per_run"]]
    marks = [CONFOUNDED * x for x in confounded] + [""] * len(row["per_step"])
    cells = [DASH if x is None else format_number(factor * x) + m for x, m in zip(values, marks, strict=True)]
    return {
        "name": effect_name(row, structure),
        "single": row["wheelset"] is not None,
        "parameter": f"{row['parameter'].replace('_', ' ')}{suffix}",
        "bound": "up to" if core.effect_record(row["kind"])["smaller_is_stronger"] else "from",
        "cells": cells[:shown],
        "values": values[:shown],
        "steps": cells[shown:],
    }


def marks_legend(rows: Sequence[Row]) -> list[str]:
    """Return the meanings of the marks in the cells of effects, of those that occur.

    >>> marks_legend([{"cells": ["1.2", "3.4*"]}])
    ['* detected there before it can be separated from another effect']
    >>> marks_legend([{"cells": ["1.2", "–"]}])
    ['– no size found that would be detected there']
    """
    return [f"{mark} {text}" for mark, text in MARKS.items() if any(mark in cell for r in rows for cell in r["cells"])]


def parameter_rows(document: Document) -> list[Row]:
    """Return a row of texts for every parameter: standard deviations relative to its nominal value."""
    return [
        {
            "name": p["path"],
            "cells": [_relative(sd, p["value"]) for sd in (p["sd"], p["with_everything"], *p["per_run"])],
            "prior": DASH if p["prior_sd"] is None else _relative(p["prior_sd"], p["value"]),
        }
        for p in document["parameters"]
    ]


def _relative(sd: float, value: float) -> str:
    return f"{100 * sd / abs(value):.2g} %" if value else f"{sd:.2g}"


def confounded_rows(document: Document, structure: Structure | None) -> list[Row]:
    """Return a row for every effect that is detected before it can be separated from others."""
    return [
        {
            "name": effect_name(c, structure),
            "rivals": [
                f"{effect_name(r, structure)} (separable from {r['separable_from']:.2g} times the minimum)"
                if r["separable_from"] < MAX_MULTIPLE
                else f"{effect_name(r, structure)} (not separable)"
                for r in c["from"]
            ],
        }
        for c in document["confounded"]
        if c["wheelset"] is None
    ]


MAX_MULTIPLE: Final = 20.0  # of the minimum detectable size, beyond which two effects count as not separable


def sentence(document: Document) -> str:
    """Return the selection in one sentence."""
    chosen = document["selected"]
    if chosen is None:
        return "The budget does not cover one sensor and two runs."
    last = document["steps"][-1]
    found = sum(r["value"] is not None for r in document["detectable"])
    estimation = ", ".join(chosen["estimation"])
    return (
        f"{len(chosen['sensors'])} sensors ({', '.join(chosen['sensors'])}), {estimation} for estimation and "
        f"{chosen['validation']} for validation: {100 * last['attained_share']:.0f} % of the attainable precision "
        f"for a cost of {last['cost']:g}; {found} of {len(document['detectable'])} effects have a minimum size."
    )
