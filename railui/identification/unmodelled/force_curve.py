"""A free curve of force against motion at a place: what it explains of the residual, the vehicle adjusted with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from railui import core
from railui.arrays import FloatArray
from railui.campaign.dataset import Dataset, simulate
from railui.identification.estimation.output_error import Fit, fit_output_error
from railui.identification.estimation.problem import FitSegment, adapt_to_model
from railui.identification.structure.candidates import driven_places
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effect_records import WHEELSET_LOCATIONS
from railui.vehicle.model import Model

POINTS = 9  # of a measured curve
REACH = 2.5  # standard deviations of the motion that the curve spans to either side
SMOOTH = 3e-3  # penalty on the bends of a curve, in its own scale
PLACES = ("secondary_lateral", "secondary_yaw", "primary_lateral", "primary_yaw", "wheelset", "wheelset_yaw", "rig")


@dataclass(frozen=True)
class CurveLocation:
    """A place (on one wheelset or all), what its curve stands against (z or v), the grid of motion, a usual force."""

    at: str
    wheelset: int | None
    against: str
    grid: FloatArray
    size: float


def fit_curve(
    fit: Fit, measurement: Dataset, declared: Model, spot: CurveLocation, force: FloatArray, jobs: int | None
) -> Fit | None:
    """Everything adjusted with a free curve at a spot, from the linear estimate of its points."""
    middle = len(force) // 2  # a constant force is not seen in the band: the curve is pinned at rest
    points = {"motion": tuple(float(x) for x in spot.grid), "force": tuple(float(x - force[middle]) for x in force)}
    try:
        model = fit.model.with_effect(PlacedEffect("measured_force", spot.at, spot.wheelset, points, spot.against))
        more = [p for p in model.effect_paths() if p not in fit.free.paths and not p.endswith(f".force.{middle}")]
        paths = [*fit.free.paths, *more]
        return fit_output_error(
            model, measurement, paths, declared, ready=adapt_to_model(model, fit.segments, measurement), tolerance=1e-5,
            most=15, jobs=jobs,
        )  # fmt: skip
    except ValueError:
        return None


def curve_locations(fit: Fit) -> list[CurveLocation]:
    """Places and what a curve there may stand against, with its grid of motion."""
    model, stretches = fit.model, [t.segment for t in fit.segments]
    linear = model.vehicles().sites(model.single())
    barred = driven_places(stretches)
    out = []
    for at in PLACES:
        ports = [w for place, w in linear if place == at and w != core.LINKAGE]
        if not ports or at in barred:
            continue
        for wheelset in (None, 1, 2) if at in WHEELSET_LOCATIONS else (None,):
            if at in ("wheelset", "wheelset_yaw") and wheelset is None:
                continue
            used = [w for w in ports if wheelset is None or w == wheelset]
            for against in ("z", "v"):
                sd = _motion(fit, at, used, against)
                k = linear[(at, used[0])][0]
                size = (k if k > 0 else 1e6) * _motion(fit, at, used, "z")
                out.append(CurveLocation(at, wheelset, against, sd * np.linspace(-REACH, REACH, POINTS), size))
    return out


def _motion(fit: Fit, at: str, wheelsets: Sequence[int], against: str) -> float:
    channels = [f"{against}.{at}.{w}" for w in wheelsets]
    sds = [simulate(fit.model, t.segment, channels, steps=t.steps, initial=t.initial_state)[0][0].std() for t in fit.segments]
    return float(np.mean(sds)) or 1e-6


def explained(fit: Fit, bases: Sequence[FloatArray], spot: CurveLocation) -> tuple[float, FloatArray]:
    """Share of the squared residual that a free curve explains beyond the adjustable parameters, and its forces."""
    n = len(spot.grid)
    own = len(bases[0])
    size = own + n
    gram = np.zeros((size, size))
    for t, base in zip(fit.segments, bases, strict=True):
        hats = _hats(fit, spot, t)
        if hats is None:
            return 0.0, np.zeros(n)
        rows = np.vstack([base.reshape(own, -1), hats.reshape(n, -1)])
        gram += rows @ rows.T
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    gram = gram * np.outer(scale, scale)
    inner = gram[1:own, 1:own] + 1e-9 * np.eye(own - 1)
    whole = gram[1:, 1:] + 1e-9 * np.eye(size - 1)
    bend = np.diff(np.eye(n), 2, axis=0) / scale[own:]
    whole[own - 1 :, own - 1 :] += SMOOTH * bend.T @ bend / np.mean(bend**2)
    rest = gram[0, 0] - gram[0, 1:own] @ linalg.solve(inner, gram[1:own, 0], assume_a="pos")
    solution = linalg.solve(whole, gram[1:, 0], assume_a="pos")
    left = gram[0, 0] - gram[0, 1:] @ solution
    force = solution[own - 1 :] * scale[own:] / scale[0]
    return float(1.0 - left / rest), np.asarray(force)


def _hats(fit: Fit, spot: CurveLocation, target: FitSegment) -> FloatArray | None:
    """Output difference per unit of each point of the curve [point, channel, n]."""
    n = len(spot.grid)
    unit = 1e-3 * spot.size
    rows = [
        core.effect_numbers(
            "measured_force",
            {"motion": spot.grid, "force": unit * np.eye(n)[i] if i < n else np.zeros(n)},
        )
        for i in [n, *range(n)]
    ]
    place = core.Placement("measured_force", spot.at, spot.wheelset, len(rows[0]), spot.against)
    try:
        vehicles = fit.model.vehicles(target.segment.coach_forces, [place])
        here = fit.model.on(*target.segment.segment_key)
        batch = here.batch(np.tile(here.row, (n + 1, 1)), np.array(rows), np.ones((n + 1, 1)))
        series, lost = simulate(
            fit.model, target.segment, target.segment.channels, batch=batch, vehicles=vehicles, steps=target.steps,
            filter=target.filter, initial=target.initial_state,
        )  # fmt: skip
    except ValueError:
        return None
    return None if np.any(lost >= 0) else target.without_initial_state((series[1:] - series[0]) / unit)
