"""Campaigns of the independent generator read as measurements, made once for all tests."""

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

SHORT = (25.0, 20.0)  # s
SPEEDS = (40.0, 31.0)  # m/s


@dataclass(frozen=True, eq=False)
class Made:
    """A campaign with its truth, as measured, and the declared vehicle."""

    truth: Campaign
    measurement: Dataset
    declared: Model


@cache
def made(
    *effects: str,
    seed: int = 3,
    seconds: Sequence[float] = SHORT,
    columns: Sequence[str] = (),
    speeds: Sequence[float] = SPEEDS,
) -> Made:
    """A campaign with planted effects, each written as `kind at=place name=number`; its last run validates."""
    order = Order([parse(text) for text in effects], seed=seed, seconds=seconds, columns=columns, speeds=speeds)
    truth = campaign(order)
    with tempfile.TemporaryDirectory() as folder:
        write(truth, Path(folder))
        measurement = read_dataset(load_campaign(folder))
    return Made(truth, measurement, Model(measurement.campaign.design))


@cache
def fitted(*effects: str, **more: Any) -> Fit:
    """The declared vehicle of such a campaign, adjusted without an effect."""
    one = made(*effects, **more)
    return calibrate(one.measurement, one.declared, jobs=2)
