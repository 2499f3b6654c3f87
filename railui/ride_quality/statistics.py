"""Statistics of vehicles on a road, streamed with the steps, sixteen side by side."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, Vehicles, sosfilt
from railui.ride_quality.comfort import comfort_sections, felt_acceleration
from railui.ride_quality.running_safety import force_limit, load_paths
from railui.track.excitation import Excitation
from railui.track.input_table import LEADING, PER_WHEELSET
from railui.vehicle.model import Model

SCORED: Final = ("e1", "e2", "ayf")
BLOCK: Final = 5.0  # s, of the running rms of EN 12299
GAUGE: Final = 4  # column of the gauge among those of a wheelset
JUDGED_BY: Final = "weighted_acceleration_1974"  # of several floor points: that which feels most of it decides


def guided_by_force(model: Model) -> bool:
    """Do guiding forces stand for flange contact in the score (`riding.guidance: lateral_force`)?"""
    return model.design.setting("riding.guidance") == "lateral_force"


def displacements(model: Model) -> tuple[str, ...]:
    """The channels that guidance is judged by: e1, e2, ..., or the sums of guiding forces Y1, Y2, ..."""
    letter = "Y" if guided_by_force(model) else "e"
    return tuple(f"{letter}{i + 1}" for i in range(len(model.behind())))


def admissible(model: Model, rows: FloatArray) -> FloatArray:
    """What guidance must stay within [n]: the clearance [m], or 10 kN + 2 Q_0/3 of the lightest wheelset [N]."""
    if not guided_by_force(model):
        return np.ascontiguousarray(rows[:, model.columns["contact.flange_clearance"]])
    loads = np.stack([rows[:, model.columns[path]] for path in load_paths(model)])
    return np.asarray(force_limit(loads.min(axis=0)))


def half_gauges(table: FloatArray, steps: int, wheelsets: int) -> FloatArray:
    """Half the gauge deviation [wheelset, sample] in m under each wheelset, of an input table of so many steps."""
    columns = [LEADING + PER_WHEELSET * i + GAUGE for i in range(wheelsets)]
    return np.asarray(0.5 * table[:: 2 * steps, columns].T)


def with_gauge(sd_e: FloatArray, half: FloatArray) -> FloatArray:
    """Spread [..., wheelset] of e against flanges that half a gauge deviation [wheelset, sample] moves, in m.

    At the two flanges e and g/2 covary with opposite signs: in the mean of both nothing of it is left.
    """
    return np.asarray(np.hypot(sd_e, half.std(axis=-1)))


def statistics_many(
    model: Model,
    rows: FloatArray,
    road: Excitation,
    *,
    steps: NDArray[np.int64] | None = None,
    jobs: int | None = None,
) -> dict[str, FloatArray]:
    """Statistics of n vehicles of one structure and use, rows [n, row] of `Model`, streamed with the steps.

    As `score_many` takes them: mean_e, sd_e, flange_fractions [n, 2], accelerations [n], wz [n] (the rms
    weighted with B), diverged [n]; and block_rms [n, blocks of 5 s], lost_at [n] (s [m] where a vehicle was
    found diverged, else NaN), steps [n] per sample (as given, or as `Vehicles.steps` says), clearance [n]
    [m]. A vehicle's digits depend on nothing but itself. Raises ValueError where a vehicle is too stiff to be stepped.
    """
    vehicles, batch = model.vehicles(), model.batch(rows)
    if steps is None:
        steps = np.array(vehicles.steps(batch, road.speed, road.speed, road.dt))
    wheelbases = model.wheelbases(rows)
    clearance = admissible(model, rows)
    sections = comfort_sections(model, rows, road.dt)
    found: dict[str, FloatArray] = {"steps": steps.astype(float), "clearance": clearance}
    lost = np.full(len(rows), -1)
    kinds = list(zip(wheelbases, steps.tolist(), strict=True))
    for a, n in sorted(set(kinds)):
        here = np.array([i for i, kind in enumerate(kinds) if kind == (a, n)])
        group = _Group(model, vehicles, batch.select(here), road, road.table(a, n), n, clearance[here], jobs)
        parts, lost[here] = group.statistics({name: each[here] for name, each in sections.items()})
        widens = model.design.gauge_widens_clearance and not guided_by_force(model)
        if widens and np.any(road.track.gauge):
            parts |= group.widened(parts["sd_e"])
        if model.design.riding.peak_limit is not None and "acceleration" in sections:
            parts["acceleration_peak"] = group.peaks(sections["acceleration"][here])
        for name, values in parts.items():
            found.setdefault(name, np.zeros((len(rows), *values.shape[1:])))[here] = values
    found["diverged"] = (lost >= 0).astype(float)
    found["lost_at"] = np.where(lost >= 0, road.track.s[np.maximum(lost, 0)], np.nan)
    return found


class _Group:
    """Vehicles of one structure, wheelbase and step count on a road."""

    def __init__(
        self, model: Model, vehicles: Vehicles, batch: Batch, road: Excitation, table: FloatArray, steps: int,
        clearance: FloatArray, jobs: int | None,
    ) -> None:  # fmt: skip
        self.vehicles, self.batch, self.clearance, self.jobs = vehicles, batch, clearance, jobs
        self.course = (table, road.dt, steps)
        self.wheels, self.points = displacements(model), felt_acceleration(model)

    def statistics(self, sections: dict[str, FloatArray]) -> tuple[dict[str, FloatArray], NDArray[np.int64]]:
        """What streams with the steps, and the sample at which each vehicle was lost (-1: never).

        Of several floor points the accelerations are those of the worst, `point`; `NAME_points` has them all.
        """
        weights = [np.ascontiguousarray(each) for each in sections.values()]
        block = max(1, round(BLOCK / self.course[1]))
        rides = self.vehicles.score(
            self.batch, *self.course, (*self.wheels, *self.points), self.clearance, weights, block=block,
            jobs=self.jobs, wheelsets=len(self.wheels),
        )  # fmt: skip
        e, names = rides.displacement, list(sections)
        parts = {"mean_e": e[:, :, 0], "sd_e": e[:, :, 1], "flange_fractions": e[:, :, 2]}
        worst, row = np.argmax(rides.rms[:, :, names.index(JUDGED_BY)], axis=1), np.arange(len(self.batch))
        parts["block_rms"] = np.sqrt(rides.blocks[row, worst])
        parts |= {name: rides.rms[row, worst, i] for i, name in enumerate(names)}
        if len(self.points) > 1:
            parts["point"] = worst.astype(float)
            parts |= {f"{name}_points": rides.rms[:, :, i] for i, name in enumerate(names)}
        return parts, rides.diverged

    def widened(self, sd_e: FloatArray) -> dict[str, FloatArray]:
        """Shares of contact against c + g/2, counted on the series, and the spread against it."""
        series, _ = self.vehicles.simulate(self.batch, *self.course, self.wheels, jobs=self.jobs)
        table, _, steps = self.course
        half = half_gauges(table, steps, len(self.wheels))
        touching = np.abs(series) >= self.clearance[:, None, None] + half
        return {"flange_fractions": touching.mean(axis=2), "sd_e": with_gauge(sd_e, half)}

    def peaks(self, sections: FloatArray) -> FloatArray:
        """The greatest acceleration [n] at any comfort point."""
        series, _ = self.vehicles.simulate(self.batch, *self.course, self.points, jobs=self.jobs)
        found = [sosfilt(w, x) for w, x in zip(sections, series, strict=True)]
        return np.asarray(np.abs(found).max(axis=(1, 2)))
