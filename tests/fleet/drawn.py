"""A made fleet whose runs are drawn: the true vehicles of the generator, seen with the errors of the quick path.

Every run has the inner products of a run that was simulated and summarised by the quick path (its template). Its
estimate is the true change plus an error with the covariance of these products, and an error that all runs on a section
have in common until the track is recorded again. Nothing is simulated, so that years of a fleet take minutes; what is
not linear in the changes is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import FloatArray
from railui.fleet.fleet_file import Fleet
from railui.fleet.observations import Observations, observations_of
from railui.fleet.quick_path import estimates_of_gram
from railui.fleet.summary import RunSummary
from tests.fleet.simulate import START, vehicle_name
from tests.truth.files import paths as numbers_of
from tests.truth.fleet import RECORD_DAYS, SECTIONS, FleetOrder, State, members, state_of

PRIOR_SHARE = 0.5  # of a parameter's value, as in the quick path
GAIN_SHAPE = 0.2  # change of the gain by an amount of 1


@dataclass(frozen=True)
class Errors:
    """Errors beyond those of the products: `factor` of their standard deviation, and common to a section.

    common: standard deviation of the common error over that of a run. growth: of the deteriorating sections, per day,
    over that of a run.
    """

    factor: float = 1.2
    common: float = 0.7
    growth: float = 0.01


DETERIORATING = {"north": 150.0, "south": 240.0}  # day from which the track has changed


def draw_fleet(fleet: Fleet, order: FleetOrder, templates: Sequence[RunSummary], errors: Errors) -> Observations:
    """Draw all runs of a fleet as the store would give them."""
    fleet_members = members(order)
    rows, summaries = [], []
    common = _common_errors(order, len(templates[0].estimate))
    for day in range(0, order.days, order.every):
        for k in range(order.vehicles):
            state = state_of(order, fleet_members[k], k, day)
            template = templates[int(np.random.default_rng([order.seed, 51, k, day]).integers(len(templates)))]
            summaries.append(_drawn(order, state, template, errors, common))
            name = f"{vehicle_name(k)}_{day:03d}"
            about = (START + float(day), state.mileage, state.load, state.degrees, state.section)
            rows.append((name, vehicle_name(k), "bogie", *about, name, "summarised"))
    return observations_of(fleet, fleet.types["bogie"], rows, summaries)


def _common_errors(order: FleetOrder, count: int) -> dict[str, FloatArray]:
    """Directions [record, number] of the common error of every section, and of its deterioration as the last row."""
    records = int(order.days // RECORD_DAYS) + 1
    return {
        section: np.random.default_rng([order.seed, 52, i]).standard_normal((records + 1, count))
        for i, section in enumerate(SECTIONS)
    }


def _drawn(
    order: FleetOrder, state: State, template: RunSummary, errors: Errors, common: dict[str, FloatArray]
) -> RunSummary:
    """A run with the products of a template and the estimate of a drawn error."""
    rng = np.random.default_rng([order.seed, 53, state.vehicle, state.day])
    p, gram = len(template.x), template.gram.copy()
    truth = true_numbers(state, template)
    record, age = divmod(float(state.day), RECORD_DAYS)
    shared = errors.common * common[state.section][int(record)]
    if order.track_faults and state.section in DETERIORATING:
        first = DETERIORATING[state.section]
        since = min(age, max(state.day - first, 0.0))  # until the track is recorded again
        shared = shared + errors.growth * since * common[state.section][-1]
    inner = gram[1:, 1:]
    scale = 1.0 / np.sqrt(np.diag(inner))
    values, vectors = np.linalg.eigh(inner * np.outer(scale, scale))
    kept = values > 1e-9 * values[-1]
    root = vectors[:, kept] * np.sqrt(values[kept])
    noise = errors.factor * np.sqrt(template.variance) * (root @ rng.standard_normal(int(kept.sum()))) / scale
    x = truth[:p]
    change = np.concatenate([np.zeros(p), truth[p:]]) + shared * template.sd
    gram[1:, 0] = gram[0, 1:] = inner @ change + noise
    prior_sd = PRIOR_SHARE * np.abs(x)
    estimate, sd, determined = estimates_of_gram(gram, x, x, prior_sd, template.variance)
    growth = np.log1p(0.5 * np.abs(shared).mean())
    level = np.exp(growth + 0.08 * rng.standard_normal(len(template.channels)))
    return replace(
        template, x=x, gram=gram, estimate=estimate, sd=sd, determined=determined, errors=level, section=state.section
    )


def true_numbers(state: State, template: RunSummary) -> FloatArray:
    """True parameters and amounts [p + k] of a run; a clearance of 0.1 mm counts as an amount of 0.05."""
    known = numbers_of(state.true)
    amounts = []
    for name in template.directions:
        kind, _, place = name.partition(" at ")
        if kind == "sensor_gain":
            amounts.append((state.gains.get(place, 1.0) - 1.0) / GAIN_SHAPE)
            continue
        own = [e for e in state.effects if kind == e.kind and place == f"{e.at} {e.wheelset}"]
        amounts.append(sum(0.05 * float(e.parameters["half_width"]) / 1e-4 for e in own))
    return np.array([*(known[path] for path in template.paths), *amounts])
