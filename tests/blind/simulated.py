"""Campaigns of the independent generator read as datasets, simulated once for all tests."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.estimation.output_error import Fit
from railui.identification.loop import calibrate
from railui.vehicle.model import Model
from tests.truth.campaign import Campaign, Order, campaign, write
from tests.truth.effects import parse

DURATIONS = (25.0, 20.0)  # s
SPEEDS = (40.0, 31.0)  # m/s


@dataclass(frozen=True, eq=False)
class SimulatedCampaign:
    """A simulated campaign: its true vehicle, its dataset and the nominal model."""

    truth: Campaign
    dataset: Dataset
    nominal: Model


@cache
def simulated_campaign(
    *effects: str,
    seed: int = 3,
    seconds: Sequence[float] = DURATIONS,
    columns: Sequence[str] = (),
    speeds: Sequence[float] = SPEEDS,
) -> SimulatedCampaign:
    """Simulate a campaign with planted effects, each written as `kind at=location name=number`.

    Its last run is the validation run.
    """
    order = Order([parse(text) for text in effects], seed=seed, seconds=seconds, columns=columns, speeds=speeds)
    truth = campaign(order)
    with tempfile.TemporaryDirectory() as folder:
        write(truth, Path(folder))
        dataset = read_dataset(load_campaign(folder))
    return SimulatedCampaign(truth, dataset, Model(dataset.campaign.design))


@cache
def calibrated(*effects: str, **options: Any) -> Fit:
    """Calibrate the nominal model of such a campaign, without an added effect."""
    case = simulated_campaign(*effects, **options)
    return calibrate(case.dataset, case.nominal, jobs=2)
