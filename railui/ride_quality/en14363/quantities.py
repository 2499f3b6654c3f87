"""Assessment quantities of EN 14363: filtered signals, their values in a section, limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.dsp.spectra import welch
from railui.ride_quality.en14363.recording import BODY_COLUMN, FRAME_COLUMN, Recording
from railui.ride_quality.en14363.zones import Section
from railui.ride_quality.guiding_forces import HALF_BANDWIDTH, MAX_BAND_SHARE, MIN_DOMINANT_FREQUENCY, RMS_WINDOW
from railui.ride_quality.safety_limits import INSTABILITY_SHARE, QUOTIENT_LIMIT, force_limit

Side = Literal["right", "left", ""]
Kind = Literal["extremes", "extreme of the curve", "outward", "rms", "median", "largest"]

IN_CURVE: Final = "extreme of the curve"
STEP: Final = 0.5  # m between two sliding means
MEAN_LENGTH: Final = 2.0  # m
LOWEST, HIGHEST = 0.15, 99.85  # %
FORCE_BAND: Final = 20.0  # Hz
RIDE_BAND: Final = (0.4, 10.0)  # Hz
BODY_SAFETY_BAND, FRAME_BAND = 6.0, 10.0  # Hz, of the simplified method
QUASI_STATIC_FORCE: Final = 60e3  # N, as generally quoted: to be checked against the edition in force
BODY_SAFETY: Final = {1: 3.0, 2: 3.0, 3: 2.8, 4: 2.6}  # m/s^2 by zone
RIDE_LIMITS: Final = {"goods": (3.0, 1.3)}  # m/s^2: peak, rms
PASSENGER_RIDE_LIMITS: Final = (2.5, 0.5)
QUASI_STATIC_ACCELERATIONS: Final = {"goods": 1.3}  # m/s^2 by use, from memory of UIC 518
PASSENGER_QUASI_STATIC_ACCELERATION: Final = 1.5  # m/s^2
FILTER_ORDER: Final = 4
MIN_OVERSAMPLING: Final = 2.2
EXTENSION: Final = 2.0  # periods of the lower edge of a band by which a series is extended at both ends
LIFTED: Final = 1.0 + 1e-9  # least unloading of a wheel without load, above the limit 1
WINDOW_STEP: Final = 10.0  # m


@dataclass(frozen=True)
class VehicleData:
    """Static wheel load [N] of each wheelset, mass of the heaviest bogie with its wheelsets [kg] or None, use."""

    wheel_loads: tuple[float, ...]
    bogie_mass: float | None
    use: str


@dataclass(frozen=True, eq=False)
class Signal:
    """Filtered signal of one quantity at one place.

    Attributes
    ----------
    quantity, place, category, unit : str
        category selects the factor of the estimation; "quasi-static" is the mean.
    s, x : FloatArray
        Distance [m] and values [location].
    kind : str
        "extremes": 0.15 % and 99.85 % of a signal positive to the right; "extreme of the curve": the same on tangent
        track, in curves that on the side of the quasi-static part; "outward": 99.85 % of a wheel, in curves the outer
        one; "rms"; "median": in curves, of the outer wheel, or of a body with its sign reversed in left-hand ones;
        "largest".
    limits : dict
        Limit by number of the zone.
    side : str
        Wheel; empty for a wheelset or a body.
    """

    quantity: str
    place: str
    category: str
    unit: str
    s: FloatArray
    x: FloatArray
    kind: Kind
    limits: dict[int, float]
    side: Side = ""

    def sample_place(self, section: Section) -> str:
        """Return the place of the statistical sample: in curves the outer wheel, on either side."""
        return f"{self.place}, outer wheel" if self.side and section.zone.number > 1 else self._wheel()

    def _wheel(self) -> str:
        return f"{self.place}, {self.side} wheel" if self.side else self.place

    def values(self, section: Section) -> list[float]:
        """Return the values of a section that enter the statistics: none, one or two."""
        x = self.x[(self.s >= section.start) & (self.s < section.end)]
        direction = float(np.sign(section.curvature)) if section.zone.number > 1 else 0.0
        is_inner = direction != 0.0 and self.side == ("right" if direction > 0 else "left")
        if not x.size or not np.isfinite(x).all() or section.zone.number not in self.limits or is_inner:
            return []
        if self.kind == "rms":
            return [float(np.sqrt(np.mean(x**2)))]
        if self.kind == "largest":
            return [float(x.max())]
        if self.kind == "median":
            return [float(np.median(x)) * (1.0 if self.side else direction)] if direction else []
        if self.kind == "outward":
            return [float(np.percentile(x, HIGHEST))]
        low, high = np.percentile(x, [LOWEST, HIGHEST])
        if direction and self.kind == "extreme of the curve":
            return [float(high if self._quasi_static_sign(section) > 0 else -low)]
        return [float(-low), float(high)]

    def _quasi_static_sign(self, section: Section) -> float:
        """Return the sign of the quasi-static part in a curve: guiding forces point outward, in a right-hand one left.

        An accelerometer feels the cant deficiency towards the centre, and a cant excess away from it.
        """
        if self.unit == "N":
            return float(-np.sign(section.curvature))
        return float(np.sign(section.curvature) * (1.0 if section.cant_deficiency >= 0.0 else -1.0))


def filtered(x: FloatArray, rate: float, low: float | None, high: float) -> FloatArray:
    """Filter with zero phase between two frequencies [Hz]; the upper one is left out where the rate is too low."""
    if rate > MIN_OVERSAMPLING * high:
        x = sosfiltfilt(butterworth(FILTER_ORDER, [high], rate), x)
    if low is None:
        return x
    n = min(len(x) - 1, round(EXTENSION / low * rate))
    extended = np.concatenate([2 * x[0] - x[n:0:-1], x, 2 * x[-1] - x[-2 : -n - 2 : -1]])
    slow = sosfiltfilt(butterworth(FILTER_ORDER, [low], rate), extended)
    return np.asarray((extended - slow)[n : n + len(x)])


def sliding_means(s: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return means over 2 m every 0.5 m of x [sample] at s [sample] m: their middles [m], and the means.

    NaN where x is NaN anywhere in the 2 m.

    >>> at, mean = sliding_means(np.arange(0.0, 5.0), np.array([0.0, 1.0, 2.0, 3.0, 4.0]))
    >>> at.tolist(), mean.tolist()
    ([1.0, 1.5, 2.0, 2.5, 3.0], [1.0, 1.5, 2.0, 2.5, 3.0])
    """
    middles = np.arange(s[0] + 0.5 * MEAN_LENGTH, s[-1] - 0.5 * MEAN_LENGTH + 1e-9, STEP)
    first, last = middles - 0.5 * MEAN_LENGTH, middles + 0.5 * MEAN_LENGTH
    missing = np.isnan(x)
    defined = np.where(missing, 0.0, x)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (defined[1:] + defined[:-1]) * np.diff(s))])
    mean = (_at(last, s, defined, integral) - _at(first, s, defined, integral)) / MEAN_LENGTH
    if missing.any():
        count = np.concatenate([[0], np.cumsum(missing)])
        ends = np.searchsorted(s, last, side="right"), np.searchsorted(s, first, side="left")
        mean[count[ends[0]] > count[ends[1]]] = np.nan
    return middles, mean


