"""Bar rows of a loop: errors per channel, estimated parameters, ranking of the candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from railui.desk.presenters.loop_history import LoopHistory, Ranking, candidate_text
from railui.desk.presenters.loop_text import error_text, short_path
from railui.desk.state.form_rows import symbol_text
from railui.desk.widgets.bars import Bar
from railui.io.number_format import format_quantity, typeset
from railui.io.problems import FileProblems
from railui.vehicle.parameters import PARAMETERS

MAX_RANKING_ROWS: Final = 60
MAX_MISFIT_RATIO: Final = 999.9  # printed
MODEL_STATES: Final = ("declared", "before", "after")


def error_rows(history: LoopHistory, is_narrow: bool) -> list[Bar]:
    """Return a row per channel: latest error as a bar, error of the nominal model behind it, noise floor as a mark."""
    errors = history.errors
    states = [state for state in MODEL_STATES if state in errors]
    if not states:
        return []
    nominal = errors.get("declared", {})
    latest = errors.get("after") or errors.get("before") or nominal
    drawn = [*nominal.values(), *latest.values(), *errors.get("floor", {}).values(), *history.totals.values()]
    worst = max([1e-9, *(v for v in drawn if np.isfinite(v))])
    shown = states[-1:] if is_narrow else states

    def row(name: str, values: Mapping[str, float], is_emphasised: bool = False) -> Bar:
        text = " ▸ ".join(error_text(values[state]) for state in shown)
        mark = None
        if "floor" in values:
            text += f" ┃ {error_text(values['floor'])}"
            mark = values["floor"] / worst
        reference = _relative_error(values["declared"], worst)
        return Bar(name, _relative_error(values[states[-1]], worst), text, reference, mark, is_emphasised)

    rows = [row("all", history.totals, True)]
    return rows + [row(c, {state: e[c] for state, e in errors.items() if c in e}) for c in latest]


def error_caption(is_narrow: bool) -> str:
    """Return the caption of the error rows."""
    return "NRMSE ┃ noise floor" if is_narrow else "nominal ▸ calibrated ▸ with effect ┃ noise floor"


def _relative_error(value: float, worst: float) -> float:
    """Return an error as a fraction of the worst one; 1 if the simulation diverged."""
    return value / worst if np.isfinite(value) else 1.0


def parameter_rows(history: LoopHistory, is_narrow: bool) -> list[Bar]:
    """Return a row per parameter: value, change from the nominal value, and rho as a bar."""
    iteration, campaign = history.iteration, history.campaign
    if iteration is None or campaign is None:
        return []
    rows = []
    for path, value, rho in zip(iteration.paths, iteration.values, iteration.rho, strict=True):
        nominal = campaign.design.values.get(path)
        change = f"{100 * (value / nominal - 1):+.0f} %" if nominal else ""
        text = f"{typeset(format_quantity(float(value), _unit(history, path), 3)):>14} {change:>7}"
        name = symbol_text(PARAMETERS[path].symbol) if is_narrow and path in PARAMETERS else short_path(path)
        rows.append(Bar(name, abs(float(rho)), text))
    return rows


def _unit(history: LoopHistory, path: str) -> str:
    """Return the unit of a parameter; that of a candidate effect comes from the model that is being refitted."""
    if path in PARAMETERS:
        return PARAMETERS[path].unit
    nominal = None if history.campaign is None else history.campaign.design
    for design in (history.fitted_design, nominal):
        if design is None:
            continue
        try:
            return design.unit(path)
        except FileProblems:
            continue  # a parameter of a sensor, or a point of a curve
    return "1"


def ranking_rows(history: LoopHistory, is_narrow: bool) -> list[Bar]:
    """Return a row per candidate in the order of its score; after the loop in the order of the report."""
    if history.finished is not None:
        return reported_rows(history.finished.report["ranking"])
    return live_ranking_rows(history.rankings[-1], is_narrow)


def live_ranking_rows(ranking: Ranking, is_narrow: bool) -> list[Bar]:
    """Return a row per candidate of one score test in the order of its score."""
    best_rss = min(ranking.refits.values(), default=1.0)
    rows = []
    for score in sorted(ranking.scores.values(), key=lambda s: -s.admissible_rho)[:MAX_RANKING_ROWS]:
        rss = ranking.refits.get(score.candidate)
        text = f"{score.rho:+.3f}"
        if not is_narrow:
            text += " " * 9 if rss is None else f"  x{min(rss / best_rss, MAX_MISFIT_RATIO):6.2f}"
        rows.append(
            Bar(
                candidate_text(score.candidate, is_narrow),
                score.admissible_rho,
                text,
                is_emphasised=rss is not None and rss <= best_rss,
                role="current" if rss else "base",
            )
        )
    return rows


def ranking_caption(history: LoopHistory) -> str:
    """Return the names of the numbers in the ranking."""
    if history.finished is not None:
        return "rho, NRMSE, selection frequency"
    if history.refits:
        return "rho, residual / best residual"
    return "rho" if history.scores else ""


def reported_rows(ranking: Sequence[Mapping[str, Any]]) -> list[Bar]:
    """Return a row per candidate in the order of the report."""
    rows = []
    for i, row in enumerate(ranking[:MAX_RANKING_ROWS]):
        frequency = f" {100 * row['weight']:3.0f} %" if row["weight"] else " " * 6
        text = f"{row['rho']:+.3f} {row['nrmse']:.3f}{frequency}"
        role = "current" if row["refitted"] else "base"
        rows.append(Bar(candidate_name(row), abs(row["rho"]), text, is_emphasised=i == 0, role=role))
    return rows


def candidate_name(row: Mapping[str, Any]) -> str:
    """Return the name of an effect in a report."""
    kind = "no effect" if row["kind"] == "none" else row["kind"].replace("_", " ")
    if not row["at"]:
        return kind if row["kind"] == "none" else f"{kind} added"
    wheelset = f" {row['wheelset']}" if row["wheelset"] else ""
    return f"{kind}, {row['at'].replace('_', ' ')}{wheelset}"
