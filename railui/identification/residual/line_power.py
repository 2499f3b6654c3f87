"""Power of a residual in a spectral line, beyond noise of any colour.

Noise has a continuous spectrum: its density at a line is interpolated from those in the gaps on both sides.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.identification.prediction import Prediction
from railui.identification.residual.coherence import UNKNOWN, Share

LINE_HALF_WIDTH = 0.2  # of the spacing of the lines
GAP = (0.35, 0.65)  # distance of a gap from a line, where the density is that of noise
REACH = GAP[1]
MIN_PERIODS = 10  # of the lowest line in a record that resolves it
# values of a spectrum with a Hann window for each independent one: neighbours have the correlations 4/9 and 1/36
WINDOW_WIDTH = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)


class LinePower(NamedTuple):
    """Power in lines beyond noise, its variance in noise, and all power; zeros: the lines are not resolved."""

    excess: float
    variance: float
    total: float


def line_power(f: FloatArray, density: FloatArray, line: float, spacing: float, count: int = 1) -> LinePower:
    """Compute the power of a density [F] at frequencies f [F] in lines a spacing apart, of which `line` is the lowest.

    Two neighbouring lines share the gap between them.
    """
    bands = [line_bands(f, line + k * spacing, spacing) for k in range(count)]
    inside, gaps = [b[1] for b in bands], [bands[0][0], *(b[2] for b in bands)]
    in_gaps = np.array([density[gap].mean() for gap in gaps])
    noise = np.sqrt(in_gaps[:-1] * in_gaps[1:])
    width = 2.0 * LINE_HALF_WIDTH * spacing
    excess = width * sum(float(density[k].mean()) - level for k, level in zip(inside, noise, strict=True))
    # a mean of n values has the relative variance 1/n; the level of a line follows half the relative change of each gap
    of_lines = sum(level**2 / k.sum() for k, level in zip(inside, noise, strict=True))
    followed = 0.5 * (np.append(noise, 0.0) + np.append(0.0, noise))
    of_gaps = sum(level**2 / gap.sum() for gap, level in zip(gaps, followed, strict=True))
    return LinePower(float(excess), float(WINDOW_WIDTH * width**2 * (of_lines + of_gaps)), float(density.sum() * f[1]))


def line_bands(f: FloatArray, line: float, spacing: float) -> tuple[NDArray[np.bool_], ...]:
    """Which of the frequencies f [F] lie in the gap below a line, in the line and in the gap above it."""
    near, far, half = (share * spacing for share in (*GAP, LINE_HALF_WIDTH))
    edges = ((line - far, line - near), (line - half, line + half), (line + near, line + far))
    return tuple((f >= low) & (f <= high) for low, high in edges)


def largest_share(powers: Iterable[tuple[str, LinePower]], standard_errors: float) -> Share:
    """Share of a channel's power that is in lines, and its standard error in noise: the largest that is significant.

    Parameters
    ----------
    powers
        Channel and power of every record. Channels have different units, so that their powers do not add.
    standard_errors
        By which a significant share exceeds zero; where none does, the largest of all is returned.

    Returns
    -------
    Share
        NaN where no record resolves the lines.
    """
    sums: dict[str, FloatArray] = {}
    for channel, power in powers:
        sums[channel] = sums.get(channel, np.zeros(3)) + power
    shares = [Share(float(e / total), float(np.sqrt(v) / total)) for e, v, total in sums.values() if total > 0.0]
    significant = [s for s in shares if s.is_significant(standard_errors)]
    return max(significant or shares, key=lambda s: s.share, default=UNKNOWN)


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
