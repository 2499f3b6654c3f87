"""Failed fits: a model out of step with the motion, or worse than the nominal model, is fitted from several starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.campaign.comparison import compare
from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.growing_windows import (
    block_starts,
    largest_ratio,
    leave_wrong_minimum,
    slips,
)
from railui.identification.estimation.validation import Validation, is_worse_than_nominal, validate


def has_failed(context: Context, fit: Fit, nominal: Validation, calibrated: Validation) -> bool:
    """True where a calibrated model is worse on the validation runs than the nominal one, and above noise."""
    is_at_floor = fit.error_to_noise <= context.settings.selection.unexplained_ratio
    return not is_at_floor and is_worse_than_nominal(context, nominal, calibrated)


def slips_on_validation(context: Context, validation: Validation, segments: Sequence[Segment]) -> bool:
    """True where the error of a model is larger than the signal in any block of the validation runs."""
    return _validation_misfit(context, validation, segments) > context.settings.windows.slipped_misfit


def follows_on_validation(context: Context, validation: Validation, segments: Sequence[Segment]) -> bool:
    """True where a model is in step with the motion in every block of the validation runs."""
    return _validation_misfit(context, validation, segments) <= context.settings.windows.followed_misfit


def _validation_misfit(context: Context, validation: Validation, segments: Sequence[Segment]) -> float:
    """Largest ratio of the squared error of a block to its signal, the channels in proportion to their power."""
    settings, worst = context.settings.windows, 0.0
    for segment, series in zip(segments, validation.series, strict=True):
        comparison = compare(context.campaign, segment, series)
        scale = np.maximum(np.mean(comparison.measured**2, axis=1), 1e-300)
        starts = block_starts(settings, segment, comparison.measured.shape[1], 1)
        power, rss = (
            np.add.reduceat(np.sum(x**2 / scale[:, None], axis=0), starts)
            for x in (comparison.measured, comparison.measured - comparison.simulated)
        )
        variance = sum(context.noise.get(c, 0.0) ** 2 / s for c, s in zip(comparison.channels, scale, strict=True))
        lengths = np.diff(np.append(starts, comparison.measured.shape[1]))
        worst = max(worst, largest_ratio(settings, rss, power, variance * lengths))
    return worst


def retry_failed_fit(
    context: Context, fit: Fit, nominal: Validation, validation: Validation
) -> tuple[Fit, Fit | None, Validation]:
    """Fit a calibrated model anew where it is out of step with the motion or worse than the nominal model.

    Costs nothing where it is neither.

    Parameters
    ----------
    nominal, validation
        The nominal and the calibrated model on the validation runs.

    Returns
    -------
    tuple
        The fit over whole runs; the one on windows where no fit over whole runs follows the motion; and the validation
        of the first.
    """
    segments = context.dataset.selection
    is_wrong = has_failed(context, fit, nominal, validation)
    if context.nominal.design.structure is None:  # a stable vehicle of bodies stays in step with its track
        is_wrong = is_wrong or slips(context, fit) or slips_on_validation(context, validation, segments)
    is_prescribed = context.nominal.design.form == "bench"  # its motion cannot fall out of step
    if context.is_out_of_time or is_prescribed or not is_wrong:
        return fit, None, validation
    context.progress.message("the fit may have ended in a wrong minimum: trying several starts on short windows")
    again, windowed = leave_wrong_minimum(context, fit)
    if again.model is not fit.model:
        validation = validate(context, again.model, segments)
    return again, windowed, validation
