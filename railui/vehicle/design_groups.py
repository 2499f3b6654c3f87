"""Groups of a design: settings of the ride quality assessment, parameter estimation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class RidingSettings:
    """Use of the train and settings of its ride quality assessment (file group `riding`, SI)."""

    use: str
    journey: float
    comfort_weight: float
    admissible_flange_fraction: float
    floor_frequency: float
    floor_damping: float
    cushion_frequency: float | None = None
    cushion_damping: float | None = None
    rms_limit: float | None = None
    peak_limit: float | None = None


@dataclass(frozen=True)
class Adjustment:
    """Parameter estimation that produced a design.

    Attributes
    ----------
    campaign, sha256
        Name and hash of the campaign.
    names
        Paths of the estimated parameters.
    covariance
        Their covariance, row by row [SI].
    samples
        Deviations from the design's values [SI], a row per vehicle that reproduces the measured motions about as well.
    estimates
        Estimated values [SI]; empty where they are unknown.
    """

    campaign: str
    sha256: str
    names: tuple[str, ...]
    covariance: tuple[tuple[float, ...], ...]
    samples: tuple[tuple[float, ...], ...] = ()
    estimates: tuple[float, ...] = field(default=(), compare=False, repr=False)

    def restricted(self, numbers: Sequence[int]) -> Adjustment:
        """Return the adjustment of some of its parameters, by their numbers in `names`."""
        return replace(
            self,
            names=tuple(self.names[i] for i in numbers),
            covariance=tuple(tuple(self.covariance[i][j] for j in numbers) for i in numbers),
            samples=tuple(tuple(row[i] for i in numbers) for row in self.samples),
            estimates=tuple(self.estimates[i] for i in numbers) if self.estimates else (),
        )
