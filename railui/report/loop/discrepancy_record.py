"""Discrepancy of a loop as data: location, force against motion, cause."""

from __future__ import annotations

from typing import Any

from railui.identification.result import LoopResult
from railui.identification.unmodelled.discrepancy import Discrepancy


def discrepancy_record(result: LoopResult) -> dict[str, Any] | None:
    """Return the discrepancy, None without one; its location is null where the evidence does not suffice to name it."""
    discrepancy = result.discrepancy
    if discrepancy is None:
        return None
    located = {} if discrepancy.is_located(result.context.settings.verdict) else {"at": None, "wheelset": None}
    evidence = {"share": discrepancy.evidence.share, "share_sd": discrepancy.evidence.standard_error}
    return _curve(discrepancy) | located | evidence | {"locations": _locations(result, discrepancy)}


def _locations(result: LoopResult, discrepancy: Discrepancy) -> list[dict[str, Any]]:
    """Return the locations at which forces explain the residual equally well, the one with fewest forces first."""
    return [
        {"at": at, "wheelset": wheelset, "share": evidence.share, "share_sd": evidence.standard_error}
        for at, wheelset, evidence in discrepancy.locations(result.context.settings.verdict)
    ]


def _curve(discrepancy: Discrepancy) -> dict[str, Any]:
    curve = discrepancy.curve
    record = {
        "at": discrepancy.at,
        "wheelset": discrepancy.wheelset,
        "against": curve.against,
        "motion": list(curve.abscissa),
        "force": list(curve.ordinate),
        "sd": list(curve.sd),
        "motion_unit": curve.abscissa_unit,
        "force_unit": curve.ordinate_unit,
    }
    return record | _cause(discrepancy)


def _cause(discrepancy: Discrepancy) -> dict[str, Any]:
    """Return the keys of a discrepancy that a curve of force against motion does not describe."""
    if discrepancy.is_unexplained_difference:
        return {"differs": True}
    if (dependence := discrepancy.run_dependence) is not None:
        keys = ("file", "role", "speed", "value", "sd")
        return {
            "parameter": dependence.path,
            "parameters": list(dependence.ratios),
            "runs": [{key: getattr(run, key) for key in keys} for run in dependence.runs],
            "p": dependence.p,
            "nrmse": dependence.validation.nrmse,
        }
    if (drift := discrepancy.drift) is not None:
        return {"parameter": drift.path, "parameters": list(drift.ratios)}
    if (coupling := discrepancy.coupling) is not None:
        pairs = [[{"at": at, "wheelset": wheelset} for at, wheelset in pair] for pair in coupling.pairs]
        return {"coupling": {"pairs": pairs, "per": coupling.against, "share": coupling.share}}
    return {}
