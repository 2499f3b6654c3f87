"""What a long study shows while it works: whoever watches gets every event, and stops the study by raising Stopped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from railui.arrays import FloatArray

if TYPE_CHECKING:
    from railui.identification.estimation.validation import Validation
    from railui.identification.structure.evidence import ScoreResult


@dataclass(frozen=True, eq=False)
class FitIteration:
    """A fit after one step: values [p] of its paths, error per channel, rho [p] of the residual with each sensitivity.

    At the optimum every rho is 0, but for parameters that a prior or a bound holds.
    """

    iteration: int
    paths: tuple[str, ...]
    values: FloatArray
    channels: Mapping[str, float]
    rho: FloatArray
    simulations: int


@dataclass(frozen=True, eq=False)
class ModelValidated:
    """A model judged on the validating runs: `which` is declared, before or after."""

    stage: str
    validation: Validation


@dataclass(frozen=True, eq=False)
class ScoreTestProgress:
    """How far a trace is: bundles of candidates looked at, and what was seen of the last one."""

    done: int
    total: int
    results: tuple[ScoreResult, ...]
