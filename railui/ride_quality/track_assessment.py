"""Assessment of a track by the ride of a reference vehicle: track sections ranked by ride quality, worst first."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.core import sosfilt
from railui.dsp.spectra import detrend
from railui.ride_quality.comfort import CARBODY_CENTRE, carbody_effect, comfort_sections
from railui.ride_quality.conditions import comfort_notes, guidance_notes
from railui.ride_quality.evaluation import TrackLike, excitation_of
from railui.ride_quality.guiding_forces import MEAN_LENGTH, GuidingForces, guiding_force_channels, wheel_load_paths
from railui.ride_quality.running_safety import SAFETY_KEYS, safety_of
from railui.ride_quality.safety_limits import SafetyLimits, force_limit
from railui.ride_quality.score import CLASSES, FRAME_FLOOR, evaluate_ride
from railui.ride_quality.statistics import (
    guidance_channels,
    guidance_limits,
    half_gauge_deviations,
    is_guided_by_force,
    sd_with_gauge,
    straight_samples,
)
from railui.track import Track
from railui.track.excitation import Excitation
from railui.vehicle.model import Model
from railui.vehicle.on_track import spacings
from railui.vehicle.resolve import ModelSource, require_rating, resolve_model
from railui.vehicle.simulate import simulate_series

CURVES_NOTE: Final = (
    "curves: flanges guide there, so e and flange contact count on straights only; the score of a section mainly in "
    "curves is that of comfort, its class that of comfort and running safety"
)
CURVE_REASON: Final = "comfort alone, flanges guide in the curve"
MIN_STRAIGHT_SHARE: Final = 0.5  # of a section, from which its guidance is that of its straights
SECTION_LENGTH: Final = 200.0  # m, the usual length for the quality of a line
GEOMETRY_BAND: Final = (3.0, 25.0)  # m, wavelength range D1 of EN 13848, by which maintenance is usually ordered
MIN_SAMPLES: Final = 10.0  # of a section
RIDE_KEYS: Final = (
    *("score", "class", "decided_by", "comfort_hours", "weighted_acceleration", "weighted_acceleration_1974", "wz"),
    *("flange_fraction", "flange_fractions", "flange_fraction_gaussian", "flange_margin"),
)
FORCE_KEYS: Final = ("sum_of_guiding_forces", "share_above_limit", "derailment_quotient")

Severity = tuple[float, float, float]


def assess(
    track: TrackLike,
    design: ModelSource,
    speed: float | str,
    *,
    section_length: float = SECTION_LENGTH,
    seed: int | None = None,
    jobs: int | None = 1,
) -> dict[str, Any]:
    """Assess a track by the ride of a reference vehicle over it.

    The vehicle runs over the whole track: a section begins with the motion that the one before it left. A last piece
    shorter than half a section belongs to the section before.

    Parameters
    ----------
    track : Track, TrackSource, spec or path
        Track.
    design : Design, Model or path
        Reference vehicle.
    speed : float or str
        Speed [m/s], or a quantity such as "144 km/h".
    section_length : float
        Length of a track section [m].
    seed : int, optional
        Seed that replaces that of the spec.
    jobs : int, optional
        Threads.

    Returns
    -------
    dict
        `stretches`: the sections, worst first, each with from, to [m], the keys of a ride in it (score, class,
        decided_by, comfort, flange contact), the largest displacement `largest_e` [m]; by the names of EN 14363 (see
        `railui.ride_quality.running_safety`), of the worst wheelset, `sum_of_guiding_forces` [N], its
        `share_above_limit` and `derailment_quotient`; the largest values of running safety, which limit the class:
        `SAFETY_KEYS` and `criteria`; and the geometry, `sd_yw`
        [m] of wavelengths of 3 to 25 m with its rank among the sections `rank_geometry`, 1 the worst. `agreement`:
        Spearman's rank correlation between the order by geometry and the order by ride, 1 if both are the same.

    Raises
    ------
    ValueError
        For a section that is shorter than 4 m or not shorter than the track, and as `ride`.

    References
    ----------
    Broersen 1976, 2.4.

    Examples
    --------
    >>> result = assess("erri_b176_high length=1000", "designs/test_bogie.yaml", 40.0)
    >>> len(result["stretches"]), result["stretches"][0]["score"] <= result["stretches"][-1]["score"]
    (5, True)
    """
    model, excitation = resolve_model(design), excitation_of(track, speed, seed)
    require_rating(model.design)
    sections = _cut_sections(excitation.track, section_length)
    ride = _TrackRide(model, excitation, jobs)
    geometry = band_pass(excitation.track, *GEOMETRY_BAND)
    sd = np.array([float(geometry[a:b].std()) for a, b in sections])
    results = [ride.section(a, b) | {"sd_yw": float(x)} for (a, b), x in zip(sections, sd, strict=True)]
    for result, (rank, _) in zip(results, ranks(-sd), strict=True):
        result["rank_geometry"] = rank
    severities = [severity(result) for result in results]
    order = sorted(range(len(results)), key=lambda i: severities[i], reverse=True)
    return {
        "track": excitation.source.name,
        "speed": excitation.speed,
        "seed": excitation.source.seed,
        "stretch": section_length,
        "comfort_point": ride.comfort_point,
        "sum_of_guiding_forces_limit": float(ride.force_limits.min()),
        "derailment_quotient_limit": SafetyLimits.of(model).quotient,
        "stretches": [results[i] for i in order],
        "agreement": rank_correlation(sd, severities),
        "notes": [*excitation.source.notes, *comfort_notes(model), *ride.notes()],
    }


def band_pass(track: Track, shortest: float, longest: float) -> FloatArray:
    """Return the lateral deviation [m] of a track [sample] in a band of wavelengths [m]."""
    n = len(track)
    spectrum = np.fft.rfft(detrend(track.yw))
    with np.errstate(divide="ignore"):
        wavelength = np.where(np.arange(len(spectrum)) > 0, n * track.spacing / np.arange(len(spectrum)), np.inf)
    spectrum[(wavelength < shortest) | (wavelength >= longest)] = 0.0
    return np.asarray(np.fft.irfft(spectrum, n))


def check_section_length(track: Track, length: float) -> None:
    """Raise ValueError for a section length [m] that is too short or not shorter than the track.

    Guiding forces are compared as means over 2 m, of which even a last piece of half a section must contain one.
    """
    shortest = max(MIN_SAMPLES * track.spacing, 2.0 * MEAN_LENGTH)
    if not shortest <= length < track.length or round(length / track.spacing) >= len(track):
        bounds = f"between {shortest:g} m and the length of the track, {track.length:g} m"
        raise ValueError(f"a section of {length:g} m cannot be assessed: give a length {bounds}")


def _cut_sections(track: Track, length: float) -> list[tuple[int, int]]:
    """Return the first sample of every section and the sample after its last."""
    check_section_length(track, length)
    samples = round(length / track.spacing)
    edges = list(range(0, len(track) - samples // 2, samples))
    return list(zip(edges, [*edges[1:], len(track)], strict=True))


def severity(result: dict[str, Any]) -> Severity:
    """Return the sort key of a section, the worst the largest: class, score, flange share."""
    return (-float(CLASSES.index(result["class"])), -float(result["score"]), float(result["flange_fraction"] or 0.0))


def rank_correlation(sd: FloatArray, severities: list[Severity]) -> float | None:
    """Return Spearman's correlation of two orders; None for fewer than three sections or if all are equal."""
    positions = [sorted(severities).index(each) for each in severities]
    if len(positions) < 3 or len(set(positions)) < 2 or len(set(sd.tolist())) < 2:
        return None
    mean_ranks = [np.mean(ranks(x), axis=1) for x in (sd, np.array(positions))]
    return float(np.corrcoef(*mean_ranks)[0, 1])


