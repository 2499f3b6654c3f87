"""Information of one planned run about parameters and effects, for any set of its sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class RunInformation:
    """Products of the rows of a run: p sensitivities, then k output differences, weighted by noise.

    Attributes
    ----------
    channels
        Names of the sensors [channel].
    gram
        Inner products [channel, p + k, p + k] over the compared samples.
    noise_scores
        Products [sample, channel, p + k] of the rows with realisations of the noise in blocks of time.
    block_norms
        Squared lengths [block, channel, p + k].
    signal, noise
        Sums of squares [channel] of the motion and, in the mean, of the noise.
    samples
        Compared samples of a channel.
    """

    channels: tuple[str, ...]
    gram: FloatArray
    noise_scores: FloatArray
    block_norms: FloatArray
    signal: FloatArray
    noise: FloatArray
    samples: int

    @property
    def blocks(self) -> int:
        """Number of blocks of time."""
        return len(self.block_norms)

    @property
    def realisation_scale(self) -> float:
        """Factor of the noise scores that makes their sum of squares that of one run."""
        return float(np.sqrt(self.blocks / len(self.noise_scores)))
