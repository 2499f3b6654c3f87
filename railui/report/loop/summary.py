"""Lines below the verdict: what qualifies it, share explained, independent test, errors with each run left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui.report.loop.changes import change_lines
from railui.report.loop.groups import group_lines
from railui.report.loop.next_run import next_run_lines
from railui.report.loop.wording import ROLE_LABELS

Report = Mapping[str, Any]


def summary_lines(report: Report) -> list[str]:
    """Return the lines of a loop report that belong to its verdict."""
    return [
        *caution_lines(report),
        *group_lines(report),
        *_explained_line(report),
        test_line(report),
        *left_out_lines(report),
        *change_lines(report),
        *next_run_lines(report),
    ]


def caution_lines(report: Report) -> list[str]:
    """Return the notes that qualify the verdict; reports of earlier versions have none."""
    return [f"{text}." for text in report.get("cautions", ())]


def _explained_line(report: Report) -> list[str]:
    value, spread = report["explained"]["value"], report["explained"]["standard_error"]
    if value is None or not report["effects"]:
        return []
    error = "" if spread is None else f" +/- {100 * spread:.2g}"
    by_condition = (report.get("conditions") or {}).get("decides", False)
    what = "the effects explain" + (", with parameters by condition" if by_condition else "")
    return [f"Share of the error beyond noise that {what}: {100 * value:.4g}{error} %."]


def test_line(report: Report) -> str:
    """Return the errors on segments that decided nothing, or that there are none."""
    test = report["test"]
    if not test["files"]:
        return (
            "No independent test: no run has the role test, and the validation runs are too short to hold back a part."
        )
    files = ", ".join(test["files"])
    where = f"the last part of {files}, held back" if test["held_back"] else files
    before, after, floor = (_number(test[key]) for key in ("nrmse_before", "nrmse_after", "floor"))
    return f"Independent test on {where}: NRMSE {before} -> {after}; expected from noise alone {floor}."


def left_out_lines(report: Report) -> list[str]:
    """Return the error of each run with the parameters estimated on all others."""
    rows = report.get("leave_one_run_out", ())
    if not rows:
        return []
    cells = "; ".join(
        f"{row['file']} ({ROLE_LABELS[row['role']]}) {_first_order(row)}{_number(row['nrmse_with_all'])} with it"
        for row in rows
    )
    return [f"NRMSE of each run, parameters estimated on all others to first order: {cells}."]


def _first_order(row: Mapping[str, Any]) -> str:
    if row["nrmse"] is None:
        return "unknown without it (the parameters change too much for first order), "
    return f"{_number(row['nrmse'])}, "


def _number(value: float | None) -> str:
    if value is None:
        return "diverged"
    return f"{value:.3f}" if value >= 0.0095 else f"{value:.2g}"
