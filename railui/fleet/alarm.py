"""Alarms: a crossing with its attribution, its course and the day at which a limit is reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.fleet import FleetSettings
from railui.fleet.attribution import Attribution, Explanation, attribute
from railui.fleet.course import Course, fit_course
from railui.fleet.mixed_model import MAD
from railui.fleet.monitor import Crossing, Monitor
from railui.fleet.observations import ERROR, Observations

OUTSIDE: Final = "outside"
BEFORE: Final = 6  # blocks before the onset that a course begins with
CONTROLLED_SHARE: Final = 0.5  # of the variance between sections and blocks, that a vehicle's sisters leave at most


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
    index = names.index(name) if name in names else None
    course = None if index is None else course_of(data, monitor, crossing, index, last if until is None else until)
    scale = 1.0 if chosen is None or index is None else data.quantities[index].scale
    return Alarm(
        crossing,
        data.vehicles[v],
        float(monitor.start[last + 1]),
        verdict,
        name,
        alternatives,
        attribution.explained,
        float("nan") if chosen is None else chosen.change / scale,
        float("nan") if chosen is None else chosen.sd / scale,
        course,
        index,
        tuple(data.files[i] for i in runs),
    )


def _attribution(data: Observations, monitor: Monitor, crossing: Crossing, runs: NDArray[np.int64]) -> Attribution:
    """Compare explanations with what was expected of the runs before the onset."""
    v, first = crossing.subject, crossing.started
    summaries = [data.summaries[i] for i in runs]
    names = (*summaries[0].paths, *summaries[0].directions)
    p = len(summaries[0].paths)
    followed = {q.name: j for j, q in enumerate(data.quantities)}
    earlier = np.flatnonzero((data.vehicle == v) & (monitor.block_of_run <= first))
    expected, spread, scale = np.zeros((len(runs), len(names))), np.zeros(len(names)), np.ones(len(names))
    levels = monitor.levels[min(first + 1, crossing.block)]
    for j, name in enumerate(names):
        past = np.array([data.summaries[i].estimate[j] for i in earlier])
        if name not in followed:
            if j < p and len(past):
                expected[:, j] = np.median(past)
                spread[j] = MAD * float(np.median(np.abs(past - np.median(past)))) or abs(float(np.median(past))) * 0.05
            continue
        k = followed[name]
        unit, model, use = data.quantities[k].scale, monitor.models[k], data.use[runs, k]
        level = levels.a[v, k] + levels.b[v, k] * use
        expected[:, j] = unit * (level + data.covariates[runs] @ model.fixed[1:3] + monitor.control[runs, k])
        uncertain = levels.aa[v, k] + 2.0 * use[-1] * levels.ab[v, k] + use[-1] ** 2 * levels.bb[v, k]
        common = CONTROLLED_SHARE * model.cell_variance / len(runs)
        common += max(model.variance - 1.0, 0.0) * float(np.median(data.sd[runs, k])) ** 2 / len(runs)
        spread[j], scale[j] = unit * np.sqrt(max(uncertain + common, 0.0)), unit
    excess = float(np.median([m.variance for m in monitor.models]))
    return attribute(summaries, expected, spread, scale, max(excess, 1.0))


def _decide(
    data: Observations, attribution: Attribution, crossing: Crossing, settings: FleetSettings
) -> tuple[str, Explanation | None, tuple[str, ...]]:
    """Verdict, best explanation and those that are not separated from it."""
    first = attribution.explanations[0] if attribution.explanations else None
    is_error = data.quantities[crossing.quantities[0]].kind == ERROR
    if first is None or attribution.explained < settings.min_explained or (is_error and first.deviance < 10.0):
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
