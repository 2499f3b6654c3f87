"""Keys of the results of ride, stability and curve that a study may use as objectives and constraints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from railui.io.units import UnitError
from railui.running_stability.summary import DEFAULT_SPEEDS

MAX_SPEED: Final = DEFAULT_SPEEDS[-1]  # m/s, upper end of the search, which counts where there is none below
CRITICAL_SPEEDS: Final = ("linear_critical_speed", "rest_critical_speed", "fold_speed", "practical_critical_speed")


@dataclass(frozen=True)
class ResponseKey:
    """Key of a result.

    Attributes
    ----------
    key : str
        Name in the JSON result of the analysis.
    analysis : str
        Analysis that computes it: ride, stability or curve.
    unit : str
        SI unit.
    is_list : bool
        The result is a list; a study uses its largest magnitude.
    is_text : bool
        The result is not a number; a study cannot use it.
    """

    key: str
    analysis: str
    unit: str = "1"
    is_list: bool = False
    is_text: bool = False


RESPONSE_KEYS: dict[str, ResponseKey] = {
    r.key: r
    for r in (
        ResponseKey("score", "ride"),
        ResponseKey("class", "ride", is_text=True),
        ResponseKey("decided_by", "ride", is_text=True),
        ResponseKey("comfort_hours", "ride", "h"),
        ResponseKey("comfort_clipped", "ride", is_text=True),
        ResponseKey("comfort_point", "ride", is_text=True),
        ResponseKey("weighted_acceleration", "ride", "m/s^2"),
        ResponseKey("weighted_acceleration_1974", "ride", "m/s^2"),
        ResponseKey("flange_fraction", "ride"),
        ResponseKey("flange_fractions", "ride", is_list=True),
        ResponseKey("flange_fraction_gaussian", "ride"),
        ResponseKey("flange_margin", "ride"),
        ResponseKey("n_mv", "ride"),
        ResponseKey("wz", "ride"),
        ResponseKey("largest_sum_of_guiding_forces", "ride", "N"),
        ResponseKey("largest_derailment_quotient", "ride"),
        ResponseKey("largest_rms_100m", "ride", "N"),
        ResponseKey("largest_wheel_unloading", "ride"),
        ResponseKey("safety_share", "ride"),
        ResponseKey("linear_critical_speed", "stability", "m/s"),
        ResponseKey("linear_critical_frequency", "stability", "Hz"),
        ResponseKey("rest_critical_speed", "stability", "m/s"),
        ResponseKey("linear_damping", "stability"),
        ResponseKey("klingel_wavelength", "stability", "m"),
        ResponseKey("fold_speed", "stability", "m/s"),
        ResponseKey("practical_critical_speed", "stability", "m/s"),
        ResponseKey("modes", "stability", is_text=True),
        ResponseKey("displacement", "curve", "m", is_list=True),
        ResponseKey("angle_of_attack", "curve", "rad", is_list=True),
        ResponseKey("guiding_force", "curve", "N", is_list=True),
        ResponseKey("wear_number", "curve", "N"),
    )
}
NUMERIC_KEYS = tuple(r.key for r in RESPONSE_KEYS.values() if not r.is_text)


def check_bound(key: str, bound: float) -> None:
    """Raise UnitError for a bound of a critical speed that no search reaches."""
    if key in CRITICAL_SPEEDS and bound >= MAX_SPEED:
        message = f"{key} is searched up to {MAX_SPEED:g} m/s, so that no vehicle exceeds a bound of {bound:g} m/s"
        raise UnitError(message, f"give less than {MAX_SPEED:g} m/s, or bound linear_damping at the higher speed")
