"""Expected result of planned runs: minimum detectable effects, standard deviations, confounded effects.

With the inner products G of parameters s and effects d over the estimation runs, an effect of amount 1 leaves
n = G_dd - G_ds (G_ss + P)^-1 G_sd of its squared length, P the priors; the standard deviation of its score comes from
realisations of the noise. The criteria of detection are those of the loop.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.loop_settings import LoopSettings
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.covariance import effective_freedom
from railui.identification.structure.candidates import Candidate
from railui.identification.structure.gain_forecast import PredictedGain
from railui.identification.structure.minimum_detectable import (
    POWER_QUANTILE,
    detectable_rows,
    minimum_detectable_amount,
)
from railui.identification.structure.score_result import MIN_SCORE_FREEDOM
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.student import from_normal, noncentrality
from railui.planning.information import Information
from railui.planning.run_information import RunInformation
from railui.planning.validation_products import ValidationProducts

SEPARATION = 1.6449  # normal quantile of the one-sided 5 % level at which two effects are separated
MAX_DRAWS = 500  # of the largest score over the library under noise
MAX_RIVALS = 3
# cached properties that depend on the estimation runs alone, and on the validation run
OF_ESTIMATION = ("gram", "absorbed", "parameter_sd", "scores", "critical_score")
OF_VALIDATION = ("noise_floor", "predicted_gains", "amounts")


@dataclass(frozen=True)
class Choice:
    """Sensors and runs of a plan: numbers of the estimation runs and of the validation run."""

    channels: tuple[str, ...]
    estimation: tuple[int, ...]
    validation: int


@dataclass(frozen=True)
class ExpectedScore:
    """Score that an amount of a shape will have: squared length left, its standard deviation under noise."""

    candidate: Candidate
    shape: int
    norm: float
    unabsorbed_share: float
    sd: float
    degrees_of_freedom: float

    def detectable_amount(self, critical: float, power_quantile: float) -> float:
        """Return the amount whose score exceeds a critical one [standard normal] with the power of a quantile."""
        freedom = self.degrees_of_freedom
        return noncentrality(from_normal(critical, freedom), freedom, power_quantile) * self.sd / self.norm


@dataclass(frozen=True)
class Rival:
    """An effect that explains a part of another one.

    Attributes
    ----------
    correlation
        Of both output differences, after projection on what the parameters leave.
    separable_from
        Amount from which data distinguish the two with 90 % power, over the minimum detectable amount.
    """

    candidate: Candidate
    correlation: float
    separable_from: float


class Expectation:
    """Expected result of a choice of sensors and runs.

    Parameters
    ----------
    min_relative_gain
        Share by which an effect must lower the validation error.
    critical_score
        That of the family-wise test; computed for the choice by default.
    """

    def __init__(
        self,
        information: Information,
        choice: Choice,
        settings: LoopSettings,
        min_relative_gain: float,
        seed: int = 0,
        critical_score: float | None = None,
    ) -> None:
        self.information = information
        self.choice = choice
        self.settings = settings
        self.min_relative_gain = min_relative_gain
        self.seed = seed
        self.given_critical_score = critical_score
        self.parameters = len(information.free.paths)

    @cached_property
    def gram(self) -> FloatArray:
        """Inner products [p + k, p + k] over the chosen sensors and estimation runs."""
        return np.asarray(sum(run.gram[self._rows(run)].sum(axis=0) for run in self._estimation))

    @cached_property
    def noise_energy(self) -> float:
        """Expected misfit of the true model."""
        return float(sum(run.noise[self._rows(run)].sum() for run in self._estimation))

    @cached_property
    def _inverse(self) -> FloatArray:
        p = self.parameters
        a = self.gram[:p, :p] + np.diag(self._precision)
        return scaled_inverse(a, 1e-10)

    @cached_property
    def _precision(self) -> FloatArray:
        """Precision [p] of the priors on the scale of the inner products."""
        samples = sum(run.samples * len(self.choice.channels) for run in self._estimation)
        share = self.settings.calibration.independent_sample_share
        return np.asarray(self.noise_energy / (share * samples) / self.information.free.prior_sd**2)

    @cached_property
    def absorbed(self) -> FloatArray:
        """Change [k, p] of the parameters that absorbs an amount of 1 of each shape."""
        p = self.parameters
        return np.asarray(self.gram[p:, :p] @ self._inverse)

    @property
    def _estimation(self) -> list[RunInformation]:
        return [self.information.runs[i] for i in self.choice.estimation]

    def _rows(self, run: RunInformation) -> list[int]:
        return [run.channels.index(c) for c in self.choice.channels]

    @cached_property
    def parameter_sd(self) -> FloatArray:
        """Standard deviation [p] of every estimate: noise through the least squares, and the priors."""
        p = self.parameters
        estimates = self._noise_scores[:, :p] @ self._inverse
        prior_sd = self.information.free.prior_sd
        priors = self._inverse * self._precision * np.where(np.isfinite(prior_sd), prior_sd, 0.0)
        return np.asarray(np.sqrt(np.sum(estimates**2, axis=0) + np.sum(priors**2, axis=1)))

    @cached_property
    def _projected_noise(self) -> FloatArray:
        """Scores [sample, k] of noise after projection; their sum of squares is the variance of the score."""
        p = self.parameters
        return np.asarray(self._noise_scores[:, p:] - self._noise_scores[:, :p] @ self.absorbed.T)

    @cached_property
    def _noise_scores(self) -> FloatArray:
        """Scores [sample, p + k] of noise on the estimation runs, scaled to the length of each run."""
        parts = [run.realisation_scale * run.noise_scores[:, self._rows(run)].sum(axis=1) for run in self._estimation]
        return np.concatenate(parts)

    @cached_property
    def scores(self) -> list[ExpectedScore | None]:
        """Expected score [k] of every shape; None where the parameters absorb it, or its sensor is not recorded."""
        p, test = self.parameters, self.settings.score_test
        total = np.diag(self.gram)[p:]
        left = total - np.einsum("kp,kp->k", self.absorbed, self.gram[p:, :p])
        sd = np.sqrt(np.sum(self._projected_noise**2, axis=0))
        freedom = self._degrees_of_freedom()
        found: list[ExpectedScore | None] = []
        for k, (candidate, shape) in enumerate(self.information.keys):
            least = test.min_remaining_share_linear if candidate.is_linear else test.min_remaining_share
            share = left[k] / max(total[k], 1e-300)
            is_usable = total[k] > 0.0 and share > least and sd[k] > 0.0
            found.append(
                ExpectedScore(candidate, shape, float(left[k]), float(share), float(sd[k]), float(freedom[k]))
                if is_usable
                else None
            )
        return found

    def _degrees_of_freedom(self) -> FloatArray:
        """Effective number [k] of blocks less one: an intermittent effect acts in few."""
        norms = np.concatenate([run.block_norms[:, self._rows(run)].sum(axis=1) for run in self._estimation])
        leverage = norms[:, self.parameters :] / np.maximum(norms[:, self.parameters :].sum(axis=0), 1e-300)
        return effective_freedom(leverage, MIN_SCORE_FREEDOM)

    @cached_property
    def critical_score(self) -> float:
        """Largest score over the library that noise exceeds at the significance level."""
        if self.given_critical_score is not None:
            return self.given_critical_score
        usable = [k for k, score in enumerate(self.scores) if score is not None]
        if not usable:
            return float("inf")
        noise = self._projected_noise[:, usable]
        noise = noise / np.maximum(np.linalg.norm(noise, axis=0), 1e-300)
        rng = np.random.default_rng(np.random.SeedSequence([self.seed, 23]))
        draws = min(self.settings.score_test.bootstrap_draws, MAX_DRAWS)
        drawn = rng.standard_normal((draws, len(noise))) @ noise
        one_sided = np.array([self.information.keys[k][0].is_one_sided for k in usable])
        highest = np.where(one_sided, drawn, np.abs(drawn)).max(axis=1)
        return float(np.quantile(highest, 1.0 - self.settings.score_test.significance_level))

    @cached_property
    def noise_floor(self) -> float:
        """NRMSE on the validation run that noise alone leaves."""
        return self._validation.noise_floor

    @property
    def _validation(self) -> ValidationProducts:
        return self.information.validation_products(self.choice.validation, self.choice.channels)

    @cached_property
    def predicted_gains(self) -> list[PredictedGain]:
        """NRMSE^2 on the validation run that an amount of 1 of each shape [k] adds, and its product with noise."""
        mean = self._validation.outputs.left(self.absorbed)
        sd = np.sqrt(self._validation.scores.left(self.absorbed))
        return [PredictedGain(m, s) for m, s in zip(mean.tolist(), sd.tolist(), strict=True)]

    def validated_on(self, number: int) -> Expectation:
        """Return the expectation with another validation run; the estimation runs are not evaluated again."""
        for name in OF_ESTIMATION:
            getattr(self, name)  # cached before it is copied
        other = copy(self)
        other.choice = replace(self.choice, validation=number)
        for name in OF_VALIDATION:
            other.__dict__.pop(name, None)
        return other

    @cached_property
    def amounts(self) -> FloatArray:
        """Minimum detectable amount [k] of every shape; infinite where there is none."""
        test = ScoreTestResult((), (), 1.0, self.critical_score, self.noise_energy, self.settings.score_test)
        amounts = np.full(len(self.scores), np.inf)
        for k, (score, gain) in enumerate(zip(self.scores, self.predicted_gains, strict=True)):
            if score is not None and gain.mean > 0.0:
                gains = {(score.candidate, score.shape): gain}
                amounts[k] = minimum_detectable_amount(score, test, self.min_relative_gain, self.noise_floor, gains)
        return amounts

    def detectable(self) -> list[dict[str, Any]]:
        """Return the rows of the minimum detectable effects, as the report of a loop has them."""
        usable = [
            score
            for score, amount in zip(self.scores, self.amounts, strict=True)
            if score is not None and np.isfinite(amount)
        ]
        by_key = dict(zip(self.information.keys, self.amounts.tolist(), strict=True))
        return detectable_rows(usable, lambda score: by_key[score.candidate, score.shape])

    def least_amounts(self) -> dict[Candidate, float]:
        """Minimum detectable amount of each candidate, over its shapes."""
        least: dict[Candidate, float] = {}
        for (candidate, _), amount in zip(self.information.keys, self.amounts, strict=True):
            least[candidate] = min(least.get(candidate, np.inf), float(amount))
        return least

    def rivals(self) -> dict[Candidate, list[Rival]]:
        """Effects that data at the minimum detectable amount do not separate from each candidate, the closest first."""
        p = self.parameters
        projected = self.gram[p:, p:] - self.absorbed @ self.gram[:p, p:]
        usable = np.array([s is not None and np.isfinite(a) for s, a in zip(self.scores, self.amounts, strict=True)])
        length = np.sqrt(np.maximum(np.diag(projected), 1e-300))
        correlation = np.where(usable, projected / np.outer(length, length), 0.0)
        shapes: dict[Candidate, list[int]] = {}
        for k in np.flatnonzero(usable):
            shapes.setdefault(self.information.keys[k][0], []).append(int(k))
        found = {}
        for candidate, own in shapes.items():
            best = own[int(np.argmin(self.amounts[own]))]
            score = self.scores[best]
            assert score is not None
            rows = [
                self._rival(other, _best_correlation(correlation[best, theirs], other), best, score)
                for other, theirs in shapes.items()
                if other is not candidate
            ]
            confounded = sorted((r for r in rows if r.separable_from > 1.0), key=lambda r: -r.separable_from)
            if confounded:
                found[candidate] = confounded[:MAX_RIVALS]
        return found

    def _rival(self, other: Candidate, correlation: float, k: int, score: ExpectedScore) -> Rival:
        left = max(1.0 - correlation**2, 1e-12)
        amount = (SEPARATION + POWER_QUANTILE) * score.sd / score.norm / np.sqrt(left)
        return Rival(other, correlation, float(amount / self.amounts[k]))


def _best_correlation(correlations: FloatArray, rival: Candidate) -> float:
    """Correlation of the shape of a rival that explains most; a one-sided rival explains nothing of the other sign."""
    usable = np.maximum(correlations, 0.0) if rival.is_one_sided else correlations
    return float(usable[int(np.argmax(np.abs(usable)))])


__all__ = ["Choice", "Expectation", "ExpectedScore", "Rival"]
