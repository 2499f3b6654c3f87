"""Schematic of a vehicle from above with its motion: wheelsets, frames and bodies on the rails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from railui.arrays import FloatArray
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import LimitLine, Line, PlotData, series_role
from railui.vehicle.design_reader import Design
from railui.vehicle.dofs import body_and_motion
from railui.vehicle.model import Model

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode

DRAWN_MOTION: Final = 0.3  # m in the picture, of the largest lateral motion
HALF_GAUGE: Final = 0.75  # m, where the design has none
WHEEL_RADIUS: Final = 0.46  # m, half the length of a wheel in the picture
FRAME_OVERHANG, FRAME_HALF_WIDTH = 0.5, 1.0  # m, of a frame beyond its wheelsets
BODY_OVERHANG, BODY_HALF_WIDTH = 2.0, 1.4  # m
LONE_HALF_LENGTH: Final = 1.3  # m of a frame over one wheelset
CYCLE_SECONDS: Final = 2.5  # s that a cycle of a mode takes in the picture
CYCLE_POINTS: Final = 65  # of the motion over a cycle
RIDE_SECONDS: Final = 4.0  # s of the ride in the lower picture
RIDE_SLOWNESS: Final = 2.0  # seconds of the picture per second of the ride
MM_PER_M: Final = 1e3
Motion = Mapping[str, tuple[float, float]]  # lateral displacement [m] to the right and yaw [rad] by body


@dataclass(frozen=True)
class Part:
    """Part of the schematic; x: its middle [m], forward; a wheelset is an axle with wheels, all others rectangles."""

    name: str
    x: float
    half_length: float
    half_width: float
    is_wheelset: bool


def vehicle_parts(design: Design, model: Model, dofs: Sequence[str]) -> list[Part]:
    """Return the wheelsets, frames and bodies of a vehicle; each frame stands over the next of its wheelsets."""
    places = np.array(model.wheelset_distances(), dtype=float)
    x = 0.5 * (places.max() + places.min()) - places
    gauge = next((design.value(path) for path in design.paths() if path.endswith("half_gauge")), HALF_GAUGE)
    names = list(dict.fromkeys(body_and_motion(dof)[0] for dof in dofs))
    wheelsets = [name for name in names if name.startswith("wheelset")]
    frames = [name for name in names if name.startswith("frame")]
    parts = [Part(name, float(at), WHEEL_RADIUS, gauge, True) for name, at in zip(wheelsets, x, strict=False)]
    for name, under in zip(frames, np.array_split(x, max(1, len(frames))), strict=False):
        half = 0.5 * float(np.ptp(under)) + FRAME_OVERHANG if np.ptp(under) else LONE_HALF_LENGTH
        parts.append(Part(name, float(under.mean()), half, FRAME_HALF_WIDTH, False))
    for name in names:
        if name not in (*wheelsets, *frames):
            half = 0.5 * float(np.ptp(x)) + BODY_OVERHANG
            parts.append(Part(name, float(x.mean()), half, BODY_HALF_WIDTH, False))
    return parts


def largest_motion(parts: Sequence[Part], motion: Mapping[str, tuple[FloatArray, FloatArray]]) -> float:
    """Return the largest lateral displacement [m] of any end of a part, over the motion [sample] of each body."""
    ends = [
        np.max(np.abs(y) + np.abs(psi) * part.half_length, initial=0.0)
        for part in parts
        for y, psi in [motion.get(part.name, (np.zeros(1), np.zeros(1)))]
    ]
    return float(max(ends, default=0.0))


def mode_motion(mode: TrackedMode, speed: float) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return lateral displacement and yaw of each body over a cycle of a mode, without its decay [CYCLE_POINTS]."""
    vector = mode.vectors[int(np.argmin(np.abs(mode.speeds - speed)))]
    phase = np.exp(2j * np.pi * np.linspace(0.0, 1.0, CYCLE_POINTS))
    return _by_body(mode.dofs, [np.real(value * phase) for value in vector])


def ride_channel(dof: str) -> str:
    """Return the channel of a simulation that is a degree of freedom.

    >>> ride_channel("y"), ride_channel("psi1"), ride_channel("y.body")
    ('z.frame.0', 'psi1', 'y.body')
    """
    if "." in dof or (dof.startswith("psi") and dof != "psi"):
        return dof
    names = {"y": "z.frame.0", "psi": "z.frame_yaw.0"}
    return names.get(dof, f"z.wheelset.{dof[1:]}")


