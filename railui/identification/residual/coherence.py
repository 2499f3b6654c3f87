"""Coherence of the residual with the track, with the motions and with the residuals of the other channels.

Sensor noise of one channel is incoherent with all of them. A wrong model, an unmodelled effect and noise of the track
columns are not: each reaches several channels through the vehicle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.comparison import comparison_filter, cut_samples, upper_band_limit
from railui.campaign.segment import Segment
from railui.dsp.spectra import MIN_INPUT_SIZE, hann
from railui.identification.context import Context
from railui.identification.prediction import Prediction
from railui.vehicle.track_geometry import track_geometry

WINDOW_SECONDS = 2.56  # longest window of the spectra
MIN_WINDOW_SECONDS = 0.64
RIG_WINDOWS = 60  # half-overlapping windows in a record of a rig
WINDOWS_PER_INPUT = 4  # at least; the window is shortened for them
OVERLAP_CORRELATION = 1 / 6  # of the transforms of white noise in Hann windows that overlap by half, Welch 1967
JACKKNIFE_GROUPS = 10


class Share(NamedTuple):
    """Coherent share of a power less its expectation by chance, and its standard error; NaN: record too short."""

    share: float
    standard_error: float

    def is_significant(self, standard_errors: float) -> bool:
        """True where the share differs from chance by more than so many standard errors."""
        return bool(self.share > standard_errors * self.standard_error)


UNKNOWN = Share(float("nan"), float("nan"))


@dataclass(frozen=True)
class ResidualCoherence:
    """Shares of the residual's power of a channel that a linear relation per frequency explains.

    Attributes
    ----------
    track
        By the track columns under both wheelsets; by the input of a rig; zero without any.
    motions
        By all simulated channels, which are free of sensor noise.
    others
        By the residuals of all other channels; zero where there are none.
    """

    track: Share
    motions: Share
    others: Share


def residual_coherence(context: Context, predictions: Sequence[Prediction]) -> dict[str, ResidualCoherence]:
    """Compute how much of the residual of each compared channel is coherent with track, motions and other residuals.

    The multiple coherence is estimated on every segment alone, since the relations depend on the speed, from
    half-overlapping Hann windows. With p inputs and K averages, white noise has a coherence of p/K by chance, which is
    subtracted. Standard errors come from a jackknife over groups of windows; for a share near zero they are too large
    by about a half.

    Parameters
    ----------
    context
        Of the identification.
    predictions
        Of one model on segments, as `predict_each` computes them; those that diverge are left out.

    References
    ----------
    Bendat, Piersol, Random Data, 4th ed., 7.3 and 9.3.
    """
    parts: dict[str, list[_ChannelSums]] = {}
    for prediction in predictions:
        if prediction.diverged_at is None:
            for name, sums in _segment_sums(context, prediction).items():
                parts.setdefault(name, []).append(sums)
    return {name: _combine(sums) for name, sums in parts.items()}


class _Coherent(NamedTuple):
    """Power [1 + group] that inputs explain less chance, and the power: of all windows, then without each group."""

    explained: FloatArray
    total: FloatArray


@dataclass(frozen=True)
class _ChannelSums:
    track: _Coherent | None
    motions: _Coherent | None
    others: _Coherent | None


def _segment_sums(context: Context, prediction: Prediction) -> dict[str, _ChannelSums]:
    comparison, segment = prediction.comparison, prediction.segment
    residuals = comparison.measured - comparison.simulated
    track = track_inputs(context, segment)
    motions = comparison_filter(context.campaign, segment, prediction.series)
    band = context.campaign.band
    limits = (0.0, np.inf) if band is None else (band[0], upper_band_limit(band, 1.0 / segment.dt))
    spectra = _Spectra(segment, comparison.dt, residuals.shape[1], max(len(track), len(motions)), limits)
    lines = spectra.transforms(residuals)
    track_lines, motion_lines = spectra.transforms(track), spectra.transforms(motions)
    by_track, by_motions = spectra.coherent(lines, track_lines), spectra.coherent(lines, motion_lines)
    by_others = spectra.coherent_with_others(lines)
    names = comparison.channels
    return {name: _ChannelSums(by_track[i], by_motions[i], by_others[i]) for i, name in enumerate(names)}


def track_inputs(context: Context, segment: Segment) -> FloatArray:
    """Filtered track columns under all wheelsets [input, n], or the input of a rig; those that are zero left out."""
    columns = segment.columns
    n = segment.samples - 2 * cut_samples(context.campaign, segment)
    inputs = [columns[name] for name in segment.input_columns]
    if not segment.is_rig:
        inputs = track_geometry(context.nominal.design).under_wheelsets(columns["s"], inputs)
    moving = [x for x in inputs if np.ptp(x) > 0.0]
    return comparison_filter(context.campaign, segment, np.stack(moving)) if moving else np.zeros((0, n))


class _Spectra:
    """Windowed transforms of the compared samples of a segment, at the frequencies of the band."""

    def __init__(self, segment: Segment, dt: float, samples: int, inputs: int, band: tuple[float, float]) -> None:
        self.length = window_length(segment, dt, samples, inputs)
        self.starts = range(0, samples - self.length + 1, max(self.length // 2, 1))
        f = np.fft.rfftfreq(self.length, dt)
        self.used = (f >= band[0]) & (f <= band[1]) & (f > 0.0)
        self.phase = np.where(np.arange(len(f)) % 2, -1.0, 1.0)[self.used]

    def transforms(self, series: FloatArray) -> ComplexArray:
        """Transforms [frequency, window, series] of series [series, n]."""
        window = hann(self.length)
        parts = []
        for k in self.starts:
            part = series[:, k : k + self.length]
            parts.append(np.fft.rfft((part - part.mean(axis=1, keepdims=True)) * window, axis=1))
        return np.stack(parts)[..., self.used].transpose(2, 0, 1)

    def coherent(self, outputs: ComplexArray, inputs: ComplexArray) -> list[_Coherent | None]:
        """Power of each of the outputs [frequency, window, output] that inputs explain; None: too short a segment."""
        kept = self._jackknife(outputs.shape[1], inputs.shape[2])
        return _by_output([_explained_power(outputs[:, k], inputs[:, k], self.phase) for k in kept], outputs.shape[2])

    def coherent_with_others(self, series: ComplexArray) -> list[_Coherent | None]:
        """Power of each of some series [frequency, window, series] that all others explain; None: too short."""
        kept = self._jackknife(series.shape[1], series.shape[2] - 1)
        return _by_output([_power_explained_by_others(series[:, k], self.phase) for k in kept], series.shape[2])

    @staticmethod
    def _jackknife(windows: int, inputs: int) -> list[NDArray[np.bool_]]:
        """Masks of all windows, then of those without each group; none if too few windows for so many inputs."""
        if windows * (1.0 - 1.0 / JACKKNIFE_GROUPS) < inputs + 2:
            return []
        group = np.arange(windows) * min(JACKKNIFE_GROUPS, windows) // windows
        return [np.ones(windows, dtype=bool), *(group != g for g in range(group[-1] + 1))]


def _by_output(powers: Sequence[tuple[FloatArray, FloatArray]], outputs: int) -> list[_Coherent | None]:
    """Split powers (explained [output], all [output]) of all windows and without each group by output."""
    if not powers:
        return [None] * outputs
    both = np.array(powers)
    return [_Coherent(both[:, 0, i], both[:, 1, i]) for i in range(outputs)]


def window_length(segment: Segment, dt: float, samples: int, inputs: int) -> int:
    """Samples of a window: short enough for several windows per input."""
    enough = 2 * samples // (WINDOWS_PER_INPUT * max(inputs, 1) + 1)
    if segment.is_rig:
        return max(min(2 * samples // RIG_WINDOWS, enough), 8)
    return int(np.clip(enough, round(MIN_WINDOW_SECONDS / dt), round(WINDOW_SECONDS / dt)).clip(max=samples))


def _explained_power(outputs: ComplexArray, inputs: ComplexArray, phase: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Power [output] that the inputs explain at all frequencies less chance, and the power of the outputs.

    The projection P on the inputs [frequency, window, input] takes trace(P C) of K shares of white noise by chance, C
    the correlation of its windows; phase: sign [frequency] of that of neighbours, whose starts differ by half a window.
    """
    power = np.sum(np.abs(outputs) ** 2, axis=1)
    if inputs.shape[2] == 0:
        return np.zeros(outputs.shape[2]), power.sum(axis=0)
    scale = np.sqrt(np.sum(np.abs(inputs) ** 2, axis=1, keepdims=True))
    basis, size, _ = np.linalg.svd(inputs / np.maximum(scale, 1e-300), full_matrices=False)
    independent = size > MIN_INPUT_SIZE * size[:, :1]
    projected = np.abs(basis.conj().transpose(0, 2, 1) @ outputs) ** 2
    explained = np.sum(projected * independent[:, :, None], axis=1)
    neighbours = np.sum(_neighbour_products(basis) * independent, axis=1)
    incoherent = _beyond_chance(power - explained, outputs.shape[1], independent.sum(axis=1), neighbours, phase)
    return np.sum(power - incoherent, axis=0), power.sum(axis=0)


