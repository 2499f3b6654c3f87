"""Residuals that several channels share but that follow no motion: a changing contact, or noise of the track."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.loop import close_loop
from railui.identification.unmodelled.discrepancy import _is_force_on_vehicle
from railui.identification.unmodelled.evidence import LocationEvidence
from tests.truth.campaign import Order, campaign, write
from tests.truth.effects import effect

WET_PATCHES = effect("wet_patches", "contact", depth=0.6, length=150.0)
ACCELEROMETERS = ("ay1", "ay2", "ayf")


def test_patches_of_low_friction_are_no_noise(tmp_path: Path) -> None:
    """They change the phase of the motion along the track, so that the residual is coherent with none."""
    write(campaign(Order(effects=(WET_PATCHES,), seed=47047, without=ACCELEROMETERS)), tmp_path)
    result = close_loop(read_dataset(load_campaign(tmp_path)), jobs=2)
    assert not result.remainder.coherent and not result.remainder.structured
    assert result.validations["after"].nrmse > 3.0 * result.noise_floor.nrmse
    assert result.verdict == "outside" and result.discrepancy is not None and result.discrepancy.at == "contact"


@pytest.mark.parametrize("without", [ACCELEROMETERS, ("e1", "e2", "d1", "d2", "rf")])
def test_noise_of_three_times_the_stated_size_is_no_discrepancy(tmp_path: Path, without: tuple[str, ...]) -> None:
    """That of the track reaches all channels alike."""
    write(campaign(Order(seed=47047, without=without, stated=1.0 / 3.0, seconds=(40.0, 30.0))), tmp_path)
    result = close_loop(read_dataset(load_campaign(tmp_path)), jobs=2)
    assert (result.verdict, result.discrepancy) == ("none", None)


@pytest.mark.parametrize(
    ("locations", "contact_share", "is_on_vehicle"),
    [
        (("primary_yaw",), 0.5, True),
        (("primary_yaw", "secondary_lateral"), 0.5, True),
        (("primary_yaw", "wheelset_yaw"), 0.5, False),
        (("wheelset",), 0.5, False),
        (("primary_yaw",), 0.85, False),  # the contact explains nearly as much
        ((), 0.0, False),
    ],
)
def test_only_a_force_away_from_the_contact_is_no_noise_of_the_track(locations, contact_share, is_on_vehicle) -> None:
    evidence = LocationEvidence(0.9, 0.01)
    discrepancy = SimpleNamespace(
        evidence=evidence,
        contact_share=contact_share,
        locations=lambda settings: [(at, None, evidence) for at in locations],
    )
    assert _is_force_on_vehicle(SimpleNamespace(settings=LoopSettings()), discrepancy) is is_on_vehicle
