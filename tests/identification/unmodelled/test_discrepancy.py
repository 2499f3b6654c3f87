"""Residuals that several channels share but that follow no motion: a changing contact, or noise of the track."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
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
