"""Identifiability as data: directions, profile likelihoods, coefficients, values per section, correlations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from railui.identification.estimation.identifiability import Profile, SectionEstimates, analyse_identifiability
from railui.identification.estimation.parallel_models import Correlations
from railui.identification.loop import LoopResult
from railui.identification.unmodelled.coefficients import Coefficient


def identifiability(result: LoopResult) -> dict[str, Any]:
    """Return singular values of the weighted sensitivity per relative change, their directions, and sentences."""
    found = analyse_identifiability(result.after, result.context.settings.identifiability)
    return {
        "singular_values": [d.singular_value for d in found.directions],
        "directions": [{"sd": d.sd, "parts": dict(d.parts)} for d in found.directions],
        "parameters": {
            path: {"word": word, "relative_sd": sd, "with": list(partners)}
            for path, word, sd, partners in found.classes
        },
        "words": found.sentences(),
    }


def profile_rows(profiles: Sequence[Profile]) -> dict[str, Any]:
    """Return per path the deviance against the fixed value, and the ends of the 90 % interval (None: open)."""
    return {
        p.path: {"values": list(p.values), "deviance": list(p.deviance), "low": p.low, "high": p.high} for p in profiles
    }


def coefficient_rows(coefficients: Sequence[Coefficient]) -> list[dict[str, Any]]:
    """Return one row per coefficient of the wheelset equations, the largest contradiction to its derivation first."""
    return [
        {
            "wheelset": c.wheelset,
            "equation": c.equation,
            "motion": c.motion,
            "difference": c.difference,
            "sd": c.sd,
            "unit": c.unit,
            "t": c.t,
            "share": c.share,
            "contradicts": c.contradicts_derivation,
        }
        for c in coefficients
    ]


def segment_rows(found: SectionEstimates) -> dict[str, Any]:
    """Return parameters per track section, with chi-squared of their variation."""
    return {
        "between": found.sections.tolist(),
        "unit": "m",
        "parameters": {
            path: {"values": found.values[:, k].tolist(), "sd": found.sd[:, k].tolist(), "chi2": float(found.chi2[k])}
            for k, path in enumerate(found.paths)
        },
    }


def correlation_rows(found: Correlations) -> dict[str, Any]:
    """Return rho per parameter and channel, and lambda per parameter, of two parallel models."""
    return {
        path: {"rho": dict(zip(found.channels, map(float, found.rho[k]), strict=True)), "lambda": float(found.steps[k])}
        for k, path in enumerate(found.paths)
    }
