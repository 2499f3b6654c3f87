"""Vehicles near or beyond their hunting limit, adjusted on short windows that each begin anew.

Over a whole run what a linear vehicle does there grows or dies by powers of e that no fit can follow; over a few
seconds, with the initial state of each free, it is near to linear in its parameters (multiple shooting).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from railui import core
from railui.campaign.dataset import Dataset, Segment
from railui.identification.estimation.output_error import STABLE, Fit, fit_output_error
from railui.identification.estimation.problem import reprepare_segments, prepare_segments
from railui.progress import Report, Watch, silent, unwatched
from railui.vehicle.model import Model

WINDOW = 3.0  # s
NEAR = -1.0  # 1/s, growth from which a vehicle is too near its limit for a whole run
ROUNDS = 3  # times that further runs are cut

Key = tuple[str, int]


def limits_hunting(model: Model) -> bool:
    """Can an effect of the model hold the hunting of its linear base?"""
    return any(core.record(e.kind)["acts"] == "creep" or e.kind == "flange_contact" for e in model.effects)


def max_growth_rate(model: Model, stretch: Segment) -> float:
    """Growth [1/s] of the least damped small motion at the speeds of a stretch; negative: it dies."""
    return max(model.growth(v) for v in stretch.speeds)


def unstable_segments(model: Model, stretches: Sequence[Segment], limit: float) -> set[Key]:
    """The stretches on which small motions of the vehicle grow faster than the limit [1/s]."""
    return {(s.file, s.number) for s in stretches if max_growth_rate(model, s) > limit}


def cut_into_windows(stretches: Sequence[Segment], cut: Collection[Key]) -> list[Segment]:
    """The stretches, some of them in windows."""
    return [w for s in stretches for w in (s.windows(WINDOW) if (s.file, s.number) in cut else [s])]


def windowed_files(fit: Fit) -> list[str]:
    """The runs of a fit that were cut in windows."""
    return list(dict.fromkeys(t.segment.file for t in fit.segments if t.segment.window_of is not None))


def refit_hunting(
    before: Fit,
    measurement: Dataset,
    declared: Model,
    *,
    jobs: int | None = None,
    report: Report = silent,
    watch: Watch = unwatched,
) -> tuple[Fit, Fit | None]:
    """The adjusted vehicle, and where the data ask for one that hunts, that one, adjusted on windows.

    The first may be a better one than was given: a fit over whole runs can end beside the best where the limit is near.
    """
    stretches = measurement.estimation
    if declared.design.kind != "bogie" or limits_hunting(declared):
        return before, None
    cut = unstable_segments(before.model, stretches, NEAR)
    if before.constrained:
        worst = max(stretches, key=lambda s: max_growth_rate(before.model, s))
        cut.add((worst.file, worst.number))
    if not cut:
        return before, None
    paths = measurement.campaign.estimated_parameters
    model, spent = declared, 0
    for _ in range(ROUNDS):
        windows = cut_into_windows(stretches, cut)
        count = sum(w.window_of is not None for w in windows)
        report(f"near its hunting limit: adjusting on {count} windows of {WINDOW:g} s")
        ready = prepare_segments(model, measurement, windows)
        fit = fit_output_error(
            model, measurement, paths, declared, ready=ready, stable=False, tolerance=1e-4, jobs=jobs, watch=watch
        )
        model, spent = fit.model, spent + fit.simulations
        more = unstable_segments(fit.model, stretches, STABLE) - cut
        if not more:
            break
        cut |= more
    fit = fit_output_error(
        fit.model, measurement, paths, declared, ready=reprepare_segments(fit.model, fit.segments, measurement), stable=False,
        jobs=jobs, watch=watch,
    )  # fmt: skip
    if unstable_segments(fit.model, stretches, STABLE):
        report(
            f"the linear vehicle hunts on {', '.join(windowed_files(fit))}: adjusted on windows of {WINDOW:g} s, "
            "the initial state of each estimated along"
        )
        return before, replace(fit, simulations=spent + fit.simulations)
    again = fit_output_error(fit.model, measurement, paths, declared, ready=before.segments, jobs=jobs, watch=watch)
    return (again if again.cost < before.cost else before), None
