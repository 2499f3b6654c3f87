"""Residual of a free decay: what a wrong law leaves lies at the frequency of the motion and its multiples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.spectra import hann_periodogram
from railui.identification.prediction import Prediction
from railui.identification.residual.coherence import Share
from railui.identification.residual.line_power import (
    MIN_PERIODS,
    REACH,
    LinePower,
    followed_channels,
    largest_share,
    line_power,
)

HARMONICS = 3  # the fundamental is the first


def share_at_harmonics(predictions: Sequence[Prediction], standard_errors: float) -> Share:
    """Share of the residual's power at the frequency of a free motion and its multiples, beyond noise of any colour.

    A wrong law changes frequency, decay or shape of the oscillation. Noise and drift of the sensor have a continuous
    spectrum: its density at a line is interpolated from those in the gaps on both sides.

    Parameters
    ----------
    predictions
        Of a model on records of a free motion; those that diverge, or are shorter than ten periods, are left out.

    standard_errors
        By which a significant share exceeds zero.

    Returns
    -------
    Share
        Of the channel with the largest significant one, over all records, and its standard error in noise of the
        interpolated density; NaN where no record resolves the lines.
    """
    powers = (
        (c.name, _power_at_harmonics(c.measured - c.simulated, c.simulated, 1.0 / c.prediction.comparison.dt))
        for c in followed_channels(predictions)
    )
    return largest_share(powers, standard_errors)


def _power_at_harmonics(residual: FloatArray, motion: FloatArray, rate: float) -> LinePower:
    """Power of a residual [n] at the harmonics of a motion [n]."""
    f, of_motion = hann_periodogram(motion, rate)
    _, density = hann_periodogram(residual, rate)
    fundamental = float(f[int(np.argmax(of_motion))])
    if fundamental < MIN_PERIODS * f[1] or (HARMONICS + REACH) * fundamental > f[-1]:
        return LinePower(0.0, 0.0, 0.0)
    return line_power(f, density, fundamental, fundamental, HARMONICS)