def ranks(x: ArrayLike) -> list[tuple[int, int]]:
    """Return the lowest and the highest rank of every value, from 1 on; they differ for equal values.

    >>> ranks([0.3, 0.1, 0.3])
    [(2, 3), (1, 1), (2, 3)]
    """
    ordered = np.sort(x)
    first, last = np.searchsorted(ordered, x, "left") + 1, np.searchsorted(ordered, x, "right")
    return list(zip(first.tolist(), last.tolist(), strict=True))


class _TrackRide:
    """One ride over the whole track: displacements, weighted accelerations and guiding forces as series."""

    def __init__(self, model: Model, excitation: Excitation, jobs: int | None) -> None:
        self.model = model
        self.excitation = excitation
        available = model.vehicles().channel_names(model.single_batch())
        wheelsets = [c for c in available if re.fullmatch(r"e\d+", c)]
        floors = [c for c in available if c.startswith("floor.")]
        forces = guiding_force_channels(model)
        self.is_guided_by_force = is_guided_by_force(model)
        totals = guidance_channels(model) if self.is_guided_by_force else ()
        channels = [*wheelsets, *totals, *(floors or ["ayf"]), *forces]
        series, diverged_at = simulate_series(model, excitation, channels, jobs=jobs)
        self.diverged_at = diverged_at
        self.valid_samples = len(excitation.track) if diverged_at is None else diverged_at
        ends = [len(wheelsets), len(wheelsets) + len(totals), len(channels) - len(forces)]
        self.e, total_forces, accelerations, y = np.split(series, ends)
        self.guidance = total_forces if self.is_guided_by_force else self.e
        self.force_limits = force_limit(
            np.array([model.design.values[path] for path in wheel_load_paths(model)]), model.design.riding.use
        )
        self.forces = self._guiding_forces(y)
        sections = comfort_sections(model, model.row[None], excitation.dt)
        self.weighted = {name: sosfilt(sos[0], accelerations) for name, sos in sections.items()}
        self.comfort_point = FRAME_FLOOR if carbody_effect(model) is None else CARBODY_CENTRE
        if floors:
            self.comfort_point = f"the worst of {', '.join(floors)}"
        self.limit = float(guidance_limits(model, model.row[None])[0])
        self.half_gauge = np.zeros((len(wheelsets), len(excitation.track)))
        self.is_straight = np.ones(len(excitation.track), dtype=bool)
        if not self.is_guided_by_force and (model.design.gauge_widens_clearance or excitation.track.has_curves):
            table = excitation.table(spacings(model, model.row[None], excitation)[0], 1)
            if model.design.gauge_widens_clearance:
                self.half_gauge = half_gauge_deviations(table, 1, len(wheelsets))
            if excitation.track.has_curves:
                self.is_straight = straight_samples(table, 1, len(wheelsets))

    def _guiding_forces(self, series: FloatArray) -> GuidingForces | None:
        """Return the guiding forces up to divergence; None if the vehicle diverges within 4 m."""
        spacing, n = self.excitation.track.spacing, self.valid_samples
        if spacing * n <= 2 * MEAN_LENGTH:
            return None
        return GuidingForces.from_series(self.model, series[:, :n], 1.0 / self.excitation.dt, spacing)

    def notes(self) -> list[str]:
        """Return notes on the limit of guidance, on divergence and on the wheel loads of Y/Q."""
        notes = guidance_notes(self.model, self.limit)
        if self.excitation.track.has_curves and not self.is_guided_by_force:
            notes.append(CURVES_NOTE)
        if self.diverged_at is not None:
            location = self.excitation.distance_at(self.diverged_at)
            notes.append(f"the vehicle left the track at s = {location:.5g} m: no statistics from there on")
        if self.forces is not None:
            notes += safety_of(self.model, self.forces, self.excitation.track.s).notes()
        return notes

    def section(self, first: int, stop: int) -> dict[str, Any]:
        """Return the ride quality and guiding forces from sample `first` to before `stop`."""
        location = {"from": self.excitation.distance_at(first), "to": self.excitation.distance_at(stop - 1)}
        if self.valid_samples < stop:
            undefined: dict[str, Any] = dict.fromkeys((*RIDE_KEYS, *FORCE_KEYS, *SAFETY_KEYS)) | {"criteria": []}
            reason = {"score": 0.0, "class": CLASSES[0], "decided_by": "the vehicle left the track", "largest_e": None}
            return location | undefined | reason
        limit, statistics = self._guidance_between(first, stop)
        for name, x in self.weighted.items():
            statistics[name] = float(np.sqrt(np.mean(x[:, first:stop] ** 2, axis=1)).max())
        if "acceleration" in self.weighted:
            statistics["acceleration_peak"] = float(np.abs(self.weighted["acceleration"][:, first:stop]).max())
        forces, findings = self._forces_between(first, stop)
        riding, is_guided = self.model.design.riding, self._is_guided(first, stop)
        quality = evaluate_ride(
            statistics, riding if is_guided else replace(riding, comfort_weight=1.0), limit, findings
        )
        result = {key: quality[key] for key in RIDE_KEYS}
        if not is_guided:
            result |= {key: None for key in RIDE_KEYS if key.startswith("flange_")}
            if quality["decided_by"].startswith("score"):
                result["decided_by"] = f"score {quality['score']:.1f}: {CURVE_REASON}"
        result["largest_e"] = float(np.abs(self.e[:, first:stop]).max())
        return location | result | forces

    def _is_guided(self, first: int, stop: int) -> bool:
        """Return True for a section whose guidance counts: half of it or more is straight."""
        return bool(self.is_straight[first:stop].mean() >= MIN_STRAIGHT_SHARE)

    def _guidance_between(self, first: int, stop: int) -> tuple[float, dict[str, Any]]:
        """Return the limit of guidance and the statistics of a section.

        The clearance [m] and e on its straights, at rest without any; or the limit of the sum of guiding forces [N] and
        this sum in the whole section.
        """
        inside = first + np.flatnonzero(self.is_straight[first:stop])
        is_guided = self._is_guided(first, stop)
        if not is_guided:
            inside = np.arange(first, stop)
        x, half_gauge = self.guidance[:, inside], self.half_gauge[:, inside]
        limit = self.limit + half_gauge
        statistics = {
            "mean_e": x.mean(axis=1),
            "sd_e": sd_with_gauge(x.std(axis=1), half_gauge),
            "flange_fractions": (np.abs(x) >= limit).mean(axis=1),
        }
        if not is_guided:
            statistics = {name: np.zeros(len(x)) for name in statistics}
        return float(limit.mean()), {**statistics, "comfort_point": self.comfort_point}

    def _forces_between(self, first: int, stop: int) -> tuple[dict[str, Any], list[tuple[str, str]]]:
        """Return guiding forces, criteria of running safety and exceeded limits of a section."""
        if self.forces is None:
            return dict.fromkeys((*FORCE_KEYS, *SAFETY_KEYS)) | {"criteria": []}, []
        forces = self.forces.between(first, stop, self.valid_samples)
        safety = safety_of(self.model, forces, self.excitation.track.s, first)
        criteria = {"criteria": [each.as_dict() for each in safety.criteria]}
        return forces.section_maxima() | safety.measures() | criteria, safety.findings
