"""Power of a residual in a spectral line, beyond noise of any colour.

Noise has a continuous spectrum: its density at a line is interpolated from those in the gaps on both sides.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.identification.estimation.residual_coherence import UNKNOWN, Share
from railui.identification.prediction import Prediction

LINE_HALF_WIDTH = 0.2  # of the spacing of the lines
GAP = (0.35, 0.65)  # distance of a gap from a line, where the density is that of noise
REACH = GAP[1]
MIN_PERIODS = 10  # of the lowest line in a record that resolves it
WINDOW_WIDTH = 1.5  # values of a spectrum with a Hann window for each independent one


class LinePower(NamedTuple):
    """Power in lines beyond noise, its variance in noise, and all power; zeros: the lines are not resolved."""

    excess: float
    variance: float
    total: float


def line_power(f: FloatArray, density: FloatArray, line: float, spacing: float) -> LinePower:
    """Compute the power of a density [F] at frequencies f [F] in a line, whose neighbours are a spacing away."""

    def mean_density(low: float, high: float) -> tuple[float, float]:
        """Mean between two frequencies, and how many independent values it has."""
        inside = density[(f >= low) & (f <= high)]
        return float(inside.mean()), len(inside) / WINDOW_WIDTH

    near, far = GAP[0] * spacing, GAP[1] * spacing
    below, n_below = mean_density(line - far, line - near)
    above, n_above = mean_density(line + near, line + far)
    half = LINE_HALF_WIDTH * spacing
    inside, n_line = mean_density(line - half, line + half)
    # a mean of n values has the relative variance 1/n, the geometric mean of two means a quarter of the sum
    noise = float(np.sqrt(below * above))
    variance = (2.0 * half * noise) ** 2 * (1.0 / n_line + 0.25 / n_below + 0.25 / n_above)
    return LinePower(2.0 * half * (inside - noise), variance, float(density.sum() * f[1]))


def largest_share(powers: Iterable[tuple[str, LinePower]]) -> Share:
    """Share of a channel's power that is in lines, of the channel with most, and its standard error in noise.

    Parameters
    ----------
    powers
        Channel and power of every record. Channels have different units, so that their powers do not add.

    Returns
    -------
    Share
        NaN where no record resolves the lines.
    """
    sums: dict[str, FloatArray] = {}
    for channel, power in powers:
        sums[channel] = sums.get(channel, np.zeros(3)) + power
    shares = [Share(float(e / total), float(np.sqrt(v) / total)) for e, v, total in sums.values() if total > 0.0]
    return max(shares, key=lambda s: s.share, default=UNKNOWN)


class FollowedChannel(NamedTuple):
    """A channel of a prediction that does not diverge, measured and simulated [n]."""

    prediction: Prediction
    name: str
    measured: FloatArray
    simulated: FloatArray


def followed_channels(predictions: Sequence[Prediction]) -> Iterator[FollowedChannel]:
    """Iterate over the channels of the predictions that do not diverge."""
    for prediction in predictions:
        if prediction.diverged_at is None:
            compared = prediction.comparison
            for name, measured, simulated in zip(compared.channels, compared.measured, compared.simulated, strict=True):
                yield FollowedChannel(prediction, name, measured, simulated)
