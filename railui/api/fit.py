"""Fit: estimated parameters of a campaign with their covariance, residuals, noise model and candidate effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np

from railui.api.campaign import as_campaign
from railui.api.design import Design
from railui.api.display import Summarised, SummaryRow, draw_on
from railui.api.residual import Residual, residuals_of, segments_of
from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign as MeasuredCampaign
from railui.core import effect_record
from railui.identification.estimation.fit import Fit as Estimation
from railui.identification.estimation.identifiability import COMBINED as COMBINED
from railui.identification.estimation.identifiability import DETERMINED as DETERMINED
from railui.identification.estimation.identifiability import ROUGH as ROUGH
from railui.identification.estimation.identifiability import UNSEEN as UNSEEN
from railui.identification.loop import METHODS, calibrate_only
from railui.identification.result import LoopResult
from railui.identification.structure.candidate_scores import NO_SCORE_TEST, run_score_test
from railui.io.atomic import to_json_value
from railui.io.problems import suggest_name
from railui.progress import SILENT, Progress
from railui.report.loop.data import loop_report
from railui.report.loop.files import calibrated_design
from railui.report.loop.wording import unit_location
from railui.vehicle.effects import parameter_unit
from railui.vehicle.model import Model

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from railui.campaign.noise.model import NoiseModel
    from railui.identification.estimation.identifiability import Identifiability
    from railui.identification.estimation.validation import Validation
    from railui.identification.structure.score_test import ScoreTestResult

# keys of the loop report that the estimation alone does not determine
LOOP_ONLY_KEYS: Final = (
    "verdict",
    "out_of_time",
    "explained",
    "remainder",
    "leave_one_run_out",
    "sentence",
    "ranking",
    "traces",
    "detectable",
    "classes",
    "outside",
)
NORMAL_95: Final = 1.959964  # half the width of a 95 % interval in standard deviations


class Estimate(NamedTuple):
    """Estimate of a parameter.

    Attributes
    ----------
    path : str
    value, sd : float
        Estimate and its standard deviation, SI.
    unit : str
    nominal : float or None
        Value of the nominal vehicle; None for a number of an added effect.
    """

    path: str
    value: float
    sd: float
    unit: str
    nominal: float | None


class ScoredCandidate(NamedTuple):
    """Candidate effect: kind, location, wheelset (None: all), partial correlation rho with the residual."""

    kind: str
    at: str
    wheelset: int | None
    rho: float


@dataclass(frozen=True, eq=False)
class Fit(Summarised):
    """Estimated parameters of a campaign.

    `Campaign.adjust` computes that of the nominal vehicle, `Loop.fit` is that with the selected effects.

    Attributes
    ----------
    result : LoopResult
        Everything that the identification computed.
    data : mapping
        The report of `railui.adjust`.
    stage : {"before", "after"}
        The model without effects, or with those selected.
    """

    result: LoopResult = field(repr=False)
    data: Mapping[str, Any] = field(repr=False)
    stage: Literal["before", "after"] = "before"

    @property
    def estimation(self) -> Estimation:
        """The fit of the identification: normal equations, priors, iterations."""
        return self.result.before if self.stage == "before" else self.result.after

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths [p] of the estimated parameters, in the order of `covariance`; PATH@SEGMENT of a run's phase."""
        return self.estimation.free.paths

    @property
    def values(self) -> FloatArray:
        """Estimates [p], SI."""
        return self.estimation.x

    @property
    def sd(self) -> FloatArray:
        """Standard deviations [p] of the estimates."""
        return self.estimation.sd

    @property
    def covariance(self) -> FloatArray:
        """Covariance [p, p] of the estimates, robust to correlation of the residual in time."""
        return self.estimation.covariance

    @property
    def correlation(self) -> FloatArray:
        """Correlation [p, p] of the estimates."""
        sd = self.sd
        scale = np.where(sd > 0, sd, 1.0)
        return np.asarray(self.covariance / np.outer(scale, scale))

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Estimate of each parameter by path, with unit and nominal value."""
        nominal = self.result.nominal.design.values
        rows = {}
        for path, value, sd in zip(self.paths, self.values, self.sd, strict=True):
            base = path.partition("@")[0]
            unit = _unit(self.result, self.estimation.model, base)
            rows[path] = Estimate(path, float(value), float(sd), unit, nominal.get(base))
        return rows

    @property
    def units(self) -> dict[str, str]:
        """Unit of each parameter by path."""
        return {path: one.unit for path, one in self.estimates.items()}

    @property
    def status(self) -> str:
        """Reason for which the iteration ended."""
        return self.estimation.status

    @property
    def iterations(self) -> int:
        """Number of iterations."""
        return self.estimation.iterations

    @property
    def validation(self) -> Validation:
        """Validation of this model on the whole validation runs: NRMSE per channel and overall."""
        return self.result.validations[self.stage]

    @property
    def nrmse(self) -> float:
        """NRMSE on the validation runs; NaN where the vehicle diverged."""
        return self.validation.nrmse

    @property
    def nominal_nrmse(self) -> float:
        """NRMSE of the nominal vehicle on the validation runs."""
        return self.result.validations["declared"].nrmse

    @property
    def noise_floor(self) -> float:
        """NRMSE that noise alone leaves on the validation runs."""
        return self.result.noise_floor.nrmse

    @property
    def noise_model(self) -> NoiseModel:
        """Noise of every column: stated and estimated level, and colour; as a mapping, the level used."""
        return self.result.context.noise

    @property
    def design(self) -> Design:
        """The calibrated vehicle; with its covariance for the model of `stage` after, and from `Campaign.adjust`."""
        if self.stage == "after" or self.result.before is self.result.after:
            return Design.of(calibrated_design(self.result))
        return Design.of(self.estimation.model.design)

    @cached_property
    def identifiability(self) -> Identifiability:
        """Directions and classes of the parameters: determined, determined in combination only, not seen."""
        from railui.identification.estimation.identifiability import analyse_identifiability

        return analyse_identifiability(self.estimation, self.result.context.settings.identifiability)

    @cached_property
    def scores(self) -> ScoreTestResult:
        """Score test of every candidate effect against the residual of this fit; computed where it is not known."""
        if self.stage == "after" and self.result.score_test is not NO_SCORE_TEST:
            return self.result.score_test
        first = self.result.steps[0].score_test
        if self.stage == "before" and first is not NO_SCORE_TEST:
            return first
        return run_score_test(self.result.context, self.estimation)

    @property
    def candidates(self) -> tuple[ScoredCandidate, ...]:
        """Candidate effects by the partial correlation of their output difference with the residual, the best first."""
        rows = (row.candidate for row in self.scores.best)
        rho = (row.rho for row in self.scores.best)
        return tuple(ScoredCandidate(c.kind, c.at, c.wheelset, float(r)) for c, r in zip(rows, rho, strict=True))

    def residuals(self, role: str = "validation") -> tuple[Residual, ...]:
        """Return the residual series of every segment of a role.

        Parameters
        ----------
        role : {"validation", "estimation", "test"}

        Raises
        ------
        ValueError
            For another role.
        """
        segments = segments_of(self.result, role)
        return residuals_of(self.result, self._validated(role, segments), segments, role)

    def _validated(self, role: str, segments: Sequence[Any]) -> Validation:
        from railui.identification.estimation.validation import validate

        if role == "validation":
            return self.validation
        if self.stage == "after":
            return self.result.validate(segments)
        return validate(self.result.context, self.estimation.model, segments)

    def interval(self, path: str) -> tuple[float, float]:
        """Return the 95 % interval of a parameter from its standard deviation; KeyError for an unknown path."""
        estimates = self.estimates
        if path not in estimates:
            raise KeyError(f"{path!r} is not estimated: {suggest_name(path, estimates)}")
        one = estimates[path]
        return one.value - NORMAL_95 * one.sd, one.value + NORMAL_95 * one.sd

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document that `railui adjust` writes: every number finite or None."""
        return dict(self.data)

    def to_frame(self) -> pandas.DataFrame:
        """Return path, value, sd, unit and nominal of each parameter; ImportError without pandas."""
        from railui.api.frames import frame_of_rows

        return frame_of_rows([estimate._asdict() for estimate in self.estimates.values()]).set_index("path")

    def plot_estimates(self, ax: Axes | None = None) -> Axes:
        """Draw each estimate over its nominal value, with 95 % intervals."""
        from railui.report.figures.drawing import BLUE, GREY

        rows = [one for one in self.estimates.values() if one.nominal]

        def draw(on: Axes) -> None:
            ratios = np.array([one.value / (one.nominal or 1.0) for one in rows])
            errors = NORMAL_95 * np.array([one.sd / abs(one.nominal or 1.0) for one in rows])
            at = -np.arange(len(rows))
            on.errorbar(ratios, at, xerr=errors, fmt="o", ms=4, color=BLUE, lw=1.0)
            on.axvline(1.0, color=GREY, lw=0.8)
            on.set_yticks(at, [one.path for one in rows], fontsize=7)
            on.set_xlabel("estimate over nominal value, 95 % interval")

        return draw_on(ax, draw, (7.6, 0.8 + 0.24 * len(rows)))

    def summary_title(self) -> str:
        """Return the campaign."""
        return f"parameters estimated from {self.result.dataset.campaign.name}"

    def summary_rows(self) -> list[SummaryRow]:
        """Return each estimate, then the errors."""
        from railui.io.number_format import format_quantity

        rows = [
            SummaryRow(one.path, f"{format_quantity(one.value, one.unit)} +/- {format_quantity(one.sd, one.unit, 2)}")
            for one in self.estimates.values()
        ]
        errors = (self.nominal_nrmse, self.nrmse, self.noise_floor)
        names = ("NRMSE, nominal", "NRMSE, calibrated", "noise floor")
        return [*rows, *(SummaryRow(name, float(error)) for name, error in zip(names, errors, strict=True))]

    def summary_notes(self) -> Sequence[str]:
        """Return what the runs determine, in sentences."""
        return self.identifiability.sentences()


