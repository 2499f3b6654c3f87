"""Limits of running safety: Y/Q of Nadal and Weinstock, sum of guiding forces, unloading of wheels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.vehicle.kernel_rows import effect_row
from railui.vehicle.model import FLANGE, Model

BASE_FORCE_LIMIT: Final = 10e3  # N, of the limit 10 kN + 2 Q_0/3 of the sum of guiding forces
FORCE_LIMIT_FACTORS: Final = {
    "goods": 0.85
}  # of that limit by use, 1 for passengers; not compared with the text of EN 14363
INSTABILITY_SHARE: Final = 0.5  # of the limit of the sum: that of its rms over 100 m
QUOTIENT_LIMIT: Final = 0.8  # Y/Q as mean over 2 m
UNLOADING_LIMIT: Final = 0.6  # (Q_0 - Q)/Q_0; that of the quasi-static test on twisted track, used here for dynamic Q
ASSUMED_FRICTION: Final = 0.36  # of Nadal's formula for a design whose creep is unbounded: Y/Q 1.2 at 70 degrees
CHORD: Final = 2e-3  # m over which the angle of a flange is measured: noise of measured profiles has no angle


def force_limit(wheel_load: Any, use: str = "") -> Any:
    """Return the limit [N] of the sum of guiding forces for static wheel loads Q_0 [N]: k (10 kN + 2 Q_0/3).

    k is 1, and 0.85 for the use "goods"; 2 Q_0 is the static load of the wheelset. The limit of track shift of
    Prud'homme, which EN 14363 adopted.

    >>> round(force_limit(54e3))
    46000
    """
    return FORCE_LIMIT_FACTORS.get(use, 1.0) * (BASE_FORCE_LIMIT + 2.0 * wheel_load / 3.0)


def nadal_limit(flange_angle: float, friction: float) -> float:
    """Return Nadal's limit of Y/Q of a flange at an angle [rad]: (tan g - mu)/(1 + mu tan g).

    References
    ----------
    M. J. Nadal, 1908; restated by B. Marquis, R. Greif, Application of Nadal limit to the prediction of wheel climb
    derailment, JRC2011-56064.

    >>> round(nadal_limit(np.radians(70.0), 0.36), 2)
    1.2
    """
    return float((np.tan(flange_angle) - friction) / (1.0 + friction * np.tan(flange_angle)))


def weinstock_limit(flange_angle: float, friction: float) -> float:
    """Return Weinstock's limit of the sum of abs(Y/Q) of both wheels of a wheelset: Nadal's limit plus mu.

    The wheel that does not flange transmits at most mu Q. Source: H. Weinstock, ASME 84-WA/RT-1, 1984, after the
    literature: the paper itself was not available.

    >>> round(weinstock_limit(np.radians(70.0), 0.36), 2)
    1.56
    """
    return nadal_limit(flange_angle, friction) + friction


def flange_angle(y: FloatArray, h: FloatArray) -> float:
    """Return the greatest angle [rad] of a flange from its tip outward: y across, h up [m], shape [n].

    Of chords of 2 mm, so that the noise of a measured profile does not count.

    >>> y = np.array([-0.05, -0.04, -0.03, 0.0])
    >>> round(float(np.degrees(flange_angle(y, np.array([-0.028, -0.028, -0.001, 0.0])))), 1)  # 27 mm on 10 mm
    69.7
    """
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(h)))])
    begin = np.arange(0.0, arc[-1] - CHORD, 0.1 * CHORD)
    across, up = (np.interp(begin + CHORD, arc, x) - np.interp(begin, arc, x) for x in (y, h))
    return float(np.max(np.arctan2(up, across)))


@dataclass(frozen=True)
class SafetyLimits:
    """Limits of running safety of a vehicle, and the properties of its model on which their meaning depends.

    Attributes
    ----------
    quotient : float
        Y/Q: the smaller of 0.8 and Nadal's limit.
    nadal, weinstock : float or None
        None if the flange angle is unknown.
    flange_angle : float or None
        Of the wheel profile [rad]; None without profiles.
    friction : float
        Coefficient of friction of Nadal's formula, see `friction_of`.
    has_flange : bool
        The design has an effect flange_contact.
    has_load_transfer : bool
        Roll and cant change the wheel loads.
    """

    quotient: float
    nadal: float | None
    weinstock: float | None
    flange_angle: float | None
    friction: float
    has_flange: bool
    has_load_transfer: bool

    @classmethod
    def of(cls, model: Model) -> SafetyLimits:
        """Return the limits of a vehicle."""
        angle, friction = flange_angle_of(model), friction_of(model)
        mu = ASSUMED_FRICTION if friction is None else friction
        nadal = None if angle is None else nadal_limit(angle, mu)
        return cls(
            quotient=QUOTIENT_LIMIT if nadal is None else min(QUOTIENT_LIMIT, nadal),
            nadal=nadal,
            weinstock=None if angle is None else weinstock_limit(angle, mu),
            flange_angle=angle,
            friction=mu,
            has_flange=bool(_flanges(model)),
            has_load_transfer=model.design.structure is not None,
        )

    @property
    def is_indication(self) -> bool:
        """True if Y/Q is an indication only, since wheel loads are static or no flange limits the displacement."""
        return not (self.has_flange and self.has_load_transfer)


def friction_of(model: Model) -> float | None:
    """Return the largest coefficient of friction of the flanges, else of the creep laws; None if there is none."""
    return max((flange.friction for flange in _flanges(model) if flange.friction), default=creep_friction_of(model))


def creep_friction_of(model: Model) -> float | None:
    """Return the largest coefficient of friction of the creep laws at the contacts; None if the creep is unbounded."""
    values = [e.parameters.get("friction") for e in model.effects if e.at == "contact" and e.kind != FLANGE]
    return max((float(value) for value in values if isinstance(value, float)), default=None)


class _Flange(NamedTuple):
    """Numbers of a flange_contact, its friction 0 unless the design gives one."""

    clearance: float
    stiffness: float
    friction: float
    depth: float
    angle: float


def _flanges(model: Model) -> list[_Flange]:
    return [_Flange(*effect_row(effect)) for effect in model.effects if effect.kind == FLANGE]


def flange_angle_of(model: Model) -> float | None:
    """Return the flange angle [rad] of the wheel profile, else of the flange with friction that is least inclined.

    None without both, or if the files of the profiles are missing.
    """
    profiles = model.design.profiles
    if profiles is None or profiles.sha256 is None:
        return min((flange.angle for flange in _flanges(model) if flange.friction), default=None)
    try:
        curve = profiles.geometry(model.design.values).pair.wheel_curve
    except (OSError, ValueError):  # the files changed since the design was read
        return None
    return flange_angle(curve.y, curve.h)
