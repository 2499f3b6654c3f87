"""Guiding forces of a ride: sums and Y/Q per wheel as sliding means over 2 m, rms over 100 m.

The models are lateral: vertical irregularities are not modelled. The wheels of a vehicle of bodies and elements that
rolls are loaded and unloaded quasi-statically; those of a planar bogie have their static load.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.dsp.spectra import welch
from railui.ride_quality.safety_limits import force_limit
from railui.vehicle.model import Model

MAX_BAND_SHARE: Final = 0.45  # of the sampling rate, below which the band of f_0 lies
MEAN_LENGTH: Final = 2.0  # m, of the sliding mean
PERCENTILE: Final = 99.85  # of the magnitudes of the sliding means
LOW_PASS_FREQUENCY: Final = 20.0  # Hz, of guiding forces and wheel loads
MIN_OVERSAMPLING: Final = 2.2  # sampling rate over the low-pass frequency below which forces are not filtered
RMS_WINDOW: Final = 100.0  # m, of the running rms that indicates instability
RMS_STEP: Final = 10.0  # m, between two windows
HALF_BANDWIDTH: Final = 2.0  # Hz, to either side of the dominant frequency f_0
MIN_DOMINANT_FREQUENCY: Final = 0.4  # Hz: slower forces come from the line, not from the vehicle
FILTER_ORDER: Final = 4


def wheel_load_paths(model: Model) -> list[str]:
    """Return the path of the static wheel load Q_0 of every wheelset."""
    structure = model.design.structure
    if structure is None:
        return ["vehicle.wheel_load"] * len(model.wheelset_distances())
    return [wheelset.part.number_path("wheel_load") for wheelset in structure.wheelsets]


def sliding_mean(x: FloatArray, spacing: float, length: float = MEAN_LENGTH) -> FloatArray:
    """Return means of a series [..., n] over a length [m] of samples `spacing` [m] apart, [..., n - k + 1].

    >>> sliding_mean(np.array([0.0, 1.0, 2.0, 3.0]), 1.0).tolist()
    [0.5, 1.5, 2.5]
    """
    k = max(1, round(length / spacing))
    total = np.zeros((*x.shape[:-1], x.shape[-1] + 1))
    np.cumsum(x, axis=-1, out=total[..., 1:])
    return np.asarray((total[..., k:] - total[..., :-k]) / k)


def guiding_force_channels(model: Model) -> list[str]:
    """Return the channels of guiding forces: Yi.right, Yi.left, and dQi if load transfer is modelled."""
    numbers = range(1, len(wheel_load_paths(model)) + 1)
    wheels = [f"Y{i}.{side}" for i in numbers for side in ("right", "left")]
    return wheels + ([f"dQ{i}" for i in numbers] if model.design.structure is not None else [])


@dataclass(frozen=True, eq=False)
class GuidingForces:
    """Guiding forces and wheel loads of a ride as sliding means over 2 m, low-passed at 20 Hz.

    Attributes
    ----------
    total : FloatArray
        Sums of guiding forces [wheelset, location] in N.
    limit : FloatArray
        Limits of these sums [wheelset] in N.
    wheels : FloatArray
        Guiding forces of the wheels, outward positive [wheelset, wheel, location] in N.
    quotient : FloatArray
        Y/Q [wheelset, wheel, location]; NaN where the wheel is unloaded within the 2 m.
    unloading : FloatArray
        (Q_0 - Q)/Q_0 [wheelset, wheel, location].
    is_lifted : array of bool
        True where the wheel is unloaded within the 2 m [wheelset, wheel, location].
    rms : FloatArray
        Rms over 100 m of each sum within 2 Hz of its dominant frequency [wheelset, window] in N; no window on a track
        shorter than 100 m.
    centres : NDArray
        Sample in the middle of each of these windows.
    dominant_frequency : FloatArray
        Dominant frequency f_0 of each sum [Hz]; NaN without a window.
    """

    total: FloatArray
    limit: FloatArray
    wheels: FloatArray
    quotient: FloatArray
    unloading: FloatArray
    is_lifted: NDArray[np.bool_]
    rms: FloatArray
    centres: NDArray[np.int64]
    dominant_frequency: FloatArray

    @classmethod
    def from_series(cls, model: Model, series: FloatArray, rate: float, spacing: float) -> GuidingForces:
        """Compute from the series [channel, sample] of `guiding_force_channels` sampled at `rate` [Hz]."""
        loads = np.array([model.design.values[path] for path in wheel_load_paths(model)])
        n = len(loads)
        Q_0 = loads[:, None, None]
        Y = series[: 2 * n].reshape(n, 2, -1)
        Y_outward = _low_pass(Y * np.array([1.0, -1.0])[:, None], rate)  # to the right at the right wheel
        wheels = sliding_mean(Y_outward, spacing)
        if len(series) > 2 * n:
            transfer = _low_pass(series[2 * n :], rate)
            Q = Q_0 + np.stack([transfer, -transfer], axis=1)
            quotient, is_lifted = _quotient(Y_outward, Q, spacing)
            share = sliding_mean(transfer, spacing) / loads[:, None]
            unloading = np.stack([-share, share], axis=1)
        else:  # static wheel loads
            quotient, unloading = wheels / Q_0, np.zeros_like(wheels)
            is_lifted = np.zeros(wheels.shape, dtype=bool)
        rms, centres, f_0 = _instability(Y.sum(axis=1), rate, spacing)
        return cls(
            total=wheels[:, 0] - wheels[:, 1],
            limit=np.asarray(force_limit(loads, model.design.riding.use)),
            wheels=wheels,
            quotient=quotient,
            unloading=unloading,
            is_lifted=is_lifted,
            rms=rms,
            centres=centres,
            dominant_frequency=f_0,
        )

    def between(self, first: int, stop: int, samples: int) -> GuidingForces:
        """Return the forces from sample `first` to before `stop` of `samples`, at least one location of them."""
        last = max(first + 1, stop - (samples - self.total.shape[1]))
        inside = (self.centres >= first) & (self.centres < stop)
        cut = {name: getattr(self, name)[..., first:last] for name in LOCATED}
        return replace(self, **cut, rms=self.rms[:, inside], centres=self.centres[inside])

    def section_maxima(self) -> dict[str, Any]:
        """Return the characteristic values of the worst wheelset and wheel."""
        total = np.abs(self.total)
        quotients = [q for q in characteristic_quotients(self.quotient).ravel().tolist() if np.isfinite(q)]
        return {
            "sum_of_guiding_forces": float(characteristic_values(total).max()),
            "share_above_limit": float(np.mean(total > self.limit[:, None], axis=1).max()),
            "derailment_quotient": max(quotients, default=None),
        }


def _quotient(Y: FloatArray, Q: FloatArray, spacing: float) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return 2 m means of Y/Q, NaN where Q is not positive within them, and where that is."""
    is_unloaded = Q <= 0.0
    if not is_unloaded.any():
        quotient = sliding_mean(Y / Q, spacing)
        return quotient, np.zeros(quotient.shape, dtype=bool)
    is_lifted = sliding_mean(is_unloaded.astype(float), spacing) > 0.5 * spacing / MEAN_LENGTH
    ratio = np.where(is_unloaded, 0.0, Y) / np.where(is_unloaded, 1.0, Q)
    return np.where(is_lifted, np.nan, sliding_mean(ratio, spacing)), is_lifted


