"""Prediction of the measured channels: a model simulated on a segment, filtered and compared.

Every simulation of the identification passes through a `Predictor`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign
from railui.campaign.comparison import Comparison, compare
from railui.campaign.segment import Segment
from railui.core import Batch, Vehicles, ZeroPhaseFilter
from railui.vehicle.model import Model


class SimulationError(ValueError):
    """A model that cannot be simulated: it diverges, is too stiff, or two of its effects supersede the same term."""


class DivergedError(SimulationError):
    """A vehicle that diverges.

    Attributes
    ----------
    sample
        At which it does, where that is known.
    """

    def __init__(self, message: str, sample: int = 0) -> None:
        super().__init__(message)
        self.sample = sample


class Simulation(NamedTuple):
    """Series [vehicle, channel, n] and the sample at which each vehicle diverged [vehicle]; -1: never.

    Samples after a divergence are zeros: they do not show it.
    """

    series: FloatArray
    diverged: NDArray[np.int64]

    def converged(self) -> FloatArray:
        """Return the series; DivergedError where a vehicle diverged."""
        if np.any(self.diverged >= 0):
            raise DivergedError("the vehicle diverges", int(np.max(self.diverged)))
        return self.series


@dataclass(frozen=True, eq=False)
class Prediction:
    """A model's motion on a segment: all channels simulated [channel, n], and the compared ones filtered.

    `diverged_at` [s]: the series is NaN then.
    """

    segment: Segment
    series: FloatArray
    comparison: Comparison
    diverged_at: float | None = None


@dataclass(frozen=True, eq=False)
class Predictor:
    """A model on a segment.

    Attributes
    ----------
    given_steps
        RK4 steps per sample; None: as many as the model needs.
    initial_state
        State [q, q'] at the first sample; None: at rest.
    filter
        Comparison filter, applied in the kernel; None: channels as simulated.
    """

    model: Model
    segment: Segment
    given_steps: int | None = None
    initial_state: FloatArray | None = None
    filter: ZeroPhaseFilter | None = None

    @cached_property
    def steps(self) -> int:
        """RK4 steps per sample."""
        return self.given_steps or required_steps(self.model, self.segment)

    def simulate(
        self,
        channels: Sequence[str] | None = None,
        *,
        batch: Batch | None = None,
        vehicles: Vehicles | None = None,
        table: FloatArray | None = None,
        jobs: int | None = 1,
    ) -> Simulation:
        """Simulate the model, or other vehicles in its place, over the segment.

        Parameters
        ----------
        channels
            Names; all measured channels by default.
        batch, vehicles
            Other numbers, and another structure, than the model's. The model itself has the phases of the segment.
        table
            Input table in the place of the measured one, for example with noise.
        """
        model, segment = self.model, self.segment
        vehicles = vehicles or model.vehicles(segment.coach_forces)
        batch = model.on_segment(*segment.segment_key).single_batch() if batch is None else batch
        if self.initial_state is not None:
            batch = batch.with_initial_states(self.initial_state)
        table = segment.table(model.wheelset_spacing(), self.steps) if table is None else table
        names = segment.channels if channels is None else channels
        return Simulation(
            *vehicles.simulate(batch, table, segment.dt, self.steps, names, filter=self.filter, jobs=jobs)
        )

    def predict(self, campaign: Campaign) -> Prediction:
        """Simulate all measured channels and compare them as the campaign defines it."""
        series, diverged = self.simulate()
        if diverged[0] >= 0:
            return undefined_prediction(campaign, self.segment, int(diverged[0]))
        return Prediction(self.segment, series[0], compare(campaign, self.segment, series[0]))


def undefined_prediction(campaign: Campaign, segment: Segment, sample: int) -> Prediction:
    """Return the prediction of a model that diverges at a sample: its series is NaN."""
    undefined = np.full((len(segment.channels), segment.samples), np.nan)
    return Prediction(segment, undefined, compare(campaign, segment, undefined), float(segment.columns["t"][sample]))


def required_steps(model: Model, segment: Segment, damped_mode_step: float = 1.0) -> int:
    """Number of RK4 steps per sample that a model needs on a segment.

    damped_mode_step: largest abs(lambda) h of damped linear modes.

    Raises
    ------
    SimulationError
        Where there are too many, or two effects supersede the same term.
    """
    batch = model.on_segment(*segment.segment_key).single_batch()
    try:
        vehicles = model.vehicles(segment.coach_forces)
        [steps] = vehicles.required_steps(batch, *segment.speeds, segment.dt, damped_mode_step=damped_mode_step)
    except ValueError as error:
        raise SimulationError(f"{segment.file}: {error}") from error
    return max(steps, segment.least_steps)


def required_steps_each(
    vehicles: Vehicles, batch: Batch, segment: Segment, damped_mode_step: float = 1.0
) -> NDArray[np.int64]:
    """Number of RK4 steps per sample that each vehicle of a batch needs, as `required_steps`; -1 where too many."""
    try:
        steps = vehicles.required_steps(batch, *segment.speeds, segment.dt, damped_mode_step=damped_mode_step)
    except ValueError:
        if len(batch) == 1:
            return np.array([-1])
        singles = [batch.select([i]) for i in range(len(batch))]
        return np.concatenate([required_steps_each(vehicles, one, segment, damped_mode_step) for one in singles])
    return np.maximum(steps, segment.least_steps)
