"""Changes against an earlier campaign whose posterior was the prior: rows of data, and sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from scipy import special

from railui.identification.result import LoopResult
from railui.report.numbers import quantity_with_sd

LEVEL: Final = 0.01  # family-wise, over all parameters


def prior_record(result: LoopResult) -> dict[str, Any] | None:
    """Return what has changed since the campaign before; None without a prior.

    The estimate is a mean of the prior and of what the new data say, weighted by their precisions. With the variance
    s^2 of the estimate before, P of the prior (s^2 and the usual drift) and v of the new estimate, the new data alone
    have the variance w = 1/(1/v - 1/P), and z = (x - x_before) / (v/w sqrt(s^2 + w)) is standard normal where nothing
    has changed.
    """
    prior = result.dataset.campaign.prior
    if prior is None:
        return None
    fit = result.after
    rows: list[dict[str, Any]] = []
    for i, path in enumerate(fit.free.paths):
        if path in prior.values:
            before, sd_before = prior.values[path], prior.sd[path]
            value, sd = float(fit.x[i]), float(fit.sd[i])
            z = change_score(value - before, sd, sd_before, float(fit.free.prior_sd[i]))
            rows.append(
                {
                    "path": path,
                    "unit": fit.model.design.unit(path),
                    "before": before,
                    "sd_before": sd_before,
                    "value": value,
                    "sd": sd,
                    "z": z,
                }
            )
    critical = float(-special.ndtri(0.5 * LEVEL / max(len(rows), 1)))
    changes = [{**row, "changed": row["z"] is not None and abs(row["z"]) > critical} for row in rows]
    return {"campaign": prior.campaign, "verdict": prior.verdict, "file": str(prior.file), "changes": changes}


def change_score(difference: float, sd: float, sd_before: float, prior_sd: float) -> float | None:
    """Return z of a difference from the estimate before; None where the new data add nothing."""
    information = 1.0 / max(sd, 1e-300) ** 2 - 1.0 / prior_sd**2
    if not np.isfinite(information) or information <= 1e-3 / prior_sd**2:
        return None
    w = 1.0 / information
    return float(difference / (sd**2 / w * np.sqrt(sd_before**2 + w)))


def change_lines(report: Mapping[str, Any]) -> list[str]:
    """Return what has changed since the campaign before, in sentences."""
    prior = report.get("prior")
    if prior is None:
        return []
    changed = [row for row in prior["changes"] if row["changed"]]
    if not changed:
        return [f"Since {prior['campaign']}: no estimate has changed beyond chance (1 % over all)."]
    texts = [
        f"{row['path']} {quantity_with_sd(row['before'], row['sd_before'], row['unit'])} -> "
        f"{quantity_with_sd(row['value'], row['sd'], row['unit'])} (z = {row['z']:+.1f})"
        for row in sorted(changed, key=lambda row: -abs(row["z"]))
    ]
    return [f"Changed since {prior['campaign']} beyond chance (1 % over all): {'; '.join(texts)}."]
