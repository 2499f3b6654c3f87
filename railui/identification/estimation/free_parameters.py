"""Free parameters of a fit: paths with their bounds, priors and usual sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.arrays import FloatArray
from railui.campaign.segment import CARBODY_FORCES
from railui.identification.context import Context
from railui.identification.estimation.modulating_functions import dominant_period
from railui.vehicle.model import Model
from railui.vehicle.parameter import is_curve_point, is_numbered
from railui.vehicle.superseded import superseded_paths

USUAL_PHASE = 0.3  # rad
RIG_ANGULAR_FREQUENCY = 62.8  # rad/s: 10 Hz
RIG_DAMPING_RATIO = 0.1
BOUND_WIDTH = 1e-6  # of the usual size: an estimate so near a bound counts as being on it
RATE_ORDER = {"z": 1, "vz": 0, "az": -1}  # powers of the angular frequency that make a rate of a channel


@dataclass(frozen=True)
class FreeParameters:
    """Numbers that a fit moves.

    Attributes
    ----------
    paths
        Their names [p].
    low, high
        Bounds [p].
    size
        Usual size [p].
    prior, prior_sd
        Mean and standard deviation of the priors [p]; infinite: none.
    ratio
        True for numbers [p] that move by ratios: those of effects, whose size is not known beforehand.
    """

    paths: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    size: FloatArray
    prior: FloatArray
    prior_sd: FloatArray
    ratio: NDArray[np.bool_]

    def are_on_bound(self, x: FloatArray) -> NDArray[np.bool_]:
        """True for each of the estimates x [p] that is on one of its bounds."""
        width = BOUND_WIDTH * self.size
        return np.asarray((x <= self.low + width) | (x >= self.high - width))

    def take(self, indices: NDArray[np.intp], paths: Sequence[str] | None = None) -> FreeParameters:
        """Return the parameters of some indices, which may repeat, under their own names or others."""
        numbers = (self.low, self.high, self.size, self.prior, self.prior_sd)
        low, high, size, prior, sd = (x[indices] for x in numbers)
        names = [self.paths[j] for j in indices] if paths is None else paths
        return FreeParameters(tuple(names), low, high, size, prior, sd, self.ratio[indices])

    def without_parameter(self, j: int) -> FreeParameters:
        """Return the same without the j-th parameter, which keeps its value."""
        return self.take(np.delete(np.arange(len(self.paths)), j))


@dataclass(frozen=True)
class _Bounds:
    """Bounds, usual size, prior and kind of step of one number."""

    low: float
    high: float
    size: float
    prior: float
    prior_sd: float
    ratio: bool = False


def free_parameters(context: Context, model: Model, paths: Sequence[str]) -> FreeParameters:
    """Collect bounds and priors of paths, and of the phases of each segment, from parameter list and catalogue."""
    freed = model.free_paths(paths)
    rows = [_with_prior(context, path, _bounds(context, model, path)) for path in freed]
    low, high, size, prior, sd = (
        np.array([getattr(row, name) for row in rows], dtype=float)
        for name in ("low", "high", "size", "prior", "prior_sd")
    )
    return FreeParameters(tuple(freed), low, high, size, prior, sd, np.array([row.ratio for row in rows]))


def _with_prior(context: Context, path: str, bounds: _Bounds) -> _Bounds:
    """Return bounds with the estimate of an earlier campaign as prior, wider by the usual drift since."""
    prior = context.campaign.prior
    if prior is None or path not in prior.values:
        return bounds
    mean, sd = prior.values[path], prior.sd[path]
    drift = context.settings.calibration.prior_drift * abs(mean)
    return replace(bounds, prior=mean, prior_sd=max(float(np.hypot(sd, drift)), 1e-12 * bounds.size))


def _bounds(context: Context, model: Model, path: str) -> _Bounds:
    if "@" in path:
        return _Bounds(-np.inf, np.inf, USUAL_PHASE, model.value(path), np.inf)
    if path in model.design.parameters:
        return _vehicle_bounds(context, model, path)
    bounds = _effect_bounds(model, path, context.settings.calibration.curve_prior_sd)
    if model.design.structure is not None and (nominal := _nominal_of_effect(context, path)):
        # a flange that no run reaches keeps its clearance
        share = context.settings.calibration.element_prior_share
        bounds = replace(bounds, prior=nominal, prior_sd=share * abs(nominal))
    if model.design.form == "rig" and path.endswith(".slip_speed"):
        return replace(bounds, low=min(max(bounds.low, least_slip_speed(context)), bounds.high))
    return bounds


def _nominal_of_effect(context: Context, path: str) -> float | None:
    """Return the nominal value of a number of an effect; None for an effect that the nominal vehicle has not."""
    group, number, key = path.split(".", 2)
    nominal = context.nominal.design.effects
    if group != "effects" or int(number) >= len(nominal):
        return None
    value = nominal[int(number)].parameters.get(key)
    return value if isinstance(value, float) else None


def _vehicle_bounds(context: Context, model: Model, path: str) -> _Bounds:
    parameter = model.design.parameters[path]
    nominal = context.nominal.design.values[path]
    usual = parameter.usual_range
    if not np.isfinite(usual[1]):
        usual = (min(0.0, 10 * nominal), max(10 * nominal, 1.0))
    if path.startswith("vehicle.rig"):
        reach = context.settings.calibration.rig_parameter_range * max(abs(nominal), rig_scale(context, model, path))
        usual = (-reach if parameter.minimum < 0.0 else 0.0, reach)
    low = min(usual[0], 0.1 * nominal)
    high = max(usual[1], 10 * nominal)
    # a free decay has no input, so that its gain keeps the nominal value
    undriven = abs(nominal) or 1.0 if path == "vehicle.rig.gain" else np.inf
    if path == "vehicle.rig.preload" and (model.design.form != "bench" or context.campaign.band is not None):
        # a comparison without the mean shows it only where the stiffness depends on the motion
        undriven = rig_scale(context, model, path)
    if model.design.structure is not None and (path.startswith("vehicle.") or is_numbered(path)):
        # of the many elements and wheelsets of a vehicle its sensors barely see some
        undriven = context.settings.calibration.element_prior_share * abs(nominal) or np.inf
    size = max(abs(nominal), 0.01 * (high - low))
    if _has_no_influence(context, model, path):
        undriven = context.settings.calibration.element_prior_share * size
    prior_sd = parameter.prior_sd if parameter.prior_sd is not None else undriven
    return _Bounds(low, high, size, nominal, prior_sd)


def _has_no_influence(context: Context, model: Model, path: str) -> bool:
    """True for a number without influence on the estimation runs.

    An effect has its own in its place, or the force there was measured in all of them.
    """
    segments = context.dataset.estimation
    measured = [at for q, at in CARBODY_FORCES.items() if segments and all(q in s.columns for s in segments)]
    is_driven = path.startswith(tuple(f"vehicle.{at.replace('_', '.', 1)}_" for at in measured))
    return is_driven or path in superseded_paths(model.design, with_defaults=True)


def _effect_bounds(model: Model, path: str, curve_prior_sd: float) -> _Bounds:
    now = model.value(path)
    low, high = _catalogue_bounds(model, path)
    ratio = low >= 0 and now > 0
    curve = _curve_size(model, path)
    return _Bounds(
        low=max(low, 1e-4 * now) if ratio else low,
        high=high,
        size=max(abs(now), curve, 1e-12),
        prior=0.0 if curve else now,
        prior_sd=curve_prior_sd * curve if curve else np.inf,
        ratio=ratio,
    )


def least_slip_speed(context: Context) -> float:
    """Slip speed [of z per s] of a rig below which the estimation runs do not distinguish friction from Coulomb's."""
    rates = []
    for segment in context.dataset.estimation:
        channel = segment.channels[0]
        angular_frequency = 2.0 * np.pi / dominant_period(segment)
        rates.append(float(np.std(segment.columns[channel])) * angular_frequency ** RATE_ORDER.get(channel, 0))
    return context.settings.calibration.min_slip_share * min(rates)


