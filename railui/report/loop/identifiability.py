"""Identifiability as data: directions, profile likelihoods, coefficients, values per section, correlations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from railui.identification.estimation.identifiability import Profile, SectionEstimates, analyse_identifiability
from railui.identification.estimation.parallel_models import Correlations
from railui.identification.result import LoopResult
from railui.identification.unmodelled.coefficients import Coefficient


def identifiability(result: LoopResult) -> dict[str, Any]:
    """Return singular values of the weighted sensitivity per relative change, their directions, and sentences."""
    analysis = analyse_identifiability(result.after, result.context.settings.identifiability)
    return {
        "singular_values": [d.singular_value for d in analysis.directions],
        "directions": [{"sd": d.sd, "parts": dict(d.parts)} for d in analysis.directions],
        "parameters": {
            path: {"word": word, "relative_sd": sd, "with": list(partners)}
            for path, word, sd, partners in analysis.classes
        },
        "words": analysis.sentences(),
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


def segment_rows(estimates: SectionEstimates) -> dict[str, Any]:
    """Return parameters per track section, with chi-squared of their variation."""
    return {
        "between": estimates.sections.tolist(),
        "unit": "m",
        "parameters": {
            path: {
                "values": estimates.values[:, k].tolist(),
                "sd": estimates.sd[:, k].tolist(),
                "chi2": float(estimates.chi2[k]),
            }
            for k, path in enumerate(estimates.paths)
        },
    }


def correlation_rows(correlations: Correlations) -> dict[str, Any]:
    """Return rho per parameter and channel, and lambda per parameter, of two parallel models."""
    return {
        path: {
            "rho": dict(zip(correlations.channels, map(float, correlations.rho[k]), strict=True)),
            "lambda": float(correlations.steps[k]),
        }
        for k, path in enumerate(correlations.paths)
    }
