"""Events of an identification, passed to `Progress.event` while it runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from railui.arrays import FloatArray

if TYPE_CHECKING:
    from railui.identification.estimation.validation import Validation
    from railui.identification.structure.score_result import ScoreResult


@dataclass(frozen=True, eq=False)
class FitIteration:
    """State of a fit after one iteration.

    Attributes
    ----------
    values
        Estimates [p] of the numbers at `paths`.
    channels
        Relative error of each channel.
    rho
        Correlation [p] of the residual with each sensitivity. At the optimum every rho is 0, except for parameters
        that a prior or a bound keeps away from it.
    simulations
        Vehicles simulated so far.
    """

    iteration: int
    paths: tuple[str, ...]
    values: FloatArray
    channels: Mapping[str, float]
    rho: FloatArray
    simulations: int


@dataclass(frozen=True, eq=False)
class ModelValidated:
    """A model validated on the validation runs; `stage` is declared, before or after."""

    stage: str
    validation: Validation


@dataclass(frozen=True, eq=False)
class ScoreTestProgress:
    """Progress of a score test: batches of candidates simulated, and the results of the last batch."""

    done: int
    total: int
    results: tuple[ScoreResult, ...]
