"""Output-error estimation: fit the free parameters of a model to the estimation runs of a dataset."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit, block_duration
from railui.identification.estimation.free_parameters import free_parameters
from railui.identification.estimation.gauss_newton import MAX_ITERATIONS, GaussNewton
from railui.identification.estimation.problem import FitSegment, prepare_segments
from railui.vehicle.model import Model

COARSE_TOLERANCE = 1e-4  # of a fit from whose estimates another one starts


def fit_output_error(
    context: Context,
    model: Model,
    paths: Sequence[str],
    *,
    segments: Sequence[FitSegment] | None = None,
    start: FloatArray | None = None,
    stable: bool | None = None,
    tolerance: float = 1e-6,
    max_iterations: int = MAX_ITERATIONS,
    misfit_limit: float = np.inf,
) -> Fit:
    """Estimate the numbers at `paths` of a model, and the phases of each segment, by Gauss-Newton.

    Parameters
    ----------
    segments
        As prepared; the estimation runs by default.
    start
        Start values [p] of `Model.free_paths`; those of the model by default.
    stable
        Reject linear vehicles that are unstable over a whole run; by default unless creep or flanges bound the motion.
    tolerance
        Relative gain of the misfit below which the fit ends.
    misfit_limit
        Misfit below which the fit must come to be of use; it ends early where that is out of reach.

    Raises
    ------
    ValueError
        Where the vehicle diverges at a point of the fit.
    """
    if segments is None:
        segments = prepare_segments(context, model, context.dataset.estimation)
    free = free_parameters(context, model, paths)
    stable = not model.limits_hunting if stable is None else stable
    duration = block_duration(context.settings.calibration, context.nominal, [t.segment for t in segments])
    optimiser = GaussNewton(context, model, free, segments, block=duration, stable=stable)
    x = np.array([model.value(p) for p in free.paths]) if start is None else start
    return optimiser.fit(x, tolerance=tolerance, max_iterations=max_iterations, misfit_limit=misfit_limit)


def continue_fit(
    context: Context, fit: Fit, segments: Sequence[FitSegment], *, tolerance: float, max_iterations: int
) -> Fit:
    """Iterate further from a fit; its normal equations hold where its segments have the same steps and initial states.

    Raises
    ------
    ValueError
        Where the vehicle diverges at a point of the fit.
    """
    optimiser = GaussNewton.of_fit(context, fit, segments, stable=not fit.model.limits_hunting)
    normal = fit.normal if _same_simulation(fit.segments, segments) else None
    return optimiser.fit(fit.x, tolerance=tolerance, max_iterations=max_iterations, normal=normal)


def _same_simulation(former: Sequence[FitSegment], segments: Sequence[FitSegment]) -> bool:
    """True where a model has the same motion on both; free initial states are estimated anew."""
    return all(
        not t.has_free_start and t.steps == old.steps and np.array_equal(t.initial_state, old.initial_state)
        for old, t in zip(former, segments, strict=True)
    )
