"""What a fit may move: paths with their bounds, priors and usual sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.arrays import FloatArray
from railui.vehicle.model import Model
from railui.vehicle.parameters import PARAMETERS

PHASE = 0.3  # rad, a usual size of a phase
CURVE = 2.0  # prior standard deviation of a measured curve's points, in its largest force


@dataclass(frozen=True)
class FreeParameters:
    """The numbers that a fit moves: paths, bounds, priors (sd infinite: none), usual size of each.

    ratio: steps are ratios, for effect numbers whose size is not known beforehand.
    """

    paths: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    size: FloatArray
    prior: FloatArray
    prior_sd: FloatArray
    ratio: NDArray[np.bool_]

    def without_parameter(self, j: int) -> FreeParameters:
        """The same, one number held."""
        low, high, size, prior, sd = (
            np.delete(x, j) for x in (self.low, self.high, self.size, self.prior, self.prior_sd)
        )
        return FreeParameters(
            (*self.paths[:j], *self.paths[j + 1 :]), low, high, size, prior, sd, np.delete(self.ratio, j)
        )


def free_parameters(model: Model, paths: Sequence[str], declared: Model) -> FreeParameters:
    """Bounds and priors of paths and of the phases of each stretch, from the list of parameters and the catalogue."""
    low, high, size, prior, sd, ratio = [], [], [], [], [], []
    values = declared.design.values
    paths = model.freed(paths)
    for path in paths:
        now = model.value(path)
        if "@" in path:
            low.append(-np.inf)
            high.append(np.inf)
            size.append(PHASE)
            prior.append(now)
            sd.append(np.inf)
            ratio.append(False)
            continue
        if path in PARAMETERS:
            p = PARAMETERS[path]
            mean = values[path]
            usual = p.usual if np.isfinite(p.usual[1]) else (min(0.0, 10 * mean), max(10 * mean, 1.0))
            if path.startswith("vehicle.rig"):
                reach = 100.0 * max(abs(mean), rig_scale(model, path))
                usual = (-reach if path.endswith("gain") else 0.0, reach)
            low.append(min(usual[0], 0.1 * mean))
            high.append(max(usual[1], 10 * mean))
            size.append(max(abs(mean), 0.01 * (high[-1] - low[-1])))
            prior.append(mean)
            # nothing drives a free decay: its gain stays where it is
            held = abs(mean) or 1.0 if path == "vehicle.rig.gain" else np.inf
            sd.append(p.prior if p.prior is not None else held)
            ratio.append(False)
            continue
        bounds = _effect_bounds(model, path)
        ratio.append(bounds[0] >= 0 and now > 0)
        low.append(max(bounds[0], 1e-4 * now) if ratio[-1] else bounds[0])
        high.append(bounds[1])
        size.append(max(abs(now), _curve_size(model, path), 1e-12))
        curve = _curve_size(model, path)
        prior.append(0.0 if curve else now)
        sd.append(CURVE * curve if curve else np.inf)
    a, b, c, d, e = (np.array(x, dtype=float) for x in (low, high, size, prior, sd))
    return FreeParameters(tuple(paths), a, b, c, d, e, np.array(ratio))


def rig_scale(model: Model, path: str) -> float:
    """A usual size of a rig's parameter where its declared value is zero: 10 Hz, a tenth of critical damping."""
    m, w = model.design.values["vehicle.rig.mass"], 62.8
    return {"stiffness": m * w * w, "damping": 0.2 * m * w}.get(path.rpartition(".")[2], 1.0)


def _curve_size(model: Model, path: str) -> float:
    """The largest force of a measured curve, for the points where it is zero; 0 for other numbers."""
    _, number, key = path.split(".", 2)
    if not key.startswith("force."):
        return 0.0
    force = model.design.effects[int(number)].parameters["force"]
    return float(np.max(np.abs(force)))


def _effect_bounds(model: Model, path: str) -> tuple[float, float]:
    group, number, key = path.split(".", 2)
    if key.startswith("force."):
        return -np.inf, np.inf
    if group == "sensors":
        p = next(p for p in core.record(model.sensors[int(number)].kind)["parameters"] if p["key"] == key)
        return float(p["minimum"]), float(p["maximum"])
    parameter = model.design.parameter(path)
    return parameter.minimum, parameter.maximum
