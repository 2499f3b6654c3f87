"""Level and trend of every vehicle and quantity, updated block after block.

With the state x = (a, b), h = (1, m) and a value y of variance r, the gain is K = P h / (h'P h + r), the next state
x + K (y - h'x), and its covariance P - K h'P: R. E. Kalman, J. Basic Eng. 82 (1960) 35.
The state itself does not change.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Levels:
    """State of the filters: level a and trend b over the use, a + b m.

    Attributes
    ----------
    a, b
        [v, q].
    aa, ab, bb
        Their variances and covariance [v, q].
    """

    a: FloatArray
    b: FloatArray
    aa: FloatArray
    ab: FloatArray
    bb: FloatArray

    def predict(self, use: FloatArray) -> FloatArray:
        """Values at uses [v, q]."""
        return self.a + self.b * use

    def variance(self, use: FloatArray) -> FloatArray:
        """Variance of the prediction."""
        return np.maximum(self.aa + 2.0 * use * self.ab + use**2 * self.bb, 0.0)

    def update(self, use: FloatArray, value: FloatArray, variance: FloatArray, largest: float) -> Levels:
        """Update by the values of a block; NaN: none. Innovations count up to so many standard deviations."""
        known = np.isfinite(value)
        total = self.variance(use) + np.where(known, variance, 1.0)
        bound = largest * np.sqrt(total)
        innovation = np.where(known, np.clip(value - self.predict(use), -bound, bound), 0.0)
        gain_a = np.where(known, (self.aa + use * self.ab) / total, 0.0)
        gain_b = np.where(known, (self.ab + use * self.bb) / total, 0.0)
        row_a, row_b = self.aa + use * self.ab, self.ab + use * self.bb
        return Levels(
            self.a + gain_a * innovation,
            self.b + gain_b * innovation,
            self.aa - gain_a * row_a,
            self.ab - gain_a * row_b,
            self.bb - gain_b * row_b,
        )

    def wandered(self, variance: FloatArray) -> Levels:
        """Return the levels a block later, after a random walk of a variance [q]."""
        return Levels(self.a, self.b, self.aa + variance, self.ab, self.bb)

    def reset(self, which: NDArray[np.bool_], prior: Levels) -> Levels:
        """Return the prior for some vehicles and quantities [v, q]."""
        return Levels(
            *(np.where(which, getattr(prior, name), getattr(self, name)) for name in ("a", "b", "aa", "ab", "bb"))
        )
