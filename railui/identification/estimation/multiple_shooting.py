"""Multiple shooting: vehicles near or beyond their hunting limit are fitted on short windows.

Over a whole run the motion of such a linear vehicle grows or decays by powers of e that no fit can follow. Over a few
seconds, with the initial state of each window free, it is nearly linear in its parameters.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import COARSE_TOLERANCE, fit_output_error
from railui.identification.estimation.problem import prepare_segments, reprepare_segments
from railui.identification.prediction import DivergedError
from railui.vehicle.model import Model

MAX_ROUNDS = 3  # of cutting further segments into windows


def max_growth_rate(model: Model, segment: Segment) -> float:
    """Growth rate [1/s] of the least stable small motion at the speeds of a segment; negative: it decays."""
    on_segment = model.on_segment(*segment.segment_key)
    return max(on_segment.growth_rate(v) for v in segment.speeds)


def unstable_segments(model: Model, segments: Sequence[Segment], limit: float) -> set[str]:
    """Names of the segments on which small motions of the vehicle grow faster than the limit [1/s]."""
    return {s.segment_key.name for s in segments if max_growth_rate(model, s) > limit}


def cut_into_windows(segments: Sequence[Segment], cut: Collection[str], duration: float) -> list[Segment]:
    """Replace the segments of some names by windows of so many seconds, and free motions by one window each.

    A free motion is nothing but its initial state, which has to be estimated together with the parameters.
    """

    def windows(segment: Segment) -> list[Segment]:
        if segment.segment_key.name in cut:
            return segment.windows(duration)
        return segment.windows(segment.samples * segment.dt) if segment.is_free else [segment]

    return [w for s in segments for w in windows(s)]


def windowed_files(fit: Fit) -> list[str]:
    """List the runs of a fit that were cut into windows."""
    return list(dict.fromkeys(t.segment.file for t in fit.segments if t.is_window))


def windowed_growth_rate(context: Context) -> float:
    """Growth rate [1/s] of the least stable motion from which a fit goes by windows.

    Where sprung bodies decay slowly at any speed, only an unstable motion counts.
    """
    settings = context.settings
    is_slow = context.nominal.design.has_sprung_bodies
    return settings.calibration.max_growth_rate if is_slow else settings.windows.windowed_growth_rate


def refit_hunting(context: Context, before: Fit) -> tuple[Fit, Fit | None]:
    """Fit a calibrated vehicle near its hunting limit on windows.

    Returns
    -------
    tuple
        The calibrated vehicle, replaced by a better one where the fit over whole runs ended away from its optimum; and
        where the data demand a vehicle that hunts, that one, fitted on windows.
    """
    if not context.nominal.design.is_on_track or context.nominal.limits_hunting:
        return before, None
    cut = _segments_near_limit(context, before)
    if not cut or context.is_out_of_time:
        return before, None
    try:
        return _refit_on_windows(context, before, cut)
    except DivergedError as error:
        context.progress.message(f"{error}, on windows: estimated on whole runs alone")
        return before, None


def _refit_on_windows(context: Context, before: Fit, cut: set[str]) -> tuple[Fit, Fit | None]:
    segments, paths = context.dataset.estimation, context.campaign.estimated_parameters
    limit, duration = context.settings.calibration.max_growth_rate, context.settings.windows.window_duration
    fit, spent = _fit_windows(context, cut)
    segments_again = reprepare_segments(context, fit.model, fit.segments)
    fit = fit_output_error(context, fit.model, paths, segments=segments_again, stable=False)
    if unstable_segments(fit.model, segments, limit):
        context.progress.message(
            f"the linear vehicle hunts on {', '.join(windowed_files(fit))}: estimated on windows of "
            f"{duration:g} s, together with the initial state of each window (multiple shooting)"
        )
        return before, replace(fit, simulations=spent + fit.simulations)
    spent += before.simulations + fit.simulations
    again = fit_output_error(context, fit.model, paths, segments=before.segments)
    better = again if again.cost < before.cost else before
    return replace(better, simulations=spent + again.simulations), None


def _segments_near_limit(context: Context, before: Fit) -> set[str]:
    segments = context.dataset.estimation
    cut = unstable_segments(before.model, segments, windowed_growth_rate(context))
    if before.constrained:
        worst = max(segments, key=lambda s: max_growth_rate(before.model, s))
        cut.add(worst.segment_key.name)
    return cut


def _fit_windows(context: Context, cut: set[str]) -> tuple[Fit, int]:
    """Fit on windows, and cut further segments until the vehicle is stable on all others; count the simulations."""
    segments = context.dataset.estimation
    duration = context.settings.windows.window_duration
    paths = context.campaign.estimated_parameters
    model, spent = context.nominal, 0
    for _ in range(MAX_ROUNDS):
        windows = cut_into_windows(segments, cut, duration)
        count = sum(w.window_of is not None for w in windows)
        context.progress.message(
            f"the vehicle is near its hunting limit: estimating on {count} windows of {duration:g} s"
        )
        prepared = prepare_segments(context, model, windows)
        fit = fit_output_error(context, model, paths, segments=prepared, stable=False, tolerance=COARSE_TOLERANCE)
        model, spent = fit.model, spent + fit.simulations
        more = unstable_segments(fit.model, segments, context.settings.calibration.max_growth_rate) - cut
        if not more or context.is_out_of_time:
            break
        cut = cut | more
    return fit, spent
