"""Prior of the vehicles: what the hierarchical models of all quantities teach about levels, trends and scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.fleet.level_filter import Levels
from railui.fleet.mixed_model import MixedModel, QuantityRuns, fit_mixed_model
from railui.fleet.observations import PARAMETER, Observations

ITERATIONS: Final = {False: 20, True: 6}  # of the first fit, and of one that starts from the one before
MAX_SHARE: Final = 1.5  # of a vehicle's parameter over that of the fleet
MEDIAN_VARIANCE: Final = 0.5 * np.pi  # of a median over that of a mean


@dataclass(frozen=True, eq=False)
class FleetPrior:
    """Prior of levels and trends, slopes and variances of q quantities.

    Attributes
    ----------
    models
        Hierarchical models [q].
    mean, slope
        Of the fleet [q].
    mean_sd, slope_sd
        Their standard deviations [q].
    level_variance, trend_variance
        Between vehicles [q].
    covariate_slopes, covariate_sd
        Slopes over temperature and load [2, q], and their standard deviations.
    run_variance
        Factor of the variances of the runs [q].
    cell_variance
        Between sections and blocks [q].
    freedom
        Degrees of freedom of the scatter [q].
    share
        Factor [v, q] of the slopes over temperature and load: see `relative_levels`.
    """

    models: tuple[MixedModel, ...]
    mean: FloatArray
    slope: FloatArray
    mean_sd: FloatArray
    slope_sd: FloatArray
    level_variance: FloatArray
    trend_variance: FloatArray
    covariate_slopes: FloatArray
    covariate_sd: FloatArray
    run_variance: FloatArray
    cell_variance: FloatArray
    freedom: FloatArray
    share: FloatArray

    @classmethod
    def of_models(cls, models: Sequence[MixedModel], share: FloatArray) -> FleetPrior:
        """Collect the numbers of the models."""
        fixed = np.array([m.fixed for m in models]).T
        fixed_sd = np.array([m.fixed_sd for m in models]).T

        def each(name: str) -> FloatArray:
            return np.array([getattr(m, name) for m in models])

        return cls(
            tuple(models),
            fixed[0],
            fixed[3],
            fixed_sd[0],
            fixed_sd[3],
            each("level_variance"),
            each("slope_variance"),
            fixed[1:3],
            fixed_sd[1:3],
            each("variance"),
            each("cell_variance"),
            each("freedom"),
            share,
        )

    def levels(self, vehicles: int) -> Levels:
        """Return the prior of so many vehicles."""
        ones = np.ones((vehicles, len(self.mean)))
        level, trend = self.level_variance + self.mean_sd**2, self.trend_variance + self.slope_sd**2
        return Levels(self.mean * ones, self.slope * ones, level * ones, 0.0 * ones, trend * ones)

    def levels_among(self, present: Levels, use: FloatArray, taught: NDArray[np.bool_]) -> Levels:
        """Return the prior about the present values of the vehicles that count [v, q].

        Notes
        -----
        Sisters determine levels up to what sections and blocks have in common. A level that is learnt anew is
        therefore not expected at the mean of the fleet, whose estimate changes with every fit, but at the same
        distance from it as the median of the other vehicles.
        """
        prior = self.levels(len(use))
        beyond = np.where(taught, present.predict(use) - prior.predict(use), np.nan)
        count = np.maximum(taught.sum(axis=0), 1)
        known = np.asarray(taught.any(axis=0))
        shift = np.zeros(len(self.mean))
        if known.any():
            shift[known] = np.nanmedian(beyond[:, known], axis=0)
        doubt = np.where(known, MEDIAN_VARIANCE * self.level_variance / count, 0.0)
        return Levels(prior.a + shift, prior.b, prior.aa + doubt, prior.ab, prior.bb)


def fit_fleet_prior(
    data: Observations, runs: NDArray[np.bool_], cell: NDArray[np.int64], previous: FleetPrior | None
) -> FleetPrior:
    """Fit the hierarchical model of every quantity to some runs.

    cell: section and block of every run. previous: prior whose variances the iteration starts from.
    """
    cells, numbers = np.unique(cell[runs], return_inverse=True)
    share = relative_levels(data, runs)
    models = []
    for j in range(len(data.quantities)):
        units, unit = np.unique(data.unit[runs, j], return_inverse=True)
        quantity = QuantityRuns(
            data.y[runs, j],
            data.sd[runs, j],
            data.covariates[runs] * share[data.vehicle[runs], j, None],
            data.use[runs, j],
            unit,
            numbers,
            (len(units), len(cells)),
        )
        start = previous.models[j] if previous else None
        models.append(fit_mixed_model(quantity, start, ITERATIONS[previous is not None]))
    return FleetPrior.of_models(models, share)


def relative_levels(data: Observations, runs: NDArray[np.bool_]) -> FloatArray:
    """Median of every vehicle over that of the fleet [v, q], 1 for quantities that are no parameters.

    Temperature and load change a parameter by a share of its value, which differs between vehicles.
    """
    share = np.ones((len(data.vehicles), len(data.quantities)))
    columns = np.array([j for j, q in enumerate(data.quantities) if q.kind == PARAMETER], dtype=np.int64)
    usual = np.median(data.y[runs][:, columns], axis=0)
    for v in np.unique(data.vehicle[runs]):
        own = np.median(data.y[runs & (data.vehicle == v)][:, columns], axis=0)
        share[v, columns] = np.clip(own / np.where(usual == 0.0, np.inf, usual), 1.0 / MAX_SHARE, MAX_SHARE)
    return share
