"""The keys of what ride, stability and curve tell: what a study may aim at."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Result:
    """One key: which question answers it, its unit, and how many numbers it is.

    `many`: a list, of which the largest magnitude counts. `word`: no number, nothing to aim at.
    """

    key: str
    question: str
    unit: str = "1"
    many: bool = False
    word: bool = False


RESULTS: dict[str, Result] = {
    r.key: r
    for r in (
        Result("score", "ride"),
        Result("class", "ride", word=True),
        Result("decided_by", "ride", word=True),
        Result("comfort_hours", "ride", "h"),
        Result("comfort_clipped", "ride", word=True),
        Result("comfort_point", "ride", word=True),
        Result("weighted_acceleration", "ride", "m/s^2"),
        Result("weighted_acceleration_1974", "ride", "m/s^2"),
        Result("flange_fraction", "ride"),
        Result("flange_fractions", "ride", many=True),
        Result("flange_fraction_gaussian", "ride"),
        Result("flange_margin", "ride"),
        Result("n_mv", "ride"),
        Result("wz", "ride"),
        Result("linear_critical_speed", "stability", "m/s"),
        Result("linear_critical_frequency", "stability", "Hz"),
        Result("linear_damping", "stability"),
        Result("klingel_wavelength", "stability", "m"),
        Result("fold_speed", "stability", "m/s"),
        Result("practical_critical_speed", "stability", "m/s"),
        Result("modes", "stability", word=True),
        Result("displacement", "curve", "m", many=True),
        Result("angle_of_attack", "curve", "rad", many=True),
        Result("guiding_force", "curve", "N", many=True),
        Result("wear_number", "curve", "N"),
    )
}
# what may be aimed at
NUMBERS = tuple(r.key for r in RESULTS.values() if not r.word)
