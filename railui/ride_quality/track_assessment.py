"""A track judged by what a standard vehicle does on it: stretch by stretch, worst first."""

from __future__ import annotations

import re
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import sosfilt
from railui.dsp.spectra import detrend
from railui.ride_quality.comfort import COACH, carbody_of, comfort_sections
from railui.ride_quality.evaluation import TrackGiven, excitation_of
from railui.ride_quality.running_safety import (
    QUOTIENT_LIMIT,
    SLIDING,
    UNLOADED,
    Guided,
    force_channels,
    force_limit,
    load_note,
    load_paths,
)
from railui.ride_quality.score import CLASSES, FLOOR_OF_FRAME, riding_quality
from railui.ride_quality.statistics import half_gauges, with_gauge
from railui.track import Track
from railui.track.excitation import Excitation
from railui.vehicle.model import Model
from railui.vehicle.resolve import Given, model_of
from railui.vehicle.simulate import simulate_series

STRETCH: Final = 200.0  # m, as the quality of a line is usually told
GEOMETRY: Final = (3.0, 25.0)  # m, wavelength range D1 of EN 13848, by which maintenance is ordered today
KEPT: Final = (
    *("score", "class", "decided_by", "comfort_hours", "weighted_acceleration", "weighted_acceleration_1974", "wz"),
    *("flange_fraction", "flange_fractions", "flange_fraction_gaussian", "flange_margin"),
)

PRESSED: Final = ("sum_of_guiding_forces", "share_above_limit", "derailment_quotient")


def assess(
    track: TrackGiven,
    design: Given,
    speed: float | str,
    *,
    stretch: float = STRETCH,
    seed: int | None = None,
    jobs: int | None = 1,
) -> dict[str, Any]:
    """A track (or its spec or file) judged by the ride of a standard vehicle at a speed [m/s], worst stretch first.

    stretches: from, to [m], the keys of a ride in it (score, class, decided_by, comfort, flange contact), the
    largest displacement `largest_e` [m]; by the names of EN 14363 (see
    `railui.ride_quality.running_safety`), of the wheelset that has most,
    `sum_of_guiding_forces` [N], its `share_above_limit` and `derailment_quotient` (None where a wheel was
    wholly unloaded); and the geometry beside them, `sd_yw` [m] of waves of 3 to 25 m with its
    place `rank_geometry` among the stretches, 1 the worst. `agreement`: Spearman's rank correlation between the
    order by geometry and the order by ride, 1 where they are one. The vehicle rides the whole track; a stretch
    begins with the motion that the one before it left. A last piece shorter than half a stretch belongs to the one
    before. Raises ValueError for a stretch that is shorter than 4 m or not shorter than the track, and as `ride`.
    Source: Broersen 1976, 2.4.

    >>> found = assess("erri_b176_high length=1000", "designs/test_bogie.yaml", 40.0)
    >>> len(found["stretches"]), found["stretches"][0]["score"] <= found["stretches"][-1]["score"]
    (5, True)
    """
    model, road = model_of(design), excitation_of(track, speed, seed)
    cuts = _cuts(road.track, stretch)
    ride = _Ride(model, road, jobs)
    geometry = in_band(road.track, *GEOMETRY)
    sd = np.array([float(geometry[a:b].std()) for a, b in cuts])
    found = [ride.stretch(a, b) | {"sd_yw": float(g)} for (a, b), g in zip(cuts, sd, strict=True)]
    for one, (rank, _) in zip(found, _places(-sd), strict=True):
        one["rank_geometry"] = rank
    badness = [_badness(one) for one in found]
    agreement = _agreement(sd, badness)
    order = sorted(range(len(found)), key=lambda i: badness[i], reverse=True)
    notes = list(road.laid.notes)
    if ride.lost_at is not None:
        notes.append(f"the vehicle left the track at s = {ride.lost_at:.5g} m: no statistics from there on")
    if ride.guided is not None:
        notes += [load_note(model), *([UNLOADED] if ride.guided.quotient is None else [])]
    return {
        "track": road.laid.name,
        "speed": road.speed,
        "seed": road.laid.seed,
        "stretch": stretch,
        "comfort_point": ride.point,
        "sum_of_guiding_forces_limit": float(ride.limit.min()),
        "derailment_quotient_limit": QUOTIENT_LIMIT,
        "stretches": [found[i] for i in order],
        "agreement": agreement,
        "notes": notes,
    }


def in_band(track: Track, shortest: float, longest: float) -> FloatArray:
    """Lateral deviation [m] of a track [samples], only its waves between two wavelengths [m]."""
    n = len(track)
    line = np.fft.rfft(detrend(track.yw))
    with np.errstate(divide="ignore"):
        wavelength = np.where(np.arange(len(line)) > 0, n * track.spacing / np.arange(len(line)), np.inf)
    line[(wavelength < shortest) | (wavelength >= longest)] = 0.0
    return np.asarray(np.fft.irfft(line, n))


