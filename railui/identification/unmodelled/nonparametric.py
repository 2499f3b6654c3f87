"""Nonparametric estimate of the force of an identified effect, to compare with its law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import adapt_to_model, drop_states
from railui.identification.prediction import SimulationError
from railui.io.problems import FileProblems
from railui.vehicle.effects import PlacedEffect

KIND = "measured_force"
TOLERANCE = 1e-4
MAX_ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class ForcePoints:
    """Force F at points of a motion, with its standard deviation: each [point].

    The force at the middle point is given, not estimated: a constant force lies outside the comparison band.
    """

    motion: FloatArray
    force: FloatArray
    sd: FloatArray


def estimate_force_points(
    context: Context, fit: Fit, index: int, against: str, motion: FloatArray, start: FloatArray
) -> ForcePoints | None:
    """Replace an effect by a free force curve and estimate its points; all other parameters keep their values.

    Parameters
    ----------
    context, fit
        Of the identification, and the calibrated model with the effect.
    index
        Of the effect among those of the design.
    against
        Abscissa: displacement "z" or velocity "v".
    motion
        Points [point] of the abscissa, ascending.
    start
        Force F [point] from which the estimation starts.

    Returns
    -------
    ForcePoints or None
        None if the vehicle cannot be simulated with a curve in place of the effect.
    """
    effect = fit.model.design.effects[index]
    points: Mapping[str, tuple[float, ...]] = {"motion": tuple(motion.tolist()), "force": tuple(start.tolist())}
    try:
        model = fit.model.without_effect(index)
        segments = drop_states(context, fit.model, model, fit.segments)
        model = model.with_effect(PlacedEffect(KIND, effect.at, effect.wheelset, points, against))
        group = f"effects.{len(model.design.effects) - 1}.force"
        free = [f"{group}.{i}" for i in range(len(motion)) if i != len(motion) // 2]
        found = fit_output_error(
            context.in_background(context.jobs),
            model,
            free,
            segments=adapt_to_model(context, model, segments),
            tolerance=TOLERANCE,
            max_iterations=MAX_ITERATIONS,
            stable=False,
        )
    except (SimulationError, FileProblems):  # a point that the motion hardly visits may have a force beyond all limits
        return None
    sd_by_path = dict(zip(found.free.paths, found.sd, strict=True))
    paths = [f"{group}.{i}" for i in range(len(motion))]
    force = np.array([found.model.value(path) for path in paths])
    return ForcePoints(motion, force, np.array([sd_by_path.get(path, 0.0) for path in paths]))
