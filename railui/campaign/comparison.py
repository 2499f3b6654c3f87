"""Comparison of simulated with measured channels: band-pass filter and normalised root-mean-square error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign
from railui.campaign.segment import Segment
from railui.core import ZeroPhaseFilter
from railui.dsp.filters import butterworth, padlen, sosfilt_zi, sosfiltfilt
from railui.runs.columns import is_compared

FILTER_ORDER = 4
MAX_BAND_SHARE = 0.45  # of the sampling rate, the upper end of the band


@dataclass(frozen=True, eq=False)
class Comparison:
    """Channels of a segment as compared, measured and simulated [channel, n], dt [s] between samples."""

    channels: tuple[str, ...]
    measured: FloatArray
    simulated: FloatArray
    dt: float


def compared_channels(segment: Segment) -> list[str]:
    """List the channels of a segment that count in the error."""
    return [c for c in segment.channels if is_compared(c)]


def compare(campaign: Campaign, segment: Segment, series: FloatArray) -> Comparison:
    """Filter the compared channels of a segment as measured and as simulated.

    Parameters
    ----------
    series
        Every channel of the segment as simulated [channel, n]; NaN where the vehicle diverged.
    """
    used = [i for i, c in enumerate(segment.channels) if c in compared_channels(segment)]
    measured = comparison_filter(campaign, segment, segment.measured(segment.channels)[used])
    diverged = np.all(np.isnan(series))
    simulated = np.full_like(measured, np.nan) if diverged else comparison_filter(campaign, segment, series[used])
    return Comparison(tuple(segment.channels[i] for i in used), measured, simulated, segment.dt)


def upper_band_limit(band: tuple[float, float], rate: float) -> float:
    """Upper end of the band [Hz] at a sampling rate [Hz]."""
    return min(band[1], MAX_BAND_SHARE * rate)


def band_pass(band: tuple[float, float] | None, rate: float, *, keeps_mean: bool = False) -> FloatArray:
    """Design the Butterworth band-pass of the comparison as sections [section, 6].

    For a band of None there are none, so that the mean is removed, or with `keeps_mean` one that passes everything.
    """
    if band is None:
        return np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]]) if keeps_mean else np.zeros((0, 6))
    return butterworth(FILTER_ORDER, (band[0], upper_band_limit(band, rate)), rate)


def cut_samples(campaign: Campaign, segment: Segment) -> int:
    """Count the samples left out at either end; a window of multiple shooting and a decay are compared in full."""
    if segment.window_of is not None or segment.is_free:
        return 0
    return round(campaign.cut_length(segment.samples * segment.dt) / segment.dt)


def segment_filter(campaign: Campaign, segment: Segment) -> FloatArray:
    """Design the comparison filter of a segment as sections [section, 6].

    The mean of the force on a component is part of its law (the preload), and of a motion that is prescribed nothing
    drifts: without a band all of it is compared. A free decay whose sensors drift is compared above the drift, but for
    windows of multiple shooting, which are too short for it.
    """
    if campaign.band is None and segment.drift_limit and segment.window_of is None:
        return band_pass((segment.drift_limit, np.inf), 1.0 / segment.dt)
    return band_pass(campaign.band, 1.0 / segment.dt, keeps_mean=segment.kind == "bench")


def kernel_filter(campaign: Campaign, segment: Segment, weights: FloatArray, every: int = 1) -> ZeroPhaseFilter:
    """Build the comparison filter of a segment for the kernel, with weights [channel]; it keeps every n-th sample."""
    sos = segment_filter(campaign, segment)
    return ZeroPhaseFilter(sos, sosfilt_zi(sos), padlen(sos), cut_samples(campaign, segment), weights, every)


def comparison_filter(campaign: Campaign, segment: Segment, x: FloatArray) -> FloatArray:
    """Filter channels [channel, n] forwards and backwards through the band-pass, then cut both ends."""
    cut = cut_samples(campaign, segment)
    return sosfiltfilt_or_demean(segment_filter(campaign, segment), x)[..., cut : x.shape[-1] - cut]


def sosfiltfilt_or_demean(sos: FloatArray, x: FloatArray) -> FloatArray:
    """Filter channels [channel, n] forwards and backwards; subtract the mean where there are no sections."""
    return np.asarray(sosfiltfilt(sos, x) if len(sos) else x - x.mean(axis=-1, keepdims=True))


def nrmse(comparisons: Sequence[Comparison]) -> dict[str, float]:
    """Compute sqrt(sum (x - z)^2 / sum x^2) per channel over all segments; NaN for a channel without any motion."""
    error: dict[str, float] = {}
    power: dict[str, float] = {}
    for comparison in comparisons:
        for c, x, z in zip(comparison.channels, comparison.measured, comparison.simulated, strict=True):
            error[c] = error.get(c, 0.0) + float(np.sum((x - z) ** 2))
            power[c] = power.get(c, 0.0) + float(np.sum(x**2))
    return {c: float(np.sqrt(error[c] / power[c])) if power[c] > 0 else float("nan") for c in error}


def overall_nrmse(channels: Mapping[str, float]) -> float:
    """Root of the mean of the squared errors over the compared channels."""
    used = [v for c, v in channels.items() if is_compared(c)]
    return float(np.sqrt(np.mean(np.square(used)))) if used else float("nan")
