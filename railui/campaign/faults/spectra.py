"""Windowed spectra of the columns of a run, as accelerations, and the kinematic relations between them.

The lateral motions y_1, y_2 of the wheelsets and y, psi of the frame give every measured response:

    e_i = y_i - y_wi - r phi_wi,   d_1 = y_1 - y - a psi,   d_2 = y_2 - y + a psi,
    ay_i = y_i'',   ayf = y'',   rf = psi'

With more responses than motions, the left null space of these equations relates the responses to each other,
independently of the vehicle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.corrections.apply import distance
from railui.campaign.segment import Segment
from railui.core import Spline
from railui.dsp.spectra import detrend, hann, tukey

# coefficients of (y_1, y_2, y, a psi) in every response of a bogie, and its order of derivative
BOGIE_MOTIONS = {
    "e1": ((1, 0, 0, 0), 0),
    "e2": ((0, 1, 0, 0), 0),
    "ay1": ((1, 0, 0, 0), 2),
    "ay2": ((0, 1, 0, 0), 2),
    "ayf": ((0, 0, 1, 0), 2),
    "rf": ((0, 0, 0, 1), 1),
    "d1": ((1, 0, -1, -1), 0),
    "d2": ((0, 1, -1, 1), 0),
}
RIG_MOTIONS = {"z": ((1,), 0), "vz": ((1,), 1), "az": ((1,), 2)}
RAILS = {"e1": ("yw.1", "phiw.1"), "e2": ("yw.2", "phiw.2")}
ROLL = {"ay1": "roll.1", "ay2": "roll.2", "ayf": "roll.f"}
TAPER_SECONDS = 1.0  # at either end of a segment
WINDOW_SECONDS = 2.56
BAND = (0.6, 20.0)  # Hz
DENSE_BELOW = 5.0  # Hz; above, every other frequency is used
MAX_RATE_SHARE = 0.4  # of the sampling rate, up to which derivatives are taken
MIN_WINDOWS = 8  # of a run
RIG_WINDOWS = 12  # of a record of a rig
MAX_RIG_BINS = 80


@dataclass(frozen=True, eq=False)
class RunSpectra:
    """Transforms [window, frequency, column] of the columns of a run, each as an acceleration.

    Attributes
    ----------
    f
        Frequencies [Hz].
    time, speed
        Middle [s] from the start of the run and speed [m/s] of every window.
    relations
        Coefficients [relation, column]: their sums are zero for sound data.
    """

    names: tuple[str, ...]
    f: FloatArray
    z: ComplexArray
    time: FloatArray
    speed: FloatArray
    relations: FloatArray

    def columns(self, channel: str) -> list[int]:
        """List the columns of a channel; a track column is under both wheelsets."""
        parts = ("roll", channel) if channel == "phiw" else (channel,)
        return [i for i, name in enumerate(self.names) if name.split(".")[0] in parts]

    def is_related(self, channel: str) -> bool:
        """True if a channel is in a relation."""
        columns = self.columns(channel)
        return bool(columns) and bool(np.any(np.abs(self.relations[:, columns]) > 1e-9))


def run_spectra(segments: Sequence[Segment], wheelbase: float, radius: float) -> RunSpectra | None:
    """Compute the spectra of all segments of one run; None without any relation or with too few windows.

    Parameters
    ----------
    wheelbase, radius
        2 a and r of the vehicle [m].
    """
    if segments[0].kind not in ("bogie", "rig"):
        return None
    is_rig = segments[0].kind == "rig"
    motions = RIG_MOTIONS if is_rig else BOGIE_MOTIONS
    common = set.intersection(*(set(s.columns) for s in segments))
    responses = [name for name in motions if name in common]
    if not responses:
        return None
    names, relations = _relations(responses, motions, is_rig)
    if not len(relations):
        return None
    length = _window_length(segments, is_rig)
    dt = segments[0].dt
    f = np.asarray(np.fft.rfftfreq(length, dt), dtype=np.float64)
    used = _used_frequencies(f, dt, is_rig)
    start = segments[0].columns["t"][0]
    z, time, speed = [], [], []
    for segment in segments:
        if segment.samples < 2 * length:
            continue
        series = _series(segment, names, motions, wheelbase, radius, f[used])
        edge = 0 if is_rig else round(TAPER_SECONDS / dt)
        t, v = segment.columns["t"], segment.columns.get("v", np.ones(segment.samples))
        for first in range(edge, segment.samples - edge - length + 1, length // 2):
            rows = slice(first, first + length)
            z.append(np.fft.rfft(detrend(series[:, rows]) * hann(length))[:, used].T)
            time.append(float(np.mean(t[rows])) - start)
            speed.append(float(np.mean(v[rows])))
    if len(z) < MIN_WINDOWS:
        return None
    return RunSpectra(names, f[used], np.array(z), np.array(time), np.array(speed), relations)


def _window_length(segments: Sequence[Segment], is_rig: bool) -> int:
    if is_rig:
        return max(max(s.samples for s in segments) // RIG_WINDOWS * 2, 16)
    return round(WINDOW_SECONDS / segments[0].dt)


def _used_frequencies(f: FloatArray, dt: float, is_rig: bool) -> FloatArray:
    low, high = (1.5 * f[1], MAX_RATE_SHARE / dt) if is_rig else (BAND[0], min(BAND[1], MAX_RATE_SHARE / dt))
    used = np.flatnonzero((f >= low) & (f <= high))
    if is_rig:
        return np.asarray(used[:: max(len(used) // MAX_RIG_BINS, 1)])
    return np.concatenate([used[f[used] < DENSE_BELOW], used[f[used] >= DENSE_BELOW][::2]])


def _relations(
    responses: Sequence[str], motions: Mapping[str, tuple[tuple[int, ...], int]], is_rig: bool
) -> tuple[tuple[str, ...], FloatArray]:
    """Return the names of the columns, and the relations [relation, column] between them."""
    names = list(responses)
    rails = [name for r in responses for name in RAILS.get(r, ())]
    names += rails + ([] if is_rig else [ROLL[r] for r in responses if r in ROLL])
    h = np.array([motions[r][0] for r in responses], dtype=float)
    u, singular, _ = np.linalg.svd(h)
    null = u[:, int(np.sum(singular > 1e-9)) :].T
    relations = np.zeros((len(null), len(names)))
    relations[:, : len(responses)] = null
    for i, r in enumerate(responses):
        for rail in RAILS.get(r, ()):
            relations[:, names.index(rail)] = null[:, i]  # y_i = e_i + y_wi + r phi_wi
    return tuple(names), relations


def _series(
    segment: Segment,
    names: Sequence[str],
    motions: Mapping[str, tuple[tuple[int, ...], int]],
    wheelbase: float,
    radius: float,
    f: FloatArray,
) -> FloatArray:
    """Series [column, n] of a segment as accelerations, band-passed."""
    c = segment.columns
    rows = []
    for name in names:
        base, _, place = name.partition(".")
        if place:
            rows.append(track_series(c, base, place, wheelbase, radius))
            order = 2 if base == "roll" else 0
        else:
            rows.append(c[name] * (0.5 * wheelbase if name == "rf" else 1.0))
            order = motions[name][1]
        rows[-1] = _as_acceleration(rows[-1], segment.dt, 2 - order, f)
    return np.array(rows)


def track_series(c: Mapping[str, FloatArray], base: str, place: str, wheelbase: float, radius: float) -> FloatArray:
    """Track column under a wheelset: yw, r phiw, or the cross-level for the share of gravity."""
    if place == "f":
        front, rear = (track_series(c, base, i, wheelbase, radius) for i in "12")
        return 0.5 * (front + rear)
    values = c.get("yw" if base == "yw" else "phiw")
    if values is None or not np.any(values):
        return np.zeros_like(c["t"])
    if place == "2":
        s = distance(c)
        values = Spline(s, values)(np.maximum(s - wheelbase, s[0]))
    return values * (radius if base == "phiw" else 1.0)


def _as_acceleration(x: FloatArray, dt: float, order: int, f: FloatArray) -> FloatArray:
    """Derivative of an order of a series [n] in the band of the frequencies, by its transform."""
    n = len(x)
    edges = tukey(n, min(2.0 * TAPER_SECONDS / (n * dt), 0.2))
    spectrum = np.fft.rfft(detrend(x) * edges)
    frequencies = np.fft.rfftfreq(n, dt)
    low, high = 0.5 * f[0], f[-1] + 0.5 * f[0]
    band = np.clip((frequencies - low) / max(f[0] - low, 1e-12), 0.0, 1.0)
    band *= np.clip((1.15 * high - frequencies) / (0.15 * high), 0.0, 1.0)
    return np.fft.irfft(spectrum * (2j * np.pi * frequencies) ** order * band, n)
