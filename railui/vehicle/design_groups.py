"""Groups of a design: settings of the ride quality assessment, parameter estimation."""

from __future__ import annotations

from dataclasses import dataclass


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
    """

    campaign: str
    sha256: str
    names: tuple[str, ...]
    covariance: tuple[tuple[float, ...], ...]
    samples: tuple[tuple[float, ...], ...] = ()
