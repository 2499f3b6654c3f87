"""Differences between the joints or wheelsets that share an estimated number, as rows of the report and in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui.identification.result import LoopResult
from railui.report.numbers import display_scale, format_number

Report = Mapping[str, Any]


def group_rows(result: LoopResult) -> list[dict[str, Any]]:
    """Return the test of every shared number, those whose members differ significantly first."""
    freed = result.freed.validation
    return [
        {
            "path": group.path,
            "unit": result.nominal.design.unit(group.path),
            "members": list(group.members),
            "differences": list(group.differences),
            "partial_correlation": group.partial_correlation,
            "p_value": group.p_value,
            "asks": group.is_heterogeneous,
            "nrmse": None if freed is None or not group.is_heterogeneous else freed.nrmse,
        }
        for group in result.freed.groups
    ]


def group_lines(report: Report) -> list[str]:
    """Return the numbers whose members differ significantly, with the remedy; nothing where none."""
    heterogeneous = [row for row in report.get("groups", ()) if row["asks"]]
    if not heterogeneous:
        return []
    named = "; ".join(f"{row['path']} ({differences_text(row)} from the mean)" for row in heterogeneous)
    paths = ", ".join(row["path"] for row in heterogeneous)
    return [f"The members of a group differ significantly: {named}. Write `free: [{paths}]` in the campaign."]


def differences_text(row: Report) -> str:
    """Return the deviation of each member from their mean, in one readable unit.

    >>> differences_text({"members": [1, 2], "differences": [6e3, -6e3], "unit": "N*s/m"})
    '1: +6.0 kN·s/m, 2: -6.0 kN·s/m'
    """
    factor, unit = display_scale(row["differences"], row["unit"])
    values = [factor * x for x in row["differences"]]
    texts = [f"{'+' if x > 0 else '-'}{format_number(abs(x), 2)} {'' if unit == '1' else unit}".strip() for x in values]
    return ", ".join(f"{member}: {text}" for member, text in zip(row["members"], texts, strict=True))


def group_table(report: Report) -> list[dict[str, Any]]:
    """Return the rows of the page's table, empty where no number is shared."""
    return [
        {
            "path": row["path"],
            "differences": differences_text(row),
            "rho": f"{row['partial_correlation']:.2f}",
            "p": format_number(row["p_value"], 2),
            "asks": row["asks"],
        }
        for row in report.get("groups", ())
    ]
