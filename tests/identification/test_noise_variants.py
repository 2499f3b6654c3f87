"""Verdicts do not depend on what a campaign states of its noise, nor on its colour.

pytest -m slow tests/identification/test_noise_variants.py
"""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
from tests.noise_variants import VARIANTS, noise_variant

ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared" / "runs"
BUNDLED = ROOT / "designs" / "campaigns" / "worn_axle_box"
EXPECTED = {
    "bundled": ("effect", "free_play primary_lateral"),
    "blind_a": ("effect", "gauge_conicity contact"),
    "blind_b": ("effect", "maxwell_damper secondary_yaw"),
    "low_adhesion": ("effect", "creep_saturation contact"),
    "nothing_missing": ("none", ""),
    "stiff_friction": ("effect", "dry_friction secondary_lateral"),
    "worn_axle_box": ("effect", "free_play primary_lateral"),
}


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", EXPECTED)
def test_the_verdict_does_not_depend_on_the_stated_noise(name: str, variant: str, tmp_path: Path):
    source = BUNDLED if name == "bundled" else SHARED / name
    if not source.is_dir():
        pytest.skip("the shared campaigns are not at hand")
    result = close_loop(read_dataset(load_campaign(noise_variant(source, tmp_path / "copy", variant))), jobs=2)
    found = " + ".join(f"{e.kind} {e.at}" for e in result.after.model.effects)
    assert (result.verdict, found) == EXPECTED[name]
    assert 0.8 < result.error_to_noise < 1.15
