"""Weighted inner products of a validation run, from which the error that an effect adds to it follows.

With d the output difference per amount of a shape, s the sensitivities and a what the parameters absorb of it, both the
squared error (d - s a)' W (d - s a) and its variance under noise are quadratic forms of a.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.planning.run_information import RunInformation


@dataclass(frozen=True, eq=False)
class QuadraticForm:
    """Inner products of p parameters [p, p], of k shapes with them [k, p], and of every shape with itself [k]."""

    parameters: FloatArray
    cross: FloatArray
    squares: FloatArray

    def left(self, absorbed: FloatArray) -> FloatArray:
        """Squared length [k] of each shape less the part [k, p] that the parameters absorb."""
        crossed = np.einsum("kp,kp->k", absorbed, self.cross)
        squared = np.einsum("kp,kp->k", absorbed @ self.parameters, absorbed)
        return np.asarray(np.maximum(self.squares - 2.0 * crossed + squared, 0.0))


@dataclass(frozen=True, eq=False)
class ValidationProducts:
    """Products of the outputs and of their scores under noise, as shares of the power of each sensor.

    noise_floor: NRMSE that noise alone leaves.
    """

    outputs: QuadraticForm
    scores: QuadraticForm
    noise_floor: float


def validation_products(run: RunInformation, channels: Sequence[str], p: int) -> ValidationProducts:
    """Return the products of some sensors of a run; p: number of parameters among its rows."""
    rows = [run.channels.index(c) for c in channels]
    power = run.signal[rows] + run.noise[rows]
    weights = 1.0 / power / len(rows)
    scores = run.realisation_scale * np.tensordot(run.noise_scores[:, rows], weights, ([1], [0]))
    return ValidationProducts(
        QuadraticForm(
            np.tensordot(weights, run.gram[rows, :p, :p], 1),
            np.tensordot(weights, run.gram[rows, p:, :p], 1),
            weights @ np.diagonal(run.gram, axis1=1, axis2=2)[rows, p:],
        ),
        QuadraticForm(scores[:, :p].T @ scores[:, :p], scores[:, p:].T @ scores[:, :p], np.sum(scores[:, p:] ** 2, 0)),
        float(np.sqrt(np.mean(run.noise[rows] / power))),
    )
