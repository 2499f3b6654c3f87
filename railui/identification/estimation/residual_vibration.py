"""Vibration in the residual of a rig: power about one frequency, which noise with a smooth spectrum does not have.

A second mode, a parameter that varies in time, or a force that was not measured need not be coherent with any input;
the rig answers them at its natural frequencies all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.spectra import hann_periodogram
from railui.identification.estimation.line_power import (
    MIN_PERIODS,
    REACH,
    LinePower,
    followed_channels,
    largest_share,
    line_power,
)
from railui.identification.estimation.residual_coherence import Share
from railui.identification.prediction import Prediction


def vibration_share(predictions: Sequence[Prediction]) -> Share:
    """Share of the residual's power about the frequency where it has most, beyond noise of any colour.

    Parameters
    ----------
    predictions
        Of a model on records of a rig; those that diverge are left out.

    Returns
    -------
    Share
        Of the channel with most, over all records, and its standard error; a residual with most power at a few periods
        in a record, as drift has, counts as one without vibration.
    """
    return largest_share(
        (c.name, _power_about_peak(c.measured - c.simulated, 1.0 / c.prediction.comparison.dt))
        for c in followed_channels(predictions)
    )


def _power_about_peak(residual: FloatArray, rate: float) -> LinePower:
    """Power of a residual [n] about the frequency where it has most."""
    f, density = hann_periodogram(residual, rate)
    peak = float(f[int(np.argmax(density))])
    if peak < MIN_PERIODS * f[1] or (1.0 + REACH) * peak > f[-1]:
        return LinePower(0.0, 0.0, float(density.sum() * f[1]))
    return line_power(f, density, peak, peak)
