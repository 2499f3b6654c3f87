"""Result of the loop: models before and after, their validations, the evidence and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import special

from railui.arrays import FloatArray
from railui.campaign.finding import Finding
from railui.campaign.segment import Segment
from railui.identification.context import Context, WithContext
from railui.identification.estimation.block_merging import independent_edges
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.leave_one_out import LeftOutRun
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.validation import (
    Validation,
    block_errors_after_start,
    error_after_start,
    validate,
    validate_each,
)
from railui.identification.structure.freed_groups import FreedGroups
from railui.identification.structure.gain_forecast import PredictedGains
from railui.identification.structure.score_test import ScoreTestResult
from railui.identification.structure.stage import SelectionStep
from railui.identification.unmodelled.condition_dependence import ConditionDependence
from railui.identification.unmodelled.discrepancy import Discrepancy
from railui.identification.unmodelled.sensitive_motion import SensitiveMotion
from railui.identification.verdict import Explained, Remainder, Verdict
from railui.vehicle.model import Model


@dataclass(frozen=True)
class IndependentTest:
    """NRMSE on the test segments, without and with the effects, and the error expected from noise there.

    files: the runs. is_held_back: whether the segments are parts of validation runs, not runs of role test.
    is_contradicted: whether the effects raise the error there significantly.
    """

    nrmse_before: float
    nrmse_after: float
    floor: float
    files: tuple[str, ...]
    is_held_back: bool
    is_contradicted: bool = False


@dataclass(frozen=True, eq=False)
class LoopResult(WithContext):
    """Result of the loop, from which the report is made.

    Attributes
    ----------
    before, after
        The calibrated model without effects, and with those selected.
    validations
        On the whole validation runs, by declared, before and after.
    explained
        Share of the error beyond noise that the effects remove; None where there is none to remove.
    remainder
        Residual of the final model.
    test
        Errors on the test runs, or on the reserved part of validation runs; None where the runs are too short.
    findings, withdrawn
        Findings of the data checks, and those that the final model contradicts.
    windowed
        The model without effects fitted on windows, where the vehicle hunts or falls out of step with the motion.
    is_failed_fit
        Whether the calibrated model was worse than the nominal one on the runs that select effects.
    has_track_noise
        Whether the noise of the track columns is that which explains the residual, since it was not known better.
    is_out_of_time
        Whether the time budget ended before the search did.
    left_out
        Error of each run with the parameters estimated on all others, from three runs.
    predicted_gains
        On the validation runs, of the candidates of the last score test.
    conditions
        Parameters under the stated conditions of the runs; None where there are none.
    floor_of_conditions
        Noise floor on the runs that select effects, where the verdict is that on the model whose parameters differ
        between the conditions; None where it is not.
    sensitive_motion
        Law with which the equation of motion of a rig holds whose motion no simulation follows; None: none.
    freed
        Test of differences between the joints or wheelsets that share an estimated number, and the model without those.
    """

    before: Fit
    after: Fit
    validations: dict[str, Validation]
    noise_floor: NoiseFloor
    steps: tuple[SelectionStep, ...]
    score_test: ScoreTestResult
    verdict: Verdict
    explained: Explained | None
    remainder: Remainder
    test: IndependentTest | None
    discrepancy: Discrepancy | None
    seconds: float = 0.0
    findings: tuple[Finding, ...] = ()
    withdrawn: tuple[Finding, ...] = ()
    windowed: Fit | None = None
    is_failed_fit: bool = False
    has_track_noise: bool = False
    is_out_of_time: bool = False
    left_out: tuple[LeftOutRun, ...] = ()
    predicted_gains: PredictedGains = field(default_factory=dict, repr=False)
    conditions: ConditionDependence | None = None
    floor_of_conditions: NoiseFloor | None = None
    freed: FreedGroups = field(default_factory=FreedGroups, repr=False)
    sensitive_motion: SensitiveMotion | None = None

    @property
    def seed(self) -> int:
        """Seed of the tests and of the ranking; noise realisations have fixed seeds (`Context`)."""
        return self.context.seed

    @property
    def simulations(self) -> int:
        """Vehicles simulated for the fits before and after; once where the two are one fit but for its last step."""
        is_same_fit = self.after.normal is self.before.normal
        return self.after.simulations + (0 if is_same_fit else self.before.simulations)

    @property
    def is_by_condition(self) -> bool:
        """True where the verdict is that on the model whose parameters differ between the conditions."""
        return self.floor_of_conditions is not None

    @property
    def error_to_noise(self) -> float:
        """Validation error over noise floor; that of parameters apart for every condition where these decide."""
        if self.floor_of_conditions is not None and self.conditions is not None:
            return self.conditions.separate_nrmse / self.floor_of_conditions.nrmse
        return self.validations["after"].nrmse / self.noise_floor.nrmse

    def validate(self, segments: Sequence[Segment]) -> Validation:
        """Validate the final model on segments."""
        return validate_final(self.context, self.after, self.discrepancy, segments)


def validate_final(
    context: Context, fit: Fit, discrepancy: Discrepancy | None, segments: Sequence[Segment]
) -> Validation:
    """Validate the final model, which is that of the discrepancy where the two share their fit."""
    if discrepancy is not None and discrepancy.lowers_error and discrepancy.fit is fit:
        return discrepancy.validate(context, segments)
    return validate(context, fit.model, segments)


def run_independent_test(
    context: Context,
    before: Fit,
    after: Fit,
    discrepancy: Discrepancy | None,
    by_run: Mapping[int, Model] | None = None,
) -> IndependentTest | None:
    """Compute the errors on the test segments; None without any.

    by_run: model after of each run by its index, where conditions decide; runs without one are left out.
    """
    dataset = context.dataset
    segments = [s for s in dataset.test if by_run is None or s.run_index in by_run]
    if not segments:
        return None
    without = validate(context, before.model, segments)
    nrmse_before = error_after_start(context, without, segments)
    nrmse_after, is_contradicted = nrmse_before, False
    final = None
    if by_run is not None:
        final = validate_each(context, [(by_run[s.run_index], s) for s in segments])
    elif after is not before or discrepancy is not None:
        final = validate_final(context, after, discrepancy, segments)
    if final is not None:
        nrmse_after = error_after_start(context, final, segments)
        errors, final_errors = (block_errors_after_start(context, one, segments) for one in (without, final))
        is_contradicted = is_error_raised(errors, final_errors, context.settings.validation.contradiction_level)
    draws = context.settings.validation.preliminary_floor_draws
    floor = estimate_noise_floor(context, after.model, segments, draws, is_after_start=True)
    files = tuple(dict.fromkeys(s.file for s in segments))
    is_held_back = not dataset.has_test_runs
    return IndependentTest(nrmse_before, nrmse_after, floor.nrmse, files, is_held_back, is_contradicted)


def is_error_raised(before: FloatArray, after: FloatArray, level: float) -> bool:
    """True where squared errors [block] are significantly higher after than before: Student's paired test, one-sided.

    A model that diverges, of which the errors are NaN, has a higher error than one that does not.

    Examples
    --------
    >>> is_error_raised(np.array([1.0, 2.0, 1.0]), np.array([1.5, 2.6, 1.4]), 0.01)
    True
    >>> is_error_raised(np.array([1.0, 2.0, 1.0]), np.array([1.5, 1.5, 1.5]), 0.01)
    False
    """
    if not np.all(np.isfinite(before)):
        return False
    if not np.all(np.isfinite(after)):
        return True
    rise = after - before
    rise = np.add.reduceat(rise, independent_edges((rise - rise.mean())[:, None]))
    n = len(rise)
    mean, standard_error = float(rise.mean()), float(rise.std(ddof=1) / np.sqrt(n)) if n > 1 else np.inf
    return mean > float(special.stdtrit(max(n - 1, 1), 1.0 - level)) * standard_error
