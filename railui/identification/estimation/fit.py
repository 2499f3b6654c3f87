"""Result of a fit: estimates with their covariance, and the normal equations in blocks of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.campaign.settings.estimation import CalibrationSettings
from railui.identification.estimation.block_products import block_length
from railui.identification.estimation.covariance import block_covariance, block_degrees_of_freedom
from railui.identification.estimation.free_parameters import FreeParameters
from railui.identification.estimation.problem import FitSegment
from railui.vehicle.model import Model

MIN_HUNTING_FREQUENCY = 3.0  # rad/s, where the hunting frequency sets the length of a block
LEAST_BLOCKS = 4  # of a short record: a single one would have no scatter, and count as exact
DEFAULT_HUNTING_FREQUENCY = 6.0  # rad/s, without any segment
OSCILLATING_FREQUENCY = 1.0  # rad/s, above which a mode counts as oscillating


def residual_variance(rss: float, samples: float, independent_share: float) -> float:
    """Misfit per independent sample; a precision 1/sd^2 times it is comparable with the inner products.

    Neighbouring samples of a signal are correlated, so that a prior weighs more than their number suggests.
    """
    return rss / (independent_share * samples)


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Inner products per block of time.

    Attributes
    ----------
    gram
        Products [block, channel, 1 + p, 1 + p] of the residual and its p sensitivities.
    samples
        Compared samples.
    independent_share
        Share of the samples that counts as independent.
    """

    gram: FloatArray
    samples: int
    independent_share: float

    @property
    def total(self) -> FloatArray:
        """Sum over all blocks and channels [1 + p, 1 + p]."""
        return np.asarray(self.gram.sum(axis=(0, 1)))

    @property
    def rss(self) -> float:
        """The misfit: sum of the squared weighted residuals."""
        return float(self.total[0, 0])

    @property
    def misfit_per_sample(self) -> float:
        """Misfit per compared sample: about 1 where noise alone is left."""
        return self.rss / self.samples

    @property
    def variance(self) -> float:
        """Misfit per independent sample."""
        return residual_variance(self.rss, self.samples, self.independent_share)


@dataclass(frozen=True, eq=False)
class HeldPoint:
    """Estimates with a parameter moved that only a prior determines: the others have followed it.

    Attributes
    ----------
    index
        Number of the parameter.
    share
        Distance of the point, in that of a point of the quadrature over the prior.
    change
        Change [p] of all estimates.
    """

    index: int
    share: float
    change: FloatArray


@dataclass(frozen=True, eq=False)
class Fit:
    """A calibrated model.

    Attributes
    ----------
    x
        Estimates [p] of the free parameters.
    cost
        Deviance at the estimates.
    simulations
        Vehicles simulated.
    constrained
        True where the last points that the fit tried met the stability limit.
    block
        Duration [s] of a block of the normal equations.
    slips
        True for a fit on windows because the model falls out of step with the motion over whole runs.
    shift
        Last step [p] of the estimates, to which the normal equations do not belong; empty: none.
    given_covariance
        Covariance [p, p] after the last step; None: that of the normal equations.
    held_points
        Estimates with parameters moved that only a prior determines.
    samples
        Deviations [sample, p] of vehicles that reproduce the measured motions about as well; empty: none drawn.
    """

    model: Model
    free: FreeParameters
    x: FloatArray
    normal: NormalEquations
    cost: float
    iterations: int
    simulations: int
    status: str
    constrained: bool = False
    segments: tuple[FitSegment, ...] = field(default=(), repr=False)
    block: float = 1.0
    slips: bool = False
    shift: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)
    given_covariance: FloatArray | None = field(default=None, repr=False)
    held_points: tuple[HeldPoint, ...] = field(default=(), repr=False)
    samples: FloatArray = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance [p, p] of the estimates, by a jackknife over blocks: robust to correlation within a block."""
        if self.given_covariance is not None:
            return self.given_covariance
        blocks = self.normal.gram.sum(axis=1)
        return block_covariance(blocks, 1.0 / self.free.prior_sd**2, self.normal.variance)

    @cached_property
    def degrees_of_freedom(self) -> FloatArray:
        """Degrees of freedom [p] of the standard deviations, from the share of each block in the estimates."""
        return block_degrees_of_freedom(self.normal.gram.sum(axis=1), 1.0 / self.free.prior_sd**2, self.normal.variance)

    def block_samples(self, target: FitSegment) -> int:
        """Compared samples per block of the normal equations."""
        return block_length(self.block, target)

    @property
    def error_to_noise(self) -> float:
        """Error on the estimation runs over the error that noise leaves there."""
        return float(np.sqrt(self.normal.misfit_per_sample))

    @property
    def least_squares(self) -> FloatArray:
        """Estimates [p] at the least misfit, before their last step."""
        return self.x - self.shift if self.shift.size else self.x

    @property
    def sd(self) -> FloatArray:
        """Standard deviations of the estimates [p]."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def block_abscissae(self) -> FloatArray:
        """Distance [m], of a rig time [s], in the middle of every block of the normal equations, segment by segment."""
        middles = []
        for target in self.segments:
            x = target.trim(target.segment.abscissa)
            length = self.block_samples(target)
            middles += [float(np.mean(x[k : k + length])) for k in range(0, len(x), length)]
        return np.array(middles)


def block_duration(settings: CalibrationSettings, model: Model, segments: Sequence[Segment]) -> float:
    """Duration [s] of a block: some hunting periods, shorter for short runs; a share of a rig's record."""
    if not model.design.is_on_track:
        runs = [s.window_of or s for s in segments]
        return max(s.samples * s.dt for s in runs) / settings.rig_block_count
    eigenvalues = [model.eigenvalues(s.mean_speed)[0] for s in segments]
    hunting = min(
        (abs(z[np.argmax(np.where(z.imag > OSCILLATING_FREQUENCY, z.real, -np.inf))].imag) for z in eigenvalues),
        default=DEFAULT_HUNTING_FREQUENCY,
    )
    period = settings.block_hunting_periods * 2.0 * np.pi / max(hunting, MIN_HUNTING_FREQUENCY)
    total = sum(s.samples * s.dt for s in segments) if segments else np.inf
    duration = max(min(period, total / settings.block_count), settings.min_block_duration)
    return min(duration, total / LEAST_BLOCKS)
