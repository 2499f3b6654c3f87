"""Duration of the blocks of time from which standard deviations and scores follow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.context import create_context
from railui.identification.estimation.fit import block_duration
from tests.blind.simulated import simulated_campaign

DESIGNS = Path(__file__).parents[3] / "designs"
CALIBRATION = LoopSettings().calibration


def duration(dataset: Dataset, seconds: float) -> float:
    """Duration of a block where the estimation runs last so long."""
    context = create_context(dataset, jobs=1)
    first = context.dataset.estimation[0]
    length = round(seconds / first.dt)
    return block_duration(context.settings.calibration, context.nominal, [first.truncated(length)])


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [
        (36.0, 3.0),  # in twelve blocks
        (10.0, CALIBRATION.min_block_duration),  # in no more than ten
        (2.0, 0.5),  # in four at least
    ],
)
def test_a_coach_whose_body_sways_slowly_has_twelve_blocks(seconds: float, expected: float) -> None:
    dataset = read_dataset(load_campaign(DESIGNS / "campaigns" / "worn_centre_guide"))
    assert duration(dataset, seconds) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("seconds", "is_shortened"), [(24.0, False), (21.0, True)])
def test_a_bogie_has_blocks_of_its_hunting_periods_where_they_are_enough(seconds: float, is_shortened: bool) -> None:
    """Of seven periods, which are 1.97 s; those of three are as short as any."""
    context = simulated_campaign().context
    calibration = replace(CALIBRATION, block_hunting_periods=7.0)
    segment = context.dataset.estimation[0]
    some = segment.truncated(round(seconds / segment.dt))
    found = block_duration(calibration, context.nominal, [some])
    roots = context.nominal.eigenvalues(some.mean_speed)[0]
    hunting = abs(roots[np.argmax(np.where(roots.imag > 1.0, roots.real, -np.inf))].imag)
    periods = 7.0 * 2.0 * np.pi / hunting
    assert 21.0 / 12 < periods < 24.0 / 12
    assert found == pytest.approx(21.0 / 12 if is_shortened else periods, rel=0.01)
