"""Estimation problem: segments prepared for a fit, filtered, weighted and with their initial states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import comparison_filter, kernel_filter, sosfiltfilt_or_demean, upper_band_limit
from railui.campaign.segment import Segment
from railui.core import ZeroPhaseFilter, adds_body
from railui.identification.context import Context
from railui.identification.estimation.block_products import scaled_inverse
from railui.identification.estimation.initial_state import (
    DIFFERENCE_STEP,
    estimate_initial_state,
    may_hunt,
    state_scale,
)
from railui.identification.estimation.noise_floor import noise_variances, noise_weights
from railui.identification.prediction import DivergedError, Predictor, Simulation, required_steps
from railui.parallel import map_threads
from railui.vehicle.model import Model

WEIGHTED_WINDOWS = 6  # windows of a segment on which noise is simulated for the weights of all
START_SHARES = (0.0, 0.1, 0.3, 1.0)  # of the correction of an initial state that are tried
MAX_START_IMPROVEMENTS = 4
RENEWED_GAIN = 0.01  # of the misfit by a correction, from which the sensitivity is computed again
RIG_DIFFERENCE_STEP = 1e-5  # of a usual motion of a rig: as small as the steps of its parameters
SAMPLES_PER_PERIOD = 2.4  # of the highest frequency compared, kept at least


@dataclass(frozen=True, eq=False)
class InitialStateSensitivity:
    """Sensitivity of a window's compared channels to its initial state.

    Attributes
    ----------
    rows
        Sensitivities [state, channel, n] in usual sizes.
    inverse
        Inverse [state, state] of their products and a ridge of usual motions, for estimates.
    eliminating
        The inverse for elimination: without the ridge on a rig, of whose equilibrium nothing is known.
    """

    rows: FloatArray
    inverse: FloatArray
    eliminating: FloatArray

    def estimate(self, series: FloatArray, start: FloatArray | float = 0.0) -> FloatArray:
        """Estimate the initial states [..., state], in usual sizes, that explain series [..., channel, n] best.

        start: state [state] in usual sizes to which the estimate is added. The ridge then acts on their sum: on the
        estimate alone, states that the series hardly determine would grow from one correction to the next.
        """
        return np.asarray((self._products(series) - start) @ self.inverse)

    def project_out(self, series: FloatArray) -> FloatArray:
        """Subtract from series [..., channel, n] the part that an initial state explains."""
        return np.asarray(series - np.tensordot(self._products(series) @ self.eliminating, self.rows, 1))

    def _products(self, series: FloatArray) -> FloatArray:
        return np.asarray(np.tensordot(series, self.rows, ([-2, -1], [1, 2])))


@dataclass(frozen=True, eq=False)
class FitSegment:
    """A segment prepared for a fit.

    Attributes
    ----------
    filter
        Comparison filter with the weights of the channels.
    measured
        Measured channels, filtered and weighted [channel, n].
    initial_state
        State [q, q'] at the first sample.
    steps
        RK4 steps per sample.
    sensitivity_steps
        RK4 steps per sample of simulations that are compared with each other only.
    required_steps
        Steps that the model needs where fewer are taken; 0: those taken.
    """

    segment: Segment
    filter: ZeroPhaseFilter
    measured: FloatArray
    initial_state: FloatArray
    steps: int
    sensitivity_steps: int
    initial_sensitivity: InitialStateSensitivity | None = field(default=None, repr=False)
    required_steps: int = 0

    @property
    def is_window(self) -> bool:
        """True for a window of multiple shooting."""
        return self.segment.window_of is not None

    @property
    def has_free_start(self) -> bool:
        """True where the initial state is estimated with the parameters: a rig moves on as long as it is recorded."""
        return self.is_window or self.segment.kind == "rig"

    @property
    def for_differences(self) -> FitSegment:
        """The segment with the steps that suffice for differences between simulations."""
        return self if self.sensitivity_steps == self.steps else replace(self, steps=self.sensitivity_steps)

    def predictor(self, model: Model) -> Predictor:
        """Predict the channels as `measured` has them, filtered and weighted."""
        return Predictor(model, self.segment, self.steps, self.initial_state, self.filter)

    def motion_predictor(self, model: Model) -> Predictor:
        """Predict channels as they are, without filter and weights."""
        return Predictor(model, self.segment, self.steps, self.initial_state)

    def with_start(self, initial_state: FloatArray) -> FitSegment:
        """Return the segment with another initial state, whose sensitivity is not known."""
        return replace(self, initial_state=initial_state, initial_sensitivity=None)

    def without_initial_state(self, series: FloatArray) -> FloatArray:
        """Subtract from series [..., channel, n] the part that the initial state of a window explains."""
        return series if self.initial_sensitivity is None else self.initial_sensitivity.project_out(series)

    def trim(self, x: FloatArray) -> FloatArray:
        """Select the compared samples of x [..., n]."""
        cut = self.filter.trim
        return np.asarray(x[..., cut : x.shape[-1] - cut : self.filter.decimation])

    def filter_and_weight(self, x: FloatArray) -> FloatArray:
        """Filter and weight channels [channel, n] over the segment as `measured`."""
        return self.trim(sosfiltfilt_or_demean(self.filter.sos, x)) * self.filter.weights[:, None]


def prepare_segments(
    context: Context, model: Model, segments: Sequence[Segment], *, like: Sequence[FitSegment] = ()
) -> list[FitSegment]:
    """Prepare segments for a model: weights from sensor and track noise, initial states estimated.

    like: segments of another fit, whose weights are taken over so that the misfits of both can be compared.
    """
    weights = {_weight_key(t.segment): t.filter.weights for t in like}
    first = {key: s for s in reversed(segments) if (key := _weight_key(s)) not in weights}
    found = map_threads(lambda s: channel_weights(context, model, s), list(first.values()), context.jobs)
    weights |= zip(first, found, strict=True)

    def prepare(segment: Segment) -> FitSegment:
        return _prepare_segment(context, model, segment, weights[_weight_key(segment)])

    return list(map_threads(prepare, segments, context.jobs))


def _prepare_segment(context: Context, model: Model, segment: Segment, weights: FloatArray) -> FitSegment:
    campaign = context.campaign
    every = _decimation(campaign.band, 1.0 / segment.dt)
    filtered = comparison_filter(campaign, segment, segment.measured(segment.channels))
    measured = filtered[:, ::every] * weights[:, None]
    start = estimate_initial_state(context, model, segment)
    kernel = kernel_filter(campaign, segment, weights, every)
    return FitSegment(segment, kernel, measured, start, *required_fit_steps(context, model, segment))


def required_fit_steps(context: Context, model: Model, segment: Segment) -> tuple[int, int]:
    """Numbers of RK4 steps per sample of a model's residual and of its sensitivities on a segment."""
    steps = required_steps(model, segment)
    if steps == segment.least_steps:
        return steps, steps
    return steps, required_steps(model, segment, context.settings.calibration.damped_mode_step)


def _weight_key(segment: Segment) -> tuple[str, int, int | None]:
    """Key of the segments that have equal weights: all windows of one segment."""
    return segment.file, segment.number, segment.first_sample if segment.window_of is None else None


def _decimation(band: tuple[float, float] | None, rate: float) -> int:
    """Compare every so many samples at a sampling rate [Hz]."""
    return 1 if band is None else max(1, int(rate / (SAMPLES_PER_PERIOD * upper_band_limit(band, rate))))


def channel_weights(context: Context, model: Model, segment: Segment) -> FloatArray:
    """Weights of a segment [channel]; those of a window are of some windows of its segment."""
    whole = segment.window_of
    if whole is None:
        return noise_weights(context, model, segment)
    windows = whole.windows(segment.samples * segment.dt)
    some = windows[:: -(-len(windows) // WEIGHTED_WINDOWS)]
    starts = [estimate_initial_state(context, model, w) if may_hunt(model, w) else None for w in some]
    return np.asarray(1.0 / np.sqrt(np.mean(noise_variances(context, model, some, starts), axis=0)))


def channel_power(prepared: Sequence[FitSegment]) -> dict[str, float]:
    """Sum of the squared measured values of each channel over segments, of which some may lack channels."""
    power: dict[str, float] = {}
    for t in prepared:
        for c, row in zip(t.segment.channels, t.measured, strict=True):
            power[c] = power.get(c, 0.0) + float(np.sum(row**2))
    return power


def reprepare_segments(context: Context, model: Model, prepared: Sequence[FitSegment]) -> list[FitSegment]:
    """Renew weights and initial states of the segments of a fit for the calibrated model."""
    return prepare_segments(context, model, [t.segment for t in prepared])


def estimate_window_start(context: Context, model: Model, target: FitSegment, corrections: int = 1) -> FitSegment:
    """Correct the initial state of a window by linear least squares, some times with the same sensitivity.

    That of a vehicle is the least-squares estimate with the ridge of usual motions, from any state before it; of a rig,
    of whose equilibrium nothing is known, the ridge acts on the corrections.

    Raises
    ------
    DivergedError
        Where the vehicle diverges.
    """
    sensitivity, residual = _sensitivity_to_start(context, model, target)
    scale = state_scale(context.settings.initial_state, target.segment, model)
    n, start = len(scale), target.initial_state.copy()
    corrected = replace(target, initial_sensitivity=sensitivity)
    for remaining in reversed(range(corrections)):
        usual = 0.0 if target.segment.is_rig else start[:n] / scale
        start[:n] += scale * sensitivity.estimate(residual, usual)
        corrected = replace(corrected, initial_state=start.copy())
        if remaining:
            residual = target.measured - _simulate_from_start(model, corrected)
    return corrected


def improve_start(context: Context, model: Model, target: FitSegment) -> FitSegment:
    """Correct an initial state by as much of the linear estimate as lowers the misfit, with its sensitivity.

    That of a rig belongs to the corrected state exactly: a preload moves the motion of a rig as another initial state
    does, and differences of both that are taken at two states would seem to determine it.

    Raises
    ------
    DivergedError
        Where the vehicle diverges.
    """
    sensitivity, correction = _start_correction(context, model, target)
    starts = np.tile(target.initial_state, (len(START_SHARES), 1))
    starts[:, : len(correction)] += np.outer(START_SHARES, correction)
    series, diverged = _from_starts(model, target, starts)
    misfit = np.where(diverged < 0, np.sum((series - target.measured) ** 2, axis=(1, 2)), np.inf)
    best = int(np.argmin(np.where(np.isfinite(misfit), misfit, np.inf)))
    improved = replace(target, initial_state=starts[best], initial_sensitivity=sensitivity)
    renewed_gain = 0.0 if target.segment.is_rig else RENEWED_GAIN
    if misfit[best] < (1.0 - renewed_gain) * misfit[0]:
        sensitivity, _ = _start_correction(context, model, improved)
        improved = replace(improved, initial_sensitivity=sensitivity)
    return improved


def settle_start(context: Context, model: Model, target: FitSegment) -> FitSegment:
    """Improve the initial state of a window until it stays, a few times at most: flanges make it far from linear."""
    for _ in range(MAX_START_IMPROVEMENTS):
        improved = improve_start(context, model, target)
        if np.array_equal(improved.initial_state, target.initial_state):
            return improved
        target = improved
    return target


def _start_correction(context: Context, model: Model, target: FitSegment) -> tuple[InitialStateSensitivity, FloatArray]:
    """Sensitivity to the initial state, and its correction [state] by linear least squares."""
    sensitivity, residual = _sensitivity_to_start(context, model, target)
    scale = state_scale(context.settings.initial_state, target.segment, model)
    return sensitivity, np.asarray(scale * sensitivity.estimate(residual))


def _sensitivity_to_start(
    context: Context, model: Model, target: FitSegment
) -> tuple[InitialStateSensitivity, FloatArray]:
    """Sensitivity to the initial state, and the residual [channel, n]."""
    scale = state_scale(context.settings.initial_state, target.segment, model)
    simulated, rows = sensitivities_to_start(model, target, scale)
    if target.sensitivity_steps != target.steps:
        simulated = _simulate_from_start(model, target)
    gram = np.tensordot(rows, rows, ([1, 2], [1, 2]))
    is_rig = target.segment.is_rig
    inverse = _inverse_with_usual_motions(gram, is_rig=is_rig)
    is_free = is_rig and not target.is_window
    sensitivity = InitialStateSensitivity(rows, inverse, scaled_inverse(gram) if is_free else inverse)
    return sensitivity, target.measured - simulated


def _inverse_with_usual_motions(gram: FloatArray, *, is_rig: bool) -> FloatArray:
    """Inverse [state, state] of products of sensitivities and a ridge of usual motions.

    The motion of a rig may grow so far in a trial of the fit that the ridge is lost in rounding.
    """
    with_ridge = gram + np.eye(len(gram))
    return scaled_inverse(with_ridge) if is_rig else np.asarray(np.linalg.inv(with_ridge), dtype=np.float64)


def sensitivities_to_start(model: Model, target: FitSegment, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the compared channels [channel, n] and their sensitivities [state, channel, n] to the initial state.

    Both are simulated with the steps that suffice for differences.

    scale: usual size [state] of each estimated state, to which the sensitivities refer.

    Raises
    ------
    DivergedError
        Where the vehicle diverges.
    """
    starts = np.tile(target.initial_state, (len(scale) + 1, 1))
    step = RIG_DIFFERENCE_STEP if target.segment.is_rig else DIFFERENCE_STEP
    starts[1:, : len(scale)] += np.diag(step * scale)
    simulation = _from_starts(model, target.for_differences, starts)
    series = _without_divergence(simulation, target)
    return series[0], (series[1:] - series[0]) / step


def _simulate_from_start(model: Model, target: FitSegment) -> FloatArray:
    """Simulate the compared channels [channel, n] of a model; DivergedError where it diverges."""
    [series] = _without_divergence(_from_starts(model, target, target.initial_state[None]), target)
    return np.asarray(series)


def _without_divergence(simulation: Simulation, target: FitSegment) -> FloatArray:
    series, diverged = simulation
    if np.any(diverged >= 0):
        raise DivergedError(f"the vehicle diverges on {target.segment.file} at {target.segment.columns['t'][0]:g} s")
    return series


def _from_starts(model: Model, target: FitSegment, starts: FloatArray) -> Simulation:
    """Simulate the compared channels from each initial state [n, state]."""
    segment = target.segment
    batch = model.batch(np.tile(model.on_segment(*segment.segment_key).row, (len(starts), 1)))
    return Predictor(model, segment, target.steps, starts, target.filter).simulate(batch=batch)


def adapt_to_model(
    context: Context, model: Model, prepared: Sequence[FitSegment], max_steps: int | None = None
) -> list[FitSegment]:
    """Adapt segments to a model of another structure: steps (at most `max_steps`), and initial states if they matter.

    They matter where bodies were added, and on a rig, whose decay lasts as long as its record.
    """
    adapted = []
    for t in prepared:
        of_residual, of_sensitivities = required_fit_steps(context, model, t.segment)
        needed = max(t.steps, of_residual)
        has_other_states = t.segment.is_rig or any(adds_body(e.kind) for e in model.effects)
        start = estimate_initial_state(context, model, t.segment) if has_other_states else t.initial_state
        steps = needed if max_steps is None else max(t.steps, min(needed, max_steps))
        coarse = min(steps, max(t.sensitivity_steps, of_sensitivities))
        adapted.append(replace(t.with_start(start), steps=steps, sensitivity_steps=coarse, required_steps=needed))
    return adapted


def drop_states(context: Context, before: Model, model: Model, prepared: Sequence[FitSegment]) -> list[FitSegment]:
    """Adapt initial states of a model to the same without one of its effects.

    The displacements and velocities stay, which the model with the effect determines better; the states of all effects
    start at zero. They are estimated anew where the effect was a body.
    """
    own, former = (2 * len(m.vehicles().degrees_of_freedom(m.single_batch())) for m in (model, before))
    if own != former:
        return [t.with_start(estimate_initial_state(context, model, t.segment)) for t in prepared]
    return [t.with_start(t.initial_state[:own]) for t in prepared]


def truncate(context: Context, prepared: Sequence[FitSegment], seconds: float) -> list[FitSegment]:
    """Keep the first seconds of every segment, enough to distinguish candidates; of a rig's as many samples."""
    truncated = []
    for t in prepared:
        rig_rate = context.settings.calibration.rig_samples_per_second
        samples = round(seconds * (rig_rate if t.segment.is_rig else 1.0 / t.segment.dt))
        if t.is_window:
            if t.segment.first_sample < samples:
                truncated.append(t)
            continue
        truncated.append(t if samples >= t.segment.samples else _first_samples(context, t, samples))
    return truncated


def _first_samples(context: Context, target: FitSegment, samples: int) -> FitSegment:
    segment = target.segment.truncated(samples)
    weights, every = target.filter.weights, target.filter.decimation
    measured = comparison_filter(context.campaign, segment, segment.measured(segment.channels))[:, ::every]
    short = kernel_filter(context.campaign, segment, weights, every)
    weighted = measured * weights[:, None]
    return replace(target, segment=segment, filter=short, measured=weighted, initial_sensitivity=None)
