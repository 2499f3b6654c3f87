"""Outside the catalogue: where a missing force acts, and its measured curve against motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset, Segment
from railui.identification.estimation.output_error import Fit, GaussNewton
from railui.identification.estimation.validation import Validation, validate
from railui.identification.structure.couplings import Coupling, find_couplings
from railui.identification.structure.drift import Drift, find_drifts, refine_drift, validate_drift
from railui.identification.structure.equivalent_inputs import Origin, locate_forces
from railui.identification.structure.stepwise import is_significant_gain
from railui.identification.unmodelled.force_curve import CurveLocation, curve_locations, explained, fit_curve
from railui.identification.unmodelled.run_dependence import RunDependence, test_run_dependence
from railui.progress import Report, silent
from railui.vehicle.model import Model

TELLING = 0.19  # share of the squared misfit from which a change along the track decides by itself
SLIGHT = 0.02  # share from which a change along the track is worth a look
CLEAR = 0.5  # share that a curve explains from which its place is believed


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """The place, the measured curve (force [points] against motion [points]) and the model that carries it."""

    at: str
    wheelset: int | None
    against: str
    motion: FloatArray
    force: FloatArray
    sd: FloatArray
    motion_unit: str
    force_unit: str
    explained: float
    fit: Fit
    judgement: Validation
    course: Drift | None = None
    coupled: Coupling | None = None  # with another place, whose motion it answers
    change: RunDependence | None = None  # from run to run: shown over the validating run that differs most
    gains: bool = False  # does it lower the error on the validating runs by what counts?

    def judged(self, measurement: Dataset, stretches: Sequence[Segment]) -> Validation:
        """What was found judged on stretches."""
        if self.course is not None:
            return validate_drift(self.fit.model, self.course, measurement, stretches)
        return validate(self.fit.model, measurement, stretches)


def locate_discrepancy(
    fit: Fit,
    measurement: Dataset,
    declared: Model,
    changing: Discrepancy | None,
    *,
    jobs: int | None = None,
    report: Report = silent,
) -> Discrepancy | None:
    """Say where something acts that no entry of the catalogue makes, draw its force there, adjust all with it.

    changing: what a change along the track explains, kept unless a curve explains more.
    """
    if changing is not None and changing.explained >= CLEAR:
        return changing
    origin = next(iter(locate_forces(fit, measurement)), None)
    if origin is None:
        report("  a single channel was measured: forces at any place can make what is left of it")
    else:
        report(f"  the rest looks like forces at {origin.at} {origin.wheelset or ''}: share {origin.share:.2f}")
    adjuster = GaussNewton(fit.model, fit.free, fit.segments, block=1.0, stable=False, jobs=jobs)
    bases = [adjuster.sensitivities(t, fit.x)[0] for t in fit.segments]
    seen = [(*explained(fit, bases, spot), spot) for spot in curve_locations(fit)]
    seen = sorted((s for s in seen if s[0] > 0), key=lambda s: -s[0])
    if not seen:
        return changing
    if origin is not None and seen[0][0] < CLEAR and seen[0][0] < origin.share:
        near = [s for s in seen if _beside(s[2], origin)]
        seen = near or seen
    results = []
    for share, force, spot in seen[:2]:
        found = fit_curve(fit, measurement, declared, spot, force, jobs)
        if found is not None:
            judged = validate(found.model, measurement, measurement.validation)
            report(f"  curve against {spot.against} at {spot.at}: explains {share:.2f}, nrmse {judged.nrmse:.4f}")
            results.append((found.normal.rss, share, spot, found, judged))
    if not results:
        return changing
    _, share, spot, found, judged = min(results, key=lambda r: r[0])
    if changing is not None and 1.0 - found.normal.rss / fit.normal.rss < changing.explained:
        return changing
    at, wheelset = (spot.at, spot.wheelset) if origin is None or share >= CLEAR else (origin.at, origin.wheelset)
    coupled = next(iter(find_couplings(fit)), None)
    if coupled is not None and coupled.share >= max(CLEAR, share):
        report(f"  a coupling of {coupled.text} explains {coupled.share:.2f}")
        at, wheelset = coupled.at, coupled.wheelset
    else:
        coupled = None
    index = len(found.model.design.effects) - 1
    curve = found.model.design.effects[index]
    points = [j for j, p in enumerate(found.free.paths) if p.startswith(f"effects.{index}.force.")]
    yaw = spot.at.endswith("_yaw")
    z = "rad" if yaw else "m"
    return Discrepancy(
        at,
        wheelset,
        spot.against,
        spot.grid,
        np.array(curve.parameters["force"]),
        np.insert(found.sd[points], len(spot.grid) // 2, 0.0),
        {"z": z, "v": f"{z}/s", "s": "m"}[spot.against],
        "N*m" if yaw else "N",
        share if origin is None else max(share, origin.share),
        found,
        judged,
        coupled=coupled,
    )


def is_conclusive(seen: Discrepancy | None) -> bool:
    """Does a change along the track explain so much that it needs no other run to believe it?"""
    return seen is not None and seen.course is not None and seen.explained >= TELLING


def find_variation_along_track(fit: Fit, measurement: Dataset, report: Report = silent) -> Discrepancy | None:
    """The parameter whose change along the track explains most, where that is more than chance."""
    seen = find_drifts(fit)
    if not seen or seen[0].share < SLIGHT:
        return None
    try:
        course = refine_drift(fit, seen[0])
        judged = validate_drift(fit.model, course, measurement, measurement.validation)
    except ValueError:
        return None
    report(f"  {course.path} along the track: explains {course.share:.2f}, nrmse {judged.nrmse:.4f}")
    at, wheelset = place_of(course.path, course.ratios, fit.model)
    unit = fit.model.design.unit(course.path)
    return Discrepancy(
        at, wheelset, "s", course.distance, course.values, course.sd, "m", unit, course.share, fit, judged, course
    )


def find_run_dependence(
    fit: Fit,
    here: Fit | None,
    judged: Validation,
    measurement: Dataset,
    declared: Model,
    *,
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
) -> Discrepancy | None:
    """The parameter that differs from run to run, where values of its own would take a material share of the error.

    No fit sees the validating runs: the error stays that of the vehicle as adjusted.
    """
    if here is None or not np.isfinite(judged.nrmse):
        return None
    try:
        change = test_run_dependence(fit, here, measurement, declared, seed=seed, jobs=jobs)
    except ValueError:
        return None
    if change is None:
        return None
    report(f"  {change.path} of its own on every run: nrmse {change.judged.nrmse:.4f}, p {change.p:.4f}")
    if not is_significant_gain(judged, change.judged, measurement.campaign.min_relative_gain):
        return None
    share, _ = judged.error_reduction(change.judged)
    at, wheelset = place_of(change.path, change.ratios, fit.model)
    adjusted = fit.model.value(change.path)
    most = max((r for r in change.runs if r.role == "validate"), key=lambda r: abs(r.value - adjusted))
    s = np.concatenate([s.columns["s"][[0, -1]] for s in measurement.validation if s.run_index == most.run])[[0, -1]]
    values, sd, unit = np.full(2, most.value), np.full(2, most.sd), fit.model.design.unit(change.path)
    return Discrepancy(at, wheelset, "s", s, values, sd, "m", unit, share, fit, judged, change=change)


def place_of(path: str, ratios: Mapping[str, float], model: Model) -> tuple[str, int | None]:
    """Place and wheelset of a parameter of the vehicle, or of an effect that was added."""
    group, what, *rest = path.split(".")
    if group == "effects":
        effect = model.design.effects[int(what)]
        return effect.at, effect.wheelset
    if group == "contact":
        single = len(ratios) == 1 and what in ("leading", "trailing")
        return "contact", ("leading", "trailing").index(what) + 1 if single else None
    yaw = rest and rest[0] in ("longitudinal_stiffness", "yaw_stiffness", "yaw_damping")
    return f"{what}_{'yaw' if yaw else 'lateral'}", None


def _beside(spot: CurveLocation, origin: Origin) -> bool:
    """Can a curve at the spot stand for forces at the origin?"""
    same = ("wheelset", "wheelset_yaw") if origin.at == "contact" else (origin.at,)
    return spot.at in same and (origin.wheelset is None or spot.wheelset in (None, origin.wheelset))
