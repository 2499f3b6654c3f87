"""Discrepancy that no effect of the library explains: its location, its curve and its cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.campaign.settings.verdict import VerdictSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.validation import Validation, validate
from railui.identification.structure.couplings import Coupling
from railui.identification.structure.drift import Drift, validate_drift
from railui.identification.structure.equivalent_inputs import ForceLocation
from railui.identification.structure.locations import location_of_number
from railui.identification.unmodelled.location_evidence import NO_EVIDENCE, LocationEvidence, joint_of
from railui.identification.unmodelled.run_dependence import RunDependence
from railui.vehicle.model import Model


@dataclass(frozen=True, eq=False)
class DiscrepancyCurve:
    """Force against a motion, or values of a parameter against distance or time.

    Attributes
    ----------
    against
        Abscissa: displacement "z", velocity "v", distance along the track "s" or time "t".
    abscissa, ordinate, sd
        Points of the curve [point], with the standard deviations of the ordinate; empty where only forces are known.
    abscissa_unit, ordinate_unit
        Units in which they are.
    """

    against: str
    abscissa: FloatArray
    ordinate: FloatArray
    sd: FloatArray
    abscissa_unit: str
    ordinate_unit: str


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """A discrepancy that is not in the library.

    Attributes
    ----------
    at, wheelset
        Location, empty where none is known.
    curve
        Force against a motion, or values of a parameter along the track or with time.
    explained_share
        Share of the squared residual that it explains.
    fit, validation
        The model with the discrepancy and its validation.
    drift
        Variation of a parameter along the track, or with time.
    coupling
        Coupling with another location, to whose motion the force is proportional.
    run_dependence
        Variation of a parameter from run to run; the curve has the validation run that differs most.
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
    curve: DiscrepancyCurve
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
