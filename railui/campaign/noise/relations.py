"""Combinations of channels in which every motion cancels, so that only noise is left.

Whatever forces act, the measured motions of a bogie are those of four coordinates y_1, y_2, y, psi:

    ay_i = y_i'',   e_i = y_i - y_wi - r phi_wi,   ayf = y'',   rf = psi',
    d_1 = y_1 - y - a psi,   d_2 = y_2 - y + a psi

As accelerations they are Z = K q'' + noise with a constant matrix K, and the rows of its left null space U' K = 0 are
the combinations. The three estimates of each y_i'' work as the three-cornered hat of clocks (Gray, Allan 1974).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.noise.bounds import incoherent_power, track_inputs
from railui.campaign.noise.record import Record, band_limits
from railui.campaign.settings.noise import NoiseSettings
from railui.core import Spline
from railui.dsp.spectra import detrend, hann, tukey
from railui.vehicle.track_geometry import TrackGeometry

WINDOW_SECONDS = 2.56
MIN_LINE = 1.9  # lowest line used of a window: the first contains leakage of slow motions
TAPER_SECONDS = 2.0  # at both ends of a record, left out of the spectra
ROLL_OFF = 1.25  # upper end of the roll-off of a derivative over the highest frequency used
FOLLOWED_BAND = (0.8, 6.0)  # Hz, where motions are far above their noise
SPEED_RATIO = 1.2  # of the highest to the lowest speed of windows with one mean spectrum; a noise off by 1 %
MIN_SPEED = 1.0  # m/s, below which windows are of one speed
MIN_SINGULAR_VALUE = 1e-9
RAILS = "rails"  # noise of the track columns under the wheelset, y_w + r phi_w


class _Row(NamedTuple):
    """Channel as an acceleration: amounts of y_1, y_2, y, psi (or of all y_i), and times it is differentiated."""

    amounts: tuple[float, ...]
    order: int


def _rows(geometry: TrackGeometry) -> dict[str, _Row]:
    if not geometry.is_bogie:
        return _rows_of_wheelsets(len(geometry.distances))
    a = geometry.half_wheelbase
    return {
        "e1": _Row((1.0, 0.0, 0.0, 0.0), 2),
        "e2": _Row((0.0, 1.0, 0.0, 0.0), 2),
        "ay1": _Row((1.0, 0.0, 0.0, 0.0), 0),
        "ay2": _Row((0.0, 1.0, 0.0, 0.0), 0),
        "ayf": _Row((0.0, 0.0, 1.0, 0.0), 0),
        "rf": _Row((0.0, 0.0, 0.0, 1.0), 1),
        "d1": _Row((1.0, 0.0, -1.0, -a), 2),
        "d2": _Row((0.0, 1.0, -1.0, a), 2),
    }


def _rows_of_wheelsets(count: int) -> dict[str, _Row]:
    """Return e_i and ay_i of each wheelset, which need no kinematics of the bodies above."""
    units = [tuple(float(i == k) for k in range(count)) for i in range(count)]
    return {
        f"{letters}{i + 1}": _Row(u, order) for i, u in enumerate(units) for letters, order in (("e", 2), ("ay", 0))
    }


@dataclass(frozen=True, eq=False)
class RelationSpectra:
    """Cross spectra of the relations of a record, in its windows of one speed.

    Attributes
    ----------
    frequencies
        [Hz], F of them.
    density
        One-sided cross spectral densities [F, relation, relation].
    gains
        Amplitudes [F, relation] with which noise of each channel, and of the rails, enters the relations.
    averages
        Independent windows behind a density.
    dt, speed
        Interval [s] and mean speed [m/s] of the windows.
    """

    frequencies: FloatArray
    density: ComplexArray
    gains: Mapping[str, ComplexArray]
    averages: float
    dt: float
    speed: float


def relation_spectra(
    records: Sequence[Record], geometry: TrackGeometry, band: tuple[float, float] | None, settings: NoiseSettings
) -> list[RelationSpectra]:
    """Compute the spectra of all relations that the channels of each record satisfy; records without any left out.

    A record has one for each speed, on which the noise of the rails under the wheelsets depends.

    geometry: of the wheelsets on the track.
    """
    spectra = []
    for record in records:
        rows = {c: row for c, row in _rows(geometry).items() if c in record.channels}
        usable = round(2.0 * TAPER_SECONDS / record.dt) + 4 * round(WINDOW_SECONDS / record.dt)
        if len(rows) > 1 and len(record.columns["t"]) >= usable:  # a single channel is in no relation
            highest = band_limits(band, record.dt)[1]
            series = {c: _acceleration(record, geometry, c, row.order, highest) for c, row in rows.items()}
            names = _usable_channels(record, series, rows, geometry, settings)
            if names:
                spectra += _spectra(record, geometry, {c: rows[c] for c in names}, series, band)
    return spectra


def _spectra(
    record: Record,
    geometry: TrackGeometry,
    rows: Mapping[str, _Row],
    series: Mapping[str, FloatArray],
    band: tuple[float, float] | None,
) -> list[RelationSpectra]:
    low, high = band_limits(band, record.dt)
    names = list(rows)
    _, null = _bases(names, rows)
    relations = null.T @ np.stack([series[c] for c in names])
    samples = slice(cut := round(TAPER_SECONDS / record.dt), relations.shape[1] - cut)
    f, parts = _transforms(relations[:, samples], record.dt)
    used = (f >= max(low, MIN_LINE / WINDOW_SECONDS)) & (f <= high)
    f, w = f[used], 2.0 * np.pi * f[used]
    gains: dict[str, ComplexArray] = {
        c: (w[:, None] ** row.order * null[names.index(c)]).astype(complex) for c, row in rows.items()
    }
    spectra = []
    for speed, of_speed in _windows_by_speed(record, samples, len(parts)):
        rails = _rails_gains(gains, geometry, w, speed)
        all_gains = gains | ({RAILS: rails} if np.any(rails) else {})
        density, averages = _mean_density(parts[of_speed], record.dt)
        spectra.append(RelationSpectra(f, density[used], all_gains, averages, record.dt, speed))
    return spectra


def _rails_gains(
    gains: Mapping[str, ComplexArray], geometry: TrackGeometry, w: FloatArray, speed: float
) -> ComplexArray:
    """Amplitudes [F, relation] of noise of the rails, which each wheelset meets later than the first."""
    rails = np.zeros_like(next(iter(gains.values())))
    for number, behind in enumerate(geometry.distances, 1):
        if (c := f"e{number}") in gains:
            rails += gains[c] * np.exp(-1j * w * behind / speed)[:, None]
    return rails


def _windows_by_speed(record: Record, samples: slice, count: int) -> list[tuple[float, NDArray[np.intp]]]:
    """Speeds [m/s], each with the indices of the windows of a record that have it; one where it varies little."""
    length = round(WINDOW_SECONDS / record.dt)
    v = record.columns["v"][samples]
    means = [np.mean(v[k : k + length]) for k in (length // 2) * np.arange(count)]
    speeds = np.maximum(means, MIN_SPEED)
    classes = max(int(np.ceil(np.log(speeds.max() / speeds.min()) / np.log(SPEED_RATIO))), 1)
    if classes == 1:
        return [(record.mean_speed, np.arange(count))]
    share = np.log(speeds / speeds.min()) / np.log(speeds.max() / speeds.min())
    number = np.minimum((classes * share).astype(int), classes - 1)
    groups = [np.flatnonzero(number == k) for k in np.unique(number)]
    return [(float(np.mean(speeds[group])), group) for group in groups]


def _acceleration(record: Record, geometry: TrackGeometry, channel: str, order: int, highest: float) -> FloatArray:
    """Channel as an acceleration [n]: e_i plus the track under its wheelset, all differentiated."""
    x = record.columns[channel]
    if channel.startswith("e"):
        columns, s = record.columns, record.columns["s"]
        rails = columns["yw"] + geometry.rolling_radius * columns.get("phiw", np.zeros_like(s))
        behind = geometry.distances[int(channel[1:]) - 1]
        x = x + (Spline(s, rails)(np.clip(s - behind, s[0], s[-1])) if behind else rails)
    return differentiate(x, record.dt, order, highest)


def differentiate(x: FloatArray, dt: float, order: int, highest: float) -> FloatArray:
    """Differentiate a series [n] that is tapered at both ends, by the Fourier transform, up to a frequency [Hz]."""
    n = len(x)
    f = np.fft.rfftfreq(n, dt)
    roll = np.clip((f - highest) / ((ROLL_OFF - 1.0) * highest), 0.0, 1.0)
    gain = (2j * np.pi * f) ** order * (0.5 + 0.5 * np.cos(np.pi * roll))
    return np.asarray(np.fft.irfft(np.fft.rfft(detrend(x) * tukey(n, 2.0 * TAPER_SECONDS / (n * dt))) * gain, n))


def _usable_channels(
    record: Record,
    series: Mapping[str, FloatArray],
    rows: Mapping[str, _Row],
    geometry: TrackGeometry,
    settings: NoiseSettings,
) -> list[str]:
    """List the channels whose relations hold: all, or without the one that makes them follow the track; else none.

    A wrong gain, sign or delay, or rails that yield, leave a part of the motions in the relations. The track is no
    combination of the channels, so that their noise does not follow it.
    """
    names = list(rows)
    trials = [names, *([c for c in names if c != out] for out in names if len(names) > 2)]
    shares = []
    for used in trials:
        share = _following_share(record, used, series, rows, geometry)
        if used is names and share <= settings.max_following_share:
            return names
        shares.append(share)
    best = int(np.argmin(shares))
    return trials[best] if shares[best] <= settings.max_following_share else []


def _bases(names: Sequence[str], rows: Mapping[str, _Row]) -> tuple[FloatArray, FloatArray]:
    """Bases [channel, combination] of the motions and of the relations."""
    left, size, _ = np.linalg.svd(np.array([rows[c].amounts for c in names]))
    rank = int(np.sum(size > MIN_SINGULAR_VALUE))
    return left[:, :rank], left[:, rank:]


def _following_share(
    record: Record,
    names: Sequence[str],
    series: Mapping[str, FloatArray],
    rows: Mapping[str, _Row],
    geometry: TrackGeometry,
) -> float:
    """Largest share of a relation's power that is coherent with the track; infinite without relation."""
    _, null = _bases(names, rows)
    if null.shape[1] == 0:
        return np.inf
    track = track_inputs(record, geometry)
    relations = null.T @ np.stack([series[c] for c in names])
    powers = [incoherent_power(record, relation, track, FOLLOWED_BAND) for relation in relations]
    return max(0.0 if p is None else 1.0 - p[0] / max(p[1], 1e-300) for p in powers)


def _transforms(series: FloatArray, dt: float) -> tuple[FloatArray, ComplexArray]:
    """Frequencies [Hz] and transforms [window, series, F] of half-overlapping windows."""
    length = round(WINDOW_SECONDS / dt)
    window = hann(length)
    starts = range(0, series.shape[1] - length + 1, length // 2)
    parts = np.stack([np.fft.rfft(detrend(series[:, k : k + length]) * window) for k in starts])
    return np.asarray(np.fft.rfftfreq(length, dt)), np.asarray(parts)


def _mean_density(parts: ComplexArray, dt: float) -> tuple[ComplexArray, float]:
    """One-sided densities [F, series, series] of windows, and how many of these are independent."""
    window = hann(round(WINDOW_SECONDS / dt))
    density = 2.0 * dt / float(window @ window) * np.einsum("kif,kjf->fij", parts, parts.conj()) / len(parts)
    return np.asarray(density), 0.95 * len(parts)
