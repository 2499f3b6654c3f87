"""Batches of vehicles, and filters and statistics of their simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core.alignment import kernel_array


@dataclass(frozen=True)
class Batch:
    """Vehicles of one structure, one per row; the kernel reads the attributes by name.

    Attributes
    ----------
    numbers : array [n, parameter]
    effects : array [n, number of effects]
        Numbers of all effects.
    amounts : array [n, effect]
        Factor of each effect.
    speed_scale : array [n] or None
        Speed of each vehicle relative to the excitation.
    initial : array [n, state] or None
        Initial states; zero for None.
    """

    numbers: FloatArray
    effects: FloatArray
    amounts: FloatArray
    speed_scale: FloatArray | None = None
    initial: FloatArray | None = None

    def __post_init__(self) -> None:
        for name, array in vars(self).items():
            if array is not None:
                object.__setattr__(self, name, kernel_array(array))

    @classmethod
    def from_arrays(
        cls, numbers: FloatArray, effects: FloatArray | None = None, amounts: FloatArray | None = None, **more: Any
    ) -> Batch:
        """Return a batch; `effects` and `amounts` are empty for vehicles without effects."""
        empty = np.zeros((len(numbers), 0))
        return cls(numbers, empty if effects is None else effects, empty if amounts is None else amounts, **more)

    def __len__(self) -> int:
        return len(self.numbers)

    def with_initial_states(self, initial: FloatArray | None) -> Batch:
        """Return the same vehicles with initial states [state] for all or [n, state]."""
        if initial is None:
            return replace(self, initial=None)
        return replace(self, initial=np.broadcast_to(initial, (len(self), initial.shape[-1])))

    def select(self, rows: Any) -> Batch:
        """Return the vehicles of an index, slice or mask."""
        return Batch(
            self.numbers[rows],
            self.effects[rows],
            self.amounts[rows],
            None if self.speed_scale is None else self.speed_scale[rows],
            None if self.initial is None else self.initial[rows],
        )


@dataclass(frozen=True)
class ZeroPhaseFilter:
    """Zero-phase band-pass filter of simulated series, with trimming and weighting.

    Attributes
    ----------
    sos : array [section, 6]
    zi : array [section, 2]
        Initial state of the sections for a unit step.
    padlen : int
        Samples of the odd extension at both ends.
    trim : int
        Samples removed at both ends.
    weights : array [channel]
    decimation : int
        Every n-th sample is retained.
    """

    sos: FloatArray
    zi: FloatArray
    padlen: int
    trim: int
    weights: FloatArray
    decimation: int = 1

    def output_length(self, samples: int) -> int:
        """Return the number of output samples."""
        return -(-max(samples - 2 * self.trim, 0) // self.decimation)

    def kernel_arguments(self) -> tuple[FloatArray, FloatArray, int, int, FloatArray, int]:
        """Return all attributes in the kernel's order."""
        sos, zi, weights = (kernel_array(array) for array in (self.sos, self.zi, self.weights))
        return (sos, zi, self.padlen, self.trim, weights, self.decimation)


@dataclass(frozen=True)
class RideStatistics:
    """Statistics of simulated vehicles.

    Attributes
    ----------
    displacement : array [n, wheelset, 3]
        Mean, standard deviation and proportion of flange contact.
    rms : array [n, acceleration, cascade]
    block_rms : array [n, acceleration, block]
    diverged : array [n]
        Sample at which a vehicle diverged, -1 if it did not.
    """

    displacement: FloatArray
    rms: FloatArray
    block_rms: FloatArray
    diverged: NDArray[np.int64]
