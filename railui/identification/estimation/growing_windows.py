"""Fits on windows of growing length: a motion that slips against the model over a whole run is followed piece by piece.

A long, lightly damped or free motion whose frequency is slightly wrong is half a turn off after some periods, and the
misfit then has minima in which the model is out of step. On windows of two periods with free initial states it has
none of them. The windows are doubled as long as the model follows the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.campaign.settings.estimation import WindowSettings
from railui.identification.context import Context
from railui.identification.estimation.block_products import split_into_blocks
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.modulating_functions import dominant_period, modulating_starts
from railui.identification.estimation.output_error import COARSE_TOLERANCE, fit_output_error
from railui.identification.estimation.problem import FitSegment, adapt_to_model, prepare_segments
from railui.identification.prediction import SimulationError
from railui.vehicle.model import Model

IndexArray = NDArray[np.int64]


class Followed(NamedTuple):
    """A fit that follows the motion on the longest windows possible, and one over whole runs that starts from it."""

    windowed: Fit
    whole: Fit | None


def misfit_ratio(settings: WindowSettings, fit: Fit) -> float:
    """Largest misfit of a block over its signal: 1 where the residual is as large as the signal, beyond noise."""
    residual = fit.normal.gram[:, :, 0, 0].sum(axis=1)
    worst, first = 0.0, 0
    for target in fit.segments:
        length = fit.block_samples(target)
        signal = (split_into_blocks(target.measured[None], length) ** 2).sum(axis=(0, 1, 3))
        starts = block_starts(settings, target.segment, len(signal), length * target.filter.decimation)
        noise = np.add.reduceat(np.full(len(signal), float(length * len(target.measured))), starts)  # weighted to 1
        rss = np.add.reduceat(residual[first : first + len(signal)], starts)
        worst = max(worst, largest_ratio(settings, rss, np.add.reduceat(signal, starts), noise))
        first += len(signal)
    return worst


def block_starts(settings: WindowSettings, segment: Segment, count: int, length: int) -> IndexArray:
    """First indices of equal blocks of a run, each at least a period long, in parts of some samples."""
    run = segment.window_of or segment
    seconds = max(run.samples * run.dt / settings.misfit_blocks, dominant_period(run))
    return np.arange(0, count, max(1, round(seconds / (length * run.dt))))


def largest_ratio(settings: WindowSettings, rss: FloatArray, signal: FloatArray, noise: FloatArray) -> float:
    """Largest ratio of misfit to signal and noise [block]; infinite where diverged, blocks without motion left out."""
    counts = signal >= settings.min_block_power_share * signal.mean()
    ratios = np.where(np.isfinite(rss), rss, np.inf) / np.maximum(signal + noise, 1e-300)
    return float(np.max(ratios[counts], initial=0.0))


def slips(context: Context, fit: Fit) -> bool:
    """True where the residual of a fit is larger than the signal in any block."""
    settings = context.settings.windows
    return misfit_ratio(settings, fit) > settings.slipped_misfit


def follows(context: Context, fit: Fit) -> bool:
    """True where a fit is in step with the motion in every block."""
    settings = context.settings.windows
    return misfit_ratio(settings, fit) <= settings.followed_misfit


def window_durations(settings: WindowSettings, segments: Sequence[Segment], longer_than: float = 0.0) -> list[float]:
    """Lengths [s] of the windows: some periods of the slowest run, doubled up to half the longest run."""
    longest = max(s.samples * s.dt for s in segments)
    duration = settings.first_window_periods * max(dominant_period(s) for s in segments)
    durations = []
    while duration <= 0.5 * longest:
        if duration > longer_than:
            durations.append(duration)
        duration *= 2.0
    return durations


def spread_windows(settings: WindowSettings, segments: Sequence[Segment], duration: float) -> list[Segment]:
    """Cut segments into windows, and select some evenly where there are many."""
    windows = [w for s in segments for w in (s.windows(duration) if s.samples * s.dt >= 2.0 * duration else [s])]
    count = min(len(windows), settings.max_windows)
    return [windows[i] for i in np.unique(np.linspace(0, len(windows) - 1, count).round().astype(int))]


def follow_motion(
    context: Context, model: Model, paths: Sequence[str], whole: Sequence[FitSegment], *, shortest: Fit | None = None
) -> Followed | None:
    """Fit a model on windows of growing length, and finally over whole runs, each fit starting from the last.

    Parameters
    ----------
    paths
        Of the numbers to estimate.
    whole
        The whole runs as prepared for a fit.
    shortest
        A fit on windows from which to go on; by default the model is fitted on the shortest ones.

    Returns
    -------
    Followed or None
        None where the model cannot be simulated on the shortest windows, or the runs are too short for any.
    """
    segments = [t.segment for t in whole]
    followed = shortest
    spent = 0 if shortest is None else shortest.simulations
    for duration in window_durations(context.settings.windows, segments, _window_duration(shortest)):
        if followed is not None and context.is_out_of_time:
            break
        fit = fit_on_windows(context, model if followed is None else followed.model, paths, segments, duration)
        spent += 0 if fit is None else fit.simulations
        if fit is None or (followed is not None and not follows(context, fit)):
            break
        followed = fit
    if followed is None:
        return None
    final = fit_whole_runs(context, followed.model, paths, whole)
    followed = replace(followed, simulations=spent, slips=True)
    return Followed(followed, None if final is None else replace(final, simulations=spent + final.simulations))


def lengthen_windows(
    context: Context, model: Model, paths: Sequence[str], segments: Sequence[Segment], longest: float
) -> tuple[Model, int]:
    """Fit a hunting model on windows of two periods, doubled up to a length [s] as long as it follows the motion.

    A limit cycle of a slightly wrong frequency is out of step within a few seconds. Returns the model of the last fit
    that follows, or the given one where none does, and the number of simulations.
    """
    followed, is_first, spent = model, True, 0
    for duration in window_durations(context.settings.windows, segments):
        if duration >= longest or context.is_out_of_time:
            break
        fit = fit_on_windows(context, followed, paths, segments, duration)
        spent += 0 if fit is None else fit.simulations
        if fit is None or not (is_first or follows(context, fit)):
            break
        followed, is_first = fit.model, False
    return followed, spent


def fit_on_windows(
    context: Context,
    model: Model,
    paths: Sequence[str],
    segments: Sequence[Segment],
    duration: float,
    *,
    like: Sequence[FitSegment] = (),
) -> Fit | None:
    """Fit a model on windows of so many seconds; None where it diverges.

    like: windows of another fit, whose weights are taken over.
    """
    windows = spread_windows(context.settings.windows, segments, duration)
    try:
        prepared = prepare_segments(context, model, windows, like=like)
        return fit_output_error(context, model, paths, segments=prepared, stable=False, tolerance=COARSE_TOLERANCE)
    except SimulationError:
        return None


def fit_whole_runs(
    context: Context, model: Model, paths: Sequence[str], whole: Sequence[FitSegment], *, tolerance: float = 1e-6
) -> Fit | None:
    """Fit a model over whole runs from its own numbers; None where it diverges."""
    try:
        segments = adapt_to_model(context, model, whole)
        return fit_output_error(context, model, paths, segments=segments, tolerance=tolerance)
    except SimulationError:
        return None


def leave_wrong_minimum(context: Context, before: Fit) -> tuple[Fit, Fit | None]:
    """Try harder to fit a model whose fit slips or fails: several starts on short windows, which are then lengthened.

    The starts are the nominal model, the fit itself, and for a rig the estimates by modulating functions: from the
    whole motion and from its smallest part, where an unmodelled law changes the frequency least.

    Returns
    -------
    tuple
        The better fit over whole runs; and where that does not follow the motion, the one on the longest windows that
        does.
    """
    paths = context.campaign.estimated_parameters
    segments = [t.segment for t in before.segments]
    quiet = context.in_background(context.jobs)
    durations = window_durations(context.settings.windows, segments)
    if not durations or any(s.window_of is not None for s in segments):
        return before, None
    starts = [context.nominal, before.model]
    starts += [context.nominal.with_path_values(paths, x) for x in modulating_starts(context.nominal, segments, paths)]
    tries: list[Fit] = []
    for model in starts:
        if context.is_out_of_time:
            break
        fit = fit_on_windows(quiet, model, paths, segments, durations[0], like=tries[0].segments if tries else ())
        tries += [] if fit is None else [fit]
    spent = before.simulations + sum(f.simulations for f in tries)
    if not tries:
        return before, None
    best = min(tries, key=lambda f: f.normal.rss)
    followed = follow_motion(quiet, best.model, paths, before.segments, shortest=best)
    better = before
    if followed is not None and followed.whole is not None and followed.whole.cost < before.cost:
        better = replace(followed.whole, constrained=before.constrained)
    if followed is not None:  # it counts those of the best try once more
        spent += (followed.whole or followed.windowed).simulations - best.simulations
    better = replace(better, simulations=spent)
    if followed is None or follows(context, better):
        return better, None
    seconds = max(t.segment.samples * t.segment.dt for t in followed.windowed.segments)
    context.progress.message(
        f"over whole runs the model falls out of step with the motion: estimated on windows of {seconds:.3g} s, "
        "together with the initial state of each window (multiple shooting)"
    )
    return better, followed.windowed


def _window_duration(fit: Fit | None) -> float:
    """Length [s] of the longest window of a fit; 0 without a fit."""
    return 0.0 if fit is None else max(t.segment.samples * t.segment.dt for t in fit.segments)
