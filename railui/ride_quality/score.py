"""Score and class of a ride from its statistics, with the reason for the class."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import NoResultError
from railui.ride_quality.comfort import (
    DAY,
    HOUR,
    MIN_BLOCKS,
    comfort_index,
    comfort_time,
    goods_index,
    is_comfort_time_clipped,
    n_mv,
    sperling_wz,
)
from railui.ride_quality.guidance import flange_margin, guidance_index, log_flange_fraction_gaussian

CLASSES: Final = ("dangerous", "not admissible", "just admissible", "satisfactory", "good", "very good")
CLASS_THRESHOLDS: Final = (20.0, 40.0, 60.0, 80.0)  # lowest scores of the classes above "not admissible"
SATISFACTORY: Final = CLASSES.index("satisfactory")
NOT_ADMISSIBLE: Final = CLASSES.index("not admissible")
DANGEROUS: Final = CLASSES.index("dangerous")
DANGEROUS_FLANGE_FRACTION: Final = 0.5  # share of the time with flange contact
NON_GAUSSIAN_RATIO: Final = 10.0  # of counted to Gaussian share of flange contact, from which a note reports it
FRAME_FLOOR: Final = "frame centre through the floor transfer"
SCORE_KEYS: Final = (
    *("score", "class", "decided_by", "comfort_hours", "comfort_clipped", "comfort_point"),
    *("weighted_acceleration", "weighted_acceleration_1974", "flange_fraction", "flange_fractions"),
    *("flange_fraction_gaussian", "flange_margin", "n_mv", "wz"),
)


class ScoreSettings(Protocol):
    """Use of the train, `journey` [s]; goods also have `rms_limit` and may have `peak_limit` [m/s^2], no defaults."""

    @property
    def use(self) -> str: ...
    @property
    def journey(self) -> float: ...
    @property
    def comfort_weight(self) -> float: ...
    @property
    def admissible_flange_fraction(self) -> float: ...


def score_many(statistics: Mapping[str, Any], riding: ScoreSettings, clearance: float) -> dict[str, FloatArray]:
    """Compute the smooth measures of n rides at once, as a search needs them.

    Parameters
    ----------
    statistics : mapping
        `mean_e`, `sd_e` [n, wheelset] in m, `flange_fractions` [n, wheelset], `weighted_acceleration` and
        `weighted_acceleration_1974` [n] in m/s^2; for goods `acceleration` and, with a peak limit,
        `acceleration_peak` [n] in m/s^2; `diverged` [n], by default none.
    riding : ScoreSettings
        Use of the train.
    clearance : float
        Flange clearance [m].

    Returns
    -------
    dict of FloatArray
        Arrays [n]. A ride that diverged or has a value that is not finite has score 0, comfort time 1 min,
        acceleration inf, margin -inf, fractions 1.

    Raises
    ------
    ValueError
        For settings out of range.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> use = dict(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
    >>> ride = dict(mean_e=[[0, 0]], sd_e=[[0.002, 0.001]], flange_fractions=[[0.001, 0.0]],
    ...             weighted_acceleration=[0.15], weighted_acceleration_1974=[0.2])
    >>> measures = score_many(ride, SimpleNamespace(**use), 0.007)
    >>> [round(float(measures[key][0]), 4) for key in ("score", "comfort", "guidance", "flange_margin")]
    [51.3015, 0.6341, 0.4323, 3.5]
    """
    if not 0 <= riding.comfort_weight <= 1:
        raise ValueError(f"comfort_weight must lie between 0 and 1: {riding.comfort_weight:g}")
    if not clearance > 0:
        raise NoResultError(f"the flange clearance must be positive: {clearance:g} m")
    wheelsets = {name: np.asarray(statistics[name], np.float64) for name in ("mean_e", "sd_e", "flange_fractions")}
    scalars = {name: np.asarray(statistics[name], np.float64) for name in _scalar_statistics(statistics)}
    diverged = _diverged(statistics, wheelsets, scalars)

    def valid(values: FloatArray, otherwise: float) -> FloatArray:
        return np.where(diverged, otherwise, values)

    with np.errstate(invalid="ignore"):
        m, sd = np.abs(wheelsets["mean_e"]), wheelsets["sd_e"]
        margin = flange_margin(m, sd, clearance)
        log_fraction = valid(np.max(log_flange_fraction_gaussian(m, sd, clearance), axis=-1), 0.0)
        rms = valid(scalars["weighted_acceleration_1974"], np.inf)
        time = comfort_time(rms)
        comfort = comfort_index(time) if riding.use != "goods" else _goods_index(scalars, riding)
        comfort = valid(comfort, 0.0)
    guidance = guidance_index(log_fraction, riding.admissible_flange_fraction)
    weight = riding.comfort_weight
    return {
        "score": valid(100 * (weight * comfort + (1 - weight) * guidance), 0.0),
        "comfort": comfort,
        "guidance": valid(guidance, 0.0),
        "comfort_hours": time / HOUR,
        "weighted_acceleration": valid(scalars["weighted_acceleration"], np.inf),
        "weighted_acceleration_1974": rms,
        "flange_fraction": valid(np.max(wheelsets["flange_fractions"], axis=-1), 1.0),
        "flange_fraction_gaussian": np.exp(log_fraction),
        "flange_margin": valid(margin, -np.inf),
        "diverged": diverged.astype(np.float64),
    }


def _scalar_statistics(statistics: Mapping[str, Any]) -> list[str]:
    """Return the names of the scalar statistics of a score, with those of goods if they are given."""
    goods = [name for name in ("acceleration", "acceleration_peak") if statistics.get(name) is not None]
    return ["weighted_acceleration", "weighted_acceleration_1974", *goods]


def _diverged(
    statistics: Mapping[str, Any], wheelsets: Mapping[str, FloatArray], scalars: Mapping[str, FloatArray]
) -> NDArray[np.bool_]:
    """Return True for rides that diverged or have a value that is not finite."""
    diverged = np.asarray(statistics.get("diverged", False), dtype=bool)
    for values in wheelsets.values():
        diverged = diverged | ~np.all(np.isfinite(values), axis=-1)
    for values in scalars.values():
        diverged = diverged | ~np.isfinite(values)
    return diverged


def _goods_index(scalars: Mapping[str, FloatArray], riding: ScoreSettings) -> FloatArray:
    limit = getattr(riding, "rms_limit", None)
    if limit is None or "acceleration" not in scalars:
        raise ValueError("use: goods needs riding.rms_limit [m/s^2], which has no default, and the rms acceleration")
    peak_limit = getattr(riding, "peak_limit", None)
    return goods_index(scalars["acceleration"], scalars.get("acceleration_peak"), limit, peak_limit)


def classify(
    score: float,
    time: float,
    fraction: float,
    riding: ScoreSettings,
    parts: tuple[float, float] | None = None,
    findings: Sequence[tuple[str, str]] = (),
) -> tuple[str, str]:
    """Return the class of a ride and a sentence with the reason for it.

    A limit decides only if it lowers the class that follows from the score.

    Parameters
    ----------
    score, time, fraction : float
        Score, 0 to 100; comfort time [s]; share of flange contact.
    riding : ScoreSettings
        Use of the train.
    parts : tuple of float, optional
        Comfort and guidance index, for the reason.
    findings : sequence of tuple
        Exceeded limits of running safety and of other kinds: best class that they admit, and the reason.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> use = dict(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
    >>> classify(85.0, 1800.0, 0.0, SimpleNamespace(**use))
    ('satisfactory', 'reduced comfort after 0.5 h, within the journey of 1 h')
    """
    is_goods = riding.use == "goods"
    above = sum(score >= threshold for threshold in CLASS_THRESHOLDS)
    reasons = [(NOT_ADMISSIBLE + above, _score_reason(score, parts, is_goods))]
    if not is_goods and time < riding.journey:
        after = f"reduced comfort after {time / HOUR:.3g} h, within"
        reasons.append((SATISFACTORY, f"{after} the journey of {riding.journey / HOUR:.3g} h"))
        if time < riding.journey / 10:
            reasons.append((NOT_ADMISSIBLE, f"{after} a tenth of the journey of {riding.journey / HOUR:.3g} h"))
    contact = f"flange contact for {100 * fraction:.3g} % of the time, more than"
    if fraction > riding.admissible_flange_fraction:
        reasons.append((NOT_ADMISSIBLE, f"{contact} the admissible {100 * riding.admissible_flange_fraction:.3g} %"))
    if fraction > DANGEROUS_FLANGE_FRACTION:
        reasons.append((DANGEROUS, f"{contact} half"))
    reasons += [(CLASSES.index(name), finding) for name, finding in findings]
    rank, reason = min(reasons, key=lambda each: each[0])  # the first of equals: the score before a limit
    return CLASSES[rank], reason


def _score_reason(score: float, parts: tuple[float, float] | None, is_goods: bool) -> str:
    if parts is None:
        return f"score {score:.1f}"
    first = "load" if is_goods else "comfort"
    both = f"{first} {parts[0]:.2f}, guidance {parts[1]:.2f}"
    weaker = first if parts[0] < parts[1] else "guidance"
    return f"score {score:.1f}: {both}" + ("" if score >= CLASS_THRESHOLDS[-1] else f", the weaker is {weaker}")


def evaluate_ride(
    statistics: Mapping[str, Any],
    riding: ScoreSettings,
    clearance: float,
    findings: Sequence[tuple[str, str]] = (),
) -> dict[str, Any]:
    """Evaluate one ride: floats, strings, lists, or None where a value is undefined (never NaN).

    Parameters
    ----------
    statistics : mapping
        As for `score_many` with one ride ([wheelset] and scalars). May also contain `wz` (rms [m/s^2] of the
        acceleration weighted with B), `block_rms` [block] (W_d rms of consecutive 5 s), and `comfort_point` (its name).
    riding, clearance
        As for `score_many`.
    findings : sequence of tuple
        As for `classify`.

    Returns
    -------
    dict
        `SCORE_KEYS` and `notes`, the reasons for values that are None or clipped. A ride that diverged is dangerous,
        with score 0 and None for the other values.

    Raises
    ------
    ValueError
        For settings out of range.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> use = dict(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
    >>> ride = dict(mean_e=[0, 0], sd_e=[0.002, 0.001], flange_fractions=[0.001, 0.0], wz=0.2,
    ...             weighted_acceleration=0.15, weighted_acceleration_1974=0.2)
    >>> result = evaluate_ride(ride, SimpleNamespace(**use), 0.007)
    >>> result["class"], result["decided_by"]
    ('satisfactory', 'score 51.3: comfort 0.63, guidance 0.43, the weaker is guidance')
    """
    measures = {name: float(value) for name, value in score_many(statistics, riding, clearance).items()}
    point = str(statistics.get("comfort_point", FRAME_FLOOR))
    if measures["diverged"]:
        return dict.fromkeys(SCORE_KEYS) | {
            "score": 0.0,
            "class": CLASSES[DANGEROUS],
            "decided_by": "the vehicle left the track: motion beyond any bound",
            "comfort_point": point,
            "notes": ["no statistics: the ride diverged"],
        }
    rms, time = measures["weighted_acceleration_1974"], measures["comfort_hours"] * HOUR
    blocks = np.asarray(statistics.get("block_rms", ()))
    wz = float(sperling_wz(statistics.get("wz", np.nan)))
    parts = (measures["comfort"], measures["guidance"])
    name, reason = classify(measures["score"], time, measures["flange_fraction"], riding, parts, findings)
    result: dict[str, Any] = {
        "score": measures["score"],
        "class": name,
        "decided_by": reason,
        "comfort_hours": measures["comfort_hours"],
        "comfort_clipped": bool(is_comfort_time_clipped(rms)),
        "comfort_point": point,
        "weighted_acceleration": measures["weighted_acceleration"],
        "weighted_acceleration_1974": rms,
        "flange_fraction": measures["flange_fraction"],
        "flange_fractions": [float(share) for share in np.asarray(statistics["flange_fractions"])],
        "flange_fraction_gaussian": measures["flange_fraction_gaussian"],
        "flange_margin": _finite(measures["flange_margin"]),
        "n_mv": n_mv(blocks),
        "wz": _finite(wz),
    }
    return result | {"notes": _notes(result, time, blocks.size)}


def _notes(result: Mapping[str, Any], time: float, blocks: int) -> list[str]:
    """Return the reasons for values that are None, clipped or partial."""
    end = "24 h" if time >= DAY / 2 else "1 min"
    counted, gaussian = result["flange_fraction"], result["flange_fraction_gaussian"]
    notes = [
        (result["comfort_clipped"], f"comfort_hours: clipped to {end}, the end of the table"),
        (result["flange_margin"] is None, "flange_margin: null, a wheelset does not move against the rails"),
        (result["n_mv"] is None, f"n_mv: null, {blocks} blocks of 5 s are fewer than {MIN_BLOCKS}"),
        (result["n_mv"] is not None, "n_mv: the lateral part only, EN 12299 adds the other axes"),
        (result["wz"] is None, "wz: null, no acceleration weighted with B"),
        (
            counted > NON_GAUSSIAN_RATIO * gaussian,
            f"flange_fraction_gaussian: {gaussian:.2g} where {counted:.2g} is counted: e is not Gaussian",
        ),
    ]
    return [text for applies, text in notes if applies]


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