def _power_explained_by_others(series: ComplexArray, phase: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Power [series] of each series [frequency, window, series] that all others explain less chance, and its power.

    The columns of the transposed pseudoinverse are orthogonal to all other series: what the others leave of a series is
    its projection on its column. The others project as all series do, less that column.
    """
    windows, count = series.shape[1:]
    power = np.sum(np.abs(series) ** 2, axis=1)
    scale = np.maximum(np.sqrt(power), 1e-300)
    basis, size, axes = np.linalg.svd(series / scale[:, None], full_matrices=False)
    size = np.maximum(size, MIN_INPUT_SIZE * size[:, :1])
    column = (basis / size[:, None]) @ axes
    squares = np.sum(np.abs(column) ** 2, axis=1)
    neighbours = np.sum(_neighbour_products(basis), axis=1)[:, None] - _neighbour_products(column) / squares
    incoherent = _beyond_chance(scale**2 / squares, windows, np.full(len(series), count - 1), neighbours.T, phase)
    return np.sum(power - incoherent, axis=0), power.sum(axis=0)


def _neighbour_products(columns: ComplexArray) -> FloatArray:
    """Real part of the inner products [frequency, column] of columns [frequency, window, column] a window apart."""
    return np.asarray(np.real(np.sum(columns[:, 1:].conj() * columns[:, :-1], axis=1)))


def _beyond_chance(
    unexplained: FloatArray, windows: int, inputs: NDArray[np.int64], neighbours: FloatArray, phase: FloatArray
) -> FloatArray:
    """Expected power [frequency, output] that is incoherent with inputs which leave so much unexplained.

    neighbours: trace [frequency] or [output, frequency] of the projection on the inputs with a shift by one window.
    """
    chance = inputs + 2.0 * OVERLAP_CORRELATION * phase * neighbours
    factor = windows / np.maximum(windows - chance, 1.0)
    return np.asarray(unexplained * (factor[:, None] if factor.ndim == 1 else factor.T))


def _combine(sums: Sequence[_ChannelSums]) -> ResidualCoherence:
    """Shares over all segments of a channel."""
    return ResidualCoherence(*(_share([getattr(s, name) for s in sums]) for name in ("track", "motions", "others")))


def _share(parts: Sequence[_Coherent | None]) -> Share:
    """Share of the power of all segments, and its jackknife standard error; segments that are too short left out."""
    usable = [p for p in parts if p is not None]
    total = sum(float(p.total[0]) for p in usable)
    if not usable or total <= 0.0:
        return UNKNOWN
    share = sum(float(p.explained[0]) for p in usable) / total
    variance = 0.0
    for p in usable:
        without = p.explained[1:] / p.total[1:]
        groups = len(without)
        part = float(p.total[0]) / total
        variance += part**2 * (groups - 1) / groups * float(np.sum((without - without.mean()) ** 2))
    return Share(share, float(np.sqrt(variance)))
