"""Laws of a rig whose motion depends sensitively on its start, so that no simulation follows it over whole runs.

A strongly driven nonlinear rig may move chaotically: two simulations from nearly equal states part within a fraction of
the record. The error over whole runs then decides on no law, not even on the true one. The equation of motion holds
all the same, and a simulation follows the motion for some periods.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.campaign.segment import Segment
from railui.identification.context import Context
from railui.identification.estimation.equation_error import EquationError, LawEstimate
from railui.identification.estimation.failed_fit import follows_on_validation
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.growing_windows import follows, spread_windows
from railui.identification.estimation.initial_state import estimate_initial_state
from railui.identification.estimation.modulating_functions import dominant_period
from railui.identification.estimation.validation import Validation
from railui.identification.prediction import Predictor, SimulationError
from railui.identification.structure.candidates import Candidate, list_candidates
from railui.parallel import map_threads
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model

MAX_SAMPLES = 20_000  # of a segment, its first ones
FOLLOWED_PERIODS = 5.0  # of the windows over which a simulation must follow the motion
START_DIFFERENCE = 1e-6  # of two simulations, in the standard deviation of the motion


@dataclass(frozen=True)
class SensitiveMotion:
    """Law with which the equation of motion of a rig holds, and how far its simulations follow the record.

    Attributes
    ----------
    model
        The nominal model with the law and the estimates by equation error.
    share
        Squared equation error over that without the law.
    seconds
        Duration [s] of windows over which a simulation follows the motion.
    window_nrmse
        Median NRMSE on these, their initial states estimated.
    growth
        Largest factor by which two simulations of a run part from a small difference at its start.
    """

    model: Model
    share: float
    seconds: float
    window_nrmse: float
    growth: float

    @property
    def effect(self) -> PlacedEffect:
        """The law."""
        return self.model.design.effects[-1]


def find_sensitive_motion(context: Context, fit: Fit, validation: Validation) -> SensitiveMotion | None:
    """Find the law of a driven rig with a sensitive motion that a fit does not follow; None where there is none.

    validation: of the fit, on the runs that select effects.
    """
    if context.nominal.design.form != "rig":
        return None
    if follows(context, fit) and follows_on_validation(context, validation, context.dataset.selection):
        return None
    runs = [s.truncated(min(s.samples, MAX_SAMPLES)) for s in context.dataset.estimation if s.is_driven]
    equations = EquationError(context.nominal, runs, context.campaign.estimated_parameters)
    if not equations.is_determined:
        return None
    candidates = list_candidates(context.nominal, runs, without=context.excluded)
    laws = [law for law in map_threads(lambda c: _best_law(equations, c), candidates, context.jobs) if law is not None]
    for effect, estimate in sorted(laws, key=lambda law: law[1].share):
        if estimate.share > context.settings.notes.max_equation_error_share:
            break
        try:
            motion = _simulated_motion(context, runs, effect, estimate)
        except SimulationError:
            continue
        if motion.window_nrmse**2 <= context.settings.windows.followed_misfit:
            return motion if motion.growth >= context.settings.notes.sensitive_growth else None
    return None


def _simulated_motion(
    context: Context, runs: Sequence[Segment], effect: PlacedEffect, estimate: LawEstimate
) -> SensitiveMotion:
    """Simulate the runs and windows of them with a law and its estimates."""
    paths = context.campaign.estimated_parameters
    model = context.nominal.with_path_values(paths, estimate.values).with_effect(effect)
    seconds = FOLLOWED_PERIODS * max(dominant_period(s) for s in runs)
    windows = spread_windows(context.settings.windows, runs, seconds)
    growth = max(difference_growth(model, s) for s in runs)
    return SensitiveMotion(model, estimate.share, seconds, _median_window_error(context, model, windows), growth)


def difference_growth(model: Model, segment: Segment) -> float:
    """Largest factor by which two simulations of a segment part from a small difference of their initial states.

    The displacements are compared. Infinite where a simulation diverges.
    """
    start = np.zeros(model.vehicles(segment.coach_forces).state_count(model.single_batch()))
    first = Predictor(model, segment, initial_state=start).simulate(["z.rig.0"])
    start[0] = START_DIFFERENCE * max(float(np.std(first.series)), 1e-300)
    second = Predictor(model, segment, initial_state=start).simulate(["z.rig.0"])
    if first.diverged[0] >= 0 or second.diverged[0] >= 0:
        return np.inf
    return float(np.max(np.abs(second.series - first.series)) / start[0])


def _best_law(equations: EquationError, candidate: Candidate) -> tuple[PlacedEffect, LawEstimate] | None:
    """Law of a candidate with the least equation error, its strength estimated; None without a force of its own."""
    if not candidate.has_own_force or candidate.is_linear:
        return None
    best: tuple[PlacedEffect, LawEstimate] | None = None
    for shape in candidate.shapes:
        e = equations.estimate(candidate.effect_with(shape))
        is_possible = e is not None and (e.amount > 0 or not candidate.is_one_sided)
        if e is not None and is_possible and (best is None or e.share < best[1].share):
            best = candidate.effect_with(candidate.scale_force(shape, e.amount)), e
    return best


def _median_window_error(context: Context, model: Model, windows: Sequence[Segment]) -> float:
    """Median NRMSE of simulations of windows from their estimated initial states."""

    def error(window: Segment) -> float:
        start = estimate_initial_state(context, model, window)
        series, diverged = Predictor(model, window, initial_state=start).simulate()
        measured = window.measured(window.channels)
        residual = (measured - series[0]).var(axis=1) / np.maximum(measured.var(axis=1), 1e-300)
        return float(np.sqrt(residual.mean())) if diverged[0] < 0 else np.inf

    return float(np.median(list(map_threads(error, windows, context.jobs))))
