"""Residuals of a loop on the segment that its report shows: their spectra, whiteness and coherence with the input."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.comparison import compared_channels
from railui.campaign.noise.record import band_limits
from railui.campaign.segment import Segment
from railui.dsp.spectra import multiple_coherence, welch
from railui.identification.estimation.noise_floor import SimulatedTruth
from railui.identification.residual.coherence import track_inputs, window_length
from railui.identification.result import LoopResult
from railui.report.loop.figures import compared_series
from railui.report.numbers import CONFIDENCE_FACTOR

NOISE_DRAWS = 8  # of the noise model, for the residual of a correct model
MAX_LAG = 1.0  # s, of an autocorrelation, where that is as many samples as the least number of lags
RIG_LAG_SHARE, MIN_LAGS = 0.02, 25  # of the samples of a short series; samples
SPECTRUM_WINDOWS = 12  # without overlap


@dataclass(frozen=True, eq=False)
class ChannelResidual:
    """Residuals of one channel as compared, by model.

    Attributes
    ----------
    series
        Residual [n] of "before" and "after"; only "after" where no effect was added.
    expected
        Realisations [draw, n] of the residual that a correct model would leave: noise of sensors and track.
    band
        Compared band [Hz].
    coherence
        Share of the power that is coherent with the input, by "measured" and model [frequency]; empty without input.
    """

    name: str
    dt: float
    series: Mapping[str, FloatArray]
    expected: FloatArray
    band: tuple[float, float]
    frequencies: FloatArray
    coherence: Mapping[str, FloatArray]

    def in_band(self, f: FloatArray) -> NDArray[np.bool_]:
        """True for frequencies [Hz] above zero in the compared band."""
        return np.asarray((f > 0) & (f >= self.band[0]) & (f <= self.band[1]))

    def density(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Frequencies [Hz] and power spectral density of a series."""
        return welch(x, 1.0 / self.dt, max(len(x) // SPECTRUM_WINDOWS, min(256, len(x))))

    @cached_property
    def expected_density(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies [Hz] and power spectral density of the expected residual, mean over its realisations."""
        both = [self.density(x) for x in self.expected]
        return both[0][0], np.asarray(np.mean([density for _, density in both], axis=0))

    def ratio_to_noise(self, model: str) -> float:
        """Rms of a residual over that expected from noise."""
        return float(np.sqrt(np.mean(self.series[model] ** 2) / max(float(np.mean(self.expected**2)), 1e-300)))

    def whiteness(self, model: str) -> Whiteness:
        """Autocorrelation of a residual, divided at each frequency of the band by the amplitude of the noise model."""
        x = self.series[model]
        f = np.asarray(np.fft.rfftfreq(len(x), self.dt))
        used = self.in_band(f)
        noise_f, noise_density = self.expected_density
        noise = np.interp(f[used], noise_f, noise_density)
        power = np.zeros(len(f))
        power[used] = np.abs(np.fft.rfft(x - x.mean())[used]) ** 2 / np.maximum(noise, 1e-300)
        longest = longest_lag(len(x), self.dt)
        found, flat = (np.fft.irfft(p, len(x))[: longest + 1] for p in (power, used.astype(np.float64)))
        half_width = CONFIDENCE_FACTOR / float(np.sqrt(2.0 * max(int(used.sum()), 1)))
        correlation = np.asarray(found / max(float(found[0]), 1e-300))
        return Whiteness(self.dt * np.arange(longest + 1.0), correlation, np.asarray(flat / flat[0]), half_width)


def longest_lag(samples: int, dt: float) -> int:
    """Longest lag, in samples, of the autocorrelation of a series.

    >>> longest_lag(7000, 0.01), longest_lag(7000, 4.0), longest_lag(10, 4.0)
    (100, 25, 9)
    """
    return min(max(round(MAX_LAG / dt), MIN_LAGS), round(RIG_LAG_SHARE * samples) + MIN_LAGS, samples - 1)


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Autocorrelation [lag] of a whitened residual, that of white noise in the band, half of its 95 % interval."""

    lags: FloatArray
    correlation: FloatArray
    expected: FloatArray
    half_width: float

    @property
    def share_outside(self) -> float:
        """Share of the lags outside the 95 % interval."""
        return float(np.mean(np.abs(self.correlation - self.expected)[1:] > self.half_width))


def channel_residuals(result: LoopResult, index: int) -> dict[str, ChannelResidual]:
    """Return the residuals of every compared channel of a validation segment; a diverged model is left out."""
    segment = result.dataset.validation[index]
    series = compared_series(result, index)
    channels = compared_channels(segment)
    measured = series["measured"]
    residuals: dict[str, FloatArray] = {m: measured - series[m] for m in ("before", "after") if m in series}
    if not residuals:
        return {}
    expected = _expected_residuals(result, segment, index)
    inputs = track_inputs(result.context, segment)
    length = window_length(segment, segment.dt, measured.shape[1], len(inputs))
    band = band_limits(result.dataset.campaign.band, segment.dt)
    shown = {"measured": measured, **residuals}
    frequencies, lines = np.zeros(0), np.full((len(shown), len(measured), 1), np.nan)
    if len(inputs):
        frequencies, lines = multiple_coherence(inputs, np.stack(list(shown.values())), 1.0 / segment.dt, length)
    found = {}
    for i, name in enumerate(channels):
        row = segment.channels.index(name)
        coherence = {key: x[row] for key, x in zip(shown, lines, strict=True) if np.all(np.isfinite(x[row]))}
        own = {model: x[row] for model, x in residuals.items()}
        found[name] = ChannelResidual(name, segment.dt, own, expected[:, i], band, frequencies, coherence)
    return found


def _expected_residuals(result: LoopResult, segment: Segment, index: int) -> FloatArray:
    """Draw residuals [draw, channel, n] that the final model would leave if it were true; NaN where it diverges."""
    truth = SimulatedTruth(result.context, result.after.model, segment, index)
    drawn = [noisy - simulated for pair in map(truth.draw, range(NOISE_DRAWS)) if pair for noisy, simulated in [pair]]
    return np.stack(drawn or [np.full((len(truth.channels), segment.samples), np.nan)])
