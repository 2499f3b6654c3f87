"""Residuals without the mains hum of their channels, which the diagnosis of the data names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.corrections.apply import line_signal
from railui.identification.prediction import Prediction

BLOCK_SECONDS = 2.0  # in which the hum has one phase: its frequency is known to one over the length of the record


def without_hum(prediction: Prediction, hum: Mapping[tuple[str, str], float]) -> Prediction:
    """Return a prediction whose compared channels are measured without their hum.

    Hum is steady, of one frequency, and common to the channels of a logger: its line in a residual is no vibration,
    and residuals that share it share no force.

    Parameters
    ----------
    hum
        Frequency [Hz] by name of the run and channel.
    """
    compared = prediction.comparison
    measured: FloatArray = compared.measured.copy()
    t: FloatArray = np.arange(measured.shape[1], dtype=float) * compared.dt
    for i, channel in enumerate(compared.channels):
        frequency = hum.get((prediction.segment.file, channel))
        if frequency is not None:
            measured[i] -= line_signal(t, measured[i] - compared.simulated[i], frequency, BLOCK_SECONDS)
    return replace(prediction, comparison=replace(compared, measured=measured))