def _at(where: FloatArray, s: FloatArray, x: FloatArray, integral: FloatArray) -> FloatArray:
    """Return the integral of the line through x at any distance."""
    k = np.clip(np.searchsorted(s, where, side="right") - 1, 0, len(s) - 2)
    part = where - s[k]
    slope = (x[k + 1] - x[k]) / (s[k + 1] - s[k])
    return np.asarray(integral[k] + part * (x[k] + 0.5 * slope * part))


def signals_of(recording: Recording, vehicle: VehicleData) -> Iterator[Signal]:
    """Yield the signals of the normal method where forces are measured, else of the simplified one."""
    yield from _force_signals(recording, vehicle)
    yield from _body_signals(recording, vehicle, is_simplified=not recording.wheelsets)
    if not recording.wheelsets:
        yield from _frame_signals(recording, vehicle)


def _force_signals(recording: Recording, vehicle: VehicleData) -> Iterator[Signal]:
    """Yield sums of guiding forces, Y/Q, quasi-static guiding forces and the running rms of each wheelset."""
    s, rate = recording.s, recording.rate
    for i in recording.wheelsets:
        place, total = f"wheelset {i}", recording.total(i)
        load = vehicle.wheel_loads[min(i, len(vehicle.wheel_loads)) - 1]
        limit = float(force_limit(load, vehicle.use))
        if total is not None:
            at, mean = sliding_means(s, filtered(total, rate, None, FORCE_BAND))
            limits = dict.fromkeys(range(1, 5), limit)
            yield Signal("sum of guiding forces", place, "running safety", "N", at, mean, IN_CURVE, limits)
            yield from _running_rms(recording, total, "rms of the sum of guiding forces", place, "N", limit)
        sides: tuple[tuple[Side, float], ...] = (("right", 1.0), ("left", -1.0))
        for side, sign in sides:
            Y, Q = recording.series.get(f"Y{i}.{side}"), recording.series.get(f"Q{i}.{side}")
            if Y is None:
                continue
            outward = filtered(sign * Y, rate, None, FORCE_BAND)
            limits = dict.fromkeys((2, 3, 4), QUASI_STATIC_FORCE)
            name = "quasi-static guiding force"
            yield Signal(name, place, "quasi-static", "N", s, outward, "median", limits, side)
            if Q is not None:
                yield from _wheel_signals(s, place, side, outward, filtered(Q, rate, None, FORCE_BAND), load)


