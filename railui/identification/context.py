"""Context of an identification: the dataset, the nominal model and the options that every stage shares."""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass, field, replace

from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.noise.model import NoiseModel, as_noise_model
from railui.campaign.settings.loop_settings import LoopSettings
from railui.progress import SILENT, Progress
from railui.vehicle.model import Model


class OutOfTimeError(Exception):
    """The time budget ended within a stage that has no result yet."""


@dataclass(frozen=True, eq=False)
class Context:
    """Dataset, nominal model, settings and options of an identification.

    Attributes
    ----------
    settings
        Thresholds, as the campaign has them.
    seed
        Of the random signs of the tests and of the draws behind the ranking and the next runs. Noise realisations
        of the floor, of the weights of the channels, of the bias and of the location have fixed seeds: the
        floor of a model does not depend on the seed.
    jobs
        Threads; None: as many as the machine has cores.
    excluded
        Kinds of effects that may not be proposed.
    deadline
        Reading of `time.perf_counter` at which the time budget ends; None: no budget.
    """

    dataset: Dataset
    nominal: Model
    settings: LoopSettings
    seed: int = 0
    jobs: int | None = None
    progress: Progress = field(default=SILENT, repr=False)
    excluded: frozenset[str] = frozenset()
    deadline: float | None = None

    @property
    def is_out_of_time(self) -> bool:
        """True where the time budget is spent; what a stage has then is its result."""
        return self.deadline is not None and time.perf_counter() >= self.deadline

    def check_time(self) -> None:
        """Raise OutOfTimeError where the time budget is spent."""
        if self.is_out_of_time:
            raise OutOfTimeError

    def without_deadline(self) -> Context:
        """Return the same context without a time budget, for what follows the search."""
        return replace(self, deadline=None)

    @property
    def campaign(self) -> Campaign:
        """The campaign of the dataset."""
        return self.dataset.campaign

    @property
    def noise(self) -> NoiseModel:
        """Noise of every column: level and colour."""
        return as_noise_model(self.dataset.noise)

    def in_background(self, jobs: int | None) -> Context:
        """Return the same context with so many threads and no progress, for a computation that is one of many."""
        return replace(self, jobs=jobs, progress=SILENT)


@dataclass(frozen=True, eq=False)
class WithContext:
    """Base of results in a context, whose dataset and nominal model they name directly."""

    context: Context

    @property
    def dataset(self) -> Dataset:
        """The runs of the campaign."""
        return self.context.dataset

    @property
    def nominal(self) -> Model:
        """The nominal model."""
        return self.context.nominal


def create_context(
    dataset: Dataset,
    *,
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
    excluded: Collection[str] = (),
    budget: float | None = None,
) -> Context:
    """Create the context of a dataset, with the campaign's design as nominal model and the campaign's settings.

    budget: time [s] from now.
    """
    deadline = None if budget is None else time.perf_counter() + budget
    campaign = dataset.campaign
    nominal = Model(campaign.design, campaign.sensors)
    return Context(dataset, nominal, campaign.settings, seed, jobs, progress, frozenset(excluded), deadline)
