"""Random walk of the levels of a fleet: its variance by the likelihood of the predictions.

The mean of many runs of a block shows changes of a vehicle that are no trend over its use. Innovations of a level that
is held to be constant would then be correlated, and their sums would exceed the threshold too often. The likelihood is
that of the prediction errors: A. C. Harvey, Forecasting, Structural Time Series Models and the Kalman Filter (Cambridge
University Press 1989), section 3.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.settings.fleet import FleetSettings
from railui.dsp.robust import MAD_TO_SD
from railui.fleet.level_filter import Levels

WANDERS: Final = (0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # of the variance of a block, from a block to the next


@dataclass(frozen=True, eq=False)
class FilteredBlocks:
    """What the levels were learnt from.

    Attributes
    ----------
    start
        Levels before the first block.
    use, value, variance
        Of the mean of each vehicle and quantity [block, v, q]; the value is NaN where there is none.
    relearned
        Levels [v, q] that are learnt anew before a block, with those expected.
    known
        Values [block, v, q] of which predictions are judged.
    """

    start: Levels
    use: FloatArray
    value: FloatArray
    variance: FloatArray
    relearned: list[list[tuple[NDArray[np.bool_], Levels]]]
    known: NDArray[np.bool_]


def choose_wander(blocks: FilteredBlocks, settings: FleetSettings) -> FloatArray | None:
    """Choose the variance [q] by which levels change from a block to the next; None: too few values to choose."""
    if blocks.known.sum(axis=(0, 1)).min() < settings.min_scores:
        return None
    usual = np.nanmedian(blocks.variance, axis=(0, 1))
    misfits = [_prediction_misfit(blocks, share * usual, settings) for share in WANDERS]
    return np.asarray(np.array(WANDERS)[np.argmin(misfits, axis=0)] * usual)


def _prediction_misfit(blocks: FilteredBlocks, wander: FloatArray, settings: FleetSettings) -> FloatArray:
    """Mean negative log likelihood [q] of the predictions, with a robust scale."""
    levels = blocks.start
    spread, score = np.full_like(blocks.value, np.nan), np.full_like(blocks.value, np.nan)
    for b in range(len(blocks.value)):
        for which, expected in blocks.relearned[b]:
            levels = levels.reset(which, expected)
        levels = levels.wandered(wander)
        use, value, variance = blocks.use[b], blocks.value[b], blocks.variance[b]
        spread[b] = np.sqrt(levels.variance(use) + variance)
        score[b] = (value - levels.predict(use)) / spread[b]
        levels = levels.update(use, value, variance, settings.max_score)
    score, spread = np.where(blocks.known, score, np.nan), np.where(blocks.known, spread, np.nan)
    bound = settings.error_bound * MAD_TO_SD * np.nanmedian(np.abs(score), axis=(0, 1))
    scale = np.nanmean(np.minimum(score**2, bound**2), axis=(0, 1))
    return np.asarray(0.5 * np.log(np.maximum(scale, 1e-300)) + np.nanmean(np.log(spread), axis=(0, 1)))