def _wheel_signals(
    s: FloatArray, place: str, side: Side, outward: FloatArray, Q: FloatArray, static_load: float
) -> Iterator[Signal]:
    """Yield Y/Q of a wheel, and its unloading: without load it has no Y/Q."""
    ratio = np.where(Q > 0.0, outward / np.where(Q > 0.0, Q, 1.0), np.nan)
    at, mean = sliding_means(s, ratio)
    limits = dict.fromkeys(range(1, 5), QUOTIENT_LIMIT)
    yield Signal("Y/Q", place, "running safety", "1", at, mean, "outward", limits, side)
    if float(np.ptp(Q)) <= 1e-9 * static_load and float(Q.min()) > 0.0:  # static: a wheel of a planar model cannot lift
        return
    limits = dict.fromkeys(range(1, 5), 1.0)
    unloading = np.where(Q <= 0.0, np.maximum(1.0 - Q / static_load, LIFTED), 1.0 - Q / static_load)
    yield Signal("wheel unloading", f"{place}, {side} wheel", "largest", "1", s, unloading, "largest", limits)


def _body_signals(recording: Recording, vehicle: VehicleData, *, is_simplified: bool) -> Iterator[Signal]:
    """Yield lateral accelerations of the carbody: peak, rms, quasi-static, and for safety in the simplified method."""
    s, rate = recording.s, recording.rate
    peak, rms = RIDE_LIMITS.get(vehicle.use, PASSENGER_RIDE_LIMITS)
    for name in recording.names(BODY_COLUMN):
        ride = filtered(recording.series[name], rate, *RIDE_BAND)
        slow = filtered(recording.series[name], rate, None, FORCE_BAND)
        caption, unit = "acceleration of the carbody", "m/s^2"
        behaviour = "running behaviour"
        yield Signal(caption, name, behaviour, unit, s, ride, "extremes", dict.fromkeys(range(1, 5), peak))
        yield Signal(f"rms {caption}", name, behaviour, unit, s, ride, "rms", dict.fromkeys(range(1, 5), rms))
        steady = QUASI_STATIC_ACCELERATIONS.get(vehicle.use, PASSENGER_QUASI_STATIC_ACCELERATION)
        limits = dict.fromkeys((2, 3, 4), steady)
        yield Signal(f"quasi-static {caption}", name, "quasi-static", unit, s, slow, "median", limits)
        if is_simplified:
            safe = filtered(recording.series[name], rate, None, BODY_SAFETY_BAND)
            yield Signal(f"{caption}, to 6 Hz", name, "running safety", unit, s, safe, IN_CURVE, BODY_SAFETY)


def _frame_signals(recording: Recording, vehicle: VehicleData) -> Iterator[Signal]:
    """Yield lateral accelerations of a bogie frame for the simplified method: 12 - m/5, m of the bogie in t."""
    if vehicle.bogie_mass is None:
        return
    limit = 12.0 - vehicle.bogie_mass / 5e3
    for name in recording.names(FRAME_COLUMN):
        x = recording.series[name]
        low = filtered(x, recording.rate, None, FRAME_BAND)
        caption, limits = "acceleration of the bogie frame", dict.fromkeys(range(1, 5), limit)
        yield Signal(caption, name, "running safety", "m/s^2", recording.s, low, IN_CURVE, limits)
        yield from _running_rms(recording, x, f"rms {caption}", name, "m/s^2", limit)


def _running_rms(
    recording: Recording, x: FloatArray, caption: str, place: str, unit: str, limit: float
) -> Iterator[Signal]:
    """Yield the instability criterion: running rms over 100 m, every 10 m, in f_0 +/- 2 Hz, against half the limit."""
    s, rate = recording.s, recording.rate
    f, power = welch(x, rate, min(len(x), round(4 * RMS_WINDOW / float(np.mean(recording.v)) * rate)))
    candidates = (f >= MIN_DOMINANT_FREQUENCY) & (f <= MAX_BAND_SHARE * rate - HALF_BANDWIDTH)
    if s[-1] - s[0] <= RMS_WINDOW or not candidates.any():
        return
    f_0 = float(f[candidates][np.argmax(power[candidates])])
    band = [max(f_0 - HALF_BANDWIDTH, 0.1), f_0 + HALF_BANDWIDTH]
    narrow = sosfiltfilt(butterworth(FILTER_ORDER, band, rate), x)
    energy = np.concatenate([[0.0], np.cumsum(narrow**2)])[:-1]  # per sample
    middles = np.arange(s[0] + 0.5 * RMS_WINDOW, s[-1] - 0.5 * RMS_WINDOW, WINDOW_STEP)
    samples = np.arange(float(len(s)))
    ends = [(np.interp(middles + d, s, energy), np.interp(middles + d, s, samples)) for d in (-50.0, 50.0)]
    rms = np.sqrt((ends[1][0] - ends[0][0]) / (ends[1][1] - ends[0][1]))
    limits = dict.fromkeys(range(1, 5), INSTABILITY_SHARE * limit)
    yield Signal(caption, place, "largest", unit, middles, rms, "largest", limits)
