"""Evidence whether a residual is noise."""

from __future__ import annotations

import pytest

from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.residual.coherence import UNKNOWN, ResidualCoherence, Share
from railui.identification.residual.noise_evidence import summarise_coherence

NOTHING = Share(0.01, 0.02)
CLEAR = Share(0.4, 0.05)
SETTINGS = VerdictSettings()


def coherence(track: Share = NOTHING, motions: Share = NOTHING, others: Share = NOTHING) -> ResidualCoherence:
    return ResidualCoherence(track, motions, others)


def test_a_residual_that_is_coherent_with_nothing_is_noise():
    evidence = summarise_coherence(SETTINGS, {"ay1": coherence(), "ay2": coherence()}, has_reference=True)
    assert evidence.is_noise and not evidence.is_coherent and not evidence.is_shared


def test_a_single_channel_without_input_shows_nothing_about_noise():
    evidence = summarise_coherence(SETTINGS, {"z": coherence()}, has_reference=False)
    assert not evidence.is_noise and not evidence.is_coherent


@pytest.mark.parametrize("where", ["track", "motions"])
def test_coherence_of_one_channel_with_track_or_motion_suffices(where: str):
    evidence = summarise_coherence(
        SETTINGS, {"ay1": coherence(), "rf": coherence(**{where: CLEAR})}, has_reference=True
    )
    assert evidence.is_coherent and not evidence.is_noise
    assert (evidence.channel, evidence.share) == ("rf", CLEAR.share)


def test_residuals_coherent_with_each_other_are_shared_and_no_noise_of_the_sensors():
    evidence = summarise_coherence(SETTINGS, {"ay1": coherence(others=CLEAR), "ay2": coherence()}, has_reference=True)
    assert evidence.is_shared and not evidence.is_noise


def test_a_large_share_within_its_scatter_is_no_evidence():
    evidence = summarise_coherence(SETTINGS, {"ay1": coherence(motions=Share(0.4, 0.3))}, has_reference=True)
    assert not evidence.is_coherent


def test_runs_that_are_too_short_give_no_evidence():
    evidence = summarise_coherence(SETTINGS, {"ay1": coherence(UNKNOWN, UNKNOWN, UNKNOWN)}, has_reference=True)
    assert evidence.channel is None and not evidence.is_noise and not evidence.is_coherent
