"""Summary of a run: everything that the statistics of a fleet need of it, without its samples."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from railui.arrays import FloatArray

NAMES = ("paths", "directions", "channels")
NUMBERS = ("variance", "samples", "speed", "start", "seconds")


@dataclass(frozen=True, eq=False)
class RunSummary:
    """Products of the residual of a run, the sensitivities to p parameters and the output differences of k effects.

    Attributes
    ----------
    paths, directions
        Names of the parameters [p] and of the effects [k].
    channels
        Measured channels [c].
    x
        Parameters [p] at which the run is linearised: its own estimate.
    gram
        Inner products [1 + p + k, 1 + p + k] of the residual, the sensitivities and the differences per amount.
    estimate, sd
        Estimates and standard deviations [p + k]: of the parameters without any effect, and of the amount of every
        effect after projecting the parameters out.
    determined
        Share [p + k] of the prior variance of a parameter that the run removes; of an effect the share of its squared
        length that the parameters leave.
    errors
        Error over the error expected from noise [c].
    variance
        Squared weighted residual per independent sample.
    samples
        Compared samples.
    speed, start
        Mean speed [m/s] and distance [m] of the first sample; NaN on a rig.
    seconds
        Duration of the part that was used [s].
    """

    paths: tuple[str, ...]
    directions: tuple[str, ...]
    channels: tuple[str, ...]
    x: FloatArray
    gram: FloatArray
    estimate: FloatArray
    sd: FloatArray
    determined: FloatArray
    errors: FloatArray
    variance: float
    samples: float
    speed: float
    start: float
    seconds: float
    section: str = ""

    def arrays(self) -> dict[str, Any]:
        """Return the fields as arrays, for the store."""
        return {f.name: np.asarray(getattr(self, f.name)) for f in fields(self)}

    @classmethod
    def of_arrays(cls, arrays: dict[str, Any]) -> RunSummary:
        """Return the summary of stored arrays."""
        read = {f.name: arrays[f.name] for f in fields(cls)}
        read |= {name: tuple(arrays[name].tolist()) for name in NAMES}
        read |= {name: float(arrays[name]) for name in NUMBERS}
        return cls(**read | {"section": str(arrays["section"])})
