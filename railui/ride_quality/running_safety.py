"""Guiding forces and derailment quotients of a ride, by the quantities of EN 14363.

The models are lateral: vertical irregularities are not modelled. The wheels of a vehicle of bodies and elements that
rolls are loaded and unloaded quasi-statically; those of a planar bogie have their static load.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.filters import butterworth, sosfiltfilt
from railui.dsp.spectra import welch
from railui.track.excitation import Excitation
from railui.vehicle.model import Model
from railui.vehicle.simulate import simulate_series

MAX_BAND_SHARE: Final = 0.45  # of the sampling rate, below which the band of f_0 lies
MEAN_LENGTH: Final = 2.0  # m, of the sliding mean
PERCENTILE: Final = 99.85  # of the magnitudes of the sliding means
LOW_PASS_FREQUENCY: Final = 20.0  # Hz, of guiding forces and quotient
MIN_OVERSAMPLING: Final = 2.2  # sampling rate over the low-pass frequency below which forces are not filtered
BASE_FORCE_LIMIT: Final = 10e3  # N, of the limit 10 kN + 2 Q_0/3 of the sum of guiding forces
RMS_WINDOW: Final = 100.0  # m, of the running rms that indicates instability
RMS_STEP: Final = 10.0  # m, between two windows
HALF_BANDWIDTH: Final = 2.0  # Hz, to either side of the dominant frequency f_0
MIN_DOMINANT_FREQUENCY: Final = 0.4  # Hz: slower forces come from the line, not from the vehicle
FILTER_ORDER: Final = 4
QUOTIENT_LIMIT: Final = 0.8  # Y/Q
STATIC_LOAD_NOTE: Final = "an indication: this model is planar, its wheels bear their static load"
QUASI_STATIC_NOTE: Final = "load transfer quasi-static in roll; vertical irregularities are left out"
UNLOADED_NOTE: Final = "Y/Q: null, a wheel is wholly unloaded"


def force_limit(wheel_load: Any) -> Any:
    """Return the limit [N] of the sum of guiding forces for static wheel loads Q_0 [N]: 10 kN + 2 Q_0/3.

    Source: EN 14363.

    >>> round(force_limit(54e3))
    46000
    """
    return BASE_FORCE_LIMIT + 2.0 * wheel_load / 3.0


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
    total = np.cumsum(np.insert(x, 0, 0.0, axis=-1), axis=-1)
    return np.asarray((total[..., k:] - total[..., :-k]) / k)


def guiding_force_channels(model: Model) -> list[str]:
    """Return the channels of guiding forces: Yi.right, Yi.left, and dQi if load transfer is modelled."""
    numbers = range(1, len(wheel_load_paths(model)) + 1)
    wheels = [f"Y{i}.{side}" for i in numbers for side in ("right", "left")]
    return wheels + ([f"dQ{i}" for i in numbers] if model.design.structure is not None else [])


@dataclass(frozen=True, eq=False)
class GuidingForces:
    """Guiding forces of a ride as sliding means over 2 m.

    Attributes
    ----------
    total : FloatArray
        Sums of guiding forces [wheelset, location] in N.
    limit : FloatArray
        Limits of these sums [wheelset] in N.
    wheels : FloatArray
        Guiding forces of the wheels, outward positive [wheelset, wheel, location] in N.
    quotient : FloatArray or None
        Y/Q [wheelset, wheel, location]; None if a wheel was wholly unloaded.
    sums : FloatArray
        Sums of guiding forces without mean and filter [wheelset, sample] in N.
    """

    total: FloatArray
    limit: FloatArray
    wheels: FloatArray
    quotient: FloatArray | None
    sums: FloatArray

    @classmethod
    def from_series(cls, model: Model, series: FloatArray, rate: float, spacing: float) -> GuidingForces:
        """Compute from the series [channel, sample] of `guiding_force_channels` sampled at `rate` [Hz]."""
        loads = np.array([model.design.values[path] for path in wheel_load_paths(model)])
        n = len(loads)
        Y = series[: 2 * n].reshape(n, 2, -1)
        dQ = series[2 * n :] if len(series) > 2 * n else np.zeros((n, Y.shape[-1]))
        Q = loads[:, None, None] + np.stack([dQ, -dQ], axis=1)
        outward = Y * np.array([1.0, -1.0])[:, None]  # to the right at the right wheel
        sums = Y.sum(axis=1)

        def mean(x: FloatArray) -> FloatArray:
            return sliding_mean(_low_pass(x, rate), spacing)

        quotient = mean(outward / Q) if np.all(Q > 0.0) else None  # a wheel that lifts has no quotient
        return cls(mean(sums), np.asarray(force_limit(loads)), mean(outward), quotient, sums)

    def section_maxima(self, first: int, stop: int) -> dict[str, Any]:
        """Return the largest values of all wheelsets from sample `first` to before `stop`."""
        last = max(first + 1, stop - (self.sums.shape[1] - self.total.shape[1]))
        total, limit = np.abs(self.total[:, first:last]), self.limit[:, None]
        quotient = None if self.quotient is None else self.quotient[..., first:last]
        return {
            "sum_of_guiding_forces": float(characteristic_values(total).max()),
            "share_above_limit": float(np.mean(total > limit, axis=1).max()),
            "derailment_quotient": None if quotient is None else float(characteristic_values(quotient).max()),
        }


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


def running_safety(model: Model, excitation: Excitation) -> dict[str, Any] | None:
    """Compute guiding forces of a ride by the names of EN 14363.

    Returns
    -------
    dict or None
        Per wheelset: `sum_of_guiding_forces` [N] (99.85 % of abs of the 2 m mean), its `limit` 10 kN + 2 Q_0/3,
        `share_above_limit` of the time, `rms_100m` [N] (largest rms over 100 m in f_0 +/- 2 Hz, to be compared with
        half the limit) and `dominant_frequency` [Hz]; per wheel (right, left) `guiding_force` [N] and
        `derailment_quotient` Y/Q, likewise 99.85 % of the 2 m mean. None if the vehicle diverges or the track is
        shorter than 4 m.
    """
    series, diverged_at = simulate_series(model, excitation, guiding_force_channels(model))
    spacing, rate = excitation.track.spacing, 1.0 / excitation.dt
    if diverged_at is not None or excitation.track.length < 2 * MEAN_LENGTH:
        return None
    forces = GuidingForces.from_series(model, series, rate, spacing)
    total = np.abs(forces.total)
    quotients = None if forces.quotient is None else characteristic_values(forces.quotient)
    wheels, sums = characteristic_values(forces.wheels), characteristic_values(total)
    wheelsets = [
        {
            "sum_of_guiding_forces": float(sums[i]),
            "limit": float(limit),
            "share_above_limit": float(np.mean(total[i] > limit)),
            **instability_rms(forces.sums[i], rate, spacing),
            "guiding_force": wheels[i].tolist(),
            "derailment_quotient": None if quotients is None else quotients[i].tolist(),
        }
        for i, limit in enumerate(forces.limit)
    ]
    notes = [wheel_load_note(model)]
    if quotients is None:
        notes.append(UNLOADED_NOTE)
    if wheelsets[0]["rms_100m"] is None:
        notes.append(f"rms_100m: null, the track is shorter than {RMS_WINDOW:g} m")
    return {
        "wheelsets": wheelsets,
        "derailment_quotient": None if quotients is None else float(quotients.max()),
        "derailment_quotient_limit": QUOTIENT_LIMIT,
        "load_transfer": model.design.structure is not None,
        "notes": notes,
    }


def wheel_load_note(model: Model) -> str:
    """Return a note on the wheel loads of Y/Q."""
    return f"Y/Q: {STATIC_LOAD_NOTE if model.design.structure is None else QUASI_STATIC_NOTE}"


def _low_pass(x: FloatArray, rate: float) -> FloatArray:
    """Low-pass at 20 Hz with zero phase; unchanged if the sampling rate is too low for that."""
    if rate <= MIN_OVERSAMPLING * LOW_PASS_FREQUENCY:
        return x
    return sosfiltfilt(butterworth(FILTER_ORDER, [LOW_PASS_FREQUENCY], rate), x)


def instability_rms(total: FloatArray, rate: float, spacing: float) -> dict[str, float | None]:
    """Return the largest rms over 100 m, every 10 m, of a sum of guiding forces in f_0 +/- 2 Hz.

    f_0 is the dominant frequency of the sum [sample] in N. Both values are None if the track is shorter than 100 m.
    """
    window, step = round(RMS_WINDOW / spacing), max(1, round(RMS_STEP / spacing))
    if len(total) < window + 1:
        return {"rms_100m": None, "dominant_frequency": None}
    f, power = welch(total, rate, 4 * window)
    candidates = (f >= MIN_DOMINANT_FREQUENCY) & (f <= MAX_BAND_SHARE * rate - HALF_BANDWIDTH)
    if not candidates.any():
        return {"rms_100m": None, "dominant_frequency": None}
    f_0 = float(f[candidates][np.argmax(power[candidates])])
    band = [max(f_0 - HALF_BANDWIDTH, 0.1), f_0 + HALF_BANDWIDTH]
    filtered = sosfiltfilt(butterworth(FILTER_ORDER, band, rate), total)
    rms = np.sqrt(sliding_mean(filtered**2, spacing, RMS_WINDOW)[::step])
    return {"rms_100m": float(rms.max()), "dominant_frequency": f_0}