LOCATED: Final = ("total", "wheels", "quotient", "unloading", "is_lifted")  # attributes by location


def characteristic_quotients(quotient: FloatArray) -> FloatArray:
    """Return the 99.85th percentile of Y/Q [..., location] where it is defined; NaN for a wheel without any."""
    flat = quotient.reshape(-1, quotient.shape[-1])
    defined = [each[np.isfinite(each)] for each in flat]
    values = [float(characteristic_values(each)) if each.size else np.nan for each in defined]
    return np.array(values).reshape(quotient.shape[:-1])


def characteristic_values(x: FloatArray) -> FloatArray:
    """Return the 99.85th percentile of sliding means [..., location].

    As numpy.percentile, which would import numpy.ma at the start of every ride.
    """
    if x.shape[-1] == 1:
        return np.asarray(x[..., 0])
    position = PERCENTILE / 100.0 * (x.shape[-1] - 1)
    k = min(int(position), x.shape[-1] - 2)
    below, above = np.moveaxis(np.partition(x, [k, k + 1], axis=-1)[..., k : k + 2], -1, 0)
    return np.asarray(below + (position - k) * (above - below))


def _low_pass(x: FloatArray, rate: float) -> FloatArray:
    """Low-pass at 20 Hz with zero phase; unchanged if the sampling rate is too low for that."""
    if rate <= MIN_OVERSAMPLING * LOW_PASS_FREQUENCY:
        return x
    return sosfiltfilt(butterworth(FILTER_ORDER, [LOW_PASS_FREQUENCY], rate), x)


def instability_rms(total: FloatArray, rate: float, spacing: float) -> dict[str, float | None]:
    """Return the largest rms over 100 m, every 10 m, of a sum of guiding forces in f_0 +/- 2 Hz.

    f_0 is the dominant frequency of the sum [sample] in N. Both values are None if the track is shorter than 100 m.
    """
    rms, _, f_0 = _instability(total[None], rate, spacing)
    if not rms.size:
        return {"rms_100m": None, "dominant_frequency": None}
    return {"rms_100m": float(rms.max()), "dominant_frequency": float(f_0[0])}


def _instability(sums: FloatArray, rate: float, spacing: float) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """Return the rms of windows [wheelset, window], their middle samples, and dominant frequencies [wheelset]."""
    window, step = round(RMS_WINDOW / spacing), max(1, round(RMS_STEP / spacing))
    highest = MAX_BAND_SHARE * rate - HALF_BANDWIDTH
    if sums.shape[1] < window + 1 or highest < MIN_DOMINANT_FREQUENCY:
        return np.zeros((len(sums), 0)), np.zeros(0, dtype=np.int64), np.full(len(sums), np.nan)
    windows, frequencies = [], []
    for total in sums:
        f, power = welch(total, rate, 4 * window)
        candidates = (f >= MIN_DOMINANT_FREQUENCY) & (f <= highest)
        f_0 = float(f[candidates][np.argmax(power[candidates])])
        band = [max(f_0 - HALF_BANDWIDTH, 0.1), f_0 + HALF_BANDWIDTH]
        filtered = sosfiltfilt(butterworth(FILTER_ORDER, band, rate), total)
        windows.append(np.sqrt(np.maximum(sliding_mean(filtered**2, spacing, RMS_WINDOW)[::step], 0.0)))
        frequencies.append(f_0)
    rms = np.stack(windows)
    return rms, step * np.arange(rms.shape[1]) + window // 2, np.array(frequencies)
