"""Verdict of the loop: share of the error that the added effects remove, the remainder, and the rules over both."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.estimation.block_ratio import ratio_standard_error
from railui.identification.estimation.noise_floor import NoiseFloor
from railui.identification.estimation.validation import NO_MOTION, Validation
from railui.identification.residual.restoring_force_surface import SurfaceShares


class Verdict(StrEnum):
    """Verdicts of the loop."""

    NONE = "none"
    EFFECT = "effect"
    PARTIAL = "partial"
    OUTSIDE = "outside"
    DATA = "data"


@dataclass(frozen=True)
class Explained:
    """Share of the squared error beyond noise that the final model removes, and its standard error over blocks."""

    value: float
    standard_error: float | None


@dataclass(frozen=True)
class Remainder:
    """Residual of the final model on the validation runs.

    Attributes
    ----------
    ratio
        Share of the squared error beyond noise of the calibrated model that is left; None where that had none.
    coherent_share
        Share of the residual that is coherent with the track or with a motion, beyond chance; None: not computed.
    coherent
        Whether that share is significant.
    structured
        Whether a candidate of the library correlates with the residual more than noise does.
    candidate
        Kind and location of the candidate that correlates most; None without structure.
    at, wheelset
        Location at which a force explains the residual; None: not located.
    surface
        Shares of a component's residual force over displacement and velocity, where it depends on both together.
    vibration
        Frequency [Hz] about which the residual of a rig has most of its power; None: about none.
    """

    ratio: float | None
    coherent_share: float | None
    coherent: bool
    structured: bool
    candidate: tuple[str, str, int | None] | None = None
    at: str | None = None
    wheelset: int | None = None
    surface: SurfaceShares | None = None
    vibration: float | None = None


def explained_share(before: Validation, after: Validation, floor: NoiseFloor) -> Explained | None:
    """Compute explained = (before^2 - after^2)/(before^2 - floor^2), clipped to [0, 1].

    Parameters
    ----------
    before, after
        The calibrated model without and with the added effects, on the same runs.
    floor
        Error that noise alone leaves there.

    Returns
    -------
    Explained or None
        None where the calibrated model is at the noise floor, so that there is nothing to explain, or where the final
        model diverges. The standard error is that of a ratio over blocks of time, with the spread of the floor. An
        unknown floor (NaN) counts as zero: the share is a lower bound; an unknown spread of the floor is left out.
    """
    if not np.isfinite(after.nrmse):
        return None
    has_blocks = np.isfinite(before.nrmse)
    squared = before.nrmse**2 if has_blocks else NO_MOTION
    level, spread = (floor.nrmse, np.nan_to_num(floor.sd)) if np.isfinite(floor.nrmse) else (0.0, 0.0)
    total = squared - level**2
    if total <= max(2.0 * level * spread, 0.0):
        return None
    ratio = (squared - after.nrmse**2) / total
    value = float(np.clip(ratio, 0.0, 1.0))
    if not has_blocks or len(before.block_errors) != len(after.block_errors):
        return Explained(value, None)
    noise = level**2 / len(before.block_errors)
    of_blocks = ratio_standard_error(before.block_errors - after.block_errors, before.block_errors - noise)
    of_floor = ratio / total * 2.0 * level * spread
    return Explained(value, float(np.hypot(of_blocks, of_floor)))


def remaining_ratio(before: Validation, after: Validation, floor: NoiseFloor) -> float | None:
    """Compute (after^2 - floor^2)/(before^2 - floor^2), at least 0; None where it has no meaning."""
    squared = before.nrmse**2 if np.isfinite(before.nrmse) else NO_MOTION
    total = squared - floor.nrmse**2
    if not np.isfinite(after.nrmse) or not total > 0:  # nor where the floor is unknown
        return None
    return float(max(after.nrmse**2 - floor.nrmse**2, 0.0) / total)


def decide_verdict(
    settings: VerdictSettings,
    *,
    has_effects: bool,
    explained: Explained | None,
    remainder: Remainder,
    is_adequate: bool,
    is_noise: bool,
    has_discrepancy: bool,
    is_shared: bool = False,
    has_freed_members: bool = False,
    is_out_of_time: bool = False,
    diverges: bool = False,
    is_contradicted: bool = False,
    exceeds_noise: bool = False,
) -> Verdict:
    """Apply the rules of the verdict.

    Parameters
    ----------
    has_effects
        Whether an effect was accepted.
    is_adequate
        Whether the error is so near that of noise that no further effect can gain enough.
    is_noise
        Whether the error is that of noise, or the residual coherent with neither track, motions nor other channels.
    is_shared
        Whether the residuals of different channels are coherent.
    has_discrepancy
        Whether a discrepancy that is not in the library was found.
    has_freed_members
        Whether separate numbers of the members of a group lower the error.
    is_out_of_time
        Whether the time budget ended before the search for effects and discrepancies did.
    diverges
        Whether the final model diverges on a validation run: it does not describe the vehicle there, and effects that
        it has explain only a part.
    is_contradicted
        Whether the effects raise the error of the independent test: they are then not the whole explanation.
    exceeds_noise
        Whether the error with effects is so far above the noise floor that it is no noise, whatever its structure.
    """
    has_structure = remainder.structured or remainder.coherent or remainder.surface is not None
    is_no_noise = not is_noise and (has_structure or is_shared or remainder.vibration is not None or is_out_of_time)
    is_outside = has_discrepancy or has_freed_members or is_no_noise
    if has_effects:
        if diverges or is_contradicted:
            return Verdict.PARTIAL
        is_whole = explained is None or explained.value >= settings.min_explained_share
        leaves_noise = not (has_structure or is_outside or exceeds_noise)
        return Verdict.EFFECT if is_whole or is_adequate or leaves_noise else Verdict.PARTIAL
    return Verdict.OUTSIDE if is_outside or diverges else Verdict.NONE
