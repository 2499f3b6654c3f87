"""Motions of the same vehicle by railui and by Exudyn on the same track: python -m tests.third_program.agreement

Prints, for each vehicle and channel, the rms of the difference over the rms of railui's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from railui.core import Batch, Vehicles
from railui.ride_quality.evaluation import simulate
from railui.track.excitation import TrackSource, resolve_track
from tests.third_program import bogie, coach, numbers, rig
from tests.third_program.rail_table import Run

Floats = NDArray[np.float64]
TRACK = "erri_b176_low length=300 seed=3 spacing=0.05"
NO_ROLL_INERTIA = 1e-3  # kg*m^2: the wheelset of railui has none
WHEELSETS = ("e", "ay", "psi", "d")
# channels of the coach: Exudyn's name, railui's
BODIES = {"ay_front": "ay.frame_1", "ay_rear": "ay.frame_2", "ay_body": "ay.body"}


def relative(found: Floats, reference: Floats) -> float:
    """Rms of the difference over the rms of the reference."""
    return float(np.sqrt(np.mean((found - reference) ** 2) / np.mean(reference**2)))


def eased(spec: str = TRACK, level: float = 2.0, rise: float = 20.0) -> TrackSource:
    """A synthetic track that is level at first, then rises smoothly: rates of its lean without a jump [m]."""
    source = resolve_track(spec)
    x = np.clip((source.track.s - source.track.s[0] - level) / rise, 0.0, 1.0)
    share = x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi)
    return replace(source, track=replace(source.track, yw=share * source.track.yw, phiw=share * source.track.phiw))


def run_of(source: TrackSource, speed: float) -> Run:
    """A run at a steady speed [m/s] over a track."""
    rails = source.track
    return Run(rails.s / speed, rails.s, rails.yw, rails.phiw)


def bogie_differences(speed: float = 40.0, per_sample: int = 2) -> dict[str, float]:
    """Differences of the test bogie by channel."""
    track = eased()
    found = bogie.simulate(numbers.bogie(), run_of(track, speed), per_sample=per_sample)
    known = simulate(numbers.BOGIE, track, speed, tuple(found))
    return {name: relative(x, known[name]) for name, x in found.items()}


def coach_differences(
    speed: float = 45.0, per_sample: int = 2, roll_inertia: float | None = NO_ROLL_INERTIA
) -> dict[str, float]:
    """Differences of the coach by channel."""
    vehicle, track = numbers.coach(wheelset_roll_inertia=roll_inertia), eased()
    found = coach.simulate(vehicle, run_of(track, speed), per_sample=per_sample)
    names = {f"{x}{i}": f"{x}{i}" for x in WHEELSETS for i in (1, 2, 3, 4)} | BODIES
    known = simulate(numbers.COACH, track, speed, tuple(names.values()))
    return {own: relative(found[own], known[name]) for own, name in names.items()}


def rig_differences(per_sample: int = 4) -> dict[str, float]:
    """Differences of the linear mass on a bench by channel."""
    t = np.arange(5_000) / 1000.0
    vehicle, force = rig.Rig(95.0, 6.0e4, 150.0), multisine(t, np.random.default_rng(4))
    found = rig.simulate(vehicle, t, force, per_sample)
    known = _kernel(vehicle, t, force, tuple(found))
    return {name: relative(found[name], known[name]) for name in found}


def _kernel(vehicle: rig.Rig, t: Floats, force: Floats, channels: tuple[str, ...], steps: int = 2) -> dict[str, Floats]:
    """Channels of the kernel's rig: rows t, 1, u, u', u'' at the half steps."""
    numbers_of = np.array([[vehicle.mass, vehicle.stiffness, vehicle.damping, 1.0, 0.0]])
    batch = Batch.from_arrays(numbers_of, np.zeros((1, 0)), np.ones((1, 0))).with_initial_states(np.zeros((1, 2)))
    at = np.linspace(t[0], t[-1], 2 * steps * (len(t) - 1) + 1)
    spline = CubicSpline(t, force)
    table = np.stack([at, np.ones_like(at), *(spline(at, order) for order in range(3))], axis=1)
    series, _ = Vehicles("rig", [], rig_input="force").simulate(batch, table, float(t[1]), steps, channels)
    return dict(zip(channels, series[0], strict=True))


def multisine(t: Floats, rng: np.random.Generator, scale: float = 12.0) -> Floats:
    """Force [N] of forty harmonics from 0.8 to 16 Hz, easing in."""
    f = np.geomspace(0.8, 16.0, 40) * rng.uniform(0.98, 1.02, 40)
    signal = np.cos(2.0 * np.pi * f * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, 40)).sum(axis=1)
    return np.asarray(scale * signal * np.clip(t, 0.0, 1.0))


def lines(title: str, differences: Mapping[str, float]) -> str:
    """One vehicle as text."""
    return "\n".join([title, *(f"  {name:12} {x:.1e}" for name, x in differences.items())])


if __name__ == "__main__":
    print(lines("test bogie, 40 m/s", bogie_differences()))
    print(lines("Manchester coach, 45 m/s", coach_differences()))
    print(lines("the same, wheelsets with roll inertia", coach_differences(roll_inertia=None)))
    print(lines("mass on a bench", rig_differences()))
