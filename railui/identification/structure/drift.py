"""A parameter that changes along the track: its course, found from the sensitivities block by block.

A parameter that changes slowly against the vehicle's memory (about a second) moves the output by its own
sensitivity times its momentary deviation. So inner products per block of time are all that is needed, and a vehicle
whose parameter follows p(s) is a blend of vehicles with constant p that run side by side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset, Segment, comparison_filter, simulate, steps_for
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.estimation.output_error import Fit, block_distances
from railui.identification.estimation.validation import Validation, compared_channels, compute_validation
from railui.vehicle.model import Model

COURSES = (3, 5, 9, 17, 33)  # knots of the courses that are tried
BLOCKS = 1.3  # blocks per knot at least
FINER = 0.02  # share that more knots must explain
DRAWS = 40  # of random signs, for what chance explains
TURNS = 4  # of the refined course
WIDEST = 0.9  # of its value that a positive parameter may lose


@dataclass(frozen=True, eq=False)
class Drift:
    """A parameter and its course: values [knot] at distances [knot] with sd, share of the residual beyond chance.

    `ratios`: path -> ratio to the value, of the parameter itself (1) and of its twin on the other wheelset.
    """

    path: str
    ratios: Mapping[str, float]
    distance: FloatArray
    values: FloatArray
    sd: FloatArray
    share: float

    def at(self, s: FloatArray) -> FloatArray:
        """The parameter at distances s [m]: linear between knots, held beyond."""
        return np.interp(s, self.distance, self.values)


def hat_functions(s: FloatArray, knots: FloatArray) -> FloatArray:
    """Weights [place, knot] of linear interpolation between knots, held beyond the ends.

    >>> hats(np.array([0.0, 5.0, 12.0]), np.array([0.0, 10.0])).tolist()
    [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]
    """
    return np.stack([np.interp(s, knots, row) for row in np.eye(len(knots))], axis=1)


def find_drifts(fit: Fit, seed: int = 0) -> list[Drift]:
    """Every adjusted parameter of the vehicle as a course along the track, the one that explains most first.

    What both wheelsets have is tried on each and on both in proportion.
    """
    if fit.model.design.kind != "bogie":
        return []
    s = block_distances(fit)
    gram = fit.normal.gram.sum(axis=1)
    found = []
    for path, ratios in parameter_groups(fit):
        best: Drift | None = None
        for count in COURSES:
            if count * BLOCKS > len(s):
                break
            one = _course(fit, gram, path, ratios, s, np.linspace(s.min(), s.max(), count), seed)
            if best is None or one.share > best.share + FINER:
                best = one
        if best is not None:
            found.append(best)
    return sorted(found, key=lambda d: -d.share)


def parameter_groups(fit: Fit) -> list[tuple[str, dict[str, float]]]:
    """What may drift: single parameters, those of both wheelsets in proportion, all creep in proportion."""
    now = dict(zip(fit.free.paths, fit.x, strict=True))
    out = []
    for path in now:
        if path in fit.model.design.values:
            out.append((path, {path: 1.0}))
            twin = path.replace(".leading.", ".trailing.")
            if twin != path and twin in now and now[path]:
                out.append((path, {path: 1.0, twin: float(now[twin] / now[path])}))
    creep = [
        f"contact.{where}.{what}_creep" for what in ("lateral", "longitudinal") for where in ("leading", "trailing")
    ]
    if all(now.get(p) for p in creep):
        out.append((creep[0], {p: float(now[p] / now[creep[0]]) for p in creep}))  # adhesion: all of it at once
    return out


def _course(
    fit: Fit, gram: FloatArray, path: str, ratios: Mapping[str, float], s: FloatArray, knots: FloatArray, seed: int
) -> Drift:
    """The linear estimate of a parameter at knots, everything else adjusted along; less what chance explains."""
    u = hat_functions(s, knots)
    j = fit.free.paths.index(path)
    others = [k for k in range(1, gram.shape[1]) if k != 1 + j]
    c = np.zeros(gram.shape[1])
    for p, ratio in ratios.items():
        c[1 + fit.free.paths.index(p)] = ratio
    own = gram @ c  # [block, row]: every row against the drifting one
    prior = fit.normal.variance / fit.free.prior_sd**2
    cross = own[:, others].T @ u
    inner = np.block(
        [
            [gram[:, others][:, :, others].sum(axis=0) + np.diag(np.delete(prior, j)), cross],
            [cross.T, u.T @ ((own @ c)[:, None] * u)],
        ]
    )
    whole = scaled_inverse(inner, 1e-8)
    flat = scaled_inverse(gram[:, 1:, 1:].sum(axis=0) + np.diag(prior), 1e-12)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 19, j]))
    signs = np.vstack([np.ones(len(s)), rng.choice([-1.0, 1.0], (DRAWS, len(s)))])  # as it is, then chance
    right = np.hstack([signs @ gram[:, others, 0], signs @ (own[:, :1] * u)])
    plain, found = signs @ gram[:, 1:, 0], right @ whole
    explained = np.sum(right * found, axis=1) - np.sum((plain @ flat) * plain, axis=1)
    chance = max(float(np.mean(explained[1:])), 0.0)
    course = found[0, len(others) :]
    sd = np.sqrt(np.maximum(np.diag(whole)[len(others) :], 0.0) * chance / max(len(knots) - 1, 1))
    share = max((float(explained[0]) - chance) / fit.normal.rss, 0.0)
    return Drift(path, ratios, knots, fit.x[j] + course, sd, share)


def refine_drift(fit: Fit, drift: Drift) -> Drift:
    """The course fitted to the blended vehicles, not only to their linear forecast; the other numbers stay."""
    low, high = _limits(fit, drift.path)
    values = np.clip(drift.values, low, high)
    best, least = values, np.inf
    for _ in range(TURNS):
        course = replace(drift, values=values)
        a, b, misfit = np.zeros((len(values), len(values))), np.zeros(len(values)), 0.0
        for target in fit.segments:
            z, slope = blend_series(
                fit.model, course, target.segment, target.segment.channels, target.initial_state, target.steps
            )
            r = target.measured - target.filter_and_weight(z)
            u = hat_functions(target.segment.columns["s"], drift.distance)
            d = np.stack([target.filter_and_weight(slope * u[:, k]).ravel() for k in range(len(values))])
            a += d @ d.T
            b += d @ r.ravel()
            misfit += float(np.sum(r * r))
        if misfit < least:
            best, least = values, misfit
        ridge = 1e-6 * np.mean(np.diag(a)) * np.eye(len(values))
        values = np.clip(values + np.linalg.solve(a + ridge, b), low, high)
    share = max(1.0 - least / fit.normal.rss, 0.0)
    return replace(drift, values=best, share=share)


def _limits(fit: Fit, path: str) -> tuple[float, float]:
    j = fit.free.paths.index(path)
    return max(float(fit.free.low[j]), (1.0 - WIDEST) * float(fit.x[j])), float(fit.free.high[j])


def blend_series(
    model: Model, course: Drift, stretch: Segment, channels: Sequence[str], start: FloatArray | None, steps: int | None
) -> tuple[FloatArray, FloatArray]:
    """Channels [channel, n] of the vehicle whose parameter follows its course, and their slope with the parameter."""
    p = course.at(stretch.columns["s"])
    width = max(float(np.ptp(p)), 1e-3 * abs(float(p.mean())), 1e-12)
    grid = np.linspace(p.min() - 0.02 * width, p.max() + 0.02 * width, core.LANES)
    rows = np.tile(model.on(*stretch.segment_key).row, (core.LANES, 1))
    for path, ratio in course.ratios.items():
        rows[:, model.columns[path]] = ratio * grid
    series, lost = simulate(model, stretch, channels, batch=model.batch(rows), steps=steps, initial=start)
    if np.any(lost >= 0):
        raise ValueError(f"the vehicle diverges on {stretch.file} as {course.path} changes along the track")
    place = np.clip((p - grid[0]) / (grid[1] - grid[0]), 0.0, core.LANES - 1 - 1e-9)
    k, part = place.astype(int), place % 1.0
    n = np.arange(len(p))
    low, high = series[k, :, n].T, series[k + 1, :, n].T
    return low + part * (high - low), (high - low) / (grid[1] - grid[0])


def validate_drift(model: Model, course: Drift, measurement: Dataset, stretches: Sequence[Segment]) -> Validation:
    """The error of a vehicle whose parameter follows its course."""
    pairs, series = [], []
    for stretch in stretches:
        first = float(course.at(stretch.columns["s"][:1])[0])
        here = model.with_row(list(course.ratios), first * np.array(list(course.ratios.values())))
        start = estimate_initial_state(here, stretch, measurement.noise)
        z, _ = blend_series(model, course, stretch, stretch.channels, start, steps_for(here, stretch))
        series.append(z)
        channels = compared_channels(stretch)
        used = [stretch.channels.index(c) for c in channels]
        x = comparison_filter(measurement.campaign, stretch, stretch.measured(channels))
        pairs.append((channels, x, comparison_filter(measurement.campaign, stretch, z[used]), stretch.dt))
    return compute_validation(pairs, series, [])
