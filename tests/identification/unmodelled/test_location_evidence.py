"""Evidence for the location of a discrepancy, against hand calculation."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.settings.loop_settings import LoopSettings
from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.estimation.block_ratio import ratio_standard_error
from railui.identification.structure.equivalent_inputs import ForceLocation, WindowedShare
from railui.identification.unmodelled.location_evidence import (
    NO_EVIDENCE,
    evidence_of_blocks,
    evidence_of_forces,
    rival_locations,
)
from railui.identification.unmodelled.location_evidence import LocationEvidence as Evidence


def test_the_share_is_that_of_the_residual_beyond_noise():
    before, after = np.array([4.0, 6.0, 5.0]), np.array([3.0, 3.5, 2.5])
    share, error = evidence_of_blocks(before, after, noise=3.0)
    assert share == pytest.approx(6.0 / 12.0)
    assert error == pytest.approx(np.sqrt(3 / 2) * np.linalg.norm((before - after) - 0.5 * (before - 1.0)) / 12.0)


def test_a_residual_at_the_noise_level_is_no_evidence():
    assert evidence_of_blocks(np.ones(4), np.zeros(4), noise=4.0) == NO_EVIDENCE
    assert evidence_of_blocks(np.ones(4), np.zeros(4), noise=np.nan) == NO_EVIDENCE


@pytest.mark.parametrize(
    ("evidence", "is_sufficient"),
    [
        (Evidence(0.31, 0.1), True),
        (Evidence(0.29, 0.01), False),
        (Evidence(0.5, 0.3), False),
        (NO_EVIDENCE, False),
        (Evidence(1.05, 0.01), True),
        (Evidence(1.89, 0.57), False),
    ],
)
def test_a_location_needs_a_large_and_significant_share(evidence: Evidence, is_sufficient: bool):
    assert evidence.is_sufficient(VerdictSettings()) is is_sufficient


def test_a_negative_share_never_names_a_location():
    forces = [ForceLocation("contact", None, -0.05, 4, 0.01)]
    assert not evidence_of_forces(forces, "contact", None).is_sufficient(VerdictSettings())


def test_forces_at_another_location_are_no_evidence():
    forces = [ForceLocation("secondary_yaw", None, 0.9, 1, 0.01)]
    assert evidence_of_forces(forces, "secondary_lateral", None) == NO_EVIDENCE
    assert evidence_of_forces(forces, "secondary_yaw", None) == Evidence(0.9, 0.01)


def location(at: str, forces: int, *shares: float, chance: float = 0.0) -> ForceLocation:
    """Forces at a location that explain shares of windows, in which the squared residual is 1, by chance a part."""
    explained = np.array(shares)
    window = WindowedShare(np.ones(len(shares)), explained, chance)
    return ForceLocation(at, None, float((explained.mean() - chance) / (1.0 - chance)), forces, 0.0, (window,))


def rivals(*forces: ForceLocation) -> list[str]:
    return [o.at for o in rival_locations(LoopSettings(), forces)]


def test_the_lead_of_a_location_is_that_of_the_same_windows():
    a, b = location("primary_yaw", 2, 0.9, 0.7, 0.8), location("contact", 2, 0.86, 0.62, 0.74)
    lead, standard_error = a.lead(b)
    assert lead == pytest.approx(0.06)
    assert standard_error == pytest.approx(ratio_standard_error(np.array([0.04, 0.08, 0.06]), np.ones(3)))
    assert standard_error < 0.3 * ratio_standard_error(np.array([0.9, 0.7, 0.8]), np.ones(3))


def test_what_chance_explains_gives_no_lead():
    a, b = location("primary_yaw", 2, 0.9, 0.9, chance=0.5), location("contact", 1, 0.8, 0.8, chance=0.0)
    assert a.lead(b) == (pytest.approx(0.0), pytest.approx(0.0))


def test_a_location_that_explains_as_much_is_a_rival():
    best = location("primary_yaw", 2, 0.87, 0.87, 0.86)
    near, far = location("contact", 2, 0.85, 0.86, 0.85), location("secondary_lateral", 1, 0.60, 0.61, 0.60)
    assert rivals(best, near, far) == ["contact"]


def test_a_lead_within_two_standard_errors_does_not_decide():
    best, other = location("primary_yaw", 1, 0.9, 0.5, 0.9, 0.5), location("contact", 1, 0.5, 0.8, 0.5, 0.8)
    assert best.lead(other)[0] == pytest.approx(0.05)
    assert rivals(best, other) == ["contact"]


def test_more_forces_have_to_explain_significantly_more():
    best = location("secondary_lateral", 1, 0.90, 0.92, 0.91)
    assert not rivals(best, location("primary_lateral", 2, 0.91, 0.91, 0.91))
    assert rivals(best, location("primary_lateral", 2, 0.93, 0.95, 0.94)) == ["primary_lateral"]


def test_forces_on_the_same_bodies_are_no_rivals():
    same = location("wheelset_yaw", 1, 0.9, 0.9)
    assert not rivals(location("contact", 2, 0.9, 0.9), same)
    assert not rivals(location("frame", 2, 0.9, 0.9), location("secondary_lateral", 1, 0.9, 0.9))
    assert rivals(location("secondary_yaw", 1, 0.9, 0.9), location("secondary_lateral", 1, 0.9, 0.9))
