"""What the desk shows of one design: riding quality, spectra, series, modes, curve; computed apart from the screen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.curving import curves
from railui.dsp.spectra import welch
from railui.hunting.critical_speed import critical_speeds
from railui.ride_quality.comfort import before, floor_of
from railui.ride_quality.evaluation import simulate, simulate_rides
from railui.track.excitation import Excitation, TrackSource, is_track_file, resolve_track
from railui.vehicle.design_reader import Design
from railui.vehicle.linear import damping_ratio, eigenvalues
from railui.vehicle.model import Model
from railui.vehicle.resolve import model_of

SPEEDS: Final = np.linspace(5.0, 100.0, 191)  # m/s, of the modes
SEGMENT: Final = 10.0  # s of a periodogram
FASTEST: Final = 150.0  # m/s up to which a critical speed is looked for
RADII: Final = (250.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1000.0, 1500.0, 2000.0, 3000.0)  # m
LEAST: Final = 0.5  # 1/s or rad/s: a mode slower than this is none that one sees


@dataclass(frozen=True)
class Case:
    """On what the design rides: a track (spec or file), a speed [m/s]."""

    track: str = "erri_b176_low length=2000 seed=1"
    speed: float = 40.0


@dataclass(frozen=True, eq=False)
class Look:
    """A design seen on a case. quality: as `railui ride`; arrays in SI; f [Hz] of the densities [unit^2/Hz].

    guiding_force [radius, wheelset] and wear [radius] on `RADII`, None until `with_curves` has been there.
    """

    design: Design
    case: Case
    quality: Mapping[str, Any]
    t: FloatArray
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
    wear: FloatArray | None = None

    @property
    def linear_damping(self) -> float:
        """Damping ratio of the least damped mode at the speed of the case."""
        return float(np.interp(self.case.speed, self.speeds, np.nanmin(self.damping, axis=1)))


@lru_cache(maxsize=4)
def road(case: Case) -> Excitation:
    """The road of a case, laid once. ValueError or FileProblems where there is no such track."""
    return Excitation(laid(case.track), case.speed)


@lru_cache(maxsize=4)
def laid(track: str) -> TrackSource:
    """A track by its file or its spec. FileProblems or ValueError where it cannot be laid."""
    return resolve_track(Path(track) if is_track_file(track) else track)


def look(design: Design, case: Case) -> Look:
    """Rides a design along a case. FileProblems for what cannot ride, ValueError for a faulty case."""
    model, way = model_of(design), road(case)
    quality = simulate_rides([model], way)[0]
    series = simulate(model, way.laid, case.speed, ("e1", "e2", "ayf"))
    f, powers = _densities(model, series, way.dt)
    damping, frequency = modes(model, SPEEDS)
    critical = critical_speeds(model, model.row[None], FASTEST)[0]
    return Look(
        design, case, quality, series["t"], series["s"], {k: series[k] for k in ("e1", "e2", "ayf")}, f, powers,
        SPEEDS, damping, frequency, None if critical is None else critical.speed,
        design.value("contact.flange_clearance"),
    )  # fmt: skip


def _densities(model: Model, series: Mapping[str, FloatArray], dt: float) -> tuple[FloatArray, dict[str, FloatArray]]:
    """One-sided densities of e_1, e_2, of the frame's acceleration, and of that at the comfort point."""
    n = len(series["t"])
    segment = min(n, max(64, round(SEGMENT / dt)))
    found: dict[str, FloatArray] = {}
    for name in ("e1", "e2", "ayf"):
        x = series[name][np.isfinite(series[name])]
        f, found[name] = welch(x if len(x) >= segment else np.zeros(segment), 1.0 / dt, segment)
    kept = (f > 0.1) & (f <= 40.0)
    transfer = before(floor_of(model, model.row)).modulus(f)
    found["comfort"] = found["ayf"] * transfer**2
    return f[kept], {name: np.where(x[kept] > 0, x[kept], np.nan) for name, x in found.items()}


def modes(model: Model, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Damping ratio and frequency [Hz] of the oscillating modes at speeds [speed, mode], NaN where there is none."""
    roots = eigenvalues(model, np.repeat(model.row[None], len(speeds), axis=0), speeds)
    swinging = roots.imag > LEAST
    damping = np.where(swinging, damping_ratio(roots), np.nan)
    frequency = np.where(swinging, roots.imag / (2 * np.pi), np.nan)
    most = max(1, int(swinging.sum(axis=1).max(initial=1)))
    order = np.argsort(np.where(swinging, frequency, np.inf), axis=1)[:, :most]
    return np.take_along_axis(damping, order, axis=1), np.take_along_axis(frequency, order, axis=1)


def with_curves(seen: Look) -> Look:
    """The look with the design's stands in curves, which take longest."""
    rows = curves(seen.design, RADII)
    nothing = [np.nan] * 2
    force = np.array([(row["guiding_force"] or nothing)[:2] for row in rows], dtype=float)
    return replace(seen, guiding_force=force, wear=np.array([row["wear_number"] or np.nan for row in rows]))
