"""Model from which effects are selected: the calibrated one, or the nominal one where the calibration failed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from railui.identification.context import Context
from railui.identification.estimation.calibration import (
    calibrate,
    calibrate_from,
    fit_without_iteration,
    stable_start,
)
from railui.identification.estimation.failed_fit import has_failed, retry_failed_fit
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.multiple_shooting import refit_hunting
from railui.identification.estimation.parallel_models import two_parallel_models
from railui.identification.estimation.problem import prepare_segments
from railui.identification.estimation.validation import Validation, is_significant_gain, validate
from railui.identification.structure.stepwise import Selection
from railui.identification.unmodelled.variation import find_variation, is_conclusive


class BaseModel(NamedTuple):
    """The model from which effects are selected, its validation, and that fitted on windows where it hunts."""

    fit: Fit
    validation: Validation
    windowed: Fit | None
    is_failed: bool


def calibrated_base(context: Context, nominal: Validation) -> BaseModel:
    """Calibrate; return the nominal model where the calibration failed.

    A calibrated model that is worse on the validation runs than the nominal one, and not at the noise floor of the
    estimation runs, has ended in a local minimum; no structure can be detected in its residual. This does not apply
    where the data demand a vehicle that hunts, which a stable one cannot follow, or a parameter that varies along the
    track, whose mean on one track is not that on another.
    """
    fit, windowed = refit_hunting(context, calibrate(context))
    validation = validate(context, fit.model, context.dataset.selection)
    if windowed is None:
        fit, windowed, validation = retry_failed_fit(context, fit, nominal, validation)
    hunts = windowed is not None and not windowed.slips
    if hunts or not has_failed(context, fit, nominal, validation) or _is_better_with_variation(context, fit, nominal):
        return BaseModel(fit, validation, windowed, is_failed=False)
    context.progress.message(
        f"the calibration failed: NRMSE {validation.nrmse:.4f} on the validation runs, "
        f"{nominal.nrmse:.4f} with the nominal model, which is used instead"
    )
    start = stable_start(context)
    if start is not context.nominal:
        nominal = validate(context, start, context.dataset.selection)
    return BaseModel(fit_without_iteration(context, start), nominal, windowed, is_failed=True)


def _is_better_with_variation(context: Context, fit: Fit, nominal: Validation) -> bool:
    """True where a calibrated model with a parameter that varies within the runs is better than the nominal one."""
    variation = find_variation(context, fit)
    if variation is None or not is_conclusive(context, variation):
        return False
    return is_significant_gain(context, nominal, variation.validation)


def better_base(context: Context, base: BaseModel, selection: Selection, nominal: Validation) -> BaseModel | None:
    """Calibrate again from the estimates of the best model with an effect; None where that ends no better.

    The calibration may have ended in a local minimum, which any effect helps to leave. An effect counts against the
    best model without it.
    """
    refits = [r.fit for r in selection.steps[0].refits if r.candidate is not None] if selection.steps else []
    best = selection.fit if selection.has_effects else min(refits, key=lambda f: f.normal.rss, default=None)
    if best is None or base.windowed is not None or context.is_out_of_time:
        return None
    fit = calibrate_from(context, base.fit, best.model)
    if fit is None:
        return None
    validation = validate(context, fit.model, context.dataset.selection)
    is_better = validation.nrmse <= np.nan_to_num(base.validation.nrmse, nan=np.inf)
    if not is_better or has_failed(context, fit, nominal, validation):
        return None  # no better, or it diverges
    context.progress.message(
        "the calibration had ended in a local minimum; from the estimates with an effect, without the effect: "
        f"NRMSE {base.validation.nrmse:.4f} -> {validation.nrmse:.4f}; selecting again"
    )
    return BaseModel(fit, validation, None, is_failed=False)


def base_of_parallel_models(context: Context, nominal: Validation) -> BaseModel:
    """Calibrate by Broersen's method."""
    start = stable_start(context)
    fit = two_parallel_models(context, start, prepare_segments(context, start, context.dataset.estimation))
    validation = validate(context, fit.model, context.dataset.selection)
    return BaseModel(fit, validation, None, has_failed(context, fit, nominal, validation))
