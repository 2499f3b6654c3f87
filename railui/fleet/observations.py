"""Observations of a fleet: one row per run, one column per quantity, in units that vehicles of a type share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.fleet.fleet_file import Fleet, VehicleType
from railui.fleet.free_estimates import free_estimates
from railui.fleet.schema import EventModel
from railui.fleet.store import FleetStore
from railui.fleet.summary import RunSummary
from railui.vehicle.design import Design

PARAMETER, EFFECT, ERROR = "parameter", "effect", "error"
ERROR_SD: Final = 0.1  # of the logarithm of an error, before its scatter is estimated
MIN_LEFT: Final = 0.02  # share of an effect that the parameters must leave
DAYS_PER_YEAR: Final = 365.25
MAX_EVENTS: Final = 1000  # of a vehicle
MILEAGE_UNIT: Final = 1e5  # of the trend


@dataclass(frozen=True)
class Quantity:
    """Quantity that is followed.

    Attributes
    ----------
    name
        Path of a parameter, an effect at a location, or `error at CHANNEL`.
    kind
        parameter (relative to the nominal value), effect (amount), or error (logarithm of error over noise).
    scale
        Value of 1 in the unit of the parameter; 1 of the others.
    """

    name: str
    kind: str
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Observations:
    """Runs of the vehicles of one type, in the order of time.

    Attributes
    ----------
    files
        Files of the runs [n].
    summaries
        Summaries of the runs [n].
    vehicle, section
        Indices [n] into `vehicles` and `sections`.
    time
        Days [n].
    covariates
        Temperature and load [n, 2], less their means; zero where not known.
    use
        Use since the last maintenance of a quantity [n, q]: in 1e5 of the mileage, or in years where it is not known.
    unit
        Number [n, q] of a vehicle between two maintenances of a quantity, which has a level and a trend of its own.
    y, sd
        Values and standard deviations [n, q].
    """

    vehicles: tuple[str, ...]
    sections: tuple[str, ...]
    quantities: tuple[Quantity, ...]
    files: tuple[str, ...]
    summaries: tuple[RunSummary, ...]
    vehicle: NDArray[np.int64]
    section: NDArray[np.int64]
    time: FloatArray
    covariates: FloatArray
    use: FloatArray
    unit: NDArray[np.int64]
    y: FloatArray
    sd: FloatArray


def read_observations(fleet: Fleet, store: FleetStore, vehicle_type: VehicleType) -> Observations | None:
    """Read the summaries of the runs of a type from the store; None: there are none."""
    rows, summaries = [], []
    for row in store.runs():
        if row[2] != vehicle_type.name or row[9] != "summarised" or row[1] not in fleet.vehicles:
            continue
        arrays = store.read(row[8])
        if arrays is not None:
            rows.append(row)
            summaries.append(RunSummary.of_arrays(arrays))
    return observations_of(fleet, vehicle_type, rows, summaries) if rows else None


def observations_of(
    fleet: Fleet, vehicle_type: VehicleType, rows: Sequence[Sequence[Any]], summaries: Sequence[RunSummary]
) -> Observations:
    """Return the observations of runs, rows as the store has them."""
    vehicles = tuple(name for name, v in fleet.vehicles.items() if v.type is vehicle_type)
    places = [s.section or str(row[7]) for s, row in zip(summaries, rows, strict=True)]
    sections = tuple(sorted(set(places)))
    time = np.array([row[3] for row in rows], dtype=float)
    mileage = np.array([np.nan if row[4] is None else row[4] for row in rows], dtype=float)
    of_vehicle = np.array([vehicles.index(row[1]) for row in rows])
    quantities, y, sd = _values(summaries, vehicle_type.campaign.design, fleet.settings.min_determined_share)
    events = [(vehicles.index(e.vehicle), e) for e in fleet.events if e.vehicle in vehicles]
    return Observations(
        vehicles,
        sections,
        quantities,
        tuple(str(row[0]) for row in rows),
        tuple(summaries),
        of_vehicle,
        np.array([sections.index(p) for p in places]),
        time,
        _covariates(rows),
        *_use(of_vehicle, time, mileage, quantities, events),
        y,
        sd,
    )


def _values(
    summaries: Sequence[RunSummary], design: Design, min_share: float
) -> tuple[tuple[Quantity, ...], FloatArray, FloatArray]:
    """Quantities that all runs have and one run determines, with values and standard deviations [n, q].

    An effect that a loop added to the design of one vehicle has no counterpart on the others and is left out.
    """
    paths = [path for path in _common([s.paths for s in summaries]) if _is_of_type(path, design)]
    directions = _common([s.directions for s in summaries])
    names = [*paths, *directions]
    numbers = np.array([[of_run[name] for name in names] for of_run in map(_numbers, summaries)])
    estimate, sd, share = np.moveaxis(numbers.reshape(len(summaries), len(names), 3), 2, 0)
    determined = np.median(share, axis=0)
    columns = []
    for j, path in enumerate(paths):
        scale = abs(design.values.get(path, 0.0)) or float(np.median(np.abs(estimate[:, j]))) or 1.0
        if determined[j] >= min_share:
            columns.append((Quantity(path, PARAMETER, scale), estimate[:, j] / scale, sd[:, j] / scale))
    for j, name in enumerate(directions, len(paths)):
        if determined[j] >= MIN_LEFT and np.all(np.isfinite(estimate[:, j])):
            columns.append((Quantity(name, EFFECT), estimate[:, j], np.maximum(sd[:, j], 1e-300)))
    for channel in _common([s.channels for s in summaries]):
        errors = np.log(np.maximum([s.errors[s.channels.index(channel)] for s in summaries], 1e-12))
        columns.append((Quantity(f"error at {channel}", ERROR), errors, np.full(len(errors), ERROR_SD)))
    quantities, y, deviations = zip(*columns, strict=True)
    return tuple(quantities), np.stack(y, axis=1), np.stack(deviations, axis=1)


def _common(names: Sequence[tuple[str, ...]]) -> list[str]:
    """Names that all runs have, in the order of the first."""
    return [name for name in names[0] if all(name in others for others in names)]


def _is_of_type(path: str, design: Design) -> bool:
    """False for a parameter of an effect that the design of the type does not have."""
    group, _, rest = path.partition(".")
    return group != "effects" or int(rest.partition(".")[0]) < len(design.effects)


def _numbers(summary: RunSummary) -> dict[str, tuple[float, float, float]]:
    """Estimate, standard deviation and determined share of every parameter and effect of a run."""
    p = len(summary.paths)
    estimate, sd = summary.estimate.copy(), summary.sd.copy()
    estimate[:p], sd[:p] = free_estimates(summary)
    rows = zip(estimate.tolist(), sd.tolist(), summary.determined.tolist(), strict=True)
    return dict(zip((*summary.paths, *summary.directions), rows, strict=True))


def _covariates(rows: Sequence[Sequence[Any]]) -> FloatArray:
    """Temperature and load [n, 2] less their means."""
    table = np.array([[np.nan if x is None else x for x in (row[6], row[5])] for row in rows], dtype=float)
    known = np.isfinite(table)
    mean = np.sum(np.where(known, table, 0.0), axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.where(known, table - mean, 0.0)


def is_reset(event: EventModel, quantity: Quantity) -> bool:
    """True where maintenance changes a quantity: the resets of the event begin its name, or are none at all."""
    return not event.resets or any(quantity.name.startswith(part) for part in event.resets)


def _use(
    vehicle: NDArray[np.int64],
    time: FloatArray,
    mileage: FloatArray,
    quantities: Sequence[Quantity],
    events: Sequence[tuple[int, EventModel]],
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Use since the last maintenance, of the mileage where all runs of a vehicle have it, else of the time; units."""
    use = np.zeros((len(time), len(quantities)))
    unit = np.zeros(use.shape, dtype=np.int64)
    for v in np.unique(vehicle):
        own = np.flatnonzero(vehicle == v)
        by_mileage = bool(np.all(np.isfinite(mileage[own])))
        clock = mileage[own] / MILEAGE_UNIT if by_mileage else time[own] / DAYS_PER_YEAR
        for j, quantity in enumerate(quantities):
            origin = np.full(len(own), clock[0])
            unit[own, j] = v * MAX_EVENTS
            for at in sorted(e.time for w, e in events if w == v and is_reset(e, quantity)):
                origin = np.where(time[own] >= at, np.interp(at, time[own], clock), origin)
                unit[own, j] += time[own] >= at
            use[own, j] = clock - origin
    return use, unit
