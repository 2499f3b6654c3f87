"""Evidence for the location of a discrepancy, against hand calculation."""

from __future__ import annotations

import numpy as np
import pytest

from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.structure.equivalent_inputs import ForceLocation
from railui.identification.unmodelled.evidence import NO_EVIDENCE, evidence_of_blocks, evidence_of_forces
from railui.identification.unmodelled.evidence import LocationEvidence as Evidence


def test_the_share_is_that_of_the_residual_beyond_noise():
    before, after = np.array([4.0, 6.0, 5.0]), np.array([3.0, 3.5, 2.5])
    share, error = evidence_of_blocks(before, after, noise=3.0)
    assert share == pytest.approx(6.0 / 12.0)
    assert error == pytest.approx(np.sqrt(3 / 2) * np.linalg.norm((before - after) - 0.5 * (before - 1.0)) / 12.0)


def test_a_residual_at_the_noise_level_is_no_evidence():
    assert evidence_of_blocks(np.ones(4), np.zeros(4), noise=4.0) == NO_EVIDENCE


@pytest.mark.parametrize(
    ("evidence", "is_sufficient"),
    [(Evidence(0.31, 0.1), True), (Evidence(0.29, 0.01), False), (Evidence(0.5, 0.3), False), (NO_EVIDENCE, False)],
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
