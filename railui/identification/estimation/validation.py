"""Validation of a model on runs: error per channel, and its blocks in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import Comparison, compare, cut_samples, nrmse, overall_nrmse
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.block_ratio import ratio_scatter
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.prediction import Prediction, Predictor, SimulationError, undefined_prediction
from railui.parallel import map_threads
from railui.vehicle.model import Model

NO_MOTION = 1.0  # squared NRMSE of a model that does not move, as which one that diverges counts


class ErrorReduction(NamedTuple):
    """Share of a squared error that another model takes off, its standard error and degrees of freedom."""

    share: float
    standard_error: float
    degrees_of_freedom: int


@dataclass(frozen=True)
class Validation:
    """NRMSE per channel and overall (NaN where diverged), and the simulated series per segment.

    Attributes
    ----------
    diverged
        File and time [s] of every segment on which the vehicle diverged.
    block_errors
        Contribution of each block of time to the squared overall error.
    """

    channels: Mapping[str, float]
    nrmse: float
    series: tuple[FloatArray, ...]
    diverged: tuple[tuple[str, float], ...]
    block_errors: FloatArray = field(default_factory=lambda: np.zeros(0))

    def error_reduction(self, other: Validation) -> ErrorReduction:
        """Share of this squared error that another validation on the same runs takes off.

        A model that diverges counts as one without motion, in this place; in that of the other it takes off nothing.
        """
        if not np.isfinite(other.nrmse):
            return ErrorReduction(-np.inf, 0.0, 0)
        if not np.isfinite(self.nrmse):
            return ErrorReduction(NO_MOTION - other.nrmse**2, 0.0, 0)
        less = self.block_errors - other.block_errors
        return ErrorReduction(float(less.sum() / self.block_errors.sum()), *ratio_scatter(less, self.block_errors))


def validate(context: Context, model: Model, segments: Sequence[Segment]) -> Validation:
    """Compute the error of a model on segments; only initial states and phases are estimated on them."""
    return validate_each(context, [(model, segment) for segment in segments])


def validate_each(context: Context, models: Sequence[tuple[Model, Segment]]) -> Validation:
    """Compute the error of models, each on its segment."""
    return compute_validation(context, predict_each(context, models))


def predict_each(context: Context, models: Sequence[tuple[Model, Segment]]) -> list[Prediction]:
    """Predict segments, each by its model, with initial states and phases estimated there.

    A model with added effects may be too stiff on a segment that is run at another speed than those it was fitted to:
    its prediction is undefined from the first sample, as that of a vehicle which diverges there.

    Raises
    ------
    SimulationError
        Where a model without added effects cannot be simulated.
    """

    def predict(pair: tuple[Model, Segment]) -> Prediction:
        vehicle, segment = pair
        try:
            model = estimate_phases(context, vehicle, segment)
            start = estimate_initial_state(context, model, segment)
            return Predictor(model, segment, initial_state=start).predict(context.campaign)
        except SimulationError:
            if len(vehicle.effects) <= len(context.nominal.effects):
                raise
            return undefined_prediction(context.campaign, segment, 0)

    return list(map_threads(predict, models, context.jobs))


def compute_validation(context: Context, predictions: Sequence[Prediction]) -> Validation:
    """Summarise predictions: error per channel, overall, and in blocks of time."""
    comparisons = [p.comparison for p in predictions]
    errors = nrmse(comparisons)
    return Validation(
        errors,
        overall_nrmse(errors),
        tuple(p.series for p in predictions),
        tuple((p.segment.file, p.diverged_at) for p in predictions if p.diverged_at is not None),
        _block_errors(context, [p.segment for p in predictions], comparisons),
    )


def error_after_start(context: Context, validation: Validation, segments: Sequence[Segment]) -> float:
    """NRMSE of a validation without the start of every segment."""
    return overall_nrmse(nrmse(_after_start(context, validation, segments)))


def block_errors_after_start(context: Context, validation: Validation, segments: Sequence[Segment]) -> FloatArray:
    """Contribution [block] of blocks of time to the squared error after the start of every segment."""
    return _block_errors(context, segments, _after_start(context, validation, segments))


def _after_start(context: Context, validation: Validation, segments: Sequence[Segment]) -> list[Comparison]:
    pairs = zip(segments, validation.series, strict=True)
    return [without_start(context, s, compare(context.campaign, s, x)) for s, x in pairs]


def without_start(context: Context, segment: Segment, compared: Comparison) -> Comparison:
    """Return a comparison without the first seconds of its segment, on which the initial state is estimated."""
    settings = context.settings
    longest = settings.validation.max_start_share * segment.samples * segment.dt
    start = min(settings.initial_state.initial_state_duration, longest)
    cut = max(round(start / segment.dt) - cut_samples(context.campaign, segment), 0)
    return replace(compared, measured=compared.measured[:, cut:], simulated=compared.simulated[:, cut:])


def is_worse_than_nominal(context: Context, nominal: Validation, calibrated: Validation) -> bool:
    """True where a calibrated model has a significantly larger error than the nominal one on the same runs."""
    if not np.isfinite(nominal.nrmse):
        return False
    if not np.isfinite(calibrated.nrmse):
        return True
    gain, sd, _ = calibrated.error_reduction(nominal)
    return gain > context.settings.selection.gain_standard_errors * sd


def _block_errors(context: Context, segments: Sequence[Segment], comparisons: Sequence[Comparison]) -> FloatArray:
    """Contribution [block] of blocks of time to the squared overall error."""
    settings = context.settings.validation
    duration = error_block_duration(context, segments)
    power: dict[str, float] = {}
    for comparison in comparisons:
        for c, row in zip(comparison.channels, comparison.measured, strict=True):
            power[c] = power.get(c, 0.0) + float(np.sum(row**2))
    blocks = []
    for comparison in comparisons:
        weight = np.array([1.0 / max(power[c], 1e-300) for c in comparison.channels]) / len(power)
        squares = weight @ (comparison.measured - comparison.simulated) ** 2
        n, dt = len(squares), comparison.dt
        is_long = n * dt > settings.min_error_blocks * duration
        length = max(1, round(duration / dt)) if is_long else n // settings.short_segment_parts + 1
        blocks.append(np.add.reduceat(squares, np.arange(0, n, length)))
    return np.concatenate(blocks)


def error_block_duration(context: Context, segments: Sequence[Segment]) -> float:
    """Duration [s] of a block of errors; at least that of a block of the fit on a rig, whose motion may be slow."""
    longest_run = max((s.samples * s.dt for s in segments if s.is_rig), default=0.0)
    of_fit = longest_run / context.settings.calibration.rig_block_count
    return max(context.settings.validation.error_block_duration, of_fit)


def is_significant_gain(context: Context, old: Validation, new: Validation) -> bool:
    """True where the validation error is lower by the campaign's minimum relative gain, and clear of its scatter."""
    if not np.isfinite(new.nrmse):
        return False
    gain, sd, _ = old.error_reduction(new)
    return bool(gain >= context.campaign.min_gain and gain > context.settings.selection.gain_standard_errors * sd)
