"""Identifiability: directions of the weighted sensitivities, profile likelihoods and parameters per track section."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.settings.estimation import IdentifiabilitySettings
from railui.identification.context import Context
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.covariance import block_covariance
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.fixed_parameter import fit_with_parameter_fixed
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.prediction import SimulationError

PROFILE_POINTS = (-3.0, -1.5, 1.5, 3.0)  # standard deviations from the estimate
DEVIANCE_90 = 2.706  # rise of the deviance at the ends of a 90 % interval: chi-squared of one degree of freedom
PROFILE_ITERATIONS = 3
PROFILE_TOLERANCE = 1e-5
MAX_PARTNERS = 3
SECTION_LOOSENESS = 100.0  # variance within which a section may differ from the whole run, in that of its estimate
MIN_FACTOR = 1e-3  # of correlation in time
WIDE_PRIOR = 10.0  # relative standard deviation that remains of what the data do not show
DETERMINED, ROUGH = "determined", "determined roughly"
COMBINED, UNSEEN = "only in combination", "not seen by these sensors"


@dataclass(frozen=True)
class Direction:
    """A direction in the space of relative changes: singular value, its standard deviation, its main parts."""

    singular_value: float
    sd: float
    parts: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Identifiability:
    """Directions and classes of the parameters.

    Attributes
    ----------
    directions
        The strongest first.
    classes
        Path, class, relative standard deviation from the data alone, and correlated paths.
    determined_sd
        Relative standard deviation up to which a parameter is determined.
    """

    directions: tuple[Direction, ...]
    classes: tuple[tuple[str, str, float, tuple[str, ...]], ...]
    determined_sd: float

    def sentences(self) -> list[str]:
        """Summarise the classes in sentences."""
        lines = []
        if determined := [p for p, word, _, _ in self.classes if word == DETERMINED]:
            lines.append(f"determined to {100 * self.determined_sd:.0f} % or better: {', '.join(determined)}")
        if rough := [f"{p} ({100 * sd:.0f} %)" for p, word, sd, _ in self.classes if word == ROUGH]:
            lines.append(f"determined roughly: {', '.join(rough)}")
        groups = {tuple(sorted({p, *partners})) for p, word, _, partners in self.classes if word == COMBINED}
        lines += [f"only this combination is determined: {', '.join(group)}" for group in sorted(groups)]
        if unseen := [p for p, word, _, _ in self.classes if word == UNSEEN]:
            lines.append(f"not seen by these sensors: {', '.join(unseen)}")
        return lines


def analyse_identifiability(fit: Fit, settings: IdentifiabilitySettings) -> Identifiability:
    """Classify parameters by the singular values of the sensitivities, weighted by noise, per relative change.

    A change of a parameter by its own value counts 1, and by its usual size where it is zero. Priors are left out. The
    standard deviations, of parameters and along directions, are those from blocks of time as of the estimates: how much
    noise that is correlated in time adds differs from direction to direction.
    """
    size = np.where(np.abs(fit.x) > 0, np.abs(fit.x), fit.free.size)
    information = fit.normal.total[1:, 1:] * np.outer(size, size) / fit.normal.misfit_per_sample
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    values = np.maximum(values, 1e-12)
    covariance = _covariance_from_data(fit, size)
    along = np.sqrt(np.einsum("ik,ij,jk->k", vectors, covariance, vectors))
    directions = tuple(
        _direction(fit.free.paths, float(along[k]), vectors[:, k], settings.direction_part) for k in np.argsort(along)
    )
    alone = np.sqrt(_correlation_factors(fit) / np.maximum(np.diag(information), 1e-12))
    together = np.sqrt(np.diag(covariance))
    of_white_noise = (vectors / values) @ vectors.T
    sd_of_white_noise = np.sqrt(np.diag(of_white_noise))
    correlation = np.abs(of_white_noise / np.outer(sd_of_white_noise, sd_of_white_noise))
    classes = []
    for i, path in enumerate(fit.free.paths):
        order = [j for j in np.argsort(-correlation[i]) if j != i]
        partners = tuple(fit.free.paths[j] for j in order if correlation[i, j] > settings.partner_correlation)
        sd = float(together[i])
        if sd <= settings.determined_sd:
            classes.append((path, DETERMINED, sd, ()))
        elif alone[i] <= settings.roughly_determined_sd and partners:
            classes.append((path, COMBINED, sd, partners[:MAX_PARTNERS]))
        elif sd <= settings.roughly_determined_sd:
            classes.append((path, ROUGH, sd, ()))
        else:
            classes.append((path, UNSEEN, sd, ()))
    return Identifiability(directions, tuple(classes), settings.determined_sd)


def _covariance_from_data(fit: Fit, size: FloatArray) -> FloatArray:
    """Covariance [p, p] per relative change from the data, with a prior so wide that it determines nothing."""
    precision = 1.0 / (WIDE_PRIOR * size) ** 2
    blocks = fit.normal.gram.sum(axis=1)
    return block_covariance(blocks, precision, fit.normal.variance) / np.outer(size, size)


def _correlation_factors(fit: Fit) -> FloatArray:
    """Factors [p] by which statistics of white noise would understate the variance of each parameter alone."""
    scores = fit.normal.gram.sum(axis=1)[:, 1:, 0]
    white = np.maximum(np.diag(fit.normal.total)[1:] * fit.normal.misfit_per_sample, 1e-300)
    return np.asarray(np.maximum(np.sum((scores - scores.mean(axis=0)) ** 2, axis=0) / white, MIN_FACTOR))


def _direction(paths: Sequence[str], sd: float, vector: FloatArray, least_part: float) -> Direction:
    v = vector * np.sign(vector[np.argmax(np.abs(vector))])
    parts = [(paths[int(i)], float(v[i])) for i in np.flatnonzero(np.abs(v) >= least_part)]
    return Direction(1.0 / max(sd, 1e-150), sd, tuple(sorted(parts, key=lambda p: -abs(p[1]))))


def parameter_flags(fit: Fit, settings: IdentifiabilitySettings) -> list[str | None]:
    """Flag each free parameter as bound, unseen, correlated or None."""
    sd = fit.sd
    scaled = fit.covariance / np.outer(np.maximum(sd, 1e-300), np.maximum(sd, 1e-300))
    off_diagonal = np.abs(scaled - np.diag(np.diag(scaled)))
    is_on_bound = fit.free.are_on_bound(fit.x)
    flags: list[str | None] = []
    for i in range(len(fit.x)):
        prior_sd = fit.free.prior_sd[i]
        if is_on_bound[i]:
            flags.append("bound")
        elif np.isfinite(prior_sd) and sd[i] > settings.unseen_prior_share * prior_sd:
            flags.append("unseen")
        elif off_diagonal.size and off_diagonal[i].max() > settings.flagged_correlation:
            flags.append("correlated")
        else:
            flags.append(None)
    return flags


@dataclass(frozen=True, eq=False)
class Profile:
    """Profile likelihood: deviance [point] at values [point] of a parameter, and the ends of its 90 % interval."""

    path: str
    values: FloatArray
    deviance: FloatArray
    low: float | None
    high: float | None


def profile_likelihood(context: Context, fit: Fit, path: str) -> Profile:
    """Compute the profile likelihood of one parameter: it is fixed at points, all others are estimated again.

    The deviance is scaled so that its curvature at the estimate agrees with the standard deviation from blocks, and the
    points are moved by the last step of the estimate, to which the misfit does not belong.
    """
    context = context.in_background(context.jobs)
    j = fit.free.paths.index(path)
    sd = fit.sd[j]
    center, shift = fit.least_squares, float(fit.x[j] - fit.least_squares[j])
    scale = _profile_scale(context, fit, j)
    values, deviance = [float(center[j])], [0.0]
    for reach in PROFILE_POINTS:
        value = float(np.clip(center[j] + reach * sd, fit.free.low[j], fit.free.high[j]))
        if value in values:
            continue
        try:
            refit = fit_with_parameter_fixed(
                context, fit, j, value, tolerance=PROFILE_TOLERANCE, max_iterations=PROFILE_ITERATIONS
            )
        except SimulationError:
            continue  # diverges there: the interval ends before
        prior = ((value - fit.free.prior[j]) / fit.free.prior_sd[j]) ** 2
        values.append(value)
        deviance.append(max(refit.cost + prior - fit.cost, 0.0) * scale)
    order = np.argsort(values)
    v, d = np.array(values)[order] + shift, np.array(deviance)[order]
    middle = int(np.argmin(d))
    low = _interval_end(v[: middle + 1][::-1], d[: middle + 1][::-1])
    return Profile(path, v, d, low, _interval_end(v[middle:], d[middle:]))


def _profile_scale(context: Context, fit: Fit, j: int) -> float:
    """Variance of a parameter in the cost function over its variance from blocks."""
    optimiser = GaussNewton.of_fit(context, fit)
    a, _ = optimiser.equations(fit.normal, fit.x)
    unit = 1.0 / np.sqrt(np.diag(a))
    return float(float(np.linalg.inv(a * np.outer(unit, unit))[j, j]) * unit[j] ** 2 / fit.sd[j] ** 2)


def _interval_end(values: FloatArray, deviance: FloatArray) -> float | None:
    """Value at which the deviance crosses 2.706, its root linear between points; None where it does not."""
    root = np.sqrt(deviance)
    level = np.sqrt(DEVIANCE_90)
    for k in range(1, len(root)):
        if root[k] >= level > root[k - 1]:
            part = (level - root[k - 1]) / (root[k] - root[k - 1])
            return float(values[k - 1] + part * (values[k] - values[k - 1]))
    return None


def profile_likelihoods(context: Context, fit: Fit, paths: Sequence[str]) -> list[Profile]:
    """Compute the profiles of several parameters."""
    profiles = []
    for path in paths:
        profile = profile_likelihood(context, fit, path)
        ends = [f"{x:.5g}" if x is not None else "open" for x in (profile.low, profile.high)]
        context.progress.message(f"  profile of {path}: 90 % from {ends[0]} to {ends[1]}")
        profiles.append(profile)
    return profiles


@dataclass(frozen=True, eq=False)
class SectionEstimates:
    """Estimates [section, path] with standard deviations on track sections [section, (from, to)] in m."""

    paths: tuple[str, ...]
    sections: FloatArray
    values: FloatArray
    sd: FloatArray

    @property
    def chi2(self) -> FloatArray:
        """Reduced chi-squared [path] of the sections' values about their common one.

        About 1 where the parameter is constant and determined by the data; less where a prior holds it, or where few
        blocks of time widen the standard deviations.
        """
        weight = 1.0 / np.maximum(self.sd, 1e-150) ** 2
        mean = np.sum(weight * self.values, axis=0) / np.sum(weight, axis=0)
        return np.asarray(np.sum(weight * (self.values - mean) ** 2, axis=0) / max(len(self.values) - 1, 1))


def estimate_per_section(context: Context, fit: Fit, length: float) -> SectionEstimates:
    """Estimate every parameter on track sections of so many metres each, by one linear step from the common values.

    Priors determine what a section alone does not.

    Raises
    ------
    ValueError
        Where no section has as many blocks of time as it needs.
    """
    min_blocks = context.settings.identifiability.min_section_blocks
    s = fit.block_abscissae()
    gram = fit.normal.gram.sum(axis=1)
    count = max(1, int(np.ceil((s.max() - s.min()) / length)))
    section = np.minimum(((s - s.min()) / length).astype(int), count - 1)  # the last edge belongs to the last section
    values, sds, sections = [], [], []
    for k in range(count):
        inside = section == k
        if inside.sum() < min_blocks:
            continue
        estimate, sd = _section_estimate(fit, gram[inside].sum(axis=0), SECTION_LOOSENESS * count)
        start = s.min() + k * length
        values.append(estimate)
        sds.append(sd)
        sections.append((start, min(start + length, float(s.max()))))
    if not values:
        enough = (min_blocks + 1) * float(np.median(np.diff(s)))
        least = f"give at least {enough:.0f} m" if enough > length else "measure longer runs"
        raise ValueError(f"sections of {length:g} m are too short to estimate parameters on each, {least}")
    return SectionEstimates(fit.free.paths, np.array(sections), np.array(values), np.array(sds))


def _section_estimate(fit: Fit, gram: FloatArray, looseness: float) -> tuple[FloatArray, FloatArray]:
    """Estimates and standard deviations [p] from the products [1 + p, 1 + p] of a section.

    looseness: variance within which a section may differ from the whole run, in that of its estimate.

    The blocks of a section are too few for a variance of their own. That of the whole run grows as the inverse of the
    normal matrix does.
    """
    variance = fit.normal.variance
    priors = variance / fit.free.prior_sd**2
    loose = variance / np.maximum(looseness * fit.covariance.diagonal(), 1e-300)
    inverse = scaled_inverse(gram[1:, 1:] + np.diag(priors + loose))
    of_whole = scaled_inverse(fit.normal.total[1:, 1:] + np.diag(priors))
    step = inverse @ (gram[1:, 0] + priors * (fit.free.prior - fit.least_squares))
    growth = np.maximum(inverse.diagonal(), 0.0) / np.maximum(of_whole.diagonal(), 1e-300)
    return fit.x + step, np.asarray(fit.sd * np.sqrt(growth))
