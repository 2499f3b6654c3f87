"""Nonparametric curves of force against motion at a location: share of the residual explained, and fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from railui import core
from railui.arrays import FloatArray
from railui.campaign.settings.discrepancy import DiscrepancySettings
from railui.identification.context import Context
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.estimation.problem import FitSegment, adapt_to_model
from railui.identification.prediction import SimulationError
from railui.identification.structure.candidates import driven_locations
from railui.identification.structure.locations import Numbers, distinct_locations, location_numbers
from railui.io.problems import FileProblems
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effects import WHEELSET_LOCATIONS
from railui.vehicle.model import Model

TOLERANCE = 1e-5
MIN_VISIT_SHARE = 1e-9  # of the squared response to the most visited point of a curve, which any other counts with
MAX_ITERATIONS = 15
CURVE_LOCATIONS = (
    "secondary_lateral",
    "secondary_yaw",
    "primary_lateral",
    "primary_yaw",
    "wheelset",
    "wheelset_yaw",
    "rig",
)


@dataclass(frozen=True)
class CurveLocation:
    """Location of a force curve.

    against: displacement "z" or velocity "v". grid: points [point] of the motion. size: typical force, which scales the
    perturbations.
    """

    at: str
    wheelset: int | None
    against: str
    grid: FloatArray
    size: float


def fit_curve(context: Context, fit: Fit, location: CurveLocation, force: FloatArray) -> Fit | None:
    """Fit all parameters together with a force curve, from the linear estimate of its points.

    Returns None if the model cannot be simulated.
    """
    middle = len(force) // 2  # a constant force is outside the band: the curve is fixed to 0 at zero motion
    points = {
        "motion": tuple(float(x) for x in location.grid),
        "force": tuple(float(x - force[middle]) for x in force),
    }
    try:
        model = fit.model.with_effect(
            PlacedEffect("measured_force", location.at, location.wheelset, points, location.against)
        )
        added = [p for p in model.effect_paths() if p not in fit.free.paths and not p.endswith(f".force.{middle}")]
        paths = [*fit.free.paths, *added]
        return fit_output_error(
            context.in_background(context.jobs),
            model,
            paths,
            segments=adapt_to_model(context, model, fit.segments),
            tolerance=TOLERANCE,
            max_iterations=MAX_ITERATIONS,
        )
    except (SimulationError, FileProblems):  # a point that the motion hardly visits may have a force beyond all limits
        return None


def curve_locations(settings: DiscrepancySettings, fit: Fit) -> list[CurveLocation]:
    """List the locations of force curves, each with displacement and with velocity."""
    model = fit.model
    linear = model.local_elements
    prescribed = driven_locations([t.segment for t in fit.segments])
    spots = []
    for at, numbers in _usual_locations(model):
        ports = [w for other, w in linear if other == at and w != core.LINKAGE_NUMBER]
        if not ports or at in prescribed:
            continue
        for wheelset in numbers:
            if at in ("wheelset", "wheelset_yaw") and wheelset is None:
                continue
            spots.append((at, wheelset, [w for w in ports if wheelset is None or w == wheelset]))
    motion = _motion(fit, [(at, w) for at, _, wheelsets in spots for w in wheelsets])
    locations = []
    for at, wheelset, wheelsets in spots:
        k = linear[(at, wheelsets[0])][0]
        sd = {against: _rms([motion[f"{against}.{at}.{w}"] for w in wheelsets]) for against in ("z", "v")}
        size = (k if k > 0 else 1e6) * sd["z"]
        for against in ("z", "v"):
            grid = sd[against] * np.linspace(-settings.curve_span, settings.curve_span, settings.curve_points)
            locations.append(CurveLocation(at, wheelset, against, grid, size))
    return locations


def _usual_locations(model: Model) -> list[tuple[str, Numbers]]:
    """List the locations of force curves with their numbers: joints and wheelsets."""
    structure = model.design.structure
    if structure is None:
        return [(at, (None, 1, 2) if at in WHEELSET_LOCATIONS else (None,)) for at in CURVE_LOCATIONS]
    classes = structure.effect_locations
    used = [at for at in distinct_locations(model) if classes[at].catalogue_name in CURVE_LOCATIONS]
    return [(at, location_numbers(structure, at)) for at in used]


def _motion(fit: Fit, ports: Sequence[tuple[str, int]]) -> dict[str, list[FloatArray]]:
    """Displacement and velocity of each port on every segment, by channel."""
    channels = list(dict.fromkeys(f"{against}.{at}.{w}" for at, w in ports for against in ("z", "v")))
    series = [t.motion_predictor(fit.model).simulate(channels).converged()[0] for t in fit.segments]
    return {channel: [x[i] for x in series] for i, channel in enumerate(channels)}


def _rms(motions: Sequence[Sequence[FloatArray]]) -> float:
    """Mean over segments of the standard deviation of some motions [port][segment]."""
    return float(np.mean([np.std(of_segment) for of_segment in zip(*motions, strict=True)])) or 1e-6


def explained_by_curve(
    settings: DiscrepancySettings, fit: Fit, bases: Sequence[FloatArray], location: CurveLocation
) -> tuple[float, FloatArray]:
    """Estimate a force curve linearly: the share of the squared residual that it explains, and its forces [point].

    The share is that beyond the estimated parameters; bases: residual and sensitivities of each segment.
    """
    n = len(location.grid)
    parameters = len(bases[0])
    size = parameters + n
    gram = np.zeros((size, size))
    for t, base in zip(fit.segments, bases, strict=True):
        sensitivities = _curve_sensitivities(fit, location, t)
        if sensitivities is None:
            return 0.0, np.zeros(n)
        rows = np.vstack([base.reshape(parameters, -1), sensitivities.reshape(n, -1)])
        gram += rows @ rows.T
    squares = np.diag(gram).copy()
    squares[parameters:] = np.maximum(squares[parameters:], MIN_VISIT_SHARE * squares[parameters:].max())
    scale = 1.0 / np.sqrt(np.maximum(squares, 1e-300))
    gram = gram * np.outer(scale, scale)
    normal = gram[1:parameters, 1:parameters] + 1e-9 * np.eye(parameters - 1)
    normal_with_curve = gram[1:, 1:] + 1e-9 * np.eye(size - 1)
    normal_with_curve[parameters - 1 :, parameters - 1 :] += settings.curve_smoothness * roughness(scale[parameters:])
    rss = gram[0, 0] - gram[0, 1:parameters] @ linalg.solve(normal, gram[1:parameters, 0], assume_a="pos")
    solution = linalg.solve(normal_with_curve, gram[1:, 0], assume_a="pos")
    rss_with_curve = gram[0, 0] - gram[0, 1:] @ solution
    force = solution[parameters - 1 :] * scale[parameters:] / scale[0]
    return float(1.0 - rss_with_curve / rss), np.asarray(force)


def roughness(scale: FloatArray) -> FloatArray:
    """Matrix R [point, point] of the mean squared second difference x'Rx of a curve with the ordinates scale * x.

    It is relative to that of independent ordinates. A straight line has none.

    >>> x = np.array([1.0, 1.0, 1.0])
    >>> bool(abs(x @ roughness(np.array([1.0, 2.0, 3.0])) @ x) < 1e-12)
    True
    """
    second_difference = np.diff(np.eye(len(scale)), 2, axis=0) * scale
    return np.asarray(second_difference.T @ second_difference / np.mean(second_difference**2))


def _curve_sensitivities(fit: Fit, location: CurveLocation, target: FitSegment) -> FloatArray | None:
    """Output difference per unit of force at each point of the curve [point, channel, n]; None if one diverges."""
    n = len(location.grid)
    unit = 1e-3 * location.size
    rows = [
        core.effect_numbers(
            "measured_force",
            {"motion": location.grid, "force": unit * np.eye(n)[i] if i < n else np.zeros(n)},
        )
        for i in [n, *range(n)]
    ]
    placement = core.Placement("measured_force", location.at, location.wheelset, len(rows[0]), location.against)
    vehicles = fit.model.vehicles(target.segment.coach_forces, [placement])
    model = fit.model.on_segment(*target.segment.segment_key)
    batch = model.batch(np.tile(model.row, (n + 1, 1)), np.array(rows), np.ones((n + 1, 1)))
    series, diverged = target.for_differences.predictor(fit.model).simulate(batch=batch, vehicles=vehicles)
    return None if np.any(diverged >= 0) else target.without_initial_state((series[1:] - series[0]) / unit)