def rig_scale(context: Context, model: Model, path: str) -> float:
    """Usual size of a rig's parameter whose nominal value is zero.

    Of a mass: 10 Hz, a tenth of critical damping, the largest usual force; of a component on a bench, from its measured
    force and motion.
    """
    values, segments, key = model.design.values, context.dataset.estimation, path.rpartition(".")[2]

    def usual(column: str) -> float:
        return max((float(np.std(s.columns[column])) for s in segments if column in s.columns), default=0.0)

    if model.design.form == "bench":
        speed = usual("vz") or max(float(np.std(np.diff(s.columns["z"]))) / s.dt for s in segments)
        scales = {"stiffness": usual("z"), "damping": speed, "preload": 1.0}
        return usual("F") / max(scales[key], 1e-12)
    m, w = values["vehicle.rig.mass"], RIG_ANGULAR_FREQUENCY
    driving = abs(values["vehicle.rig.gain"]) * usual("u")
    spring = values["vehicle.rig.stiffness"] * usual("z")
    scales = {
        "stiffness": m * w * w,
        "damping": 2.0 * RIG_DAMPING_RATIO * m * w,
        "preload": max(driving, spring) or 1.0,
    }
    return scales.get(key, 1.0)


def _curve_size(model: Model, path: str) -> float:
    """Largest force of a force curve, for its points; 0 for other numbers."""
    if not is_curve_point(path):
        return 0.0
    force = model.design.effects[int(path.split(".")[1])].parameters["force"]
    return float(np.max(np.abs(force)))


def _catalogue_bounds(model: Model, path: str) -> tuple[float, float]:
    group, number, key = path.split(".", 2)
    if group == "sensors" or is_curve_point(path):
        placed = (model.sensors if group == "sensors" else model.design.effects)[int(number)]
        name = key.split(".")[0]
        p = next(p for p in core.effect_record(placed.kind)["parameters"] if p["key"] == name)
        return float(p["minimum"]), float(p["maximum"])
    parameter = model.design.parameter(path)
    return parameter.minimum, parameter.maximum
