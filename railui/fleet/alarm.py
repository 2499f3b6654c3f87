"""Alarms: a crossing with its attribution, its course and the day at which a limit is reached."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.fleet import FleetSettings
from railui.fleet.attribution import Attribution, Explanation, attribute, signatures_of
from railui.fleet.course import Course, fit_course
from railui.fleet.history import Crossing, Monitor
from railui.fleet.observations import ERROR, Observations

OUTSIDE: Final = "outside"
BEFORE: Final = 6  # blocks before the onset that a course begins with
CORRELATION_PRIOR: Final = 3.0  # scores per quantity that a prior without correlations counts as
MAX_SCORE: Final = 3.0  # of the scores from which correlations are estimated


@dataclass(frozen=True, eq=False)
class Alarm:
    """A change of a vehicle.

    Attributes
    ----------
    verdict
        parameter, effect, sensor or outside.
    name
        What explains it best; of `outside` the quantity that raised the alarm.
    alternatives
        Explanations that the data do not separate from the best.
    explained
        Share of the explainable deviance that the best explanation reaches.
    change, change_sd
        Size of the change over the runs since its onset: relative to the nominal value for a parameter.
    total_change, total_change_sd
        The same from the level before the first alarm of the quantity since maintenance.
    course
        Course of its quantity up to the block `until`; None where that is not followed.
    reference
        Crossing before which the levels count that the course is compared with: the first one of the quantity since
        maintenance, or that of the alarm where no single ramp fits both changes.
    index
        Column of the quantity in the observations; None: not followed.
    files
        Runs that the explanation rests on.
    """

    crossing: Crossing
    vehicle: str
    raised: float
    verdict: str
    name: str
    alternatives: tuple[str, ...]
    explained: float
    change: float
    change_sd: float
    total_change: float
    total_change_sd: float
    course: Course | None
    reference: Crossing
    index: int | None
    files: tuple[str, ...]


def explain_alarm(
    data: Observations,
    monitor: Monitor,
    crossing: Crossing,
    settings: FleetSettings,
    earlier: Sequence[Alarm] = (),
) -> Alarm:
    """Explain a crossing of a vehicle by its runs since the change began.

    earlier: alarms before this one, in their order.
    """
    v, first, last = crossing.subject, crossing.started, crossing.block
    of_vehicle = (data.vehicle == v) & (monitor.block_of_run <= last)
    runs = np.flatnonzero(of_vehicle & (monitor.block_of_run > first))
    if not len(runs):
        runs = np.flatnonzero(of_vehicle & (monitor.block_of_run == last))
    attribution = _attribution(data, monitor, crossing, runs)
    verdict, chosen, alternatives = _decide(data, attribution, crossing, settings)
    names = [q.name for q in data.quantities]
    name = chosen.name if chosen is not None else names[crossing.quantities[0]]
    index = names.index(name)
    begin = _first_crossing(data, monitor, crossing, index, earlier)
    change = (float("nan"), float("nan")) if chosen is None else (chosen.change, chosen.sd)
    total = change if begin is crossing or chosen is None else _change_since(data, monitor, crossing, begin, index)
    course, reference = _course(data, monitor, crossing, begin, index, settings)
    return Alarm(
        crossing,
        data.vehicles[v],
        float(monitor.start[last + 1]),
        verdict,
        name,
        alternatives,
        attribution.explained,
        *change,
        *total,
        course,
        reference,
        index,
        tuple(data.files[i] for i in runs),
    )


def _first_crossing(
    data: Observations, monitor: Monitor, crossing: Crossing, index: int, earlier: Sequence[Alarm]
) -> Crossing:
    """Return the first crossing of a vehicle that changed a quantity, without maintenance of it up to this one."""
    own = (data.vehicle == crossing.subject) & (monitor.block_of_run <= crossing.block)
    first = crossing
    for alarm in reversed(earlier):
        runs = own & (monitor.block_of_run > alarm.crossing.started)
        if alarm.crossing.subject != crossing.subject or alarm.index != index:
            continue
        if np.ptp(data.unit[runs, index]) > 0:
            break
        first = alarm.crossing
    return first


def _change_since(
    data: Observations, monitor: Monitor, crossing: Crossing, begin: Crossing, index: int
) -> tuple[float, float]:
    """Return the change over the runs since the onset from the levels before another crossing, and its deviation."""
    v, first = crossing.subject, crossing.started
    blocks = np.arange(first + 1, crossing.block + 1)
    blocks = blocks[np.isfinite(monitor.value[blocks, v, index])]
    weight = (blocks - first) / np.sum(blocks - first)
    use = mean_use(data, monitor, v, index, blocks)
    levels = monitor.levels[min(begin.started + 1, begin.block)]
    a, b, aa, ab, bb = (float(getattr(levels, x)[v, index]) for x in ("a", "b", "aa", "ab", "bb"))
    late = float(weight @ use)
    change = float(weight @ (monitor.value[blocks, v, index] - (a + b * use)))
    variance = float(weight**2 @ monitor.spread[blocks, v, index] ** 2)
    return change, float(np.sqrt(variance + max(aa + 2.0 * late * ab + late**2 * bb, 0.0)))


def _course(
    data: Observations, monitor: Monitor, crossing: Crossing, begin: Crossing, index: int, settings: FleetSettings
) -> tuple[Course | None, Crossing]:
    """Return the course since the first crossing of a quantity, unless no ramp fits it, and the crossing it refers to.

    A ramp over all blocks has more of them than one since the last alarm, whose level is that of few blocks and was
    itself on the ramp.
    """
    if begin is not crossing:
        course = course_of(data, monitor, begin, index, crossing.block)
        if course is not None and course.probability >= settings.misfit_probability:
            return course, begin
    return course_of(data, monitor, crossing, index, crossing.block), crossing


def _attribution(data: Observations, monitor: Monitor, crossing: Crossing, runs: NDArray[np.int64]) -> Attribution:
    """Compare explanations of the mean change of a vehicle since the onset; later blocks, of larger change, count more.

    Quantities that maintenance has changed in the meantime are left out.
    """
    v, first, last = crossing.subject, crossing.started, crossing.block
    unit = data.unit[runs]
    columns = [j for j, q in enumerate(data.quantities) if q.kind != ERROR and np.ptp(unit[:, j]) == 0]
    blocks = np.unique(monitor.block_of_run[runs])
    blocks = blocks[np.isfinite(monitor.value[blocks, v][:, columns]).all(axis=1)]
    if not len(blocks) or not columns:
        return Attribution((), 0.0, 0)
    levels, weight = monitor.levels[min(first + 1, last)], (blocks - min(first, blocks[0] - 1)).astype(float)
    weight /= weight.sum()
    use = np.stack([mean_use(data, monitor, v, j, blocks) for j in columns], axis=1)
    a, b, aa, ab, bb = (getattr(levels, x)[v, columns] for x in ("a", "b", "aa", "ab", "bb"))
    change = weight @ (monitor.value[blocks, v][:, columns] - (a + b * use))
    late = weight @ use
    variance = weight**2 @ monitor.spread[blocks, v][:, columns] ** 2
    variance += np.maximum(aa + 2.0 * late * ab + late**2 * bb, 0.0)
    sd = np.sqrt(variance)
    covariance = _correlation(monitor, last, columns) * np.outer(sd, sd)
    share = weight[np.clip(np.searchsorted(blocks, monitor.block_of_run[runs]), 0, len(blocks) - 1)]
    names, scale = [data.quantities[j].name for j in columns], np.array([data.quantities[j].scale for j in columns])
    return attribute(change, covariance, signatures_of([data.summaries[i] for i in runs], share, names, scale))


def _correlation(monitor: Monitor, last: int, columns: list[int]) -> FloatArray:
    """Correlations of the scores of all vehicles until a block, from the bounded scores, towards none where few."""
    z = np.clip(monitor.score[: last + 1][:, :, columns].reshape(-1, len(columns)), -MAX_SCORE, MAX_SCORE)
    z = z[np.isfinite(z).all(axis=1)]
    prior = CORRELATION_PRIOR * len(columns)
    scale = np.sqrt(np.maximum(np.mean(z**2, axis=0), 1e-12)) if len(z) else np.ones(len(columns))
    return np.asarray((z.T @ z / np.outer(scale, scale) + prior * np.eye(len(columns))) / (len(z) + prior))


def _decide(
    data: Observations, attribution: Attribution, crossing: Crossing, settings: FleetSettings
) -> tuple[str, Explanation | None, tuple[str, ...]]:
    """Verdict, best explanation and those that are not separated from it."""
    first = attribution.explanations[0] if attribution.explanations else None
    if first is None or first.deviance < settings.min_deviance:
        return OUTSIDE, None, ()
    if attribution.explained < settings.min_explained and attribution.fit_probability < settings.misfit_probability:
        return OUTSIDE, None, ()
    close = tuple(e.name for e in attribution.explanations[1:] if first.deviance - e.deviance < settings.separation)
    if first.name.startswith("sensor_"):
        return "sensor", first, close
    return ("effect" if " at " in first.name else "parameter"), first, close


def course_of(data: Observations, monitor: Monitor, crossing: Crossing, index: int, until: int) -> Course | None:
    """Course of a quantity about what was expected before the onset, from some blocks before it on."""
    v = crossing.subject
    levels = monitor.levels[min(crossing.started + 1, crossing.block)]
    blocks = np.arange(max(0, crossing.started - BEFORE), until + 1)
    use = mean_use(data, monitor, v, index, blocks)
    deviation = monitor.value[blocks, v, index] - (levels.a[v, index] + levels.b[v, index] * use)
    late = float(use.mean())
    aa, ab, bb = (float(getattr(levels, x)[v, index]) for x in ("aa", "ab", "bb"))
    level_sd = float(np.sqrt(max(aa + 2.0 * late * ab + late**2 * bb, 0.0)))
    return fit_course(_mean_time(data, monitor, v, blocks), deviation, monitor.spread[blocks, v, index], level_sd)


def _mean_time(data: Observations, monitor: Monitor, vehicle: int, blocks: NDArray[np.int64]) -> FloatArray:
    """Mean time [day] of the runs of a vehicle in blocks, the middle of one without a run."""
    runs = np.flatnonzero((data.vehicle == vehicle) & np.isin(monitor.block_of_run, blocks))
    at = np.searchsorted(blocks, monitor.block_of_run[runs])
    count = np.bincount(at, minlength=len(blocks))
    total = np.bincount(at, weights=data.time[runs], minlength=len(blocks))
    return np.where(count > 0, total / np.maximum(count, 1), 0.5 * (monitor.start[blocks] + monitor.start[blocks + 1]))


def mean_use(data: Observations, monitor: Monitor, vehicle: int, index: int, blocks: NDArray[np.int64]) -> FloatArray:
    """Use of a vehicle in blocks, interpolated where it has no run."""
    own = np.flatnonzero(data.vehicle == vehicle)
    return np.asarray(np.interp(blocks, monitor.block_of_run[own], data.use[own, index]))