def ride_motion(dofs: Sequence[str], series: Mapping[str, FloatArray]) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return lateral displacement and yaw of each body over the samples of a ride."""
    zeros = np.zeros_like(next(iter(series.values())))
    return _by_body(dofs, [series.get(ride_channel(dof), zeros) for dof in dofs])


def _by_body(dofs: Sequence[str], values: Sequence[FloatArray]) -> dict[str, tuple[FloatArray, FloatArray]]:
    motion: dict[str, tuple[FloatArray, FloatArray]] = {}
    for dof, x in zip(dofs, values, strict=True):
        body, kind = body_and_motion(dof)
        y, psi = motion.get(body, (np.zeros_like(x), np.zeros_like(x)))
        motion[body] = (x, psi) if kind == "lateral" else (y, x) if kind == "yaw" else (y, psi)
    return motion


def at_sample(motion: Mapping[str, tuple[FloatArray, FloatArray]], i: int) -> Motion:
    """Return the motion at one sample."""
    return {name: (float(y[i % len(y)]), float(psi[i % len(psi)])) for name, (y, psi) in motion.items()}


def schematic_plot(parts: Sequence[Part], motion: Motion, factor: float, rails: FloatArray | None = None) -> PlotData:
    """Plot a vehicle from above, running to the right, its motion enlarged by a factor.

    rails [2, n]: places [m] along the vehicle and lateral deviation [m] of the track; a straight track without.
    """
    extent = max((abs(part.x) + part.half_length for part in parts), default=1.0) + 0.6
    width = max((part.half_width for part in parts), default=1.0) + DRAWN_MOTION + 0.15
    gauge = next((part.half_width for part in parts if part.is_wheelset), HALF_GAUGE)
    track = np.array([[-extent, extent], [0.0, 0.0]]) if rails is None else rails
    lines = [Line(track[0], -(side * gauge + factor * track[1]), "", "base") for side in (-1.0, 1.0)]
    kinds = dict.fromkeys(_kind(part) for part in parts)
    for k, kind in enumerate(kinds):
        label = kind
        for part in (one for one in parts if _kind(one) == kind):
            y, psi = (factor * value for value in motion.get(part.name, (0.0, 0.0)))
            for x, across in outlines(part, y, psi):
                lines.append(Line(x, -across, label, series_role(k)))
                label = ""
    x_axis = Axis("x, forward", "m", low=-extent, high=extent)
    return PlotData(x_axis, Axis("-y, left side up", "m", low=-width, high=width), lines)


def _kind(part: Part) -> str:
    return part.name.split(" ")[0]


def outlines(part: Part, y: float, psi: float) -> list[tuple[FloatArray, FloatArray]]:
    """Return the lines of a part, places [m] forward and to the right, displaced by y [m] and turned by psi [rad]."""
    along, across = part.half_length, part.half_width
    if part.is_wheelset:
        shapes = [[(0.0, -across), (0.0, across)], *([(-along, s), (along, s)] for s in (-across, across))]
    else:
        corners = [(along, across), (along, -across), (-along, -across), (-along, across), (along, across)]
        shapes = [corners]
    found = []
    for shape in shapes:
        u, w = np.array(shape).T
        found.append((part.x + u - psi * w, y + w + psi * u))
    return found


def cycle_plot(motion: Mapping[str, tuple[FloatArray, FloatArray]], phase: float, frequency: float) -> PlotData:
    """Plot the lateral displacement of each body over a cycle, relative to the largest, with the present phase."""
    largest = max((float(np.max(np.abs(y))) for y, _ in motion.values()), default=0.0) or 1.0
    t = np.linspace(0.0, 1.0, CYCLE_POINTS) / max(frequency, 1e-9)
    lines = [Line(t, y / largest, name, series_role(k)) for k, (name, (y, _)) in enumerate(motion.items())]
    limits = [LimitLine(phase / max(frequency, 1e-9), "", is_vertical=True)]
    return PlotData(Axis("t", "s"), Axis("lateral, relative", low=-1.1, high=1.1), lines, limits)


def ride_plot(
    t: FloatArray, motion: Mapping[str, tuple[FloatArray, FloatArray]], track: FloatArray, now: float
) -> PlotData:
    """Plot the lateral displacement of each body and of the track in the seconds around now [s]."""
    is_shown = np.abs(t - now) <= 0.5 * RIDE_SECONDS
    lines = [Line(t[is_shown], MM_PER_M * track[is_shown], "track", "base")]
    for k, (name, (y, _)) in enumerate(motion.items()):
        lines.append(Line(t[is_shown], MM_PER_M * y[is_shown], name, series_role(k)))
    largest = MM_PER_M * max(float(np.nanmax(np.abs(track), initial=0.0)), 1e-6)
    largest = max([largest, *(MM_PER_M * float(np.nanmax(np.abs(y), initial=0.0)) for y, _ in motion.values())])
    x = Axis("t", "s", low=now - 0.5 * RIDE_SECONDS, high=now + 0.5 * RIDE_SECONDS)
    y_axis = Axis("y", "mm", low=-1.05 * largest, high=1.05 * largest)
    return PlotData(x, y_axis, lines, [LimitLine(now, "", is_vertical=True)])
