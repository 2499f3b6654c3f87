"""Evidence for the location of a discrepancy: the share of the residual beyond noise that a force there explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.loop_settings import LoopSettings
from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.estimation.block_ratio import ratio_standard_error
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.validation import Validation
from railui.identification.structure.equivalent_inputs import ForceLocation

CONTACT_LOCATIONS = ("contact", "wheelset", "wheelset_yaw")
FRAME_LOCATIONS = {"frame", "secondary_lateral", "secondary_yaw"}


class LocationEvidence(NamedTuple):
    """Share of the squared residual beyond noise that is explained, and its standard error over blocks of time."""

    share: float
    standard_error: float

    def is_sufficient(self, settings: VerdictSettings) -> bool:
        """True where the share is large and significant, and not of more than there is to explain."""
        least = max(settings.min_location_share, settings.location_standard_errors * self.standard_error)
        return least <= self.share <= settings.max_location_share


NO_EVIDENCE = LocationEvidence(0.0, 0.0)


def evidence_of_blocks(before: FloatArray, after: FloatArray, noise: float) -> LocationEvidence:
    """Compute the share from squared errors [block] before and after, and the expected sum of squares of the noise.

    An unknown noise (NaN) is no evidence.

    It is at most 1: a law of few parameters leaves less than the expected noise where that is misjudged.

    >>> evidence_of_blocks(np.array([3.0, 3.0]), np.array([2.0, 2.0]), noise=2.0)
    LocationEvidence(share=0.5, standard_error=0.0)
    """
    total = float(before.sum()) - noise
    if not total > 0:  # nor where the noise is unknown
        return NO_EVIDENCE
    less = before - after
    standard_error = ratio_standard_error(less, before - noise / len(before))
    return LocationEvidence(min(float(less.sum()) / total, 1.0), standard_error)


def expected_misfit(fit: Fit) -> float:
    """Misfit that noise alone would leave: with the weights, it has a variance of one."""
    return min(float(fit.normal.samples), fit.normal.rss)


def evidence_of_fits(before: Fit, after: Fit) -> LocationEvidence:
    """Compute the share from two fits to the same segments; with the weights, noise has a variance of one."""
    a, b = (fit.normal.gram[:, :, 0, 0].sum(axis=1) for fit in (before, after))
    if len(a) != len(b):
        return NO_EVIDENCE
    return evidence_of_blocks(a, b, min(float(before.normal.samples), float(a.sum())))


def evidence_of_validations(before: Validation, after: Validation, floor: float) -> LocationEvidence:
    """Compute the share from two validations of the same runs, and the NRMSE that noise leaves there."""
    if not np.isfinite(before.nrmse) or not np.isfinite(after.nrmse):
        return NO_EVIDENCE
    return evidence_of_blocks(before.block_errors, after.block_errors, floor**2)


def evidence_of_forces(forces: Sequence[ForceLocation], at: str, wheelset: int | None) -> LocationEvidence:
    """Return the share that independent forces at a location explain, whatever their law."""
    same = [f for f in forces if (f.at, f.wheelset) == (at, wheelset)]
    best = max(same, key=lambda f: f.share, default=None)
    return NO_EVIDENCE if best is None else LocationEvidence(best.share, best.standard_error)


def share_at_contact(forces: Sequence[ForceLocation]) -> float:
    """Return the largest share that forces at the contact explain, however many: track noise moves all wheelsets.

    >>> share_at_contact([ForceLocation("primary_yaw", None, 0.6, 4), ForceLocation("contact", None, 0.7, 8)])
    0.7
    """
    return max((f.share for f in forces if f.at in CONTACT_LOCATIONS), default=0.0)


def rival_locations(settings: LoopSettings, forces: Sequence[ForceLocation]) -> tuple[ForceLocation, ...]:
    """Return the locations at other joints whose forces explain the residual as well as those of the first.

    As many forces, or fewer, do so where their share is not significantly less, or by no more than the tolerance; more
    forces where their share is significantly larger.
    """
    best, *others = forces
    return tuple(o for o in others if not _act_alike(o.at, best.at) and _explains_as_much(settings, o, best))


def _explains_as_much(settings: LoopSettings, other: ForceLocation, best: ForceLocation) -> bool:
    lead, standard_error = best.lead(other)
    margin = settings.verdict.location_standard_errors * standard_error
    if other.forces > best.forces:
        return lead < -margin
    return lead <= max(margin, settings.discrepancy.force_location_tolerance)


def joint_of(at: str) -> str:
    """Return the joint of a location: forces on a wheelset act at its contact.

    >>> joint_of("wheelset_yaw"), joint_of("primary_yaw")
    ('contact', 'primary_yaw')
    """
    return "contact" if at in CONTACT_LOCATIONS else at


def _act_alike(a: str, b: str) -> bool:
    """True for forces at one joint, or on the frame and at its secondary suspension, which acts on it."""
    return joint_of(a) == joint_of(b) or ("frame" in (a, b) and {a, b} <= FRAME_LOCATIONS)
