"""What the measured motions determine: directions of the weighted sensitivity, profiles, parameters per stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.identification.estimation.output_error import Fit, GaussNewton, block_distances, residual_variance
from railui.progress import Report, silent

SURE = 0.10  # relative standard deviation up to which a number is determined
VAGUE = 0.5  # and up to which it is so roughly
TOLD = 0.3  # share of a direction from which a parameter is named in it
REACH = (-3.0, -1.5, 1.5, 3.0)  # standard deviations at which a profile is taken
NINETY = 2.706  # rise of the deviance at the ends of a 90 % interval
BLOCKS = 5  # of time that a stretch must hold at least
TURNS = 3  # refits of a profile's point
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
    """Directions, the strongest first; per path the word, its relative sd from the data alone, and its partners."""

    directions: tuple[Direction, ...]
    classes: tuple[tuple[str, str, float, tuple[str, ...]], ...]

    def sentences(self) -> list[str]:
        """The same in sentences."""
        sure = [p for p, word, _, _ in self.classes if word == DETERMINED]
        told = [f"determined to {100 * SURE:.0f} % or better: {', '.join(sure)}"] if sure else []
        rough = [f"{p} ({100 * sd:.0f} %)" for p, word, sd, _ in self.classes if word == ROUGH]
        told += [f"determined roughly: {', '.join(rough)}"] if rough else []
        pairs = {tuple(sorted({p, *partners})) for p, word, _, partners in self.classes if word == COMBINED}
        told += [f"only this combination is determined: {', '.join(pair)}" for pair in sorted(pairs)]
        lost = [p for p, word, _, _ in self.classes if word == UNSEEN]
        return told + ([f"not seen by these sensors: {', '.join(lost)}"] if lost else [])


def analyse_identifiability(fit: Fit) -> Identifiability:
    """Singular values of the sensitivities, weighted by noise and taken per relative change of each parameter.

    A change of a parameter by its own value counts 1; what is zero by its usual size. Priors are left out.
    """
    size = np.where(np.abs(fit.x) > 0, np.abs(fit.x), fit.free.size)
    scores = fit.normal.gram.sum(axis=1)[:, 1:, 0]
    total = fit.normal.total[1:, 1:] * np.outer(size, size)
    # blocks keep correlated residuals together: the factor by which white statistics are too sure
    white = np.maximum(np.diag(fit.normal.total)[1:] * fit.normal.rss / fit.normal.samples, 1e-300)
    factor = float(np.median(np.sum((scores - scores.mean(axis=0)) ** 2, axis=0) / white))
    information = total / (fit.normal.rss / fit.normal.samples) / max(factor, 1e-3)
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    values = np.maximum(values, 1e-12)
    paths = fit.free.paths
    directions = []
    for k in np.argsort(-values):
        v = vectors[:, k] * np.sign(vectors[np.argmax(np.abs(vectors[:, k])), k])
        parts = sorted(((paths[i], float(v[i])) for i in np.flatnonzero(np.abs(v) >= TOLD)), key=lambda p: -abs(p[1]))
        directions.append(Direction(float(np.sqrt(values[k])), float(1.0 / np.sqrt(values[k])), tuple(parts)))
    covariance = (vectors / values) @ vectors.T
    alone = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    together = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(together, together)
    words = []
    for i, path in enumerate(paths):
        partners = tuple(
            paths[j] for j in np.argsort(-np.abs(correlation[i])) if j != i and abs(correlation[i, j]) > 0.7
        )
        if together[i] <= SURE:
            words.append((path, DETERMINED, float(together[i]), ()))
        elif alone[i] <= VAGUE and partners:
            words.append((path, COMBINED, float(together[i]), partners[:3]))
        elif together[i] <= VAGUE:
            words.append((path, ROUGH, float(together[i]), ()))
        else:
            words.append((path, UNSEEN, float(together[i]), ()))
    return Identifiability(tuple(directions), tuple(words))


@dataclass(frozen=True, eq=False)
class Profile:
    """Deviance [point] of a parameter at values [point], all others adjusted again; ends of its 90 % interval."""

    path: str
    values: FloatArray
    deviance: FloatArray
    low: float | None
    high: float | None


def profile_likelihood(fit: Fit, path: str, *, jobs: int | None = None) -> Profile:
    """The profile likelihood of one number: it is held, everything else is adjusted again.

    The deviance is scaled so that near the optimum it is that of the number's standard deviation (blocks of time).
    """
    j = fit.free.paths.index(path)
    kept = [k for k in range(len(fit.x)) if k != j]
    free = fit.free.without_parameter(j)
    sd = fit.sd[j]
    ridge = fit.covariance[kept, j] / fit.covariance[j, j]
    whole = GaussNewton(fit.model, fit.free, fit.segments, block=fit.block, stable=False, jobs=jobs)
    a, _ = whole.equations(fit.normal, fit.x)
    unit = 1.0 / np.sqrt(np.diag(a))
    scale = float(np.linalg.inv(a * np.outer(unit, unit))[j, j]) * unit[j] ** 2 / sd**2
    values, deviance = [float(fit.x[j])], [0.0]
    for reach in REACH:
        value = float(np.clip(fit.x[j] + reach * sd, fit.free.low[j], fit.free.high[j]))
        if value in values:
            continue
        model = fit.model.with_row([path], np.array([value]))
        adjuster = GaussNewton(model, free, fit.segments, block=fit.block, stable=False, jobs=jobs)
        try:
            found = adjuster.fit(fit.x[kept] + ridge * (value - fit.x[j]), tolerance=1e-5, most=TURNS)
        except ValueError:
            continue  # diverges there: the interval ends before
        own = ((value - fit.free.prior[j]) / fit.free.prior_sd[j]) ** 2
        own -= ((fit.x[j] - fit.free.prior[j]) / fit.free.prior_sd[j]) ** 2
        values.append(value)
        deviance.append(max(found.cost + own - fit.cost, 0.0) * scale)
    order = np.argsort(values)
    v, d = np.array(values)[order], np.array(deviance)[order]
    middle = int(np.argmin(d))
    return Profile(path, v, d, _end(v[: middle + 1][::-1], d[: middle + 1][::-1]), _end(v[middle:], d[middle:]))


def _end(values: FloatArray, deviance: FloatArray) -> float | None:
    """Where the deviance crosses 2.706, its root linear between points; None where it does not."""
    root = np.sqrt(deviance)
    for k in range(1, len(root)):
        if root[k] >= np.sqrt(NINETY) > root[k - 1]:
            part = (np.sqrt(NINETY) - root[k - 1]) / (root[k] - root[k - 1])
            return float(values[k - 1] + part * (values[k] - values[k - 1]))
    return None


def profile_likelihoods(
    fit: Fit, paths: Sequence[str], *, jobs: int | None = None, report: Report = silent
) -> list[Profile]:
    """The profiles of several numbers."""
    out = []
    for path in paths:
        out.append(profile_likelihood(fit, path, jobs=jobs))
        ends = [f"{x:.5g}" if x is not None else "open" for x in (out[-1].low, out[-1].high)]
        report(f"  profile of {path}: 90 % from {ends[0]} to {ends[1]}")
    return out


@dataclass(frozen=True, eq=False)
class SectionEstimates:
    """Values [stretch, path] of the parameters on stretches of track [stretch, (from, to)] in m, with their sd.

    chi2 [path]: squared deviations from the common value over their variance, per stretch: about 1 where constant.
    """

    paths: tuple[str, ...]
    sections: FloatArray
    values: FloatArray
    sd: FloatArray

    @property
    def chi2(self) -> FloatArray:
        """Reduced chi-squared [path] of the stretches' values about their common one."""
        weight = 1.0 / np.maximum(self.sd, 1e-300) ** 2
        mean = np.sum(weight * self.values, axis=0) / np.sum(weight, axis=0)
        return np.asarray(np.sum(weight * (self.values - mean) ** 2, axis=0) / max(len(self.values) - 1, 1))


