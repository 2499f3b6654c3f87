"""Faults of a channel during a part of a run: the kinematic relations hold in some windows and not in others.

The residuals of the relations have a covariance that the windows of the best agreement give. The disagreement of a
channel in a window is the power of the residuals in its direction over that covariance: the part of the misfit that
vanishes when the channel is left out. A loose or noisy sensor raises it in an interval of time, and without it the
others agree there. Where the motions are stronger, constant errors of gains and delays leave more as well, so that the
disagreement counts at most in proportion to the power of the motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.corrections.correction import Correction, Corrections, yaml_line
from railui.campaign.faults.families import TRACK, candidates
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.spectra import RunSpectra
from railui.campaign.faults.wording import channel_names
from railui.campaign.settings.faults import FaultSettings
from railui.dsp.robust import MAD_TO_SD

TRIMMED_SHARE = 0.5  # of the windows, of the best agreement
MIN_TRIMMED = 6  # of the windows
TRIMMING_STEPS = 4
SMOOTHED_LINES = 3  # on either side of a frequency, for the covariance of its residuals
RIDGE = 1e-9
MIN_INSIDE, MIN_OUTSIDE = 4, 6  # windows of an interval, and of the rest of the run
MIN_OUTSIDE_SHARE = 0.25  # of the windows
QUANTILE = 0.2  # of the windows of an interval, and above it of the others, that are left out
OVERLAP_VARIANCE = 1.5  # of a mean over windows that overlap by half, over that of independent ones
SAME_DIRECTION = 0.9  # of the largest disagreement, from which channels are not distinguished by their direction
MOTION_SHARES = np.concatenate([[0.0], np.geomspace(0.01, 100.0, 17)])  # at the median power of the motions
MAX_SCATTER_RATIO = 1.1  # over the least, up to which such a share is not excluded
GAIN_DISTINCTION = 2.0  # of the misfit that the gain of one channel leaves, over that of another
TINY = 1e-300


@dataclass(frozen=True)
class IntermittentFault:
    """A channel that contradicts the others during a part of a run.

    Attributes
    ----------
    channel, others
        The channel, and others of which the data do not exclude the same.
    start, end
        Interval [s] from the start of the run.
    ratio
        Power of its disagreement in the interval over that in the rest of the run.
    gain
        Recorded over true value in the interval; None: no gain explains the disagreement.
    """

    channel: str
    others: tuple[str, ...]
    start: float
    end: float
    ratio: float
    gain: float | None


def fault_of_part(found: IntermittentFault, run: str, start: float, settings: FaultSettings) -> Fault:
    """Return a fault during a part of a run as a data fault; start: time [s] at which the run begins."""
    interval = (start + found.start, start + found.end)
    time = f"from {interval[0]:.1f} to {interval[1]:.1f} s"
    names = " or ".join([channel_names((found.channel,)), *found.others])
    text = f"{names} contradicts the other channels {time} and agrees with them otherwise: "
    if found.gain is not None:
        text += f"it is recorded {found.gain:.2g} times too large there"
    else:
        text += f"it deviates {np.sqrt(found.ratio):.1f} times as far there"
    rows = f"empty the cells of {found.channel} in these rows: the rest of the run is used"
    corrections, *others = [_left_out(c, run) for c in (found.channel, *found.others)]
    return Fault(
        "intermittent",
        (found.channel,),
        found.ratio if found.gain is None else found.gain,
        None,
        "1",
        (run,),
        text,
        found.ratio > settings.serious_intermittent_ratio,
        corrections,
        tuple(yaml_line(c) for c in others if c),
        rows,
        interval,
    )


def _left_out(channel: str, run: str) -> Corrections:
    """Return the correction that leaves a response of a run out; none for a track column."""
    return Corrections() if channel in TRACK else Corrections((Correction(channel, leave_out=True, runs=(run,)),))


class _Interval(NamedTuple):
    """Windows from first to last (excluded), with the channel whose disagreement is largest there."""

    first: int
    last: int
    channel: str
    contrast: float


def _are_inside(first: int, last: int, windows: int) -> NDArray[np.bool_]:
    """Mark the windows from first to last (excluded)."""
    number = np.arange(windows)
    return np.asarray((number >= first) & (number < last))


def find_intermittent_fault(spectra: RunSpectra, settings: FaultSettings, runs: int = 1) -> IntermittentFault | None:
    """Find the channel of a run that contradicts the others in one interval of time; None without any.

    Parameters
    ----------
    spectra
        Of the columns of the run, with known faults corrected.
    runs
        Number of runs that are searched, over which the level of the test is divided.
    """
    channels = candidates(spectra)
    whole = _Disagreement(spectra, _windows_of_agreement(spectra))
    intervals = [x for c in channels if (x := _interval(whole, c, len(channels) * runs, settings)) is not None]
    if not intervals:
        return None
    interval = max(intervals, key=lambda x: x.contrast)
    inside = _are_inside(interval.first, interval.last, len(spectra.z))
    disagreement = _Disagreement(spectra, ~inside)
    ratios = {c: disagreement.ratio(c, inside) for c in channels}
    single = [c for c in channels if disagreement.is_restored_without([c], inside, settings)]
    suspects = single or _only_pair(disagreement, channels, inside, settings)
    if not suspects:
        return None
    most = max(ratios[c] for c in suspects)
    alike = [c for c in suspects if ratios[c] >= (SAME_DIRECTION if single else 1.0) * most]
    inner = _are_inside(interval.first + 1, interval.last - 1, len(inside))  # the fault in all of each
    named, gain = _distinguished(disagreement, alike, inner, settings)
    step = float(spectra.time[1] - spectra.time[0])
    is_to_start, is_to_end = interval.first == 0, interval.last == len(spectra.time)
    return IntermittentFault(
        named[0],
        tuple(named[1:]),
        0.0 if is_to_start else float(spectra.time[interval.first]) - 0.5 * step,
        float(spectra.time[interval.last - 1]) + (1.0 if is_to_end else 0.5) * step,
        most,
        gain if single else None,
    )


def _only_pair(
    disagreement: _Disagreement, channels: Sequence[str], inside: NDArray[np.bool_], settings: FaultSettings
) -> list[str]:
    """Return two channels without which the others agree in an interval, if there is one such pair only."""
    pairs = [p for p in combinations(channels, 2) if disagreement.is_restored_without(p, inside, settings)]
    return list(pairs[0]) if len(pairs) == 1 else []


class _Disagreement:
    """Residuals [window, frequency, relation] of the relations of a run, whitened by their covariance in some windows.

    power: of the motions in each window, over its median.
    """

    def __init__(self, spectra: RunSpectra, reference: NDArray[np.bool_]) -> None:
        self.spectra = spectra
        residuals = np.einsum("kc,wfc->wfk", spectra.relations, spectra.z)
        self.root = np.linalg.inv(np.linalg.cholesky(_covariance(residuals[reference])))
        self.white = np.einsum("fij,wfj->wfi", self.root, residuals)
        recorded = [i for i, name in enumerate(spectra.names) if "." not in name]
        density = np.abs(spectra.z[:, :, recorded]) ** 2
        relative = np.median(np.mean(density / np.maximum(np.median(density, axis=0), TINY), axis=1), axis=1)
        self.power = relative / np.median(relative)

    @property
    def total(self) -> FloatArray:
        """Mean square of the residuals in each window."""
        return np.asarray(np.mean(np.abs(self.white) ** 2, axis=(1, 2)))

    def columns(self, channel: str) -> list[int]:
        """List the columns of a channel in the relations; of the track under each wheelset."""
        return [i for i in self.spectra.columns(channel) if np.any(self.spectra.relations[:, i])]

    def directions(self, channels: Sequence[str]) -> ComplexArray:
        """Orthonormal directions [frequency, relation, direction] in which errors of channels enter the residuals."""
        relations = self.spectra.relations[:, [i for c in channels for i in self.columns(c)]]
        basis, size, _ = np.linalg.svd(self.root @ relations, full_matrices=False)
        return np.asarray(basis[:, :, np.median(size / size[:, :1], axis=0) > 1e-6], dtype=complex)

    def part(self, channel: str) -> FloatArray:
        """Mean square of the residuals in the directions of a channel, per window."""
        along = np.einsum("fic,wfi->wfc", self.directions([channel]).conj(), self.white)
        return np.asarray(np.mean(np.abs(along) ** 2, axis=(1, 2)))

    def ratio(self, channel: str, inside: NDArray[np.bool_]) -> float:
        """Disagreement of a channel in an interval over that in the rest of the run."""
        part = self.part(channel)
        return float(np.mean(part[inside])) / (float(np.mean(part[~inside])) + TINY)

    def is_restored_without(self, channels: Sequence[str], inside: NDArray[np.bool_], settings: FaultSettings) -> bool:
        """True if the others agree in the interval as they do outside; also of one channel in a single relation."""
        basis = self.directions(channels)
        if basis.shape[2] >= self.white.shape[2]:
            return len(channels) == 1
        along = np.einsum("fic,wfi->wfc", basis.conj(), self.white)
        rest = np.sum(np.abs(self.white) ** 2, axis=(1, 2)) - np.sum(np.abs(along) ** 2, axis=(1, 2))
        return float(np.mean(rest[inside])) < settings.max_restored_ratio * float(np.mean(rest[~inside]))

    def prediction(self, channel: str) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Recorded values [window, frequency, column], those that the other channels predict, and the precision.

        The prediction is that of generalised least squares; the precision is that of the difference.
        """
        columns = self.columns(channel)
        a = np.asarray(self.root @ self.spectra.relations[:, columns])
        inverse = np.linalg.pinv(a, rcond=1e-6)
        recorded = self.spectra.z[:, :, columns]
        predicted = recorded - np.einsum("fci,wfi->wfc", inverse, self.white)
        return recorded, predicted, np.asarray(np.swapaxes(a.conj(), 1, 2) @ a)

    def scaled(self, channel: str, inside: NDArray[np.bool_]) -> tuple[float, float]:
        """Gain of a channel in an interval, and the misfit that it leaves there, over that in the rest of the run."""
        recorded, predicted, precision = self.prediction(channel)

        def product(p: ComplexArray, q: ComplexArray, windows: NDArray[np.bool_]) -> float:
            return float(np.real(np.einsum("wfc,fcd,wfd->", p[windows].conj(), precision, q[windows])))

        gain = product(predicted, recorded, inside) / (product(predicted, predicted, inside) + TINY)
        error, usual = recorded - gain * predicted, recorded - predicted
        left, outside = product(error, error, inside), product(usual, usual, ~inside)
        return gain, left / np.sum(inside) / (outside / np.sum(~inside) + TINY)


