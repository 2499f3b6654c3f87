"""Context of an identification: the dataset, the nominal model and the options that every stage shares."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.settings.loop_settings import LoopSettings
from railui.progress import SILENT, Progress
from railui.vehicle.model import Model


@dataclass(frozen=True, eq=False)
class Context:
    """Dataset, nominal model, settings and options of an identification.

    Attributes
    ----------
    settings
        Thresholds, as the campaign has them.
    seed
        Of every random draw.
    jobs
        Threads; None: as many as the machine has cores.
    excluded
        Kinds of effects that may not be proposed.
    """

    dataset: Dataset
    nominal: Model
    settings: LoopSettings
    seed: int = 0
    jobs: int | None = None
    progress: Progress = field(default=SILENT, repr=False)
    excluded: frozenset[str] = frozenset()

    @property
    def campaign(self) -> Campaign:
        """The campaign of the dataset."""
        return self.dataset.campaign

    @property
    def noise(self) -> Mapping[str, float]:
        """Standard deviation of the noise of every column."""
        return self.dataset.noise

    def in_background(self, jobs: int | None) -> Context:
        """Return the same context with so many threads and no progress, for a computation that is one of many."""
        return replace(self, jobs=jobs, progress=SILENT)


def create_context(
    dataset: Dataset,
    *,
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
    excluded: Collection[str] = (),
) -> Context:
    """Create the context of a dataset, with the campaign's design as nominal model and the campaign's settings."""
    campaign = dataset.campaign
    nominal = Model(campaign.design, campaign.sensors)
    return Context(dataset, nominal, campaign.settings, seed, jobs, progress, frozenset(excluded))
