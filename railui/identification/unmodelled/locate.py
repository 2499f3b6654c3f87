"""Localisation of a discrepancy that is not in the library, with its force curve, drift or run-to-run variation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.validation import Validation, is_significant_gain, validate
from railui.identification.prediction import DivergedError, SimulationError
from railui.identification.structure.couplings import Coupling, find_couplings
from railui.identification.structure.drift import Drift, find_drifts, refine_drift, validate_drift
from railui.identification.structure.equivalent_inputs import ForceLocation, locate_forces
from railui.identification.structure.locations import location_of_number
from railui.identification.structure.refit import worthwhile_misfit
from railui.identification.unmodelled.force_curve import CurveLocation, curve_locations, explained_by_curve, fit_curve
from railui.identification.unmodelled.location_evidence import (
    NO_EVIDENCE,
    LocationEvidence,
    evidence_of_blocks,
    evidence_of_fits,
    evidence_of_forces,
    evidence_of_validations,
    joint_of,
    rival_locations,
    share_at_contact,
)
from railui.identification.unmodelled.run_by_run import find_run_difference
from railui.identification.unmodelled.run_dependence import RunDependence, detect_run_dependence
from railui.parallel import map_threads
from railui.vehicle.model import Model

# locations of force curves that stand for those of independent forces
CURVE_LOCATIONS_OF = {
    "contact": ("wheelset", "wheelset_yaw"),
    "frame": ("secondary_lateral", "secondary_yaw"),
}


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """A discrepancy that is not in the library.

    Attributes
    ----------
    against
        Abscissa of the curve: displacement "z", velocity "v", distance along the track "s" or time "t".
    motion, force, sd
        Abscissa, ordinate and its standard deviation [point]. The ordinate is a force, or the value of a parameter if
        the abscissa is distance.
    explained_share
        Share of the squared residual that it explains.
    fit, validation
        The model with the discrepancy and its validation.
    drift
        Variation of a parameter along the track, or with time.
    coupling
        Coupling with another location, to whose motion the force is proportional.
    run_dependence
        Variation of a parameter from run to run; the curve shows the validation run that differs most.
    is_unexplained_difference
        Whether the runs differ in what no parameter explains; then there is no curve.
    lowers_error
        Whether it lowers the validation error significantly.
    evidence
        For the location.
    contact_share
        Share that forces at the contact or the wheelsets explain, as noise of the track columns does.
    rivals
        Locations at other joints that explain as much where the location is that of forces, whatever their law.
    """

    at: str
    wheelset: int | None
    against: str
    motion: FloatArray
    force: FloatArray
    sd: FloatArray
    motion_unit: str
    force_unit: str
    explained_share: float
    fit: Fit
    validation: Validation
    drift: Drift | None = None
    coupling: Coupling | None = None
    run_dependence: RunDependence | None = None
    is_unexplained_difference: bool = False
    lowers_error: bool = False
    evidence: LocationEvidence = NO_EVIDENCE
    contact_share: float = 0.0
    rivals: tuple[ForceLocation, ...] = ()

    def is_located(self, settings: VerdictSettings) -> bool:
        """True where the evidence suffices to name the location, and forces elsewhere do not explain as much."""
        return len(self.locations(settings)) == 1

    def locations(self, settings: VerdictSettings) -> list[tuple[str, int | None, LocationEvidence]]:
        """List the locations that explain the residual equally well; empty without evidence, or where they are many."""
        if not self.at or not self.evidence.is_sufficient(settings):
            return []
        found = [(self.at, self.wheelset, self.evidence)]
        found += [(o.at, o.wheelset, LocationEvidence(o.share, o.standard_error)) for o in self.rivals]
        return found if len({joint_of(at) for at, _, _ in found}) <= settings.max_locations else []

    def without_calibration(self) -> Discrepancy:
        """Return the discrepancy of a model whose calibration failed: located only where it follows a law.

        The errors of its parameters are in the residual, and act wherever the parameters do.
        """
        follows_law = self.drift is not None or self.coupling is not None or self.run_dependence is not None
        return self if follows_law or self.lowers_error else replace(self, evidence=NO_EVIDENCE, rivals=())

    def validate(self, context: Context, segments: Sequence[Segment]) -> Validation:
        """Validate the model with the discrepancy on segments."""
        if self.drift is not None:
            return validate_drift(context, self.fit.model, self.drift, segments)
        return validate(context, self.fit.model, segments)


class _FittedCurve(NamedTuple):
    """A force curve fitted together with all parameters, the share that its linear estimate explains."""

    share: float
    spot: CurveLocation
    fit: Fit
    validation: Validation


def locate_discrepancy(context: Context, fit: Fit, variation: Discrepancy | None) -> Discrepancy | None:
    """Locate a force that is not in the library and fit its curve together with all parameters.

    variation: the discrepancy of a variation along the track, which is returned unless a curve explains more.
    """
    settings, progress = context.settings.discrepancy, context.progress
    if variation is not None and variation.explained_share >= settings.reliable_share:
        return variation
    forces = locate_forces(context, fit)
    locating = [f for f in forces if f.can_locate(settings)]
    origin = locating[0] if locating else None
    if origin is None and fit.model.design.is_on_track and any(len(t.measured) == 1 for t in fit.segments):
        progress.message("  a single channel was measured: forces at any location can explain its residual")
    elif origin is not None:
        progress.message(
            f"  residual resembles forces at {origin.at} {origin.wheelset or ''}: "
            f"share {origin.share:.2f} +/- {origin.standard_error:.2f}"
        )
    curve = _best_curve(context, fit, origin)
    if curve is None:
        return variation
    if variation is not None and 1.0 - curve.fit.normal.rss / fit.normal.rss < variation.explained_share:
        return variation
    at, wheelset = curve.spot.at, curve.spot.wheelset
    evidence = _stronger(context, evidence_of_fits(fit, curve.fit), evidence_of_forces(forces, at, wheelset))
    rivals: tuple[ForceLocation, ...] = ()
    if origin is not None and curve.share < settings.reliable_share:
        at, wheelset = origin.at, origin.wheelset
        evidence = LocationEvidence(origin.share, origin.standard_error)
        rivals = rival_locations(context.settings, locating)
    coupling = next(iter(find_couplings(context, fit)), None)
    if coupling is not None and coupling.share >= max(settings.reliable_share, curve.share):
        progress.message(f"  a coupling of {coupling.text} explains {coupling.share:.2f}")
        at, wheelset, rivals = coupling.at, coupling.wheelset, ()
        evidence = evidence_of_blocks(coupling.before, coupling.after, _expected_misfit(fit))
    else:
        coupling = None
    share = curve.share if origin is None else max(curve.share, origin.share)
    found = _curve_discrepancy(curve, at, wheelset, share)
    return replace(found, coupling=coupling, evidence=evidence, contact_share=share_at_contact(forces), rivals=rivals)


def _stronger(context: Context, one: LocationEvidence, other: LocationEvidence) -> LocationEvidence:
    """Return the evidence that suffices, or of two such the larger share."""
    settings = context.settings.verdict
    return max(one, other, key=lambda evidence: (evidence.is_sufficient(settings), evidence.share))


def _best_curve(context: Context, fit: Fit, origin: ForceLocation | None) -> _FittedCurve | None:
    """Fit the force curves that explain most, near `origin` where none explains much; None where none can be fitted."""
    settings = context.settings.discrepancy
    background = context.in_background(context.jobs)
    optimiser = GaussNewton.of_fit(background, fit)
    try:
        bases = [optimiser.sensitivities(t, fit.x).converged() for t in fit.segments]
    except DivergedError as error:
        context.progress.message(f"  no force curve is fitted: {error}")
        return None

    def explained(spot: CurveLocation) -> tuple[float, FloatArray, CurveLocation]:
        return (*explained_by_curve(settings, fit, bases, spot), spot)

    curves = list(map_threads(explained, curve_locations(settings, fit), context.jobs))
    curves = sorted((c for c in curves if c[0] > 0), key=lambda c: -c[0])
    if curves and origin is not None and curves[0][0] < min(settings.reliable_share, origin.share):
        curves = [c for c in curves if _is_at(c[2], origin)] or curves
    is_worthwhile = bool(curves) and (1.0 - curves[0][0]) * fit.normal.rss <= worthwhile_misfit(context, fit)
    fitted = []
    for share, force, spot in curves[: settings.fitted_curves if is_worthwhile else 1]:
        curve_fit = fit_curve(context, fit, spot, force)
        if curve_fit is not None:
            validation = validate(context, curve_fit.model, context.dataset.selection)
            context.progress.message(
                f"  curve against {spot.against} at {spot.at}: explains {share:.2f}, NRMSE {validation.nrmse:.4f}"
            )
            fitted.append(_FittedCurve(share, spot, curve_fit, validation))
    return min(fitted, key=lambda c: c.fit.normal.rss, default=None)


def _curve_discrepancy(curve: _FittedCurve, at: str, wheelset: int | None, share: float) -> Discrepancy:
    """Return a fitted curve as a discrepancy at a location."""
    spot, fit = curve.spot, curve.fit
    index = len(fit.model.design.effects) - 1
    points = [j for j, p in enumerate(fit.free.paths) if p.startswith(f"effects.{index}.force.")]
    is_yaw = spot.at.endswith("_yaw")
    z = "rad" if is_yaw else "m"
    return Discrepancy(
        at,
        wheelset,
        spot.against,
        spot.grid,
        np.array(fit.model.design.effects[index].parameters["force"]),
        np.insert(fit.sd[points], len(spot.grid) // 2, 0.0),
        {"z": z, "v": f"{z}/s", "s": "m"}[spot.against],
        "N*m" if is_yaw else "N",
        share,
        fit,
        curve.validation,
    )


def is_conclusive(context: Context, variation: Discrepancy | None) -> bool:
    """True if a variation explains so much that no gain on the validation runs is required."""
    least = context.campaign.min_gain
    return variation is not None and variation.drift is not None and variation.explained_share >= least


def find_variation(context: Context, fit: Fit) -> Discrepancy | None:
    """Find the parameter whose variation along the track, of a driven rig with time, explains most.

    None if chance explains as much.
    """
    drifts = find_drifts(context, fit)
    if not drifts or drifts[0].share < context.settings.discrepancy.min_drift_share:
        return None
    try:
        drift = refine_drift(context, fit, drifts[0])
        validation = validate_drift(context, fit.model, drift, context.dataset.selection)
    except SimulationError:
        return None
    is_on_track = fit.model.design.is_on_track
    course = "along the track" if is_on_track else "with time"
    context.progress.message(
        f"  {drift.path} varying {course}: explains {drift.share:.2f}, NRMSE {validation.nrmse:.4f}"
    )
    at, wheelset = location_of(drift.path, drift.ratios, fit.model)
    unit = fit.model.design.unit(drift.path)
    return Discrepancy(
        at,
        wheelset,
        "s" if is_on_track else "t",
        drift.abscissa,
        drift.values,
        drift.sd,
        "m" if is_on_track else "s",
        unit,
        drift.share,
        fit,
        validation,
        drift,
        evidence=_drift_evidence(fit, drift),
    )


def _drift_evidence(fit: Fit, drift: Drift) -> LocationEvidence:
    """Share of the residual beyond noise that a drift explains beyond chance."""
    before = fit.normal.gram[:, :, 0, 0].sum(axis=1)
    by_chance = drift.chance_share * fit.normal.rss / len(before)
    return evidence_of_blocks(before, drift.squares + by_chance, _expected_misfit(fit))


def _expected_misfit(fit: Fit) -> float:
    """Misfit that noise alone would leave: with the weights, it has a variance of one."""
    return min(float(fit.normal.samples), fit.normal.rss)


def find_run_dependence(
    context: Context, fit: Fit, validation_fit: Fit | None, validation: Validation, floor: float
) -> Discrepancy | None:
    """Find what differs from run to run; None unless separate values of a parameter lower the error significantly.

    It is that parameter where its values explain the difference, else an unexplained difference. No fit uses the
    validation runs: the reported error stays that of the calibrated model.

    Parameters
    ----------
    floor
        NRMSE that noise leaves on the validation runs.
    """
    if validation_fit is None or not np.isfinite(validation.nrmse):
        return None
    try:
        change = detect_run_dependence(context, fit, validation_fit)
    except SimulationError:
        return None
    if change is None:
        return None
    context.progress.message(
        f"  {change.path} separate for every run: NRMSE {change.validation.nrmse:.4f}, p {change.p:.4f}"
    )
    if not is_significant_gain(context, validation, change.validation):
        return None
    evidence = evidence_of_validations(validation, change.validation, floor)
    is_adequate = change.validation.nrmse <= context.settings.selection.adequate_ratio * floor
    if not is_adequate and evidence.share < context.settings.run_dependence.min_run_dependence_share:
        return unexplained_difference(context, fit, validation_fit, validation)
    return _of_run_dependence(context, fit, validation, change, evidence)


def difference_between_estimation_runs(
    context: Context, fit: Fit, validation: Validation, floor: float
) -> Discrepancy | None:
    """Find a difference between the estimation runs; None unless models of each are at noise, and on validation runs.

    Parameters
    ----------
    floor
        NRMSE that noise leaves on the validation runs.
    """
    found = find_run_difference(context, fit)
    if found is None or not is_significant_gain(context, validation, found.validation):
        return None
    context.progress.message(f"  models apart for every estimation run: NRMSE {found.validation.nrmse:.4f}")
    evidence = evidence_of_validations(validation, found.validation, floor)
    is_adequate = found.validation.nrmse <= context.settings.selection.adequate_ratio * floor
    if not is_adequate and evidence.share < context.settings.run_dependence.min_run_dependence_share:
        return None
    if found.dependence is None:
        return _unlocated_difference(fit, validation, evidence.share)
    return _of_run_dependence(context, fit, validation, found.dependence, evidence)


def _of_run_dependence(
    context: Context, fit: Fit, validation: Validation, change: RunDependence, evidence: LocationEvidence
) -> Discrepancy:
    """Return a parameter that differs from run to run as a discrepancy."""
    share, _ = validation.error_reduction(change.validation)
    at, wheelset = location_of(change.path, change.ratios, fit.model)
    calibrated = fit.model.value(change.path)
    extreme = max((r for r in change.runs if r.role == "validate"), key=lambda r: abs(r.value - calibrated))
    segments = [s for s in context.dataset.selection if s.run_index == extreme.run]
    against, unit_of_course = ("s", "m") if fit.model.design.is_on_track else ("t", "s")
    ends = np.array([segments[0].columns[against][0], segments[-1].columns[against][-1]])
    values, sd, unit = np.full(2, extreme.value), np.full(2, extreme.sd), fit.model.design.unit(change.path)
    return Discrepancy(
        at,
        wheelset,
        against,
        ends,
        values,
        sd,
        unit_of_course,
        unit,
        share,
        fit,
        validation,
        run_dependence=change,
        evidence=evidence,
    )


def unexplained_difference(
    context: Context, fit: Fit, validation_fit: Fit | None, validation: Validation
) -> Discrepancy:
    """Return a difference between runs that no parameter explains, located by forces on the validation runs."""
    forces = [] if validation_fit is None else locate_forces(context, validation_fit)
    locating = [f for f in forces if f.can_locate(context.settings.discrepancy)]
    at, wheelset, evidence = "", None, NO_EVIDENCE
    if locating:
        best = locating[0]
        at, wheelset, evidence = best.at, best.wheelset, LocationEvidence(best.share, best.standard_error)
        context.progress.message(
            f"  residual of the validation runs resembles forces at {at} {wheelset or ''}: "
            f"share {best.share:.2f} +/- {best.standard_error:.2f}"
        )
    rivals = rival_locations(context.settings, locating) if locating else ()
    return replace(
        _unlocated_difference(fit, validation, evidence.share),
        at=at,
        wheelset=wheelset,
        evidence=evidence,
        contact_share=share_at_contact(forces),
        rivals=rivals,
    )


def _unlocated_difference(fit: Fit, validation: Validation, share: float) -> Discrepancy:
    """Return a difference between runs that no parameter explains."""
    against, unit = ("s", "m") if fit.model.design.is_on_track else ("t", "s")
    none = np.zeros(0)
    return Discrepancy(
        "", None, against, none, none, none, unit, "N", share, fit, validation, is_unexplained_difference=True
    )


def location_of(path: str, ratios: Mapping[str, float], model: Model) -> tuple[str, int | None]:
    """Return location and wheelset of a parameter of the vehicle, or of an added effect."""
    group, name, *keys = path.split(".")
    structure = model.design.structure
    if group == "effects":
        effect = model.design.effects[int(name)]
        return effect.at, effect.wheelset
    if not model.design.is_on_track:
        return "rig", None
    if group == "contact":
        is_single = len(ratios) == 1 and name in ("leading", "trailing")
        return "contact", ("leading", "trailing").index(name) + 1 if is_single else None
    if structure is not None:
        return location_of_number(structure, path), None
    is_yaw = keys and keys[0] in ("longitudinal_stiffness", "yaw_stiffness", "yaw_damping")
    return f"{name}_{'yaw' if is_yaw else 'lateral'}", None


def _is_at(spot: CurveLocation, origin: ForceLocation) -> bool:
    """True if a curve can represent the forces at their location."""
    locations = CURVE_LOCATIONS_OF.get(origin.at, (origin.at,))
    return spot.at in locations and (origin.wheelset is None or spot.wheelset in (None, origin.wheelset))