def _windows_of_agreement(spectra: RunSpectra) -> NDArray[np.bool_]:
    """Select the windows in which the relations hold best, by repeated trimming."""
    windows = len(spectra.z)
    number = min(max(round(TRIMMED_SHARE * windows), MIN_TRIMMED), windows)
    chosen = np.ones(windows, dtype=bool)
    for _ in range(TRIMMING_STEPS):
        order = np.argsort(_Disagreement(spectra, chosen).total)
        chosen = np.isin(np.arange(windows), order[:number])
    return np.asarray(chosen)


def _covariance(residuals: ComplexArray) -> ComplexArray:
    """Covariance [frequency, relation, relation] of residuals [window, frequency, relation], smoothed over lines."""
    power = np.mean(np.abs(residuals) ** 2, axis=(0, 2)) + TINY
    scaled = residuals / np.sqrt(power)[:, None]
    each = np.einsum("wfi,wfj->fij", scaled, scaled.conj()) / len(scaled)
    lines = range(len(power))
    smooth = np.stack([each[max(f - SMOOTHED_LINES, 0) : f + SMOOTHED_LINES + 1].mean(axis=0) for f in lines])
    return np.asarray(power[:, None, None] * (smooth + RIDGE * np.eye(residuals.shape[2])))


def _interval(disagreement: _Disagreement, channel: str, tests: int, settings: FaultSettings) -> _Interval | None:
    """Find the interval in which a channel disagrees most; None where it does so everywhere or by chance.

    tests: number of channels and runs that are searched.
    """
    log = np.log(disagreement.part(channel) + TINY)
    log -= np.median(log)
    found = [x for y in (log, log - np.log(disagreement.power)) if (x := _highest_interval(y)) is not None]
    intervals = []
    for first, last in dict.fromkeys(found):
        inside = _are_inside(first, last, len(log))
        y = _beyond_motion(log, disagreement.power, inside)
        contrast = float(np.quantile(y[inside], QUANTILE) - np.quantile(y[~inside], 1.0 - QUANTILE))
        level = settings.intermittent_level / (tests * 0.5 * len(y) ** 2)
        is_significant = _standard_score(y, inside) > NormalDist().inv_cdf(1.0 - level)
        if contrast > np.log(settings.intermittent_contrast) and is_significant:
            intervals.append(_Interval(first, last, channel, contrast))
    return max(intervals, key=lambda x: x.contrast, default=None)


