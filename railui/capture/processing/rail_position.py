"""Measured track: position of the rails from sensors on the axle boxes (Broersen 1976, 6.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.map_schema import RailsModel
from railui.capture.processing.sensor_map import VehicleGeometry
from railui.core import Spline
from railui.dsp.integrate import integrate, lowpass
from railui.runs.columns import column_names
from railui.track.line_geometry import GRAVITY

NATURAL_FREQUENCY_RATIO = 0.35  # to the frequency of the longest wavelength, where the gain is 1.5 % low
SETTLING_PERIODS = 0.75  # of the natural frequency, wrong at both ends
LOWPASS_CORNER_RATIO = 0.85  # of the corner wavelength to the shortest wavelength
MOTION_COLUMNS = column_names("bogie", "response", "coach")


@dataclass(frozen=True, eq=False)
class ReconstructedTrack:
    """Track under the leading wheelset, and motions without gravity.

    Attributes
    ----------
    columns
        Track and motions by column name [n].
    versions
        Lateral deviation from each wheelset alone, by wheelset; that of the trailing one is moved by 2a to the
        leading one, NaN at the end.
    natural_frequency
        Natural frequency of the integrating filter [Hz].
    settling_samples
        Samples at both ends that are wrong.
    notes
        Remarks for the user.
    has_roll
        True if a sensor measures the roll or the cross-level.
    """

    columns: Mapping[str, FloatArray]
    versions: Mapping[int, FloatArray]
    natural_frequency: float
    settling_samples: int
    notes: tuple[str, ...]
    has_roll: bool


class _Rolls(NamedTuple):
    """Cross-level phi_w at the leading wheelset and roll of both wheelsets [rad]."""

    phiw: FloatArray
    first: FloatArray
    second: FloatArray


@dataclass(frozen=True, eq=False)
class _Reconstruction:
    """Signals of a segment and the parameters of its reconstruction."""

    signals: dict[str, FloatArray]
    s: FloatArray
    dt: float
    model: RailsModel
    geometry: VehicleGeometry
    natural: float
    raw: frozenset[str]  # accelerometers that measure gravity
    notes: list[str]

    def highpass(self, x: FloatArray) -> FloatArray:
        """Filter through the high-pass of everything that is integrated."""
        return self.integrate(x, 0)

    def integrate(self, x: FloatArray, times: int, natural: float | None = None) -> FloatArray:
        zero_phase = self.model.filter == "zero_phase"
        return integrate(x, self.dt, times, natural or self.natural, self.model.damping, zero_phase)

    def at_trailing(self, x: FloatArray) -> FloatArray:
        """Return a track quantity at the trailing wheelset: x at s - 2a, the first value before the start."""
        at = np.maximum(self.s - 2 * self.geometry.half_wheelbase, self.s[0])
        return Spline(self.s, x)(at)

    def at_leading(self, x: FloatArray) -> FloatArray:
        """Return a quantity measured by the trailing wheelset at the leading one: x at s + 2a, NaN at the end."""
        at = self.s + 2 * self.geometry.half_wheelbase
        values = Spline(self.s, x)(np.minimum(at, self.s[-1]))
        return np.where(at <= self.s[-1], values, np.nan)


def natural_frequency(model: RailsModel, speed: float) -> float:
    """Return the natural frequency [Hz] of the integrating filter: stated, or for the longest wavelength.

    >>> round(natural_frequency(RailsModel(), 40.0), 3)  # speed [m/s]
    0.2
    """
    return model.natural_frequency or NATURAL_FREQUENCY_RATIO * speed / model.longest


def reconstruct(
    signals: Mapping[str, FloatArray],
    s: FloatArray,
    dt: float,
    model: RailsModel,
    geometry: VehicleGeometry,
    raw: frozenset[str],
) -> ReconstructedTrack:
    """Reconstruct the track from axle-box accelerations, wheel displacements and roll.

    y_w = (y_i'' + g phi_i, integrated twice) - e_i - r phi_w, everything through one high-pass; an accelerometer
    in `raw` measures y'' - g phi. phi_i comes from the wheelset's roll rate or inclinometer, else from the measured
    phi_w, phi_i = phi_w - sigma e_i/b; that of the trailing wheelset else from the leading one's cross-level, 2a
    later. Measured quantities (yw, phiw, gauge) are not reconstructed.

    Parameters
    ----------
    signals
        Signals [n] by quantity, in SI.
    s
        Increasing distance [m], [n].
    dt
        Sampling interval [s].
    model
        Parameters of the reconstruction.
    geometry
        Geometry of the vehicle.
    raw
        Accelerometers that measure gravity.

    Raises
    ------
    ValueError
        If y_w can neither be taken nor reconstructed.

    References
    ----------
    Broersen 1976, 6.1.
    """
    speed = float((s[-1] - s[0]) / (dt * (s.size - 1)))
    work = _Reconstruction(dict(signals), s, dt, model, geometry, natural_frequency(model, speed), raw, [])
    _combine_sides(work)
    rolls = _roll_angles(work)
    columns = _motions_without_gravity(work, rolls)
    versions: dict[int, FloatArray] = {}
    if "yw" in signals:
        columns["yw"] = signals["yw"]
    else:
        versions = _lateral_deviations(work, columns, rolls)
        columns["yw"] = _lowpass_track(work, _mean_of_available(list(versions.values())), speed)
    if rolls is not None:
        columns["phiw"] = signals["phiw"] if "phiw" in signals else _lowpass_track(work, rolls.phiw, speed)
    if "gauge" in work.signals:
        columns["gauge"] = (
            signals["gauge"] if "gauge" in signals else _lowpass_track(work, work.signals["gauge"], speed)
        )
    settling = 0 if "yw" in signals else round(SETTLING_PERIODS / work.natural / dt)
    return ReconstructedTrack(columns, versions, work.natural, settling, tuple(work.notes), rolls is not None)


def _combine_sides(work: _Reconstruction) -> None:
    """Compute e_i and the gauge from the sensors of both wheels: e -/+ g/2 on the right and on the left."""
    gauges = []
    for i in (1, 2):
        right = work.signals.pop(f"e{i}_right", None)
        left = work.signals.pop(f"e{i}_left", None)
        if right is None or left is None:
            if right is not None or left is not None:
                work.notes.append(f"e{i}: the sensor of one wheel alone cannot separate gauge and displacement")
            continue
        work.signals.setdefault(f"e{i}", 0.5 * (right + left))
        gauges.append(left - right if i == 1 else work.at_leading(left - right))
    if gauges and "gauge" not in work.signals:
        work.signals["gauge"] = _mean_of_available(gauges)


def _mean_of_available(versions: list[FloatArray]) -> FloatArray:
    """Return the mean of the finite values of several versions."""
    values = np.stack(versions)
    count = np.sum(np.isfinite(values), axis=0)
    return np.asarray(np.nansum(values, axis=0) / np.maximum(count, 1))


def _roll_angles(work: _Reconstruction) -> _Rolls | None:
    """Compute cross-level and roll; None, with a note, if no sensor measures them."""
    lean = [_relative_roll(work, i) for i in (0, 1)]
    first = _wheelset_roll(work, 1)
    second = _wheelset_roll(work, 2)
    phiw = work.signals.get("phiw")
    if phiw is None and first is not None:
        phiw = first + work.highpass(lean[0])
    elif phiw is None and second is not None:
        phiw = work.at_leading(second + work.highpass(lean[1]))
        phiw = np.where(np.isfinite(phiw), phiw, 0.0)
    if phiw is None:
        work.notes.append(
            "no sensor measures the roll: g phi_w remains in the accelerations and falsifies the rail position"
        )
        return None
    first = phiw - lean[0] if first is None else first
    second = work.at_trailing(phiw) - lean[1] if second is None else second
    return _Rolls(phiw, first, second)


def _relative_roll(work: _Reconstruction, i: int) -> FloatArray:
    """Return the roll of wheelset i (from 0) relative to the track, sigma e/b [rad]; 0 without a sensor of e."""
    e = work.signals.get(f"e{i + 1}")
    return np.zeros(work.s.shape) if e is None else work.geometry.roll[i] * e / work.geometry.half_gauge


def _wheelset_roll(work: _Reconstruction, i: int) -> FloatArray | None:
    """Return the roll of wheelset i from its gyro, its inclinometer, or both, each in its frequency range."""
    rate = work.signals.get(f"roll_rate{i}")
    angle = work.signals.get(f"inclination{i}")
    if rate is None:
        return angle
    if angle is None:
        return work.integrate(rate, 1, work.natural / 2)
    crossover = work.model.crossover
    return work.integrate(rate, 1, crossover) + angle - work.integrate(angle, 0, crossover)


def _motions_without_gravity(work: _Reconstruction, rolls: _Rolls | None) -> dict[str, FloatArray]:
    """Return the motions as columns of a run; g phi is added to raw accelerations."""
    columns = {name: x for name, x in work.signals.items() if name in MOTION_COLUMNS}
    roll_angles: dict[str, FloatArray] = {}
    if rolls is not None:
        roll_angles = {"ay1": rolls.first, "ay2": rolls.second}
    if "ayf" in columns and "ayf" in work.raw:
        if "roll_ratef" in work.signals:
            roll_angles["ayf"] = work.integrate(work.signals["roll_ratef"], 1, work.natural / 2)
        elif rolls is not None:
            roll_angles["ayf"] = 0.5 * (rolls.phiw + work.at_trailing(rolls.phiw))
    for name, roll in roll_angles.items():
        if name in columns and name in work.raw:
            columns[name] = columns[name] + GRAVITY * roll
    return columns


def _lateral_deviations(
    work: _Reconstruction, columns: Mapping[str, FloatArray], rolls: _Rolls | None
) -> dict[int, FloatArray]:
    """Return the lateral deviation at the leading wheelset from each wheelset that has both sensors."""
    versions = {}
    for i in (1, 2):
        if f"ay{i}" not in columns or f"e{i}" not in columns:
            continue
        yw = work.integrate(columns[f"ay{i}"], 2) - work.highpass(columns[f"e{i}"])
        if rolls is not None:
            phiw = rolls.phiw if i == 1 else work.at_trailing(rolls.phiw)
            yw = yw - work.geometry.rolling_radius * work.highpass(phiw)
        versions[i] = yw if i == 1 else work.at_leading(yw)
    if not versions:
        raise ValueError("no sensors for the lateral position of the rails: map yw, or ay1 and e1 (ay2 and e2)")
    return versions


def _lowpass_track(work: _Reconstruction, x: FloatArray, speed: float) -> FloatArray:
    """Remove wavelengths below the shortest one from a track column."""
    return lowpass(x, work.dt, speed / (LOWPASS_CORNER_RATIO * work.model.shortest))
