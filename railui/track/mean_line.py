"""Mean line of a measured track: the datum and the heading of its alignment, which a ride does not depend on."""

from __future__ import annotations

from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.track.line import Track

LONGEST_IRREGULARITY: Final = 150.0  # m, the longest wavelength that the mean line leaves to the irregularities
LARGEST_BETA: Final = 36.0  # of the Kaiser window: side lobes at the resolution of a double
MAIN_LOBE: Final = 0.95  # share of the distance to the longest irregularity that the main lobe of the window takes


def mean_line(s: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return offset [m] at s[0] and heading [rad] of the mean line of a lateral deviation y [sample] in m.

    The line is that of weighted least squares. The weights are a Kaiser window whose main lobe ends before wavelengths
    of 150 m, so that irregularities move the line by less than 1e-8 of their amplitude on 1 km of track; up to 150 m of
    track the weights are equal.

    >>> s = np.linspace(0.0, 100.0, 201)
    >>> [round(x, 12) for x in mean_line(s, 0.25 + 0.005 * s)]
    [0.25, 0.005]
    """
    cycles = float(s[-1] - s[0]) / LONGEST_IRREGULARITY
    beta = min(MAIN_LOBE * np.pi * np.sqrt(max(cycles**2 - 1.0, 0.0)), LARGEST_BETA)
    weights = np.kaiser(len(s), beta)
    x = s - s[0]
    middle = float(weights @ x / weights.sum())
    mean = float(weights @ y / weights.sum())
    heading = float((weights * (x - middle)) @ (y - mean) / (weights @ (x - middle) ** 2))
    return mean - heading * middle, heading


def along_mean_line(track: Track) -> Track:
    """Return a track in coordinates along its mean line; a synthetic track is in these already."""
    if track.is_synthetic:
        return track
    offset, heading = mean_line(track.s, track.yw)
    yw = track.yw - (offset + heading * (track.s - track.s[0]))
    return track.with_deviation(yw)
