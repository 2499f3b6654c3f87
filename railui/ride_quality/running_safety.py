"""Guiding forces and safety against derailment along a ride, by the quantities of EN 14363.

The models are lateral: wheels stand on their rails without vertical irregularities. Where a vehicle of bodies and
elements rolls, its wheels are loaded and unloaded quasi-statically; a planar bogie has its static wheel load.
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

SLIDING: Final = 2.0  # m, of the sliding mean
PERCENTILE: Final = 99.85  # of the distribution of its magnitude
LOW_PASS: Final = 20.0  # Hz, of guiding forces and quotient
BASE: Final = 10e3  # N, of the limit 10 kN + 2 Q_0/3 of the sum of guiding forces
WINDOW, STEP = 100.0, 10.0  # m, of the running rms that tells instability
BAND: Final = 2.0  # Hz, to either side of the dominant frequency f_0
SLOWEST: Final = 0.4  # Hz: what is slower is the line, not the vehicle
QUOTIENT_LIMIT: Final = 0.8  # Y/Q
INDICATION: Final = "an indication: this model is planar, its wheels bear their static load"
UNLOADED: Final = "Y/Q: null, a wheel is wholly unloaded"
QUASI_STATIC: Final = "load transfer quasi-static in roll; vertical irregularities are left out"


def force_limit(wheel_load: Any) -> Any:
    """Limit [N] of the sum of guiding forces of wheelsets with static wheel loads Q_0 [N]: 10 kN + 2 Q_0/3.

    Source: EN 14363.

    >>> round(force_limit(54e3))
    46000
    """
    return BASE + 2.0 * wheel_load / 3.0


def load_paths(model: Model) -> list[str]:
    """The path of the static wheel load Q_0 of every wheelset."""
    structure = model.design.structure
    if structure is None:
        return ["vehicle.wheel_load"] * len(model.behind())
    return [wheelset.part.at("wheel_load") for wheelset in structure.wheelsets]


def sliding_mean(x: FloatArray, spacing: float, length: float = SLIDING) -> FloatArray:
    """Means of a series [..., n] over a length [m] of samples `spacing` [m] apart, [..., n - k + 1].

    >>> sliding_mean(np.array([0.0, 1.0, 2.0, 3.0]), 1.0).tolist()
    [0.5, 1.5, 2.5]
    """
    k = max(1, round(length / spacing))
    total = np.cumsum(np.insert(x, 0, 0.0, axis=-1), axis=-1)
    return np.asarray((total[..., k:] - total[..., :-k]) / k)


def force_channels(model: Model) -> list[str]:
    """The channels that guiding forces are told from: Yi.right, Yi.left, and dQi where load transfer is modelled."""
    numbers = range(1, len(load_paths(model)) + 1)
    wheels = [f"Y{i}.{side}" for i in numbers for side in ("right", "left")]
    return wheels + ([f"dQ{i}" for i in numbers] if model.design.structure is not None else [])


@dataclass(frozen=True, eq=False)
class Guided:
    """The guiding forces of a ride as 2 m means at every place: of wheelsets, of wheels outwards, and their Y/Q.

    total [wheelset, place] N, limit [wheelset] N, wheels [wheelset, wheel, place] N, quotient likewise (None where a
    wheel was wholly unloaded), sums [wheelset, sample] N as they are.
    """

    total: FloatArray
    limit: FloatArray
    wheels: FloatArray
    quotient: FloatArray | None
    sums: FloatArray

    @classmethod
    def of(cls, model: Model, series: FloatArray, rate: float, spacing: float) -> Guided:
        """From the series [channel, sample] of `force_channels`, `rate` samples a second."""
        loads = np.array([model.design.values[path] for path in load_paths(model)])
        n = len(loads)
        Y = series[: 2 * n].reshape(n, 2, -1)
        dQ = series[2 * n :] if len(series) > 2 * n else np.zeros((n, Y.shape[-1]))
        Q = loads[:, None, None] + np.stack([dQ, -dQ], axis=1)
        # outwards is to the right at the right wheel; a wheel that lifts has no quotient
        outwards, sums = Y * np.array([1.0, -1.0])[:, None], Y.sum(axis=1)

        def mean(x: FloatArray) -> FloatArray:
            return sliding_mean(_smooth(x, rate), spacing)

        quotient = mean(outwards / Q) if np.all(Q > 0.0) else None
        return cls(mean(sums), np.asarray(force_limit(loads)), mean(outwards), quotient, sums)

    def between(self, a: int, b: int) -> dict[str, Any]:
        """The greatest of a stretch, first to past-the-last sample, by the names of `forces`: over all wheelsets."""
        last = max(a + 1, b - (self.sums.shape[1] - self.total.shape[1]))
        total, limit = np.abs(self.total[:, a:last]), self.limit[:, None]
        quotient = None if self.quotient is None else self.quotient[..., a:last]
        return {
            "sum_of_guiding_forces": float(largest(total).max()),
            "share_above_limit": float(np.mean(total > limit, axis=1).max()),
            "derailment_quotient": None if quotient is None else float(largest(quotient).max()),
        }


def largest(x: FloatArray) -> FloatArray:
    """99.85 % of 2 m means [..., place], as numpy's percentile has it, which reads masked arrays first."""
    if x.shape[-1] == 1:
        return np.asarray(x[..., 0])
    at = PERCENTILE / 100.0 * (x.shape[-1] - 1)
    k = min(int(at), x.shape[-1] - 2)
    below, above = np.moveaxis(np.partition(x, [k, k + 1], axis=-1)[..., k : k + 2], -1, 0)
    return np.asarray(below + (at - k) * (above - below))


