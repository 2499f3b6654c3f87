"""What the motions determine, as data: directions, profiles, coefficients, parameters per stretch, correlations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from railui.identification.estimation.identifiability import PerStretch, Profile, analyse_identifiability
from railui.identification.estimation.output_error import Fit
from railui.identification.estimation.parallel_models import Correlations
from railui.identification.unmodelled.coefficients import Coefficient


def identifiability(fit: Fit) -> dict[str, Any]:
    """Singular values of the weighted sensitivity per relative change, their directions, and the same in words."""
    found = analyse_identifiability(fit)
    return {
        "singular_values": [d.singular_value for d in found.directions],
        "directions": [{"sd": d.sd, "parts": dict(d.parts)} for d in found.directions],
        "parameters": {
            path: {"word": word, "relative_sd": sd, "with": list(partners)} for path, word, sd, partners in found.words
        },
        "words": found.sentences(),
    }


def profile_rows(profiles: Sequence[Profile]) -> dict[str, Any]:
    """Per path the deviance against the value held, and the ends of the 90 % interval (null: open)."""
    return {
        p.path: {"values": list(p.values), "deviance": list(p.deviance), "low": p.low, "high": p.high} for p in profiles
    }


def coefficient_rows(coefficients: Sequence[Coefficient]) -> list[dict[str, Any]]:
    """One row per coefficient of the wheelset equations, what contradicts its derivation most first."""
    return [
        {"wheelset": c.wheelset, "equation": c.equation, "motion": c.motion, "difference": c.difference, "sd": c.sd,
         "unit": c.unit, "t": c.t, "share": c.share, "contradicts": c.contradicts}
        for c in coefficients
    ]  # fmt: skip


def stretch_rows(found: PerStretch) -> dict[str, Any]:
    """Parameters per stretch of track, with the scatter that their standard deviations do not explain."""
    return {
        "between": found.between.tolist(),
        "unit": "m",
        "parameters": {
            path: {"values": found.values[:, k].tolist(), "sd": found.sd[:, k].tolist(), "chi2": float(found.chi2[k])}
            for k, path in enumerate(found.paths)
        },
    }


def correlation_rows(found: Correlations) -> dict[str, Any]:
    """rho per parameter and channel, and lambda per parameter, of two parallel models."""
    return {
        path: {"rho": dict(zip(found.channels, map(float, found.rho[k]), strict=True)), "lambda": float(found.steps[k])}
        for k, path in enumerate(found.paths)
    }