def check_stretch(track: Track, stretch: float) -> None:
    """Raises ValueError for a stretch [m] that is too short or not shorter than the track.

    Guiding forces are compared as means over 2 m, of which even a last piece of half a stretch must hold one.
    """
    shortest = max(10.0 * track.spacing, 2.0 * SLIDING)
    if not shortest <= stretch < track.length or round(stretch / track.spacing) >= len(track):
        told = f"between {shortest:g} m and the length of the track, {track.length:g} m"
        raise ValueError(f"a stretch of {stretch:g} m cannot be assessed: give one {told}")


def _cuts(track: Track, stretch: float) -> list[tuple[int, int]]:
    """First and past-the-last sample of every stretch."""
    check_stretch(track, stretch)
    each = round(stretch / track.spacing)
    edges = list(range(0, len(track) - each // 2, each))
    return list(zip(edges, [*edges[1:], len(track)], strict=True))


def _badness(one: dict[str, Any]) -> tuple[float, float, float]:
    """What orders stretches, the largest first: class, score, flange share."""
    return (-float(CLASSES.index(one["class"])), -float(one["score"]), float(one["flange_fraction"] or 0.0))


def _agreement(sd: FloatArray, badness: list[tuple[float, float, float]]) -> float | None:
    """Spearman's correlation of two orders; None for fewer than three stretches or where nothing differs."""
    ranks = [sorted(badness).index(b) for b in badness]
    if len(ranks) < 3 or len(set(ranks)) < 2 or len(set(sd.tolist())) < 2:
        return None
    return float(np.corrcoef(*(np.mean(_places(x), axis=1) for x in (sd, np.array(ranks))))[0, 1])


def _places(x: NDArray[Any]) -> list[tuple[int, int]]:
    """First and last place of every value in their order, from 1 on; they differ where values are equal."""
    ordered = np.sort(x)
    first, last = np.searchsorted(ordered, x, "left") + 1, np.searchsorted(ordered, x, "right")
    return list(zip(first.tolist(), last.tolist(), strict=True))


class _Ride:
    """One ride over the whole track: displacements and weighted accelerations as series."""

    def __init__(self, model: Model, road: Excitation, jobs: int | None) -> None:
        self.model, self.road = model, road
        known = model.vehicles().channels(model.single())
        wheels = [c for c in known if re.fullmatch(r"e\d+", c)]
        floors = [c for c in known if c.startswith("floor.")]
        pressed = force_channels(model)
        channels = [*wheels, *(floors or ["ayf"]), *pressed]
        series, lost = simulate_series(model, road, channels, jobs=jobs)
        self.lost = len(road.track) if lost is None else lost
        self.lost_at = None if lost is None else road.place(lost)
        self.e, floor, y = np.split(series, [len(wheels), len(channels) - len(pressed)])
        self.limit = force_limit(np.array([model.design.values[path] for path in load_paths(model)]))
        self.guided: Guided | None = None
        if road.track.spacing * self.lost > 2 * SLIDING:
            self.guided = Guided.of(model, y[:, : self.lost], 1.0 / road.dt, road.track.spacing)
        sections = comfort_sections(model, model.row[None], road.dt)
        self.weighted = {name: sosfilt(sos[0], floor) for name, sos in sections.items()}
        self.point = FLOOR_OF_FRAME if carbody_of(model) is None else COACH
        if floors:
            self.point = f"the worst of {', '.join(floors)}"
        self.clearance = model.design.value("contact.flange_clearance")
        self.half_gauge = np.zeros((len(wheels), len(road.track)))
        if model.design.gauge_widens_clearance:
            self.half_gauge = half_gauges(road.table(model.half_wheelbase(), 1), 1, len(wheels))

    def stretch(self, a: int, b: int) -> dict[str, Any]:
        """What the vehicle does between two samples."""
        place = {"from": self.road.place(a), "to": self.road.place(b - 1)}
        if self.lost < b:
            lost: dict[str, Any] = dict.fromkeys((*KEPT, *PRESSED))
            return place | lost | {
                "score": 0.0, "class": CLASSES[0], "decided_by": "the vehicle left the track", "largest_e": None
            }  # fmt: skip
        e, half = self.e[:, a:b], self.half_gauge[:, a:b]
        room = self.clearance + half
        one = {
            "mean_e": e.mean(axis=1),
            "sd_e": with_gauge(e.std(axis=1), half),
            "flange_fractions": (np.abs(e) >= room).mean(axis=1),
            "comfort_point": self.point,
        }
        for name, x in self.weighted.items():
            one[name] = float(np.sqrt(np.mean(x[:, a:b] ** 2, axis=1)).max())
        if "acceleration" in self.weighted:
            one["acceleration_peak"] = float(np.abs(self.weighted["acceleration"][:, a:b]).max())
        quality = riding_quality(one, self.model.design.riding, float(room.mean()))
        kept = {key: quality[key] for key in KEPT} | {"largest_e": float(np.abs(e).max())}
        pressed = dict.fromkeys(PRESSED) if self.guided is None else self.guided.between(a, b)
        return place | kept | pressed