def _unit(result: LoopResult, model: Model, path: str) -> str:
    """Return the unit of an estimated number; "" for a point of a force curve."""
    group, number, key = (*path.split(".", 2), "", "")[:3]
    if group not in ("effects", "sensors"):
        return model.design.unit(path)
    effect = (model.design.effects if group == "effects" else model.sensors)[int(number)]
    records = {str(p["key"]): p for p in effect_record(effect.kind)["parameters"]}
    if key not in records:
        return ""
    return parameter_unit(records[key], unit_location(result, effect.at), effect.against)


def adjust(
    campaign: MeasuredCampaign | str | Path,
    *,
    method: str = METHODS[0],
    coefficients: bool = False,
    section_length: float | None = None,
    profile: Sequence[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Estimate the parameters of a campaign's vehicle, without a search for effects, as `railui adjust`.

    Parameters
    ----------
    campaign : Campaign, str or Path
        Campaign, its directory or file.
    method : {"least-squares", "two-parallel-models"}
        All parameters at once, or one at a time by Broersen's two parallel models.
    coefficients : bool
        Estimate the 16 coefficients of the wheelset equations, too.
    section_length : float, optional
        Length [m] of the track sections of which each is estimated.
    profile : sequence of str
        Parameters whose profile likelihood is computed.
    seed : int
        Seed of the random signs of the tests and of the ranking; noise realisations have fixed seeds.
    jobs : int, optional
        Threads; all processors by default.
    progress : Progress
        Receiver of messages and intermediate results.

    Returns
    -------
    dict
        The keys of railui.adjust/1, documented in docs/results.md.

    Raises
    ------
    FileProblems
        If a file cannot be used.
    ValueError
        For an unknown method or parameter, and for `coefficients` or `section_length` of a campaign of a rig.
    """
    return estimate(
        campaign,
        method=method,
        coefficients=coefficients,
        section_length=section_length,
        profile=profile,
        seed=seed,
        jobs=jobs,
        progress=progress,
    ).to_dict()


def estimate(
    campaign: MeasuredCampaign | str | Path,
    *,
    method: str = METHODS[0],
    coefficients: bool = False,
    section_length: float | None = None,
    profile: Sequence[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    progress: Progress = SILENT,
) -> Fit:
    """Estimate the parameters of a campaign; parameters and exceptions as `adjust`."""
    loaded = as_campaign(campaign)
    if loaded.design.kind != "bogie" and (coefficients or section_length is not None):
        raise ValueError("coefficients and section_length are for bogies on a track, this campaign is not of one")
    for path in profile:
        if path not in loaded.estimated_parameters:
            known = list(loaded.estimated_parameters)
            raise ValueError(f"{path!r} is not estimated in this campaign, {suggest_name(path, known)}")
    result = calibrate_only(loaded.dataset, method=method, seed=seed, jobs=jobs, progress=progress)
    more = further_analyses(
        result,
        method=method,
        coefficients=coefficients,
        section_length=section_length,
        profile=profile,
        progress=progress,
    )
    return Fit(result, adjust_report(loop_report(result), method) | more)


def adjust_report(report: Mapping[str, Any], method: str) -> dict[str, Any]:
    """Return the part of a loop report that the estimation alone determines."""
    kept = {key: value for key, value in report.items() if key not in LOOP_ONLY_KEYS}
    return kept | {"schema": "railui.adjust/1", "method": method}


def further_analyses(
    result: LoopResult,
    *,
    method: str,
    coefficients: bool = False,
    section_length: float | None = None,
    profile: Sequence[str] = (),
    progress: Progress = SILENT,
) -> dict[str, Any]:
    """Return the further analyses of an estimation as data; parameters as `adjust`."""
    from railui.identification.estimation.identifiability import estimate_per_section, profile_likelihoods
    from railui.identification.estimation.parallel_models import residual_correlations
    from railui.identification.unmodelled.coefficients import estimate_coefficients
    from railui.report.loop.identifiability import coefficient_rows, correlation_rows, profile_rows, segment_rows

    context = replace(result.context, progress=progress)
    fit = result.before
    data: dict[str, Any] = {}
    if method == METHODS[1]:
        data["correlations"] = correlation_rows(residual_correlations(context, fit))
    if coefficients:
        data["coefficients"] = coefficient_rows(estimate_coefficients(context, fit))
    if section_length is not None:
        data["stretches"] = segment_rows(estimate_per_section(context, fit, section_length))
    if profile:
        data["profile"] = profile_rows(profile_likelihoods(context, fit, profile))
    return dict(to_json_value(data))