def _beyond_motion(log: FloatArray, power: FloatArray, inside: NDArray[np.bool_]) -> FloatArray:
    """Return the logarithm of a disagreement [n] over the part that constant errors leave in proportion to the motion.

    The largest such part is taken that the windows outside an interval do not exclude.
    """
    parts = [log - np.log1p(share * power) for share in MOTION_SHARES]
    scatter = np.array([np.std(y[~inside]) for y in parts])
    return np.asarray(parts[int(np.flatnonzero(scatter <= MAX_SCATTER_RATIO * scatter.min())[-1])])


def _highest_interval(y: FloatArray) -> tuple[int, int] | None:
    """Find the interval whose mean exceeds that of the other windows [n] most clearly; None in a short series."""
    n = len(y)
    sums = np.concatenate([[0.0], np.cumsum(y)])
    first, last = np.triu_indices(n + 1, MIN_INSIDE)
    rest = n - (last - first)
    is_valid = rest >= max(MIN_OUTSIDE, MIN_OUTSIDE_SHARE * n)
    if not np.any(is_valid):
        return None
    first, last, rest = first[is_valid], last[is_valid], rest[is_valid]
    inner, count = sums[last] - sums[first], last - first
    clearness = (inner / count - (sums[-1] - inner) / rest) * np.sqrt(count * rest / n)
    best = int(np.argmax(clearness))
    return int(first[best]), int(last[best])


def _standard_score(y: FloatArray, inside: NDArray[np.bool_]) -> float:
    """Difference of the means of a series in an interval and outside, over its standard deviation."""
    scatter = MAD_TO_SD * float(np.median(np.abs(np.diff(y)))) / np.sqrt(2.0)  # a step hardly changes it
    n, rest = int(np.sum(inside)), int(np.sum(~inside))
    sd = max(scatter, 1e-9) * np.sqrt(OVERLAP_VARIANCE * (1.0 / n + 1.0 / rest))
    return float((y[inside].mean() - y[~inside].mean()) / sd)


def _distinguished(
    disagreement: _Disagreement, channels: Sequence[str], inside: NDArray[np.bool_], settings: FaultSettings
) -> tuple[list[str], float | None]:
    """Order channels that disagree alike, and return a gain: one channel where its gain alone makes it agree."""
    scaled = {c: disagreement.scaled(c, inside) for c in channels}
    ordered = sorted(channels, key=lambda c: scaled[c][1])
    gain, left = scaled[ordered[0]]
    is_only = len(channels) == 1 or scaled[ordered[1]][1] > GAIN_DISTINCTION * left
    return (ordered[:1], gain) if left < settings.max_restored_ratio and is_only else (ordered, None)
