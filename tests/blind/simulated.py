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
from railui.identification.context import WithContext, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.validation import validate
from railui.vehicle.model import Model
from tests.truth.campaign import Campaign, Order, campaigns, write
from tests.truth.effects import parse
from tests.truth.files import paths

DURATIONS = (25.0, 20.0)  # s
SPEEDS = (40.0, 31.0)  # m/s


@dataclass(frozen=True, eq=False)
class SimulatedCampaign(WithContext):
    """A simulated campaign: its true vehicle, and the context of its identification."""

    truth: Campaign

    @property
    def true_model(self) -> Model:
        """The nominal model with the true parameters."""
        values = self.nominal.design.values
        return Model(
            self.nominal.design.with_values({k: x for k, x in paths(self.truth.vehicle).items() if k in values})
        )

    @property
    def true_error(self) -> float:
        """NRMSE that the true parameters leave on the validation runs, by this realisation of the noise."""
        return validate(self.context, self.true_model, self.dataset.validation).nrmse


@dataclass(frozen=True)
class Request:
    """Planted effects, each written as `kind at=location name=number`, and the runs; the last is the validation run."""

    effects: tuple[str, ...] = ()
    seed: int = 3
    seconds: Sequence[float] = DURATIONS
    columns: Sequence[str] = ()
    speeds: Sequence[float] = SPEEDS

    @property
    def order(self) -> Order:
        """Order to the generator."""
        effects = [parse(text) for text in self.effects]
        return Order(effects, seed=self.seed, seconds=self.seconds, columns=self.columns, speeds=self.speeds)


_simulated: dict[Request, Campaign] = {}


def simulate_together(*requests: Request) -> None:
    """Simulate campaigns for later calls of `simulated_campaign`, side by side in about the time of the longest."""
    missing = [request for request in requests if request not in _simulated]
    _simulated.update(zip(missing, campaigns([request.order for request in missing]), strict=True))


def recorded(simulated: Campaign) -> Dataset:
    """Write a simulated campaign and read its files."""
    with tempfile.TemporaryDirectory() as folder:
        write(simulated, Path(folder))
        return read_dataset(load_campaign(folder))


@cache
def simulated_campaign(*effects: str, **options: Any) -> SimulatedCampaign:
    """Simulate a campaign with planted effects; options: other fields of Request."""
    request = Request(effects, **options)
    simulate_together(request)
    truth = _simulated[request]
    return SimulatedCampaign(create_context(recorded(truth), jobs=2), truth)


@cache
def calibrated(*effects: str, **options: Any) -> Fit:
    """Calibrate the nominal model of such a campaign, without an added effect."""
    return calibrate(simulated_campaign(*effects, **options).context)
