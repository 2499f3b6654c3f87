"""Observations of a fleet: one row per run, one column per quantity, in units that vehicles of a type share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    design = vehicle_type.campaign.design
    quantities, y, sd = _values(summaries, design.values, fleet.settings.min_determined_share)
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
    summaries: Sequence[RunSummary], nominal: Mapping[str, float], min_share: float
) -> tuple[tuple[Quantity, ...], FloatArray, FloatArray]:
    """Quantities that one run determines, with values and standard deviations [n, q]."""
    first = summaries[0]
    p = len(first.paths)
    estimate = np.array([s.estimate for s in summaries])
    sd = np.array([s.sd for s in summaries])
    for row, summary in enumerate(summaries):
        estimate[row, :p], sd[row, :p] = free_estimates(summary)
    determined = np.median([s.determined for s in summaries], axis=0)
    errors = np.log(np.maximum([s.errors for s in summaries], 1e-12))
    columns = []
    for j, path in enumerate(first.paths):
        scale = abs(nominal.get(path, 0.0)) or float(np.median(np.abs(estimate[:, j]))) or 1.0
        if determined[j] >= min_share:
            columns.append((Quantity(path, PARAMETER, scale), estimate[:, j] / scale, sd[:, j] / scale))
    for j, name in enumerate(first.directions, p):
        if determined[j] >= MIN_LEFT and np.all(np.isfinite(estimate[:, j])):
            columns.append((Quantity(name, EFFECT), estimate[:, j], np.maximum(sd[:, j], 1e-300)))
    for j, channel in enumerate(first.channels):
        columns.append((Quantity(f"error at {channel}", ERROR), errors[:, j], np.full(len(errors), ERROR_SD)))
    names, y, deviations = zip(*columns, strict=True)
    return tuple(names), np.stack(y, axis=1), np.stack(deviations, axis=1)


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
