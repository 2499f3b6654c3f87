"""The pictures of a design beside its base: spectra, damping and frequencies of the modes, series, curve."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from railui.desk.presenters.look import RADII, Look
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.picture import Level, Line, Picture

View = Callable[[Look, Look], Picture]
MM = 1e3


def displacement(now: Look, base: Look) -> Picture:
    """Density of the displacement of the leading wheelset relative to the rails."""
    return _density(now, base, "e1", MM**2, Axis("e₁", "mm²/Hz", log=True))


def acceleration(now: Look, base: Look) -> Picture:
    """Density of the acceleration at the comfort point."""
    return _density(now, base, "comfort", 1.0, Axis("acceleration", "(m/s²)²/Hz", log=True))


def _density(now: Look, base: Look, key: str, factor: float, y: Axis) -> Picture:
    lines = [Line(look.f, factor * look.density[key], label, role) for look, label, role in _both(now, base)]
    return Picture(Axis("f", "Hz", log=True, low=0.1, high=40.0), y, lines)


def damping(now: Look, base: Look) -> Picture:
    """Damping ratio of the modes against speed; at 0 a mode keeps swinging."""
    lines = [
        Line(look.speeds, look.damping[:, k], label if k == 0 else "", role, points=True)
        for look, label, role in _both(now, base)
        for k in range(look.damping.shape[1])
    ]
    at = Level(now.case.speed, f"{now.case.speed:g}", upright=True)
    return Picture(Axis("V", "m/s"), Axis("damping ratio", low=-0.1, high=0.6), lines, (Level(0.0), at))


def frequency(now: Look, base: Look) -> Picture:
    """Frequencies of the modes against speed."""
    lines = [
        Line(look.speeds, look.frequency[:, k], label if k == 0 else "", role, points=True)
        for look, label, role in _both(now, base)
        for k in range(look.frequency.shape[1])
    ]
    at = Level(now.case.speed, f"{now.case.speed:g}", upright=True)
    return Picture(Axis("V", "m/s"), Axis("mode", "Hz", low=0.0, high=15.0), lines, (at,))


def series(now: Look, base: Look) -> Picture:
    """Displacement of the leading wheelset along the track, between the flanges."""
    lines = [Line(look.s, MM * look.series["e1"], label, role) for look, label, role in _both(now, base)]
    c = MM * now.clearance
    reach = 1.15 * max(c, *(float(np.nanmax(np.abs(line.y), initial=0.0)) for line in lines))
    levels = (Level(c, "flange"), Level(-c, "flange"))
    return Picture(Axis("s", "m"), Axis("e₁", "mm", low=-reach, high=reach), lines, levels)


def ride(now: Look, base: Look) -> Picture:
    """Acceleration of the frame along the track."""
    lines = [Line(look.s, look.series["ayf"], label, role) for look, label, role in _both(now, base)]
    return Picture(Axis("s", "m"), Axis("frame y''", "m/s²"), lines)


def curving(now: Look, base: Look) -> Picture:
    """Guiding force on the leading wheelset in curves without cant deficiency."""
    lines = [
        Line(np.array(RADII), 1e-3 * look.guiding_force[:, 0], label, role)
        for look, label, role in _both(now, base)
        if look.guiding_force is not None
    ]
    y = Axis("guiding force, leading", "kN")
    return Picture(Axis("R", "m", log=True), y, lines, wait="standing in curves ...")


def _both(now: Look, base: Look) -> list[tuple[Look, str, str]]:
    """The base below, where it is another design."""
    first = [(base, "base", "base")] if base is not now else []
    return [*first, (now, "now", "now")]


VIEWS: dict[str, View] = {
    "displacement spectrum": displacement,
    "comfort spectrum": acceleration,
    "damping of the modes": damping,
    "displacement": series,
    "curves": curving,
    "frequencies of the modes": frequency,
    "acceleration of the frame": ride,
}

PART = (0.0, 0.2)  # of a series, shown until somebody zooms
WINDOWS = {"displacement": PART, "acceleration of the frame": PART}
