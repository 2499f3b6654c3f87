"""Simulation results of one design for the Design panel: ride quality, spectra, series, modes, curving."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui import curves, ride_many, simulate
from railui.api.modes import damping_over_speed, linear_critical_speed
from railui.arrays import FloatArray
from railui.desk.state.run_conditions import RunConditions
from railui.dsp.spectra import welch
from railui.ride_quality.comfort import comfort_point_transfer, riding_of_row
from railui.track.excitation import Excitation, TrackSource, is_track_file, resolve_track
from railui.vehicle.design_reader import Design
from railui.vehicle.model import Model
from railui.vehicle.resolve import resolve_model

MODE_SPEEDS: Final = np.linspace(5.0, 100.0, 191)  # m/s
PERIODOGRAM_SECONDS: Final = 10.0  # s
MAX_CRITICAL_SPEED: Final = 150.0  # m/s, upper end of the search
CURVE_RADII: Final = (250.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1000.0, 1500.0, 2000.0, 3000.0)  # m
MIN_FREQUENCY: Final = 0.1  # Hz, of the spectra
MAX_FREQUENCY: Final = 40.0  # Hz
MAX_FALL: Final = 1e-4  # of a spectral density within a third of an octave, below which it is rounding error
FALL_BEGIN = 0.1  # of the largest density before a fall, where it begins
CHANNELS: Final = ("e1", "e2", "ayf")


@dataclass(frozen=True, eq=False)
class DesignResults:
    """Results of a design under run conditions; arrays in SI.

    Attributes
    ----------
    quality
        Ride quality, as printed by `railui ride`.
    s, series
        Distance [m] and channels e1, e2 [m], ayf [m/s^2] along the track.
    f, density
        Frequency [Hz] and one-sided spectral densities [unit^2/Hz].
    speeds, damping, frequency
        Speeds [m/s]; damping ratio and frequency [Hz] of the modes [speed, mode].
    critical_speed, clearance
        Linear critical speed [m/s] or None; flange clearance [m].
    guiding_force
        Sum of guiding forces [N] of the wheelsets [radius, wheelset] at CURVE_RADII; None before `with_curving`.
    """

    design: Design
    conditions: RunConditions
    quality: Mapping[str, Any]
    s: FloatArray
    series: Mapping[str, FloatArray]
    f: FloatArray
    density: Mapping[str, FloatArray]
    speeds: FloatArray
    damping: FloatArray
    frequency: FloatArray
    critical_speed: float | None
    clearance: float
    guiding_force: FloatArray | None = None

    @property
    def linear_damping(self) -> float:
        """Damping ratio of the least damped mode at the speed of the run conditions."""
        return float(np.interp(self.conditions.speed, self.speeds, np.nanmin(self.damping, axis=1)))


Comparison = tuple[DesignResults, DesignResults]  # of the current design and of its base


@lru_cache(maxsize=4)
def excitation_of(conditions: RunConditions) -> Excitation:
    """Return the excitation of run conditions; raise ValueError or FileProblems for an invalid track."""
    return Excitation(load_track(conditions.track), conditions.speed)


@lru_cache(maxsize=4)
def load_track(track: str) -> TrackSource:
    """Return a track given by its file or spec; raise ValueError or FileProblems if it is invalid."""
    return resolve_track(Path(track) if is_track_file(track) else track)


def evaluate_design(design: Design, conditions: RunConditions) -> DesignResults:
    """Simulate a design on a track and compute its spectra, modes and critical speed.

    Raises FileProblems for a design that cannot run on a track, ValueError for invalid run conditions.
    """
    model = resolve_model(design)
    excitation = excitation_of(conditions)
    quality = ride_many([model], excitation.source, conditions.speed)[0]
    series = simulate(model, excitation.source, conditions.speed, CHANNELS)
    f, density = _spectral_densities(model, series, excitation.dt)
    damping, frequency = damping_over_speed(model, MODE_SPEEDS)
    return DesignResults(
        design,
        conditions,
        quality,
        series["s"],
        {name: series[name] for name in CHANNELS},
        f,
        density,
        MODE_SPEEDS,
        damping,
        frequency,
        critical_speed=linear_critical_speed(model, MAX_CRITICAL_SPEED),
        clearance=design.value("contact.flange_clearance"),
    )


def evaluate_comparison(
    design: Design, base: Design, conditions: RunConditions, last: Comparison | None = None
) -> Comparison:
    """Evaluate a design and its base; results of the last comparison are used again where they apply."""
    known = [results for results in last or () if results.conditions == conditions]

    def results_of(wanted: Design) -> DesignResults:
        for results in known:
            if results.design.content() == wanted.content():
                return results
        known.append(evaluate_design(wanted, conditions))
        return known[-1]

    return results_of(design), results_of(base)


def add_curving(current: DesignResults, base: DesignResults) -> Comparison:
    """Return both results with curving."""
    curved = current if current.guiding_force is not None else with_curving(current)
    if base is current:
        return curved, curved
    return curved, base if base.guiding_force is not None else with_curving(base)


def with_curving(results: DesignResults) -> DesignResults:
    """Return the results with the equilibria in curves, the slowest part of the evaluation."""
    undefined = [np.nan] * 2
    rows = curves(results.design, CURVE_RADII)
    force = np.array([(row["guiding_force"] or undefined)[:2] for row in rows], dtype=float)
    return replace(results, guiding_force=force)


def _spectral_densities(
    model: Model, series: Mapping[str, FloatArray], dt: float
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return densities of e1, e2, the acceleration of the frame, and the acceleration at the comfort point."""
    n = len(series["t"])
    segment = min(n, max(64, round(PERIODOGRAM_SECONDS / dt)))
    density: dict[str, FloatArray] = {}
    for name in CHANNELS:
        x = series[name][np.isfinite(series[name])]
        f, density[name] = welch(x if len(x) >= segment else np.zeros(segment), 1.0 / dt, segment)
    transfer = comfort_point_transfer(riding_of_row(model, model.row)).modulus(f)
    density["comfort"] = density["ayf"] * transfer**2
    shown = (f > MIN_FREQUENCY) & (f <= min(MAX_FREQUENCY, last_excited_frequency(f, density["e1"])))
    return f[shown], {name: np.where(x[shown] > 0, x[shown], np.nan) for name, x in density.items()}


def last_excited_frequency(f: FloatArray, density: FloatArray) -> float:
    """Return the frequency [Hz] at which a spectral density falls to rounding errors, or the last one.

    A synthetic track has no irregularities beyond its shortest wavelength. There the density falls by MAX_FALL within a
    third of an octave, which no suspension does.
    """
    for i in np.flatnonzero((f > MIN_FREQUENCY) & (density > 0)):
        before = density[(f >= f[i] / 2 ** (1 / 3)) & (f < f[i])]
        if len(before) and density[i] < MAX_FALL * before.max():
            edge = (f < f[i]) & (density >= FALL_BEGIN * before.max())  # before the fall, not on it
            return float(f[edge][-1])
    return float(f[-1])
