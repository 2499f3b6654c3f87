"""Scores of single faults on one run, and the tests of their evidence and size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.faults.families import (
    CONTINUOUS,
    best_of_family,
    candidates,
    continuous_families,
    discrete_hypotheses,
)
from railui.campaign.faults.hypotheses import Consistency, G, Hypothesis
from railui.campaign.settings.faults import FaultSettings


@dataclass(frozen=True)
class ScoredFault:
    """A single fault, the misfit of the columns under it, and the standard deviation of its value."""

    hypothesis: Hypothesis
    misfit: float
    sd: float = float("nan")


def score_discrete(consistency: Consistency, has_units: bool, rms: Mapping[str, float]) -> list[ScoredFault]:
    """Score every single sign, unit and exchange."""
    discrete = discrete_hypotheses(candidates(consistency.spectra), has_units, rms)
    misfits = consistency.misfits([[h] for h in discrete])
    return [ScoredFault(h, float(m)) for h, m in zip(discrete, misfits, strict=True)]


def score_continuous(consistency: Consistency, has_units: bool, settings: FaultSettings) -> list[ScoredFault]:
    """Score every single gain, delay, offset and gravity at its best value."""
    spectra, scores = consistency.spectra, []
    channels = candidates(spectra)
    base, is_local = total_misfit(consistency), is_consistent(consistency, settings)
    for family, grid in continuous_families(channels, spectra):
        if not has_units and family.kind == "gain":
            continue
        local = _near(family, grid, consistency, settings) if is_local else grid
        if is_local and not _improves_locally(consistency, family, local, base):
            continue
        scores.append(ScoredFault(*best_of_family(consistency, family, local)))
    return scores


def is_evident(h: Hypothesis, evidence: float, consistency: Consistency, settings: FaultSettings) -> bool:
    """True where the evidence suffices; a sign, unit or exchange needs a share of that of the samples as well."""
    needed = settings.min_fault_evidence
    if h.kind in ("sign", "unit", "exchanged"):
        samples = consistency.weight * len(consistency.spectra.f)
        needed = max(needed, settings.min_fault_evidence_share * samples)
    return evidence > needed


def is_large(s: ScoredFault, settings: FaultSettings) -> bool:
    """True for a fault of a size that is reported, and significant."""
    h = s.hypothesis
    if h.kind == "gravity":
        return abs(abs(h.value) - G) <= settings.gravity_tolerance * G
    sizes = {"gain": (h.value - 1.0, settings.reported_gain_error), "delay": (h.value, settings.reported_delay)}
    sizes["offset"] = (h.value, settings.serious_track_offset)
    if h.kind not in sizes:
        return True
    value, smallest = sizes[h.kind]
    return abs(value) > smallest and not abs(value) < settings.fault_standard_errors * s.sd


def total_misfit(consistency: Consistency) -> float:
    """Misfit of the columns as they are, over all frequencies."""
    return float(consistency.misfit(consistency.base).sum())


def penalty(h: Hypothesis, settings: FaultSettings) -> float:
    """Penalty of a fault with a free value, as a log-likelihood."""
    return settings.free_value_penalty if h.kind in CONTINUOUS else 0.0


def is_same_fault(a: Hypothesis, b: Hypothesis) -> bool:
    """True for faults of one kind on the same channels; of units with the same factor."""
    same = (a.kind, set(a.channels)) == (b.kind, set(b.channels))
    return same and (a.kind != "unit" or bool(np.isclose(a.value, b.value)))


def is_consistent(consistency: Consistency, settings: FaultSettings, given: Sequence[Hypothesis] = ()) -> bool:
    """True if every combination of the relations holds in a quarter of the band, under faults if some are given."""
    worst = np.sort(consistency.worst_share(consistency.relations(given)))
    return float(np.mean(worst[: max(len(worst) // 4, 1)])) < settings.consistent_log_share


def _near(family: Hypothesis, grid: FloatArray, consistency: Consistency, settings: FaultSettings) -> FloatArray:
    """Return the part of a grid of lags that is near zero."""
    if family.kind not in ("delay", "offset"):
        return grid
    scale = consistency.speed if family.kind == "offset" else 1.0
    return grid[np.abs(grid) <= settings.local_lag * scale]


def _improves_locally(consistency: Consistency, family: Hypothesis, grid: FloatArray, base: float) -> bool:
    """True if one of the values next to no fault improves the consistency; any value of gravity."""
    if family.kind == "gravity":
        return True
    neutral = 1.0 if family.kind == "gain" else 0.0
    below, above = grid[grid < neutral].max(), grid[grid > neutral].min()
    misfits = consistency.misfits([[replace(family, value=float(x))] for x in (below, above)])
    return bool(np.min(misfits) < base)
