"""Overlap of two runs: sequences of samples that occur in both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.dsp.spectra import detrend, hann
from railui.runs.columns import Form, column_names
from railui.runs.plausibility import without_spikes

SEQUENCE = 16  # samples; noise makes a repetition by chance impossible
MIN_DISTINCT = 4  # different values of a sequence
MAX_SHARED_SHARE = 0.05  # of the sequences of the shorter run
MIN_SAME_NOISE = 0.3  # correlation of the noise of two runs, from which they are one recording
NOISE_BAND = (0.25, 0.45)  # of the lower sampling rate, above the motions of a vehicle
CHANCE_MARGIN = 2.0  # of a correlation over the largest one that independent noise has by chance
MAX_NOISE_RATIO = 4.0  # of noise to the median of its size; beyond it are shocks and spikes


def shared_share(a: Mapping[str, FloatArray], b: Mapping[str, FloatArray], form: Form | None = None) -> float:
    """Return the share of the sequences of 16 samples of one run that occur in the other.

    Parameters
    ----------
    a, b
        Columns [n] by name; the largest share of a response counts.
    form
        Form of both runs; that of a bogie or a rig by default.
    """
    forms: tuple[Form, ...] = ("bogie", "rig") if form is None else (form,)
    others = {name for each in forms for name in column_names(each, "clock", "track", "coach")}
    return max((_shared(a[name], b[name]) for name in (a.keys() & b.keys()) - others), default=0.0)


def _shared(x: FloatArray, y: FloatArray) -> float:
    first, second = _sequences(x), _sequences(y)
    if not first.size or not second.size:
        return 0.0
    return float(np.intersect1d(first, second).size / min(first.size, second.size))


def _sequences(x: FloatArray) -> NDArray[np.uint64]:
    """Return a hash of each sequence of samples that is neither constant nor interrupted."""
    if x.size < SEQUENCE:
        return np.empty(0, dtype=np.uint64)
    changes = np.concatenate(([0.0], np.diff(x) != 0)).cumsum()
    usable = changes[SEQUENCE - 1 :] - changes[: changes.size - SEQUENCE + 1] >= MIN_DISTINCT
    missing = np.concatenate(([0], np.cumsum(~np.isfinite(x))))
    usable &= missing[SEQUENCE:] == missing[:-SEQUENCE]
    bits = (x + 0.0).view(np.uint64)  # -0 and 0 are one value
    total = np.zeros(x.size - SEQUENCE + 1, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for k in range(SEQUENCE):
            total = total * np.uint64(0x9E3779B97F4A7C15) + (bits[k : k + total.size] ^ np.uint64(k + 1))
            total ^= total >> np.uint64(29)
    return np.unique(total[usable])


def same_noise(a: Mapping[str, FloatArray], b: Mapping[str, FloatArray], form: Form) -> float:
    """Return how far the noise of the sensors is the same in two runs of a vehicle, at the best common shift in time.

    Resampling and rounding leave no common samples and most of the noise. Runs over one track have the same motions,
    at other times, and other noise. The phases of the cross spectrum alone count (Knapp, Carter 1976), so that hum
    and strong motions do not.

    Parameters
    ----------
    a, b
        Columns [n] by name.
    form
        Form of both runs.

    Returns
    -------
    float
        Second largest value of the responses, of which one alone may be a line: 0 of independent noise, 1 of the same.
    """
    responses = [name for name in column_names(form, "response") if name in a and name in b]
    fine, coarse = sorted(float(np.median(np.diff(x["t"]))) for x in (a, b))
    band = NOISE_BAND[0] * fine / coarse, NOISE_BAND[1] * fine / coarse
    values = []
    for name in responses:
        first, second = (_noise(_evenly(x, name, fine), band) for x in (a, b))
        values.append(_highest_correlation(first, second, band))
    return sorted(values)[-2] if len(values) > 1 else 0.0


def _evenly(columns: Mapping[str, FloatArray], name: str, dt: float) -> FloatArray:
    """Return a column at even times, without its gaps and spikes."""
    t, x = columns["t"], columns[name]
    known = np.isfinite(x)
    return np.interp(np.arange(t[0], t[-1], dt), t[known], without_spikes(x[known]))


def _noise(x: FloatArray, band: tuple[float, float]) -> FloatArray:
    """Return the part of a series [n] in a band [1/sample], without the shocks that stand out of it."""
    window = hann(x.size) ** 2  # of which nothing of slow motions leaks into the band
    spectrum = np.fft.rfft(detrend(x) * window)
    noise = np.fft.irfft(np.where(_inside(band, x.size), spectrum, 0.0), x.size)
    limit = MAX_NOISE_RATIO * float(np.median(np.abs(noise)))
    return np.clip(noise, -limit, limit)


def _highest_correlation(x: FloatArray, y: FloatArray, band: tuple[float, float]) -> float:
    """Return the highest correlation of two series, whitened in a band, at any shift; 0 where chance explains it."""
    n = 2 * max(x.size, y.size)
    used = _inside(band, n)
    cross = np.where(used, np.fft.rfft(x, n).conj() * np.fft.rfft(y, n), 0.0)
    correlation = np.fft.irfft(cross / np.maximum(np.abs(cross), 1e-300), n)
    highest = float(np.max(np.abs(correlation))) * n / (2.0 * float(used.sum()))
    by_chance = float(np.sqrt(4.0 * np.log(n) / used.sum()))  # the largest of n, each the mean of half as many phases
    return highest if highest > CHANCE_MARGIN * by_chance else 0.0


def _inside(band: tuple[float, float], n: int) -> NDArray[np.bool_]:
    f = np.fft.rfftfreq(n)
    return np.asarray((f > band[0]) & (f < band[1]))
