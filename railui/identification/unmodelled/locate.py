"""Location of a force that no effect of the library explains, with its force curve."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.validation import Validation, validate
from railui.identification.prediction import DivergedError
from railui.identification.structure.couplings import find_couplings
from railui.identification.structure.equivalent_inputs import ForceLocation, locate_forces
from railui.identification.structure.refit import worthwhile_misfit
from railui.identification.unmodelled.discrepancy import Discrepancy, DiscrepancyCurve
from railui.identification.unmodelled.force_curve import CurveLocation, curve_locations, explained_by_curve, fit_curve
from railui.identification.unmodelled.location_evidence import (
    LocationEvidence,
    evidence_of_blocks,
    evidence_of_fits,
    evidence_of_forces,
    expected_misfit,
    rival_locations,
    share_at_contact,
)
from railui.parallel import map_threads

# locations of force curves that stand for those of independent forces
CURVE_LOCATIONS_OF = {
    "contact": ("wheelset", "wheelset_yaw"),
    "frame": ("secondary_lateral", "secondary_yaw"),
}


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
        evidence = evidence_of_blocks(coupling.before, coupling.after, expected_misfit(fit))
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
    identified = DiscrepancyCurve(
        spot.against,
        spot.grid,
        np.array(fit.model.design.effects[index].parameters["force"]),
        np.insert(fit.sd[points], len(spot.grid) // 2, 0.0),
        {"z": z, "v": f"{z}/s", "s": "m"}[spot.against],
        "N*m" if is_yaw else "N",
    )
    return Discrepancy(at, wheelset, identified, share, fit, curve.validation)


def _is_at(spot: CurveLocation, origin: ForceLocation) -> bool:
    """True if a curve can represent the forces at their location."""
    locations = CURVE_LOCATIONS_OF.get(origin.at, (origin.at,))
    return spot.at in locations and (origin.wheelset is None or spot.wheelset in (None, origin.wheelset))
