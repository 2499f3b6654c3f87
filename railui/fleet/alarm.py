"""Alarms: a crossing with its attribution, its course and the day at which a limit is reached."""

from __future__ import annotations

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
    course
        Course of its quantity up to the block `until`; None where that is not followed.
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
    course: Course | None
    index: int | None
    files: tuple[str, ...]


def explain_alarm(
    data: Observations, monitor: Monitor, crossing: Crossing, settings: FleetSettings, until: int | None = None
) -> Alarm:
    """Explain a crossing of a vehicle by its runs since the change began.

    until: last block of the course; that of the crossing by default.
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
    return Alarm(
        crossing,
        data.vehicles[v],
        float(monitor.start[last + 1]),
        verdict,
        name,
        alternatives,
        attribution.explained,
        float("nan") if chosen is None else chosen.change,
        float("nan") if chosen is None else chosen.sd,
        course_of(data, monitor, crossing, index, last if until is None else until),
        index,
        tuple(data.files[i] for i in runs),
    )


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
    middle = 0.5 * (monitor.start[blocks] + monitor.start[blocks + 1])
    return fit_course(middle, deviation, monitor.spread[blocks, v, index])


def mean_use(data: Observations, monitor: Monitor, vehicle: int, index: int, blocks: NDArray[np.int64]) -> FloatArray:
    """Use of a vehicle in blocks, interpolated where it has no run."""
    own = np.flatnonzero(data.vehicle == vehicle)
    return np.asarray(np.interp(blocks, monitor.block_of_run[own], data.use[own, index]))