def estimate_per_section(fit: Fit, length: float) -> SectionEstimates:
    """Every adjusted parameter on stretches of so many metres each: one step from the common values (linear).

    Priors hold on every stretch what it alone does not determine. Raises ValueError where no stretch has as many
    blocks of time as it needs.
    """
    s = block_distances(fit)
    gram = fit.normal.gram.sum(axis=1)
    count = max(1, int(np.ceil((s.max() - s.min()) / length)))
    place = np.minimum(((s - s.min()) / length).astype(int), count - 1)  # what lies on the last edge is in the last
    rows, sds, between = [], [], []
    common = fit.covariance.diagonal() * count
    # a stretch is held by the whole run ten times as loosely as the run knows it
    held = 1.0 / np.maximum(100.0 * common, 1e-300) + 1.0 / fit.free.prior_sd**2
    for k in range(count):
        inside, start = place == k, s.min() + k * length
        if inside.sum() < BLOCKS:
            continue
        part = gram[inside]
        total = part.sum(axis=0)
        variance = residual_variance(total[0, 0], max(fit.normal.samples * inside.mean(), 1.0))
        inverse = np.linalg.pinv(total[1:, 1:] + variance * np.diag(held), rcond=1e-12, hermitian=True)
        scores = part[:, 1:, 0] - part[:, 1:, 0].mean(axis=0)
        rows.append(fit.x + inverse @ total[1:, 0])
        sds.append(np.sqrt(np.maximum(np.diag(inverse @ (scores.T @ scores) @ inverse), 0.0)))
        between.append((start, min(start + length, float(s.max()))))
    if not rows:
        enough = (BLOCKS + 1) * float(np.median(np.diff(s)))
        least = f"give at least {enough:.0f} m" if enough > length else "measure longer runs"
        raise ValueError(f"stretches of {length:g} m are too short to estimate parameters on each, {least}")
    return SectionEstimates(fit.free.paths, np.array(between), np.array(rows), np.array(sds))
