"""Screening of candidates: quick fits of each on the first part of the runs, from several starting points."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np

from railui import core
from railui.campaign.settings.detection import RefitSettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import continue_fit, fit_output_error
from railui.identification.estimation.problem import FitSegment, adapt_to_model, truncate
from railui.identification.prediction import SimulationError
from railui.identification.structure.candidates import Candidate, candidate_text
from railui.identification.structure.locations import Element, estimated_elements, joint_key
from railui.identification.structure.score_result import ScoreResult
from railui.identification.structure.score_test import ScoreTestResult
from railui.io.problems import FileProblems
from railui.parallel import map_threads
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

RIG_STIFFNESS = "vehicle.rig.stiffness"
T = TypeVar("T")
R = TypeVar("R")
StartingPoint = tuple[PlacedEffect, Mapping[str, float]]
Screened = tuple[ScoreResult, Fit]


def has_states(candidate: Candidate) -> bool:
    """True for an effect with internal states."""
    return bool(core.effect_record(candidate.kind)["states"] > 0)


def starting_points(settings: RefitSettings, scores: ScoreTestResult, result: ScoreResult) -> list[StartingPoint]:
    """List the starting points of a candidate: its best shapes at their estimated amounts, and at a small one.

    Each has the phases of the segments that the score test estimated with this shape.
    """
    candidate = result.candidate
    same = sorted((s for s in scores.results if s.candidate == candidate), key=lambda s: -s.admissible_rho)
    count = settings.screened_shapes_memory if has_states(candidate) else settings.screened_shapes
    shapes = [(scaled_shape(settings, s), s.phases) for s in same[:count]]
    if candidate.strength is not None:
        shape, phases = shapes[0]
        shapes.append((candidate.scale_force(shape, settings.small_start), phases))
    return [(candidate.effect_with(shape), phases) for shape, phases in shapes]


def scaled_shape(settings: RefitSettings, result: ScoreResult) -> dict[str, float]:
    """Parameters of a shape at its estimated amount."""
    candidate = result.candidate
    shape = dict(candidate.shapes[result.shape])
    if candidate.strength is not None:
        wrong_sign = candidate.is_one_sided and result.amount <= 0
        return candidate.scale_force(shape, settings.wrong_sign_start if wrong_sign else result.amount)
    if core.effect_record(candidate.kind)["acts"] == "sensor":
        neutral = 1.0 if "gain" in shape else 0.0
        return {k: neutral + result.amount * (v - neutral) for k, v in shape.items()}
    return shape


def fit_with_effects(
    context: Context,
    model: Model,
    segments: Sequence[FitSegment],
    paths: Sequence[str],
    *,
    tolerance: float,
    max_iterations: int,
    misfit_limit: float = np.inf,
) -> Fit | None:
    """Fit a model with effects; None where it cannot be simulated."""
    try:
        return fit_output_error(
            context,
            model,
            paths,
            segments=segments,
            tolerance=tolerance,
            max_iterations=max_iterations,
            misfit_limit=misfit_limit,
        )
    except SimulationError:
        return None


class ScreeningFits:
    """Quick fits of one candidate after another on the first part of the runs, from several starting points each.

    Parameters that the data hardly determine are fixed, so that the derivatives fit into one batch of sixteen vehicles;
    a candidate that is far behind the best is given up.
    """

    def __init__(self, context: Context, fit: Fit) -> None:
        self.context = context
        self.settings = context.settings.refit
        self.model = fit.model
        self.segments = truncate(context, fit.segments, self.settings.screening_duration)
        # the steps suffice for much larger motions than those of a run; a fit with fewer ends where it diverges
        refinement = 2**context.settings.score_test.max_step_doublings
        self.max_steps = refinement * max(t.steps for t in self.segments)
        self.is_rig = fit.model.design.form == "rig"
        self.is_windowed = any(t.is_window for t in self.segments)
        base = context.campaign.estimated_parameters
        prior_share = dict(zip(fit.free.paths, fit.sd / fit.free.prior_sd, strict=True))
        self.base = sorted(base, key=lambda p: prior_share.get(p, 0.0))
        quiet = context.in_background(context.jobs)
        without_effect = fit_output_error(quiet, fit.model, base, segments=self.segments, max_iterations=0)
        self.rss_without_effect = without_effect.normal.rss
        self.least_rss = self.rss_without_effect

    @property
    def is_settled(self) -> bool:
        """True where little more than noise is left; with the weights, noise leaves a misfit of one per sample."""
        noise = self.settings.settled_noise_ratio**2 * sum(t.measured.size for t in self.segments)
        return self.least_rss <= noise + self.settings.screening_misfit_share * self.rss_without_effect

    def fit_candidates(self, scores: ScoreTestResult, results: Sequence[ScoreResult]) -> list[Screened]:
        """Fit every candidate that can be simulated by a few iterations from its best starting point.

        First a few iterations of all, then more of the two that lead, then of those that are not far behind them and of
        the related laws of the first: how soon one of them converges does not decide between them.
        """
        fits = dict[ScoreResult, Fit]()
        for s, fit in zip(results, self._map(lambda s: self._first_iterations(scores, s), results), strict=True):
            if fit is not None:
                fits[s] = fit
            if self.is_windowed:  # on windows a candidate takes seconds
                self.context.progress.message(f"  {candidate_text(s.candidate)}: first iterations on windows")
        self.least_rss = min([self.rss_without_effect, *(f.normal.rss for f in fits.values())])
        order = sorted(fits, key=lambda s: fits[s].normal.rss)
        leading = self.settings.leading_candidates

        def further(s: ScoreResult) -> Fit:
            return self._continue_if_close(s, fits[s], is_related=order[0].candidate.is_related(s.candidate))

        for some in (order[:leading], order[leading:]):
            fits.update(zip(some, self._map(further, some), strict=True))
            self.least_rss = min([self.least_rss, *(fits[s].normal.rss for s in some)])
        if self.is_rig:
            self._improve_clearance(fits)
        return list(fits.items())

    def _improve_clearance(self, fits: dict[ScoreResult, Fit]) -> None:
        """Fit a clearance from the estimates of a stop as well: without a spring in the gap both are one law.

        From its own starting points the motion of a clearance may end in a wrong valley.
        """
        of_kind = {s.candidate.kind: s for s in fits}
        stop, clearance = of_kind.get("bump_stop"), of_kind.get("free_play")
        if stop is None or clearance is None or fits[stop].normal.rss >= fits[clearance].normal.rss:
            return
        model = fits[stop].model
        effect = model.design.effects[-1]
        gap, stiffness = (float(effect.parameters[key]) for key in ("gap", "stiffness"))  # type: ignore[arg-type]
        linear = np.array([model.value(RIG_STIFFNESS) + stiffness])
        base = model.without_effect(len(model.design.effects) - 1).with_path_values([RIG_STIFFNESS], linear)
        fit = self._start((PlacedEffect("free_play", effect.at, None, {"half_width": gap}), {}), base=base)
        if fit is not None:
            fit = self._iterate(fit, self.settings.rig_iterations)
            fits[clearance] = min(fits[clearance], fit, key=lambda f: f.cost)

    def fit_together(self, effects: Sequence[PlacedEffect]) -> Fit | None:
        """Fit several effects at once from one starting point; None where they cannot be simulated."""
        self.context.check_time()
        fit = self._start(*((effect, {}) for effect in effects))
        iterations = self.settings.rig_iterations if self.is_rig else self.settings.slow_iterations
        return None if fit is None else self._iterate(fit, iterations)

    def fit_absorbed_elements(self, scores: ScoreTestResult, fitted: Sequence[ScoreResult]) -> list[Screened]:
        """Fit springs and dampers from the nominal model, where much is left with every other candidate.

        Without such an element the estimated parameters move far away to compensate for it, and near their estimates
        the score test detects little of it.
        """
        known = {s.candidate for s in fitted}
        estimated = estimated_elements(self.model, self.context.campaign.estimated_parameters)
        elements = [
            s
            for s in scores.best
            if s.candidate not in known
            and s.candidate.is_linear
            and s.unabsorbed_share <= self.settings.max_unabsorbed_share
            and not self._is_any(s.candidate, estimated)
        ]
        started = zip(elements, self._map(self._start_element, elements), strict=True)
        limit = self.settings.give_up_ratio * self.least_rss
        close = [(s, fit) for s, fit in started if fit is not None and fit.normal.rss <= limit]
        screened = []
        continued = self._map(lambda item: self._iterate(item[1], self.settings.slow_iterations), close)
        for (s, _), fit in zip(close, continued, strict=True):
            if fit.normal.rss < self.settings.absorbed_misfit_ratio * self.least_rss:
                share = fit.normal.rss / self.rss_without_effect
                name = candidate_text(s.candidate)
                self.context.progress.message(
                    f"  {name:48s} from the nominal model, misfit {share:.4f} of that without effect"
                )
                screened.append((s, fit))
                self.least_rss = fit.normal.rss
        return screened

    def _is_any(self, c: Candidate, elements: Collection[Element]) -> bool:
        """True for a spring or damper that an estimated parameter already is."""
        return c.wheelset is None and (c.kind, joint_key(self.model, c.at)) in elements

    def _map(self, work: Callable[[T], R], items: Sequence[T]) -> Iterator[R]:
        return map_threads(work, items, self.context.jobs)

    def _start_element(self, s: ScoreResult) -> Fit | None:
        self.context.check_time()
        c, strength = s.candidate, str(s.candidate.strength)
        effect = c.effect_with({strength: self.settings.absorbed_start * c.shapes[0][strength]})
        fit = self._start((effect, {}), base=self._nominal())
        # the nominal model is far from the optimum: two iterations do not rank candidates yet
        return None if fit is None else self._iterate(fit, self.settings.further_iterations)

    def _first_iterations(self, scores: ScoreTestResult, s: ScoreResult) -> Fit | None:
        """Best fit after the first iterations from every starting point; None where none can be simulated."""
        self.context.check_time()
        points = starting_points(self.settings, scores, s)
        fits = [self._start(point) for point in points]
        # a rig costs little, and a hunting vehicle without a bounding effect diverges: from the nominal model as well
        if self.is_rig or self.is_windowed:
            fits += [self._start(point, base=self._nominal()) for point in points]
        tries = [f for f in fits if f is not None]
        if tries and self._bounds_hunting(tries[0]):  # the starting points separate only after more iterations
            tries = [self._iterate(f, self.settings.slow_iterations) for f in tries]
        return min(tries, key=lambda f: f.cost, default=None)

    def _continue_if_close(self, s: ScoreResult, fit: Fit, *, is_related: bool) -> Fit:
        """Continue a fit that may still become the best; slow ones get more iterations and a wider limit."""
        self.context.check_time()
        rss, least = fit.normal.rss, self.least_rss
        if self.is_rig:  # costs little, and the speed of slip or the gap may be far from any of the shapes
            near = rss <= self.settings.give_up_ratio_memory * self.rss_without_effect
            return self._iterate(fit, self.settings.rig_iterations) if near else fit
        may_be_slow = has_states(s.candidate) or is_related
        slow = self._bounds_hunting(fit) or (may_be_slow and rss <= self.settings.give_up_ratio_memory * least)
        if slow or rss <= self.settings.give_up_ratio * least:
            return self._iterate(fit, self.settings.slow_iterations if slow else self.settings.further_iterations)
        return fit

    def _bounds_hunting(self, fit: Fit) -> bool:
        """True where an effect bounds the hunting of a vehicle that is fitted on windows."""
        return self.is_windowed and fit.model.limits_hunting

    def _nominal(self) -> Model:
        """Return the model with its estimated parameters back at their nominal values."""
        nominal = self.context.nominal
        return self.model.with_path_values(self.base, np.array([nominal.row[nominal.columns[p]] for p in self.base]))

    def _start(self, *points: StartingPoint, base: Model | None = None) -> Fit | None:
        try:
            model = base or self.model
            for effect, phases in points:
                model = model.with_effect(effect, phases)
            segments = adapt_to_model(self.context, model, self.segments, self.max_steps)
        except (SimulationError, FileProblems):
            return None  # this starting point cannot be simulated, or is outside the limits of its law; another may do
        effect_paths = model.effect_paths()
        # a segment has one phase of each rotating part
        lanes = core.LANES - 1 - len(effect_paths) - len(model.run_dependent_paths())
        few = len(self.base) if self.is_windowed else max(lanes, len(self.base) // 2)
        paths = [*self.base[:few], *effect_paths]
        return fit_with_effects(
            self.context.in_background(1),
            model,
            segments,
            paths,
            tolerance=self.settings.screening_tolerance,
            max_iterations=self.settings.first_iterations,
        )

    def _iterate(self, fit: Fit, max_iterations: int) -> Fit:
        """Continue a fit; return it as it is where that makes it no better, diverges, or is too stiff by now."""
        tolerance = self.settings.screening_tolerance
        background = self.context.in_background(1)
        try:
            segments = adapt_to_model(self.context, fit.model, fit.segments, self.max_steps)
            further = continue_fit(background, fit, segments, tolerance=tolerance, max_iterations=max_iterations)
        except SimulationError:
            return fit
        return further if further.cost < fit.cost else fit
