"""Drift of a parameter along the track, of a driven rig with time, from its sensitivity per block of time.

A parameter that changes slowly compared with the memory of the vehicle (about a second) changes the output by its
sensitivity times its momentary deviation. Inner products per block of time therefore suffice, and a vehicle with the
parameter p(x) is a blend of simultaneous simulations with constant p.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.comparison import compare
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.block_products import scaled_inverse, split_into_blocks
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.estimation.validation import Validation, compute_validation
from railui.identification.prediction import (
    DivergedError,
    Prediction,
    Predictor,
    required_steps,
    undefined_prediction,
)
from railui.vehicle.model import Model

LEAST_KNOTS = 3  # of a drift; the spacing is halved from one drift to the next
RANDOM_SIGNS_SEED = 19
PRELOAD = "vehicle.rig.preload"


@dataclass(frozen=True, eq=False)
class Drift:
    """A parameter that varies: values [knot] at abscissae [knot] of the segments, with standard deviations.

    ratios: ratio to the value by path, of the parameter itself (1) and of those that vary in proportion. share: share
    of the residual that the drift explains beyond chance, which would explain chance_share. squares: squared residual
    [block] with the drift; empty for a linear estimate.
    """

    path: str
    ratios: Mapping[str, float]
    abscissa: FloatArray
    values: FloatArray
    sd: FloatArray
    share: float
    chance_share: float = 0.0
    squares: FloatArray = field(default_factory=lambda: np.zeros(0), repr=False)

    def value_at(self, x: FloatArray) -> FloatArray:
        """Interpolate the parameter at abscissae x [n]: linear between knots, constant beyond."""
        return np.interp(x, self.abscissa, self.values)


def hat_functions(x: FloatArray, knots: FloatArray) -> FloatArray:
    """Compute weights [abscissa, knot] of linear interpolation between knots, constant beyond the ends.

    >>> hat_functions(np.array([0.0, 5.0, 12.0]), np.array([0.0, 10.0])).tolist()
    [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]
    """
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def find_drifts(context: Context, fit: Fit) -> list[Drift]:
    """Estimate the drift of every estimated parameter, in descending order of the share explained.

    None of a rig that moves freely: its amplitude remembers the values before. The knots of one that is driven are as
    far apart as its free motion takes to decay.

    A parameter that both wheelsets have is tried on each wheelset, and on both in proportion.
    """
    if not (fit.model.design.is_on_track or all(t.segment.is_driven for t in fit.segments)):
        return []
    settings = context.settings.drift
    s = fit.block_abscissae()
    least_spacing = _memory(fit.model) * settings.min_knot_spacing
    gram = fit.normal.gram.sum(axis=1)
    drifts = []
    for path, ratios in parameter_groups(fit):
        best: Drift | None = None
        count = LEAST_KNOTS
        while count <= settings.max_drift_knots and count * settings.blocks_per_knot <= len(s):
            if np.ptp(s) < (count - 1) * least_spacing:
                break
            drift = _estimate_drift(context, fit, gram, path, ratios, s, np.linspace(s.min(), s.max(), count))
            if best is None or drift.share > best.share + settings.finer_drift_share:
                best = drift
            count = 2 * count - 1
        if best is not None:
            drifts.append(best)
    return sorted(drifts, key=lambda d: -d.share)


def _memory(model: Model) -> float:
    """Time constant [s] of the slowest free motion of a rig with a mass; zero of a vehicle, which forgets in metres."""
    if model.design.form != "rig":
        return 0.0
    growth = model.growth_rate(1.0)
    return -1.0 / growth if growth < 0.0 else np.inf


def parameter_groups(fit: Fit) -> list[tuple[str, dict[str, float]]]:
    """List the parameters that may drift: single ones, those of both wheelsets and all creep in proportion.

    A preload that drifts is the drift of a sensor.
    """
    values = dict(zip(fit.free.paths, fit.x, strict=True))
    groups = []
    for path in values:
        if path in fit.model.design.values and path != PRELOAD:
            groups.append((path, {path: 1.0}))
            twin = path.replace(".leading.", ".trailing.")
            if twin != path and twin in values and values[path]:
                groups.append((path, {path: 1.0, twin: float(values[twin] / values[path])}))
    creep = [p for way in ("lateral", "longitudinal") for p in values if p.endswith(f".{way}_creep")]
    if len(creep) > 1 and all(values[p] for p in creep):  # adhesion changes all creep coefficients together
        groups.append((creep[0], {p: float(values[p] / values[creep[0]]) for p in creep}))
    return groups


def _estimate_drift(
    context: Context,
    fit: Fit,
    gram: FloatArray,
    path: str,
    ratios: Mapping[str, float],
    s: FloatArray,
    knots: FloatArray,
) -> Drift:
    """Linear estimate of a parameter at knots together with all others; its share is reduced by that of chance."""
    u = hat_functions(s, knots)
    j = fit.free.paths.index(path)
    others = [k for k in range(1, gram.shape[1]) if k != 1 + j]
    c = np.zeros(gram.shape[1])
    for p, ratio in ratios.items():
        c[1 + fit.free.paths.index(p)] = ratio
    drifting = gram @ c  # [block, row]: products of every row with the drifting sensitivity
    prior = fit.normal.variance / fit.free.prior_sd**2
    cross = drifting[:, others].T @ u
    inner = np.block(
        [
            [gram[:, others][:, :, others].sum(axis=0) + np.diag(np.delete(prior, j)), cross],
            [cross.T, u.T @ ((drifting @ c)[:, None] * u)],
        ]
    )
    inverse = scaled_inverse(inner, 1e-8)
    inverse_constant = scaled_inverse(gram[:, 1:, 1:].sum(axis=0) + np.diag(prior), 1e-12)
    rng = np.random.default_rng(np.random.SeedSequence([context.seed, RANDOM_SIGNS_SEED, j]))
    draws = context.settings.drift.drift_draws
    signs = np.vstack([np.ones(len(s)), rng.choice([-1.0, 1.0], (draws, len(s)))])  # the data first, then random signs
    right = np.hstack([signs @ gram[:, others, 0], signs @ (drifting[:, :1] * u)])
    solution, right_constant = right @ inverse, signs @ gram[:, 1:, 0]
    explained = np.sum(right * solution, axis=1)
    explained -= np.sum((right_constant @ inverse_constant) * right_constant, axis=1)
    chance = max(float(np.mean(explained[1:])), 0.0)
    change = solution[0, len(others) :]
    sd = np.sqrt(np.maximum(np.diag(inverse)[len(others) :], 0.0) * chance / max(len(knots) - 1, 1))
    share = max((float(explained[0]) - chance) / fit.normal.rss, 0.0)
    return Drift(path, ratios, knots, fit.x[j] + change, sd, share, chance / fit.normal.rss)


def refine_drift(context: Context, fit: Fit, drift: Drift) -> Drift:
    """Refine a drift by Gauss-Newton iterations on blended simulations; all other parameters stay."""
    low, high = _limits(context, fit, drift.path)
    values = np.clip(drift.values, low, high)
    best, least = values, np.full(1, np.inf)
    for _ in range(context.settings.drift.drift_iterations):
        trial = replace(drift, values=values)
        normal, gradient = np.zeros((len(values), len(values))), np.zeros(len(values))
        squares = []
        for target in fit.segments:
            z, slope = blend_series(target.motion_predictor(fit.model), trial)
            r = target.measured - target.filter_and_weight(z)
            u = hat_functions(target.segment.abscissa, drift.abscissa)
            d = np.stack([target.filter_and_weight(slope * u[:, k]).ravel() for k in range(len(values))])
            normal += d @ d.T
            gradient += d @ r.ravel()
            squares.append(np.sum(split_into_blocks(r[None], fit.block_samples(target)) ** 2, axis=(0, 1, 3)))
        of_blocks = np.concatenate(squares)
        if of_blocks.sum() < least.sum():
            best, least = values, of_blocks
        ridge = 1e-6 * np.mean(np.diag(normal)) * np.eye(len(values))
        values = np.clip(values + np.linalg.solve(normal + ridge, gradient), low, high)
    share = max(1.0 - float(least.sum()) / fit.normal.rss - drift.chance_share, 0.0)
    return replace(drift, values=best, share=share, squares=least)


def _limits(context: Context, fit: Fit, path: str) -> tuple[float, float]:
    """Limits of a drifting parameter: those of the fit, and the share of its value, if any, that at least remains."""
    j = fit.free.paths.index(path)
    low, high, constant = float(fit.free.low[j]), float(fit.free.high[j]), float(fit.x[j])
    if constant == 0.0:
        return low, high
    remaining = (1.0 - context.settings.drift.max_drift) * constant
    return (max(low, remaining), high) if constant > 0.0 else (low, min(high, remaining))


def blend_series(predictor: Predictor, drift: Drift) -> tuple[FloatArray, FloatArray]:
    """Blend simulations of a drifting parameter: channels [channel, n] and their derivative by the parameter.

    Raises
    ------
    DivergedError
        Where a vehicle of a constant parameter diverges.
    """
    model, segment = predictor.model, predictor.segment
    p = drift.value_at(segment.abscissa)
    width = max(float(np.ptp(p)), 1e-3 * abs(float(p.mean())), 1e-12)
    grid = np.linspace(p.min() - 0.02 * width, p.max() + 0.02 * width, core.LANES)
    rows = np.tile(model.on_segment(*segment.segment_key).row, (core.LANES, 1))
    for path, ratio in drift.ratios.items():
        rows[:, model.columns[path]] = ratio * grid
    series, diverged = predictor.simulate(batch=model.batch(rows))
    if np.any(diverged >= 0):
        first = int(np.min(diverged[diverged >= 0]))
        raise DivergedError(f"the vehicle diverges on {segment.file} with a drift of {drift.path}", first)
    position = np.clip((p - grid[0]) / (grid[1] - grid[0]), 0.0, core.LANES - 1 - 1e-9)
    k, part = position.astype(int), position % 1.0
    n = np.arange(len(p))
    low, high = series[k, :, n].T, series[k + 1, :, n].T
    return low + part * (high - low), (high - low) / (grid[1] - grid[0])


def validate_drift(context: Context, model: Model, drift: Drift, segments: Sequence[Segment]) -> Validation:
    """Validate a model with a drifting parameter; initial states and phases are estimated on the segments."""
    return compute_validation(context, [_predict(context, model, drift, segment) for segment in segments])


def _predict(context: Context, model: Model, drift: Drift, segment: Segment) -> Prediction:
    first = float(drift.value_at(segment.abscissa[:1])[0])
    initial_model = model.with_path_values(list(drift.ratios), first * np.array(list(drift.ratios.values())))
    initial_model = estimate_phases(context, initial_model, segment)
    start = estimate_initial_state(context, initial_model, segment)
    phased = replace(model, phases=initial_model.phases)
    predictor = Predictor(phased, segment, required_steps(initial_model, segment), start)
    try:
        series, _ = blend_series(predictor, drift)
    except DivergedError as error:
        return undefined_prediction(context.campaign, segment, error.sample)
    return Prediction(segment, series, compare(context.campaign, segment, series))
