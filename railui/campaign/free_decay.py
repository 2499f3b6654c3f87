"""Free decays of a rig: which records they are, and their frequency."""

from __future__ import annotations

import numpy as np

from railui.campaign.segment import Segment
from railui.dsp.spectra import hann_periodogram

MIN_PERIODS = 10  # of the motion in a record


def is_free_decay(segment: Segment) -> bool:
    """True for a record of a rig without input that lasts some periods."""
    is_free = segment.kind == "rig" and not np.any(segment.columns.get("u", 0.0))
    return is_free and motion_frequency(segment) * segment.samples * segment.dt >= MIN_PERIODS


def motion_frequency(segment: Segment) -> float:
    """Frequency [Hz] at which the first channel has most power."""
    x = segment.columns[segment.channels[0]]
    f, density = hann_periodogram(x, 1.0 / segment.dt)
    return float(f[int(np.argmax(density))])
