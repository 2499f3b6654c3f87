"""Riding quality: score and class of a ride from its statistics, and what decided them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Protocol

import numpy as np

from railui.arrays import FloatArray
from railui.ride_quality.comfort import (
    DAY,
    FEWEST_BLOCKS,
    HOUR,
    comfort_clipped,
    comfort_part,
    comfort_time,
    goods_part,
    n_mv,
    ride_value,
)
from railui.ride_quality.guidance import guidance_part, log_flange_fraction_gaussian

CLASSES: Final = ("dangerous", "not admissible", "just admissible", "satisfactory", "good", "very good")
THRESHOLDS: Final = (20.0, 40.0, 60.0, 80.0)  # score from which the classes above "not admissible" begin
DANGEROUS_SHARE: Final = 0.5  # of the time with flange contact
DANGEROUS_QUOTIENT: Final = 0.8  # Y/Q over 2 m
FLOOR_OF_FRAME: Final = "frame centre through the floor transfer"
SCORE_KEYS: Final = (
    *("score", "class", "decided_by", "comfort_hours", "comfort_clipped", "comfort_point"),
    *("weighted_acceleration", "weighted_acceleration_1974", "flange_fraction", "flange_fractions"),
    *("flange_fraction_gaussian", "flange_margin", "n_mv", "wz"),
)


class Riding(Protocol):
    """The use of the train: what a score weighs. `journey` [s].

    A goods train also has `rms_limit` and may have `peak_limit` [m/s^2], neither of which has a default.
    """

    @property
    def use(self) -> str: ...
    @property
    def journey(self) -> float: ...
    @property
    def comfort_weight(self) -> float: ...
    @property
    def admissible_flange_fraction(self) -> float: ...


def score_many(statistics: Mapping[str, Any], riding: Riding, clearance: float) -> dict[str, FloatArray]:
    """The smooth measures of n rides at once, arrays [n] for a search; `clearance` [m] of the flange.

    statistics: `mean_e`, `sd_e` [n, 2] in m, `flange_fractions` [n, 2], `weighted_acceleration` and
    `weighted_acceleration_1974` [n] in m/s^2; for goods `acceleration` and, with a peak limit,
    `acceleration_peak` [n] in m/s^2; `diverged` [n], where absent none. A ride that diverged, or with a
    value that is not finite, has score 0, comfort 1 min, acceleration inf, margin -inf, fractions 1. Raises
    ValueError for settings out of range.

    >>> from types import SimpleNamespace
    >>> use = dict(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
    >>> ride = dict(mean_e=[[0, 0]], sd_e=[[0.002, 0.001]], flange_fractions=[[0.001, 0.0]],
    ...             weighted_acceleration=[0.15], weighted_acceleration_1974=[0.2])
    >>> found = score_many(ride, SimpleNamespace(**use), 0.007)
    >>> [round(float(found[key][0]), 4) for key in ("score", "comfort", "guidance", "flange_margin")]
    [51.3015, 0.6341, 0.4323, 3.5]
    """
    if not 0 <= riding.comfort_weight <= 1:
        raise ValueError(f"comfort_weight must lie between 0 and 1: {riding.comfort_weight:g}")
    if not clearance > 0:
        raise ValueError(f"the flange clearance must be positive: {clearance:g} m")
    wheelsets = {name: np.asarray(statistics[name], np.float64) for name in ("mean_e", "sd_e", "flange_fractions")}
    scalars = {name: np.asarray(statistics[name], np.float64) for name in _single(statistics)}
    lost = np.asarray(statistics.get("diverged", False), dtype=bool)
    for pair in wheelsets.values():
        lost = lost | ~np.all(np.isfinite(pair), axis=-1)
    for single in scalars.values():
        lost = lost | ~np.isfinite(single)

    def kept(values: FloatArray, otherwise: float) -> FloatArray:
        return np.where(lost, otherwise, values)

    with np.errstate(invalid="ignore", divide="ignore"):
        m, sd = np.abs(wheelsets["mean_e"]), wheelsets["sd_e"]
        room = clearance - m
        sure = np.where(room == 0, 0.0, np.copysign(np.inf, room))
        margin = np.min(np.where(sd > 0, room / np.where(sd > 0, sd, 1.0), sure), axis=-1)
        log_fraction = kept(np.max(log_flange_fraction_gaussian(m, sd, clearance), axis=-1), 0.0)
        rms = kept(scalars["weighted_acceleration_1974"], np.inf)
        time = comfort_time(rms)
        comfort = comfort_part(time) if riding.use != "goods" else _goods(scalars, riding)
        comfort = kept(comfort, 0.0)
    guidance = guidance_part(log_fraction, riding.admissible_flange_fraction)
    weight = riding.comfort_weight
    return {
        "score": kept(100 * (weight * comfort + (1 - weight) * guidance), 0.0),
        "comfort": comfort,
        "guidance": kept(guidance, 0.0),
        "comfort_hours": time / HOUR,
        "weighted_acceleration": kept(scalars["weighted_acceleration"], np.inf),
        "weighted_acceleration_1974": rms,
        "flange_fraction": kept(np.max(wheelsets["flange_fractions"], axis=-1), 1.0),
        "flange_fraction_gaussian": np.exp(log_fraction),
        "flange_margin": kept(margin, -np.inf),
        "diverged": lost.astype(np.float64),
    }


def _single(statistics: Mapping[str, Any]) -> list[str]:
    """The scalar statistics on which a score rests, those of goods where they are there."""
    goods = [name for name in ("acceleration", "acceleration_peak") if statistics.get(name) is not None]
    return ["weighted_acceleration", "weighted_acceleration_1974", *goods]


def _goods(scalars: Mapping[str, FloatArray], riding: Riding) -> FloatArray:
    limit = getattr(riding, "rms_limit", None)
    if limit is None or "acceleration" not in scalars:
        raise ValueError("use: goods needs riding.rms_limit [m/s^2], which has no default, and the rms acceleration")
    peak_limit = getattr(riding, "peak_limit", None)
    return goods_part(scalars["acceleration"], scalars.get("acceleration_peak"), limit, peak_limit)


def riding_class(
    score: float,
    time: float,
    fraction: float,
    riding: Riding,
    derailment_quotient: float | None = None,
    parts: tuple[float, float] | None = None,
) -> tuple[str, str]:
    """The class of a ride and a sentence that names what decided it.

    From the score (0 to 100), comfort time [s] and share of flange contact; `derailment_quotient` is the
    greatest Y/Q over 2 m where load transfer is modelled, `parts` comfort and guidance. A limit decides
    only where it lowers the class that the score gives.

    >>> from types import SimpleNamespace
    >>> use = dict(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
    >>> riding_class(85.0, 1800.0, 0.0, SimpleNamespace(**use))
    ('satisfactory', 'reduced comfort after 0.5 h, within the journey of 1 h')
    """
    goods = riding.use == "goods"
    found = [(1 + sum(score >= threshold for threshold in THRESHOLDS), _by_score(score, parts, goods))]
    if not goods and time < riding.journey:
        after = f"reduced comfort after {time / HOUR:.3g} h, within"
        found.append((3, f"{after} the journey of {riding.journey / HOUR:.3g} h"))
        if time < riding.journey / 10:
            found.append((1, f"{after} a tenth of the journey of {riding.journey / HOUR:.3g} h"))
    touching = f"flange contact for {100 * fraction:.3g} % of the time, more than"
    if fraction > riding.admissible_flange_fraction:
        found.append((1, f"{touching} the admissible {100 * riding.admissible_flange_fraction:.3g} %"))
    if fraction > DANGEROUS_SHARE:
        found.append((0, f"{touching} half"))
    if derailment_quotient is not None and derailment_quotient > DANGEROUS_QUOTIENT:
        found.append((0, f"Y/Q {derailment_quotient:.3g} over 2 m, more than {DANGEROUS_QUOTIENT:g}"))
    rank, reason = min(found, key=lambda one: one[0])  # the first of equals: the score before a limit
    return CLASSES[rank], reason


def _by_score(score: float, parts: tuple[float, float] | None, goods: bool) -> str:
    if parts is None:
        return f"score {score:.1f}"
    first = "load" if goods else "comfort"
    both = f"{first} {parts[0]:.2f}, guidance {parts[1]:.2f}"
    weaker = first if parts[0] < parts[1] else "guidance"
    return f"score {score:.1f}: {both}" + ("" if score >= THRESHOLDS[-1] else f", the weaker is {weaker}")


def riding_quality(statistics: Mapping[str, Any], riding: Riding, clearance: float) -> dict[str, Any]:
    """The riding quality of one ride: floats, strings, lists, or None where a value is undefined (never NaN).

    statistics as for `score_many` with one ride ([2] and scalars), and `wz` (the rms [m/s^2] of the
    acceleration weighted with B), `block_rms` [blocks] (W_d rms of consecutive 5 s), `comfort_point` (its
    name), `derailment_quotient` (greatest Y/Q over 2 m, only where load transfer is modelled): each may be
    absent. `clearance` [m] of the flange. A ride that diverged is dangerous, with score 0 and None for the
    rest. `notes` says why a value is None or clipped. Raises ValueError for settings out of range.

    >>> from types import SimpleNamespace
    >>> use = dict(use="local", journey=3600.0, comfort_weight=0.4, admissible_flange_fraction=0.05)
    >>> ride = dict(mean_e=[0, 0], sd_e=[0.002, 0.001], flange_fractions=[0.001, 0.0], wz=0.2,
    ...             weighted_acceleration=0.15, weighted_acceleration_1974=0.2)
    >>> found = riding_quality(ride, SimpleNamespace(**use), 0.007)
    >>> found["class"], found["decided_by"]
    ('satisfactory', 'score 51.3: comfort 0.63, guidance 0.43, the weaker is guidance')
    """
    one = {name: float(value) for name, value in score_many(statistics, riding, clearance).items()}
    point = str(statistics.get("comfort_point", FLOOR_OF_FRAME))
    if one["diverged"]:
        return {
            **dict.fromkeys(SCORE_KEYS),
            **{
                "score": 0.0,
                "class": CLASSES[0],
                "decided_by": "the vehicle left the track: motion beyond any bound",
            },
            **{"comfort_point": point, "notes": ["no statistics: the ride diverged"]},
        }
    rms, time = one["weighted_acceleration_1974"], one["comfort_hours"] * HOUR
    blocks = np.asarray(statistics.get("block_rms", ()), dtype=np.float64)
    sperling = statistics.get("wz")
    quotient = statistics.get("derailment_quotient")
    clipped = bool(comfort_clipped(rms))
    found: dict[str, Any] = {
        "score": one["score"],
        "comfort_hours": one["comfort_hours"],
        "comfort_clipped": clipped,
        "comfort_point": point,
        "weighted_acceleration": one["weighted_acceleration"],
        "weighted_acceleration_1974": rms,
        "flange_fraction": one["flange_fraction"],
        "flange_fractions": [float(share) for share in np.asarray(statistics["flange_fractions"])],
        "flange_fraction_gaussian": one["flange_fraction_gaussian"],
        "flange_margin": _finite(one["flange_margin"]),
        "n_mv": n_mv(blocks),
        "wz": None if sperling is None else _finite(float(ride_value(sperling))),
    }
    notes = [
        (
            clipped,
            f"comfort_hours: clipped to {'24 h' if time >= DAY / 2 else '1 min'}, the end of the table",
        ),
        (found["flange_margin"] is None, "flange_margin: null, a wheelset does not move against the rails"),
        (found["n_mv"] is None, f"n_mv: null, {blocks.size} blocks of 5 s are fewer than {FEWEST_BLOCKS}"),
        (found["n_mv"] is not None, "n_mv: the lateral part only, EN 12299 adds the other axes"),
        (found["wz"] is None, "wz: null, no acceleration weighted with B"),
    ]
    parts = (one["comfort"], one["guidance"])
    name, reason = riding_class(one["score"], time, one["flange_fraction"], riding, quotient, parts)
    found |= {"class": name, "decided_by": reason, "notes": [text for holds, text in notes if holds]}
    return {key: found[key] for key in (*SCORE_KEYS, "notes")}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
