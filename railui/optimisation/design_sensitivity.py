"""Sensitivity of the results of one design to each of its parameters, without a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.optimisation.cases import Case
from railui.optimisation.evaluation import Evaluator, evaluate_in_process
from railui.optimisation.response_keys import CRITICAL_SPEEDS, MAX_SPEED, RESPONSE_KEYS
from railui.optimisation.response_map import evaluate_vehicles
from railui.optimisation.sensitivity import RELATIVE_STEP, perturbable_paths, perturbed_rows, step_scale


def design_sensitivity(
    cases: Sequence[Case], keys: Sequence[str], evaluator: Evaluator | None = None
) -> dict[str, Any]:
    """Compute derivatives of results with respect to each parameter of a design by central differences.

    Each parameter goes from 5 % below to 5 % above its value, all others fixed; the gauge and the back-to-back distance
    of profiles by 5 % of their difference.

    Parameters
    ----------
    cases : sequence of Case
        Tracks (seeds) on which the design is evaluated, without varied paths.
    keys : sequence of str
        Keys of ride, stability or curve.
    evaluator : Evaluator, optional
        In this process by default.

    Returns
    -------
    dict
        `responses`: by key unit, mean `value` over the cases and its `sd` (n - 1; None for one case); `parameters`: per
        path unit, value and by key `change` (mean over the cases, from -5 % to +5 %), its `change_sd`, the `derivative`
        in SI and `relative`, the relative change of the result over that of the parameter; `skipped`: paths that are
        zero or at the end of their range; `notes`. NaN where a perturbed vehicle fails in a case.

    References
    ----------
    Broersen 1976, 7.3.
    """
    design = cases[0].vehicle.model.design
    paths = perturbable_paths(design)
    rows = perturbed_rows(cases, {}, paths)
    own = cases[0].vehicle.rows(np.zeros((1, 0)))
    evaluate = evaluator or evaluate_in_process()
    tables = [
        evaluate_vehicles(case, np.vstack([own, one]), sorted(set(keys)), evaluate)
        for case, one in zip(cases, rows, strict=True)
    ]
    responses: dict[str, Any] = {}
    parameters: list[dict[str, Any]] = [
        {
            "path": path,
            "unit": design.unit(path),
            "value": design.value(path),
            **{name: {} for name in ("change", "change_sd", "derivative", "relative")},
        }
        for path in paths
    ]
    notes = []
    for key in keys:
        values = np.stack([np.where(t.distance_share[:, 0] < 1, np.nan, t.values[key][:, 0]) for t in tables], axis=1)
        beyond = (key in CRITICAL_SPEEDS) & (values >= MAX_SPEED)
        if np.any(beyond):
            notes.append(f"{key}: null where there is none up to {MAX_SPEED:g} m/s")
        values = np.where(beyond, np.nan, values)
        base, change = values[0], values[2::2] - values[1::2]
        responses[key] = {"unit": RESPONSE_KEYS[key].unit, "value": float(base.mean()), "sd": _sd(base)}
        for i, parameter in enumerate(parameters):
            mean = float(change[i].mean())
            scale = step_scale(design, parameter["path"])
            width = 2 * RELATIVE_STEP * (scale / parameter["value"])
            parameter["change"][key], parameter["change_sd"][key] = mean, _sd(change[i])
            parameter["derivative"][key] = mean / (2 * RELATIVE_STEP * scale)
            parameter["relative"][key] = mean / (width * float(base.mean())) if base.mean() else float("nan")
    return {
        "step": RELATIVE_STEP,
        "responses": responses,
        "parameters": parameters,
        "skipped": [path for path in design.paths() if path not in paths],
        "notes": notes,
    }


def _sd(values: FloatArray) -> float | None:
    """Return the standard deviation (n - 1) over cases, None for one case."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else None
