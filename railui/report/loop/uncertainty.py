"""Uncertainty of the estimates on the loop page: 95 % intervals, correlations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.identification.estimation.fit import Fit
from railui.report.loop.wording import parameter_name
from railui.report.numbers import CONFIDENCE_FACTOR, DASH

MAX_CORRELATED = 24  # parameters of the matrix; of more, those that correlate most
MAX_NAMED = 4  # parameters that correlate with one
MIN_NOTABLE = 0.5  # correlation with the parameter of an effect, from which it is named


def interval_text(value: float | None, sd: float | None) -> str:
    """Return a 95 % interval with the digits that the standard deviation supports.

    >>> interval_text(0.4452, 0.003), interval_text(30072.0, 280.0), interval_text(1.0, None)
    ('0.439 to 0.451', '29500 to 30600', '–')
    """
    if value is None or not sd or not np.isfinite(sd):
        return DASH
    decimals = 1 - int(np.floor(np.log10(sd))) if sd < 1e6 else 0
    decimals = max(decimals - (f"{sd:.1e}"[0] in "23456789"), -6)
    ends = (round(x, decimals) for x in (value - CONFIDENCE_FACTOR * sd, value + CONFIDENCE_FACTOR * sd))
    return " to ".join(f"{x:.{max(decimals, 0)}f}" for x in ends).replace("-", "−")


def correlation(fit: Fit) -> FloatArray:
    """Return the correlation matrix [p, p] of the estimates; zero where a standard deviation is zero or unknown."""
    covariance = np.nan_to_num(fit.covariance, nan=0.0, posinf=0.0, neginf=0.0)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sd > 0.0, sd, np.inf)
    matrix = covariance / np.outer(scale, scale)
    np.fill_diagonal(matrix, 1.0)
    return np.asarray(matrix)


def correlation_table(fit: Fit) -> dict[str, Any] | None:
    """Return names and coloured cells of the correlation matrix; None for a single parameter."""
    if len(fit.free.paths) < 2:
        return None
    matrix = correlation(fit)
    shown = _shown(matrix)
    rows = []
    for number, i in enumerate(shown, 1):
        cells = [_cell(float(matrix[i, j]), is_diagonal=i == j) for j in shown]
        rows.append({"number": number, "name": fit.free.paths[i], "cells": cells})
    return {"rows": rows, "omitted": len(matrix) - len(shown)}


def _shown(matrix: FloatArray) -> list[int]:
    """Return the parameters of the table in their order: all, or those with the largest correlations."""
    strongest = np.max(np.abs(matrix - np.eye(len(matrix))), axis=1)
    return sorted(np.argsort(-strongest, kind="stable")[:MAX_CORRELATED].tolist())


def _cell(r: float, *, is_diagonal: bool) -> dict[str, Any]:
    text = "" if is_diagonal or abs(r) < 0.095 else f"{r:.1f}".replace("0.", ".").replace("-", "−")
    return {"text": text, "sign": "diagonal" if is_diagonal else "plus" if r > 0 else "minus", "size": f"{abs(r):.2f}"}


def correlated_lines(fit: Fit, effects: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the parameters with which those of the identified effects trade off."""
    matrix, names = correlation(fit), [parameter_name(fit.model, path) for path in fit.free.paths]
    lines = []
    for i, path in enumerate(fit.free.paths):
        if path.startswith(("effects.", "sensors.")) and "@" not in path and effects:
            others = sorted(range(len(matrix)), key=lambda j: -abs(matrix[i, j]))
            notable = [j for j in others if j != i and abs(matrix[i, j]) >= MIN_NOTABLE]
            named = [f"{names[j]} ({matrix[i, j]:+.2f})".replace("(-", "(−") for j in notable[:MAX_NAMED]]
            if named:
                lines.append(f"{names[i]} correlates with {', '.join(named)}.")
    return lines
