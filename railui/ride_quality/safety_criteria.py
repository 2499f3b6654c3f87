"""Criteria of running safety: the largest value of each quantity of a ride, with its limit and place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.ride_quality.guiding_forces import MEAN_LENGTH, GuidingForces
from railui.ride_quality.safety_limits import INSTABILITY_SHARE, UNLOADING_LIMIT, SafetyLimits

WHEELS: Final = ("right", "left")
DANGEROUS, NOT_ADMISSIBLE = "dangerous", "not admissible"


@dataclass(frozen=True)
class Criterion:
    """Largest value of a quantity of running safety with its limit.

    Attributes
    ----------
    key : str
    value : float
    limit : float or None
        None if it is unknown.
    place : str
        Wheelset and wheel.
    at : float
        Distance along the track [m].
    consequence : str
        Best class of a ride that exceeds the limit.
    text : str
        Quantity, value and limit in words.
    """

    key: str
    value: float
    limit: float | None
    place: str
    at: float
    consequence: str
    text: str

    @property
    def is_exceeded(self) -> bool:
        """True for a value above its limit."""
        return self.limit is not None and self.value > self.limit

    @property
    def share(self) -> float | None:
        """Value over limit."""
        return self.value / self.limit if self.limit else None

    @property
    def finding(self) -> tuple[str, str]:
        """Best class of a ride that exceeds the limit, and the reason in words."""
        return self.consequence, f"{self.text} ({self.place}, at {self.at:.4g} m)"

    def as_dict(self) -> dict[str, Any]:
        """Return the criterion as an item of the JSON result."""
        return {
            "criterion": self.key,
            "value": self.value,
            "limit": self.limit,
            "share": self.share,
            "exceeded": self.is_exceeded,
            "place": self.place,
            "at": self.at,
        }


def criteria_of(forces: GuidingForces, limits: SafetyLimits, s: FloatArray, first: int = 0) -> list[Criterion]:
    """Return the criteria of a ride, or of a section of it that begins at sample `first` of the track s [sample] m.

    The largest 2 m mean counts, not a percentile, in which one place of a long ride would vanish.
    """
    half = round(0.5 * MEAN_LENGTH / float(s[1] - s[0]))

    def worst(
        x: FloatArray, limit: FloatArray | float, samples: NDArray[np.int64] | None = None
    ) -> tuple[float, float, str, float]:
        """Return the value nearest to its limit, the limit, its wheelset and wheel, and its distance [m].

        samples: of the track, by location; by default the middles of means over 2 m.
        """
        limits = np.broadcast_to(np.asarray(limit), x.shape)
        index = np.unravel_index(int(np.nanargmax(x / limits)), x.shape)
        wheel = f", {WHEELS[index[1]]} wheel" if x.ndim == 3 else ""
        sample = first + int(index[-1]) + half if samples is None else int(samples[index[-1]])
        at = float(s[min(sample, len(s) - 1)])
        return float(x[index]), float(limits[index]), f"wheelset {index[0] + 1}{wheel}", at

    value, limit, place, at = worst(np.abs(forces.total), forces.limit[:, None])
    text = f"sum of guiding forces {value / 1e3:.3g} kN over 2 m, more than {limit / 1e3:.3g} kN"
    found = [Criterion("sum_of_guiding_forces", value, limit, place, at, NOT_ADMISSIBLE, text)]
    if forces.rms.size:
        value, limit, place, at = worst(forces.rms, INSTABILITY_SHARE * forces.limit[:, None], forces.centres)
        text = f"unstable: rms of the sum of guiding forces {value / 1e3:.3g} kN over 100 m, more than"
        text += f" {limit / 1e3:.3g} kN"
        found.append(Criterion("rms_100m", value, limit, place, at, NOT_ADMISSIBLE, text))
    found += _climbing(forces, limits, worst)
    if limits.has_load_transfer:
        value, limit, place, at = worst(forces.unloading, UNLOADING_LIMIT)
        text = f"a wheel is unloaded by {100 * value:.3g} % over 2 m, more than {100 * limit:.3g} %"
        found.append(Criterion("wheel_unloading", value, limit, place, at, NOT_ADMISSIBLE, text))
    if forces.is_lifted.any():
        _, _, place, at = worst(forces.is_lifted.astype(float), 1.0)
        share = float(forces.is_lifted.mean(axis=-1).max())
        found.append(Criterion("wheel_lift", share, 0.0, place, at, DANGEROUS, "a wheel lifts off the rail"))
    return found


Worst = Callable[[FloatArray, FloatArray | float], tuple[float, float, str, float]]


def _climbing(forces: GuidingForces, limits: SafetyLimits, worst: Worst) -> list[Criterion]:
    """Return the criteria of flange climbing: Y/Q of a wheel, and of both wheels of a wheelset after Weinstock."""
    if not np.isfinite(forces.quotient).any():
        return []
    consequence = NOT_ADMISSIBLE if limits.is_indication else DANGEROUS
    kind = ", an indication for this model" if limits.is_indication else ""
    value, limit, place, at = worst(forces.quotient, limits.quotient)
    text = f"Y/Q {value:.3g} over 2 m, more than {limit:.3g}{kind}"
    found = [Criterion("derailment_quotient", value, limit, place, at, consequence, text)]
    sums = np.abs(forces.quotient).sum(axis=1)
    if np.isfinite(sums).any():
        value, _, place, at = worst(sums, 1.0)
        bound = limits.weinstock
        text = f"sum of abs(Y/Q) of a wheelset {value:.3g} over 2 m, more than {bound or 0.0:.3g} of Weinstock{kind}"
        found.append(Criterion("weinstock", value, bound, place, at, consequence, text))
    return found
