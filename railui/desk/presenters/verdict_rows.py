"""Rows of the verdict page: share of every stage in the error, rivals, next runs, rankings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.presenters.loop_rows import candidate_name, live_ranking_rows, reported_rows
from railui.desk.widgets.bars import Bar
from railui.report.loop.sentence import format_share

MAX_BAR_Z: Final = 6.0  # full length of the bar of a rival


def error_shares(totals: Mapping[str, float]) -> dict[str, float] | None:
    """Return the shares of the stages in the squared validation error of the nominal model; None before the verdict.

    A nominal model that diverges has no error to share: then the calibrated one is the whole.
    """
    keys = ("declared", "before", "after", "floor")
    if any(key not in totals for key in keys):
        return None
    nominal, before, after, floor = (totals[key] ** 2 for key in keys)
    whole = nominal if np.isfinite(nominal) else before
    if not np.isfinite(whole) or not whole > 0 or not np.isfinite(after):
        return None
    noise = min(floor, after)
    shares = {"calibration": whole - before, "effects": before - after, "remainder": after - noise, "noise": noise}
    return {name: share / whole for name, share in shares.items()}


SHARE_NAMES: Final = {
    "calibration": "removed by calibration",
    "effects": "removed by the effects",
    "remainder": "remainder",
    "noise": "noise",
}


def share_rows(history: LoopHistory) -> list[Bar]:
    """Return a row per share of the error; a stage that raises the error has no bar."""
    shares = error_shares(history.totals)
    if shares is None:
        return []
    return [
        Bar(
            SHARE_NAMES[name],
            max(0.0, share),
            format_share(share) if share >= 0 else f"+{format_share(-share)} error",
            is_emphasised=name == "effects",
            role="current" if name in ("calibration", "effects") else "base",
        )
        for name, share in shares.items()
    ]


def explained_text(report: Mapping[str, Any]) -> str:
    """Return the share of the error beyond noise that the effects explain."""
    value, spread = report["explained"]["value"], report["explained"]["standard_error"]
    if value is None:
        return "nothing beyond noise to explain"
    error = "" if spread is None else f" ± {format_share(spread)}"
    return f"effects explain {format_share(value)}{error} of the error beyond noise"


def rival_rows(finished: FinishedLoop) -> list[Bar]:
    """Return a row per rival model: Vuong's statistic against it as a bar, the critical value as a mark."""
    report, settings = finished.report, finished.result.context.settings.planning
    rows = []
    for row in report["rivals"][1:]:
        decision = "undecided" if row["undecided"] else "rejected"
        text = f"z {row['z']:+.1f} {decision:9}"
        name = "no effect" if row["kind"] is None else candidate_name(row)
        role = "current" if row["undecided"] else "base"
        mark = settings.critical_z / MAX_BAR_Z
        rows.append(Bar(name, max(0.0, row["z"] / MAX_BAR_Z), text, mark=mark, role=role))
    return rows


def next_run_rows(report: Mapping[str, Any]) -> list[Bar]:
    """Return a row per proposed run: probability to separate the rivals."""
    return [
        Bar(
            run["name"],
            run["probability"],
            f"{run['duration']:.0f} s  {' '.join(run['sensors'])}  {100 * run['probability']:.0f} %",
            is_emphasised=i == 0,
        )
        for i, run in enumerate(report["next_runs"])
    ]


def no_next_run_text(report: Mapping[str, Any]) -> str:
    """Return why no run is proposed."""
    rivals = report["rivals"][1:]
    if not rivals:
        return "no run proposed: no rival model was compared"
    if not any(row["undecided"] for row in rivals):
        return "none needed: every rival is rejected"
    return "no run proposed: the vehicle hunts, the time was up, or no run separates the rivals"


def ranking_count(history: LoopHistory) -> int:
    """Return the number of rankings: that of the report, and one of every score test."""
    return sum(bool(ranking.scores) for ranking in history.rankings) + (history.finished is not None)


def ranking_page(history: LoopHistory, number: int, is_narrow: bool) -> tuple[str, Sequence[Bar]]:
    """Return title and rows of a ranking; 0: that of the report after the loop, then the score tests in their order."""
    if history.finished is not None:
        if number == 0:
            return "Ranking of the verdict", reported_rows(history.finished.report["ranking"])
        number -= 1
    ranking = history.rankings[min(number, len(history.rankings) - 1)]
    title = f"Score test {number + 1} of {len(history.rankings)}"
    return title, live_ranking_rows(ranking, is_narrow)
