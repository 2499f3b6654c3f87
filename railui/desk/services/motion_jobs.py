"""Job of the page of the vehicle: its modes and its motion in a ride."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from textual.message import Message

from railui import simulate
from railui.api.modes import follow_modes
from railui.arrays import FloatArray
from railui.desk.presenters.design_results import MODE_SPEEDS, DesignResults, load_track
from railui.desk.presenters.schematic import Part, ride_channel, ride_motion, vehicle_parts
from railui.vehicle.resolve import resolve_model

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode


@dataclass(frozen=True, eq=False)
class VehicleMotion:
    """Parts of a vehicle, its modes, and its motion in a ride: t [n], s [n], by body y [m] and psi [rad] [n]."""

    parts: list[Part]
    modes: list[TrackedMode]
    t: FloatArray
    s: FloatArray
    ride: Mapping[str, tuple[FloatArray, FloatArray]]
    track: FloatArray  # lateral position [m] of a wheelset in the middle of the track at s


@dataclass
class MotionComputed(Message):
    """Motion of the design of some results."""

    results: DesignResults
    motion: VehicleMotion


def compute_motion(results: DesignResults) -> Message:
    """Follow the modes of a design and simulate its degrees of freedom."""
    model, conditions = resolve_model(results.design), results.conditions
    dofs = model.vehicles().degrees_of_freedom(model.single_batch())
    known = model.vehicles().channel_names(model.single_batch())
    channels = [name for dof in dofs if (name := ride_channel(dof)) in known]
    source = load_track(conditions.track)
    series = simulate(model, source, conditions.speed, channels)
    ride = {name: (np.nan_to_num(y), np.nan_to_num(psi)) for name, (y, psi) in ride_motion(dofs, series).items()}
    line = source.track
    radius = next((results.design.value(p) for p in results.design.paths() if p.endswith("rolling_radius")), 0.0)
    middle = line.yw + radius * line.phiw  # of a wheelset that does not move on the rails
    track = np.interp(series["s"], line.s, middle)
    parts = vehicle_parts(results.design, model, dofs)
    modes = follow_modes(model, MODE_SPEEDS)
    return MotionComputed(results, VehicleMotion(parts, modes, series["t"], series["s"], ride, track))
