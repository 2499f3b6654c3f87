"""Response of the linear vehicle to a track: transfer functions, spectral densities and rms, without simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.ride_quality.comfort import (
    HOUR,
    comfort_point_transfer,
    comfort_time,
    felt_acceleration,
    riding_of_row,
)
from railui.ride_quality.evaluation import TrackLike
from railui.ride_quality.guidance import log_flange_fraction_gaussian
from railui.ride_quality.weighting import W_D, brick_wall_1974
from railui.runs.columns import COLUMNS
from railui.track.density import TrackDensity, track_density
from railui.track.excitation import resolve_track
from railui.track.input_table import IRREGULARITIES
from railui.vehicle.channels import channel_unit, check_channels
from railui.vehicle.linear import MIN_ROOT, linearisation_notes, omitted_kinds
from railui.vehicle.model import Model
from railui.vehicle.resolve import ModelSource, resolve_model
from railui.vehicle.transfer import LinearVehicle, acting_inputs, linearise

CURVES_NOTE: Final = "line with curves: the response to its irregularities only, as on a straight track"
DEFAULT_RANGE: Final = (0.1, 50.0)  # Hz
DEFAULT_COUNT: Final = 300  # frequencies, equally spaced in their logarithm
MAX_DRAWN_DAMPING: Final = 0.5  # damping ratio below which the frequency of a mode joins the default frequencies
PANELS_PER_DECADE: Final = 24
PANELS_PER_ROTATION: Final = 4  # panels while the phase between the first and the last wheelset turns once
RESONANCE_DISTANCES: Final = (-16.0, -8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0, 16.0)  # in half bandwidths
POINTS_PER_PANEL: Final = 8  # of Gauss's quadrature
CORNERS: Final = (1.0, 2.0, 80.0)  # Hz, of the weighting of the 1970s
MIN_DECAY: Final = 1e-9  # 1/s: an oscillation that decays more slowly has no stationary response


def default_channels(model: Model) -> list[str]:
    """Return the channels of `response` by default: those of a run, then the floor points."""
    names = model.vehicles().channel_names(model.single_batch())
    numbered = [name for name in names if "." not in name and name.rstrip("0123456789") in ("e", "ay", "psi", "d")]
    order = {key: i for i, key in enumerate(("e", "ay", "d", "psi"))}
    numbered.sort(key=lambda name: (order[name.rstrip("0123456789")], len(name), name))
    return [*numbered, *(name for name in ("ayf", "rf") if name in names), *_floors(model)]


def _felt(model: Model) -> tuple[str, ...]:
    """Return the acceleration channels of comfort; empty for a vehicle without a body above its wheelsets."""
    names = model.vehicles().channel_names(model.single_batch())
    return tuple(name for name in felt_acceleration(model) if name in names)


def _floors(model: Model) -> list[str]:
    return [name for name in felt_acceleration(model) if name != "ayf"]


def default_frequencies(vehicle: LinearVehicle) -> FloatArray:
    """Return frequencies [Hz] equally spaced in their logarithm, and those of the oscillations of the vehicle."""
    grid = np.geomspace(*DEFAULT_RANGE, DEFAULT_COUNT)
    roots = vehicle.roots
    is_drawn = (roots.imag > 0) & (np.abs(roots.real) < MAX_DRAWN_DAMPING * np.abs(roots))
    own = roots.imag[is_drawn] / (2 * np.pi)
    inside = own[(own > DEFAULT_RANGE[0]) & (own < DEFAULT_RANGE[1])]
    return np.unique(np.concatenate([grid, inside]))


def response(
    design: ModelSource,
    speed: float,
    track: TrackLike | None = None,
    channels: Sequence[str] | None = None,
    frequencies: FloatArray | None = None,
    seed: int | None = None,
) -> dict[str, Any]:
    """Compute transfer functions of the linear vehicle and its stationary response to a track.

    Parameters
    ----------
    design : Design, Model or path
        Vehicle; effects that are not linear are left out.
    speed : float
        Speed [m/s].
    track : Track, TrackSource, spec or path, optional
        Track of the stationary response.
    channels : sequence of str, optional
        Channels; those of a run by default.
    frequencies : array, optional
        Frequencies of transfer functions and spectral densities [Hz].
    seed : int, optional
        Seed that replaces that of the spec; the stationary response does not depend on it.

    Returns
    -------
    dict
        `frequencies` [Hz]; `irregularities`: the inputs yw [m], phiw [rad] under the leading wheelset; `roots` [1/s];
        `stable`; `transfer`: magnitude and phase [rad] by channel and input; `stationary` (None without a track and
        for an unstable vehicle): by channel `rms` and `psd` per Hz; `ride`: keys of `railui ride` that follow from
        them; `notes`.

    Raises
    ------
    FileProblems
        For faulty files.
    ValueError
        For an unknown channel, a faulty track, and speeds or frequencies that are not positive.

    Examples
    --------
    >>> result = response("designs/check_bogie.yaml", 40.0, "erri_b176_low", ["e1"])
    >>> result["stable"], round(1e3 * result["stationary"]["e1"]["rms"], 3)
    (True, 1.47)
    """
    model = resolve_model(design)
    names = default_channels(model) if channels is None else list(channels)
    check_channels(model, names)
    if not 0 < speed < np.inf:
        raise ValueError(f"speed must be positive: {speed:g} m/s")
    felt, guided = _felt(model), [f"e{i + 1}" for i in range(len(model.wheelset_distances()))]
    vehicle = linearise(model, speed, list(dict.fromkeys([*names, *felt, *guided])))
    grid = default_frequencies(vehicle) if frequencies is None else np.asarray(frequencies, dtype=float)
    if not (len(grid) and np.all(grid > 0) and np.all(np.isfinite(grid))):
        raise ValueError("frequencies must be positive, at least one of them")
    roots, inputs = vehicle.roots, acting_inputs(vehicle)
    is_stable = bool(np.all((roots.real < -MIN_DECAY) | (np.abs(roots) < MIN_ROOT)))
    source = None if track is None else resolve_track(track, seed)
    curves = [CURVES_NOTE] if source is not None and source.track.has_curves else []
    comfort = [] if felt or source is None else ["ride: null, no acceleration is simulated above the wheelsets"]
    transfer = vehicle.transfer(grid)
    result: dict[str, Any] = {
        "speed": speed,
        "track": None if source is None else source.name,
        "frequencies": grid,
        "irregularities": inputs,
        "stable": is_stable,
        "roots": [{"real": z.real, "imag": z.imag} for z in roots if z.imag >= 0],
        "channels": {name: {"unit": channel_unit(name)} for name in names},
        "transfer": {name: _polar(transfer, vehicle, name, inputs) for name in names},
        "stationary": None,
        "ride": None,
        "density": None,
        "notes": [*curves, *comfort, *_notes(model), *_stability_note(is_stable, roots[0], source is not None)],
    }
    if source is not None and is_stable:
        density = track_density(source)
        result |= {"density": density.origin, **_stationary(model, vehicle, density, grid, transfer, names)}
    return result


def _polar(transfer: ComplexArray, vehicle: LinearVehicle, name: str, inputs: Sequence[str]) -> dict[str, Any]:
    k = vehicle.channels.index(name)
    columns = {key: transfer[:, k, IRREGULARITIES.index(key)] for key in inputs}
    return {
        key: {
            "unit": _ratio(channel_unit(name), COLUMNS[key].unit),
            "magnitude": np.abs(h),
            "phase": np.angle(h),
        }
        for key, h in columns.items()
    }


def _ratio(above: str, below: str) -> str:
    """Return the unit of a quotient.

    >>> _ratio("m/s^2", "m"), _ratio("m", "m"), _ratio("N", "rad")
    ('(m/s^2)/m', '1', 'N/rad')
    """
    if above == below:
        return "1"
    return f"({above})/{below}" if "/" in above else f"{above}/{below}"


def _notes(model: Model) -> list[str]:
    omitted = omitted_kinds(model)
    forcing = {model.effects[int(path.split(".")[1])].kind for path in model.run_dependent_paths()}.difference(omitted)
    return linearisation_notes(model) + [
        f"response to the track alone: without the excitation by {kind}" for kind in sorted(forcing)
    ]


def _stability_note(is_stable: bool, root: complex, is_asked: bool) -> list[str]:
    if is_stable:
        return []
    what = f"the linear vehicle is unstable at this speed: root {root.real:.4g} + {abs(root.imag):.4g}j 1/s"
    formal = "the transfer functions solve its equations, but no motion tends to them"
    return [f"stationary: null, {what}; {formal}" if is_asked else f"{what}; {formal}"]


def _stationary(
    model: Model,
    vehicle: LinearVehicle,
    density: TrackDensity,
    grid: FloatArray,
    transfer: ComplexArray,
    names: Sequence[str],
) -> dict[str, Any]:
    psd = output_density(transfer, density, grid, vehicle.speed)
    variance = variances(vehicle, density)
    order = [vehicle.channels.index(name) for name in names]
    stationary = {
        name: {"rms": float(np.sqrt(variance[k])), "psd": psd[:, k]} for name, k in zip(names, order, strict=True)
    }
    return {"stationary": stationary, "ride": _ride(model, vehicle, density, variance) if _felt(model) else None}


def output_density(transfer: ComplexArray, density: TrackDensity, frequency: FloatArray, speed: float) -> FloatArray:
    """Return one-sided power spectral densities [frequency, channel] per Hz: H S H* with S(f) = S(W) 2 pi/V."""
    inputs = density(2 * np.pi * frequency / speed) * (2 * np.pi / speed)
    return np.asarray(np.einsum("fci,fij,fcj->fc", transfer, inputs, transfer.conj()).real)


def variances(
    vehicle: LinearVehicle,
    density: TrackDensity,
    weight: Callable[[FloatArray], FloatArray] | None = None,
    refinement: int = 1,
) -> FloatArray:
    """Return the variances [channel] of the stationary response: the integral of its densities over frequency.

    Gauss's quadrature between the edges of the band, round the resonances, at the lines of an estimated density and at
    the corners of the weighting of the 1970s.

    Parameters
    ----------
    vehicle : LinearVehicle
    density : TrackDensity
    weight : callable, optional
        Modulus of a filter of the channels at frequencies [Hz].
    refinement : int
        Parts into which each panel is divided.
    """
    edges = _panel_edges(vehicle, density)
    fine = np.interp(np.arange(refinement * (len(edges) - 1) + 1) / refinement, np.arange(len(edges)), edges)
    points, weights = np.polynomial.legendre.leggauss(POINTS_PER_PANEL)
    half = 0.5 * np.diff(fine)
    frequency = ((0.5 * (fine[1:] + fine[:-1]))[:, None] + half[:, None] * points).ravel()
    measure = (half[:, None] * weights).ravel()
    psd = output_density(vehicle.transfer(frequency), density, frequency, vehicle.speed)
    gain = 1.0 if weight is None else weight(frequency) ** 2
    return np.asarray((gain * measure) @ psd)


def _panel_edges(vehicle: LinearVehicle, density: TrackDensity) -> FloatArray:
    low, high = (vehicle.speed * w / (2 * np.pi) for w in (density.lowest, density.highest))
    per_decade = 2 + int(PANELS_PER_DECADE * np.log10(high / low))
    rotations = (high - low) * float(vehicle.delays.max(initial=0.0))
    roots = vehicle.roots[vehicle.roots.imag > 0]
    inner = [
        np.geomspace(low, high, per_decade),
        np.linspace(low, high, 2 + int(PANELS_PER_ROTATION * rotations)),
        (roots.imag + np.multiply.outer(RESONANCE_DISTANCES, np.abs(roots.real))).ravel() / (2 * np.pi),
        np.array(CORNERS),
    ]
    if density.lines is not None:
        inner.append(vehicle.speed * density.lines / (2 * np.pi))
    edges = np.unique(np.concatenate(inner))
    return edges[(edges >= low) & (edges <= high)]


def _ride(model: Model, vehicle: LinearVehicle, density: TrackDensity, variance: FloatArray) -> dict[str, Any]:
    """Return the keys of a ride that follow from the stationary response; of several floor points the worst."""
    felt = _felt(model)
    point = comfort_point_transfer(riding_of_row(model, model.row), transfer=felt == ("ayf",))
    order = [vehicle.channels.index(name) for name in felt]

    def weighted(weight: Callable[[FloatArray], FloatArray]) -> FloatArray:
        total = variances(vehicle, density, lambda f: point.modulus(f) * weight(f))
        return np.asarray(np.sqrt(total[order]))

    rms_1974, rms = weighted(brick_wall_1974), weighted(W_D.modulus)
    worst = int(np.argmax(rms_1974))
    clearance = model.design.values["contact.flange_clearance"]
    sd = np.sqrt([variance[vehicle.channels.index(f"e{i + 1}")] for i in range(len(vehicle.delays))])
    return {
        "comfort_point": felt[worst],
        "weighted_acceleration": float(rms[worst]),
        "weighted_acceleration_1974": float(rms_1974[worst]),
        "comfort_hours": float(comfort_time(rms_1974[worst])) / HOUR,
        "flange_fraction_gaussian": float(np.exp(np.max(log_flange_fraction_gaussian(0.0, sd, clearance)))),
        "flange_margin": float(np.min(clearance / sd[sd > 0])) if np.any(sd > 0) else None,
    }
