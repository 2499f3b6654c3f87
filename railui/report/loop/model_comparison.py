"""Comparison of the candidate effects: cross-validation error, score, bootstrap selection frequency."""

from __future__ import annotations

from typing import Any

import numpy as np

from railui.identification.result import LoopResult
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.refit import (
    Refit,
    bootstrap_weights,
    cross_validation_errors,
    cross_validation_nrmse,
)
from railui.identification.structure.score_result import ScoreResult

MAX_BELOW_THRESHOLD = 3  # candidates per selection step


def rank_candidates(result: LoopResult) -> list[dict[str, Any]]:
    """Return one row per candidate and one for the model without an effect, the added effect and then the best first.

    The ranking is that of the step that added the first effect, or of the last step.
    """
    step = next((step for step in result.steps if step.added), result.steps[-1])
    settings = result.context.settings.refit
    base_fit = result.windowed or result.before
    base = Refit(None, base_fit, cross_validation_errors(settings, base_fit))
    base_nrmse = cross_validation_nrmse(base)
    # refits of a later step may have other windows than the model without effects
    refits = [r for r in step.refits if r.block_errors.shape == base.block_errors.shape]
    weights = bootstrap_weights(settings, [*refits, base], result.seed)
    refitted = {
        refit.candidate: (cross_validation_nrmse(refit), float(weight))
        for refit, weight in zip(refits, weights, strict=False)
    }
    without_effect = {"kind": "none", "at": None, "wheelset": None, "rho": 0.0, "nrmse": base_nrmse}
    rows: list[dict[str, Any]] = [without_effect | {"refitted": True, "weight": float(weights[-1])}]
    for score in step.score_test.best:
        candidate = score.candidate
        linear_estimate = base_nrmse * _relative_error(score, step.score_test.rss, settings.cross_validation_folds)
        nrmse, weight = refitted.get(candidate, (linear_estimate, 0.0))
        errors = {"rho": score.rho, "nrmse": nrmse, "refitted": candidate in refitted, "weight": weight}
        rows.append(_identity(candidate) | errors)
    rows.sort(key=lambda row: float(row["nrmse"]))
    added = step.added.candidate if step.added else None
    if added is not None:
        identity = _identity(added)
        rows.sort(key=lambda row: {key: row[key] for key in identity} != identity)
    return rows


def significant_below_threshold(result: LoopResult) -> list[dict[str, Any]]:
    """Return the best refits of every step with a significant score that added no effect: their gain was too small."""
    rows = []
    level = result.context.settings.score_test.significance_level
    for step in (s for s in result.steps if s.score_test.p <= level):
        for refit in step.refits[:MAX_BELOW_THRESHOLD] if step.added is None and not step.in_pair else ():
            if refit.candidate is not None:
                rho = refit.score_result.rho if refit.score_result else None
                errors = {"p": step.score_test.p, "rho": rho, "nrmse": cross_validation_nrmse(refit)}
                rows.append(_identity(refit.candidate) | errors)
    return rows


def _identity(candidate: Candidate) -> dict[str, Any]:
    return {"kind": candidate.kind, "at": candidate.at, "wheelset": candidate.wheelset}


def _relative_error(score: ScoreResult, rss: float, fold_count: int) -> float:
    """Return the cross-validation error with the candidate over that without, by linear estimates of its amount."""
    if score.candidate.is_one_sided and score.rho < 0:
        return 1.0
    folds = np.array([part.sum() for part in np.array_split(score.scores, fold_count)])
    norm = score.norm / fold_count
    amount = (folds.sum() - folds) / (score.norm - norm)
    gain = float(np.sum(2.0 * amount * folds - amount**2 * norm))
    return float(np.sqrt(max(1.0 - gain / rss, 0.0)))
