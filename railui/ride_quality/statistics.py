"""Statistics of rides of many vehicles, accumulated by the kernel during the simulation."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, Vehicles, sosfilt
from railui.ride_quality.comfort import comfort_sections, felt_acceleration
from railui.ride_quality.guiding_forces import wheel_load_paths
from railui.ride_quality.safety_limits import force_limit
from railui.track.excitation import Excitation
from railui.track.input_table import COLUMNS_PER_WHEELSET, FIRST_WHEELSET_COLUMN
from railui.track.line_geometry import curvature_columns
from railui.vehicle.model import Model
from railui.vehicle.on_track import on_rails, spacings, vehicles_on

SCORE_CHANNELS: Final = ("e1", "e2", "ayf")
BLOCK_DURATION: Final = 5.0  # s, of the running rms of EN 12299
MAX_STRAIGHT_CURVATURE: Final = 1e-4  # 1/m, of test zone 1: radii of 10 km and more
GAUGE_COLUMN: Final = 4  # among the columns of a wheelset
DECISIVE_STATISTIC: Final = "weighted_acceleration_1974"  # selects the worst of several floor points


def is_guided_by_force(model: Model) -> bool:
    """Return True if guiding forces replace flange contact in the score (`riding.guidance: lateral_force`)."""
    return model.design.setting("riding.guidance") == "lateral_force"


def guidance_channels(model: Model) -> tuple[str, ...]:
    """Return the channels of the guidance index: e1, e2, ..., or the sums of guiding forces Y1, Y2, ..."""
    letter = "Y" if is_guided_by_force(model) else "e"
    return tuple(f"{letter}{i + 1}" for i in range(len(model.wheelset_distances())))


def guidance_limits(model: Model, rows: FloatArray) -> FloatArray:
    """Return the limit of guidance [n]: the clearance [m], or 10 kN + 2 Q_0/3 of the lightest wheelset [N]."""
    if not is_guided_by_force(model):
        return np.ascontiguousarray(rows[:, model.columns["contact.flange_clearance"]])
    loads = np.stack([rows[:, model.columns[path]] for path in wheel_load_paths(model)])
    return np.asarray(force_limit(loads.min(axis=0), model.design.riding.use))


def half_gauge_deviations(table: FloatArray, steps: int, wheelsets: int) -> FloatArray:
    """Return half the gauge deviation [wheelset, sample] in m under each wheelset from an input table."""
    columns = [FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * i + GAUGE_COLUMN for i in range(wheelsets)]
    return np.asarray(0.5 * table[:: 2 * steps, columns].T)


def sd_with_gauge(sd_e: FloatArray, half_gauge: FloatArray) -> FloatArray:
    """Return the standard deviation [..., wheelset] in m of e relative to flanges that move with the gauge.

    `half_gauge`: half the gauge deviation [wheelset, sample] in m. The covariance of e and g/2 has opposite signs at
    the two flanges and cancels in the mean of both.
    """
    return np.asarray(np.hypot(sd_e, half_gauge.std(axis=-1)))


def straight_samples(table: FloatArray, steps: int, wheelsets: int) -> NDArray[np.bool_]:
    """Return True at each sample of a line, from its input table, where the whole vehicle is on straight track."""
    curvature = table[:: 2 * steps, curvature_columns(table.shape[1], wheelsets)]
    return np.asarray(np.all(np.abs(curvature) <= MAX_STRAIGHT_CURVATURE, axis=1))


def ride_statistics(
    model: Model,
    rows: FloatArray,
    excitation: Excitation,
    *,
    steps: NDArray[np.int64] | None = None,
    jobs: int | None = None,
) -> dict[str, FloatArray]:
    """Compute the statistics of n vehicles of one structure and use on one track.

    Parameters
    ----------
    model : Model
        Structure and settings of the vehicles.
    rows : FloatArray
        Parameters [n, row].
    excitation : Excitation
        Track at a speed.
    steps : NDArray, optional
        RK4 steps per sample [n]; by default those of `Vehicles.steps`.
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict of FloatArray
        As `score_many` takes them: mean_e, sd_e, flange_fractions [n, wheelset], weighted accelerations [n], wz [n]
        (the rms weighted with B), diverged [n]; and block_rms [n, block of 5 s], lost_at [n] (s [m] at divergence,
        else NaN), steps [n] per sample, clearance [n] [m], widened by half the mean gauge deviation if the design asks
        for it. The result of a vehicle depends on nothing but itself.

    Raises
    ------
    ValueError
        For a vehicle that is too stiff to be integrated.
    """
    vehicles, batch = vehicles_on(model, excitation), on_rails(model, model.batch(rows), excitation)
    if steps is None:
        steps = np.array(vehicles.required_steps(batch, excitation.speed, excitation.speed, excitation.dt))
    limits = guidance_limits(model, rows)
    sections = comfort_sections(model, rows, excitation.dt)
    statistics: dict[str, FloatArray] = {"steps": steps.astype(float)}
    diverged_at = np.full(len(rows), -1)
    groups = list(zip(spacings(model, rows, excitation), steps.tolist(), strict=True))
    for wheelbase, n in sorted(set(groups)):
        members = np.array([i for i, group in enumerate(groups) if group == (wheelbase, n)])
        table = excitation.table(wheelbase, n)
        group = _Group(model, vehicles, batch.select(members), excitation.dt, table, n, limits[members], jobs)
        parts, diverged_at[members] = group.statistics({name: each[members] for name, each in sections.items()})
        parts["clearance"] = limits[members]
        if not is_guided_by_force(model):
            counted = group.counted_samples(is_line=excitation.track.has_curves)
            if not counted.all():
                parts |= group.displacement_statistics(counted)
            if model.design.gauge_widens_clearance and np.any(excitation.track.gauge):
                parts |= group.gauge_statistics(parts["sd_e"], counted)
                parts["clearance"] = limits[members] + float(excitation.track.gauge[counted].mean()) / 2
        if model.design.riding.peak_limit is not None and "acceleration" in sections:
            parts["acceleration_peak"] = group.peaks(sections["acceleration"][members])
        for name, values in parts.items():
            statistics.setdefault(name, np.zeros((len(rows), *values.shape[1:])))[members] = values
    statistics["diverged"] = (diverged_at >= 0).astype(float)
    statistics["lost_at"] = np.where(diverged_at >= 0, excitation.track.s[np.maximum(diverged_at, 0)], np.nan)
    return statistics


class _Group:
    """Vehicles of one structure, wheelbase and number of steps on one track."""

    def __init__(
        self,
        model: Model,
        vehicles: Vehicles,
        batch: Batch,
        dt: float,
        table: FloatArray,
        steps: int,
        limits: FloatArray,
        jobs: int | None,
    ) -> None:
        self.vehicles = vehicles
        self.batch = batch
        self.limits = limits
        self.jobs = jobs
        self.input = (table, dt, steps)
        self.wheelset_channels = guidance_channels(model)
        self.acceleration_channels = felt_acceleration(model)

    def statistics(self, sections: dict[str, FloatArray]) -> tuple[dict[str, FloatArray], NDArray[np.int64]]:
        """Return the accumulated statistics and the sample at which each vehicle diverged (-1: never).

        Of several floor points the accelerations are those of the worst, `point`; `NAME_points` contains all of them.
        """
        rides = self.vehicles.ride_statistics(
            self.batch,
            *self.input,
            (*self.wheelset_channels, *self.acceleration_channels),
            self.limits,
            [np.ascontiguousarray(each) for each in sections.values()],
            block=max(1, round(BLOCK_DURATION / self.input[1])),
            jobs=self.jobs,
            wheelsets=len(self.wheelset_channels),
        )
        e, names = rides.displacement, list(sections)
        parts = {"mean_e": e[:, :, 0], "sd_e": e[:, :, 1], "flange_fractions": e[:, :, 2]}
        worst = np.argmax(rides.rms[:, :, names.index(DECISIVE_STATISTIC)], axis=1)
        row = np.arange(len(self.batch))
        parts["block_rms"] = np.sqrt(rides.block_rms[row, worst])
        parts |= {name: rides.rms[row, worst, i] for i, name in enumerate(names)}
        if len(self.acceleration_channels) > 1:
            parts["point"] = worst.astype(float)
            parts |= {f"{name}_points": rides.rms[:, :, i] for i, name in enumerate(names)}
        return parts, rides.diverged

    def counted_samples(self, *, is_line: bool) -> NDArray[np.bool_]:
        """Return True at each sample at which e counts: on the straights of a line, because in curves flanges guide.

        All samples where the line has less than one block of straight track.
        """
        table, dt, steps = self.input
        everywhere = np.ones(len(table[:: 2 * steps]), dtype=bool)
        if not is_line:
            return everywhere
        is_straight = straight_samples(table, steps, len(self.wheelset_channels))
        return is_straight if np.count_nonzero(is_straight) * dt >= BLOCK_DURATION else everywhere

    def displacement_statistics(self, counted: NDArray[np.bool_]) -> dict[str, FloatArray]:
        """Return mean, standard deviation and contact of e at some of the samples."""
        series, _ = self.vehicles.simulate(self.batch, *self.input, self.wheelset_channels, jobs=self.jobs)
        e = series[:, :, counted]
        touching = np.abs(e) >= self.limits[:, None, None]
        return {"mean_e": e.mean(axis=2), "sd_e": e.std(axis=2), "flange_fractions": touching.mean(axis=2)}

    def gauge_statistics(self, sd_e: FloatArray, counted: NDArray[np.bool_]) -> dict[str, FloatArray]:
        """Return shares of contact against c + g/2 at the counted samples, and the standard deviation against it."""
        series, _ = self.vehicles.simulate(self.batch, *self.input, self.wheelset_channels, jobs=self.jobs)
        table, _, steps = self.input
        half_gauge = half_gauge_deviations(table, steps, len(self.wheelset_channels))[:, counted]
        touching = np.abs(series[:, :, counted]) >= self.limits[:, None, None] + half_gauge
        return {"flange_fractions": touching.mean(axis=2), "sd_e": sd_with_gauge(sd_e, half_gauge)}

    def peaks(self, sections: FloatArray) -> FloatArray:
        """Return the largest acceleration [n] at any comfort point."""
        series, _ = self.vehicles.simulate(self.batch, *self.input, self.acceleration_channels, jobs=self.jobs)
        filtered = [sosfilt(w, x) for w, x in zip(sections, series, strict=True)]
        return np.asarray(np.abs(filtered).max(axis=(1, 2)))