def running_safety(model: Model, road: Excitation) -> dict[str, Any] | None:
    """Guiding forces of a ride by the names of EN 14363; None where the vehicle diverges or the track is too short.

    Per wheelset: `sum_of_guiding_forces` [N] (99.85 % of abs of the 2 m mean), its `limit` 10 kN + 2 Q_0/3,
    `share_above_limit` of the time, `rms_100m` [N] (greatest rms over 100 m in f_0 +/- 2 Hz, against half the limit)
    and `dominant_frequency` [Hz]; per wheel (right, left) `guiding_force` [N] and `derailment_quotient` Y/Q, likewise
    99.85 % of the 2 m mean.
    """
    built = model.design.structure is not None
    series, lost = simulate_series(model, road, force_channels(model))
    spacing, rate = road.track.spacing, 1.0 / road.dt
    if lost is not None or road.track.length < 2 * SLIDING:
        return None
    guided = Guided.of(model, series, rate, spacing)
    total, ratios = np.abs(guided.total), None if guided.quotient is None else largest(guided.quotient)
    wheels, sums = largest(guided.wheels), largest(total)
    found = [
        {
            "sum_of_guiding_forces": float(sums[i]),
            "limit": float(limit),
            "share_above_limit": float(np.mean(total[i] > limit)),
            **_instability(guided.sums[i], rate, spacing),
            "guiding_force": wheels[i].tolist(),
            "derailment_quotient": None if ratios is None else ratios[i].tolist(),
        }
        for i, limit in enumerate(guided.limit)
    ]
    worst = None if ratios is None else float(ratios.max())
    notes = [load_note(model)]
    if ratios is None:
        notes.append(UNLOADED)
    if found[0]["rms_100m"] is None:
        notes.append(f"rms_100m: null, the track is shorter than {WINDOW:g} m")
    return {
        "wheelsets": found,
        "derailment_quotient": worst,
        "derailment_quotient_limit": QUOTIENT_LIMIT,
        "load_transfer": built,
        "notes": notes,
    }


def load_note(model: Model) -> str:
    """What wheel loads Y/Q rests on."""
    return f"Y/Q: {INDICATION if model.design.structure is None else QUASI_STATIC}"


def _smooth(x: FloatArray, rate: float) -> FloatArray:
    """Low-passed at 20 Hz, without phase; as it is where it is sampled too slowly for that."""
    if rate <= 2.2 * LOW_PASS:
        return x
    return sosfiltfilt(butterworth(4, [LOW_PASS], rate), x)


def _instability(total: FloatArray, rate: float, spacing: float) -> dict[str, float | None]:
    """The greatest rms over 100 m, every 10 m, of the sum of guiding forces in f_0 +/- 2 Hz round its strongest."""
    window, step = round(WINDOW / spacing), max(1, round(STEP / spacing))
    if len(total) < window + 1:
        return {"rms_100m": None, "dominant_frequency": None}
    f, power = welch(total, rate, 4 * window)
    above = f >= SLOWEST
    f_0 = float(f[above][np.argmax(power[above])])
    band = [max(f_0 - BAND, 0.1), min(f_0 + BAND, 0.45 * rate)]
    passed = sosfiltfilt(butterworth(4, band, rate), total)
    rms = np.sqrt(sliding_mean(passed**2, spacing, WINDOW)[::step])
    return {"rms_100m": float(rms.max()), "dominant_frequency": f_0}
