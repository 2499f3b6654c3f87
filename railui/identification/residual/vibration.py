"""Vibration in the residual of a rig: power about one frequency, which noise with a smooth spectrum does not have.

A second mode, a parameter that varies in time, or a force that was not measured need not be coherent with any input;
the rig answers them at its natural frequencies all the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.campaign.settings.verdict import VerdictSettings
from railui.dsp.spectra import hann_periodogram
from railui.identification.prediction import Prediction
from railui.identification.residual.coherence import Share
from railui.identification.residual.input_noise import InputNoiseSpectra
from railui.identification.residual.line_power import (
    MIN_PERIODS,
    REACH,
    LinePower,
    followed_channels,
    largest_share,
    line_bands,
    line_power,
)


def vibration_share(
    settings: VerdictSettings,
    predictions: Sequence[Prediction],
    input_noise: Mapping[Segment, InputNoiseSpectra | None] | None = None,
) -> Share:
    """Share of the residual's power about the frequency where it has most, beyond noise of any colour.

    Parameters
    ----------
    predictions
        Of a model on records of a rig; those that diverge are left out.
    input_noise
        Spectra of the response to noise of the measured input on each segment: a resonance amplifies this noise, and
        what a little of it leaves is no vibration.

    Returns
    -------
    Share
        Of the channel with the largest significant one, over all records, and its standard error; a residual with most
        power at a few periods in a record, as drift has, counts as one without vibration.
    """
    powers = []
    for c in followed_channels(predictions):
        spectra = input_noise.get(c.prediction.segment) if input_noise else None
        rate = 1.0 / c.prediction.comparison.dt
        powers.append((c.name, _power_about_peak(settings, c.name, c.measured - c.simulated, rate, spectra)))
    return largest_share(powers, settings.coherence_standard_errors)


def vibration_frequency(predictions: Sequence[Prediction]) -> float | None:
    """Frequency [Hz] about which the residual of a rig has most power beyond a smooth spectrum.

    Returns
    -------
    float or None
        Mean frequency of the power about the peak of the record and channel where its share is largest; None where no
        record resolves one.
    """
    best, largest = None, 0.0
    for c in followed_channels(predictions):
        f, density = hann_periodogram(c.measured - c.simulated, 1.0 / c.prediction.comparison.dt)
        peak = _resolved_peak(f, density)
        if peak is None:
            continue
        power = line_power(f, density, peak, peak)
        if power.total > 0.0 and power.excess > largest * power.total:
            _, line, _ = line_bands(f, peak, peak)
            best, largest = float(np.average(f[line], weights=density[line])), power.excess / power.total
    return best


def _resolved_peak(f: FloatArray, density: FloatArray) -> float | None:
    """Frequency at which a density [F] is largest; None where a record does not resolve it, as of a drift."""
    peak = float(f[int(np.argmax(density))])
    return None if peak < MIN_PERIODS * f[1] or (1.0 + REACH) * peak > f[-1] else peak


def _power_about_peak(
    settings: VerdictSettings, channel: str, residual: FloatArray, rate: float, spectra: InputNoiseSpectra | None
) -> LinePower:
    """Power of a residual [n] about the frequency where it has most."""
    f, density = hann_periodogram(residual, rate)
    peak = _resolved_peak(f, density)
    if peak is None:
        return LinePower(0.0, 0.0, float(density.sum() * f[1]))
    if spectra is not None:
        _, line, _ = line_bands(f, peak, peak)
        needed = density[line].sum() / max(spectra.responses[channel][line].sum(), 1e-300) * spectra.noise[line].sum()
        if needed <= settings.max_input_noise_share**2 * spectra.input[line].sum():
            return LinePower(0.0, 0.0, float(density.sum() * f[1]))
    return line_power(f, density, peak, peak)
