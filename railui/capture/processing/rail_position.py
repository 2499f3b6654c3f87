"""The measured track: where the rails lie, from what sensors on the axle boxes read (Broersen 1976, 6.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from railui.arrays import FloatArray
from railui.capture.processing.map_model import RailsModel
from railui.capture.processing.sensor_map import Geometry
from railui.dsp.integrate import integrate, lowpass
from railui.runs.columns import named
from railui.vehicle.wheel_loads import GRAVITY

SHARE = 0.35  # natural frequency beside that of the longest wavelength: its gain is 1.5 % low there
SETTLE = 0.75  # periods of the natural frequency that both ends are wrong
CUT_SHORT = 0.85  # corner of the low pass beside the shortest wavelength kept
MOTIONS = named("bogie", "response", "coach")


@dataclass(frozen=True, eq=False)
class Rails:
    """The track under the leading wheelset and the motions freed of gravity, [n] each.

    `versions` are the lateral deviations that each wheelset alone tells, the trailing one's moved by 2a to where
    the leading one was (NaN where it has not been). `settle` samples at both ends are still wrong.
    """

    columns: Mapping[str, FloatArray]
    versions: Mapping[int, FloatArray]
    natural: float
    settle: int
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Work:
    """One piece while it is worked on."""

    q: dict[str, FloatArray]
    s: FloatArray
    dt: float
    model: RailsModel
    geometry: Geometry
    natural: float
    raw: frozenset[str]  # accelerometers that feel gravity
    notes: list[str]

    def slow_free(self, x: FloatArray) -> FloatArray:
        """x through the same high pass as everything that is integrated."""
        return self.integral(x, 0)

    def integral(self, x: FloatArray, times: int, natural: float | None = None) -> FloatArray:
        zero_phase = self.model.filter == "zero_phase"
        return integrate(x, self.dt, times, natural or self.natural, self.model.damping, zero_phase)

    def behind(self, x: FloatArray) -> FloatArray:
        """What the trailing wheelset meets of a track quantity: x at s - 2a, the first value before that."""
        at = np.maximum(self.s - 2 * self.geometry.half_wheelbase, self.s[0])
        return np.asarray(CubicSpline(self.s, x)(at))

    def ahead(self, x: FloatArray) -> FloatArray:
        """What the trailing wheelset told of the place where the leading one is: x at s + 2a, NaN beyond the end."""
        at = self.s + 2 * self.geometry.half_wheelbase
        found = np.asarray(CubicSpline(self.s, x)(np.minimum(at, self.s[-1])))
        return np.where(at <= self.s[-1], found, np.nan)


def natural_frequency(model: RailsModel, speed: float) -> float:
    """The eigenfrequency [Hz] of the integrating filter: as stated, or for the longest wavelength at a speed [m/s].

    >>> round(natural_frequency(RailsModel(), 40.0), 3)
    0.2
    """
    return model.natural_frequency or SHARE * speed / model.longest


def reconstruct(
    q: Mapping[str, FloatArray], s: FloatArray, dt: float, model: RailsModel, geometry: Geometry, raw: frozenset[str]
) -> Rails:
    """The track from axle-box accelerations, wheel displacements and roll; q by target in SI, s [m] rising.

    y_w = (y_i'' + g phi_i, integrated twice) - e_i - r phi_w, everything through one high pass; an accelerometer
    of `raw` reads y'' - g phi. phi_i comes from the wheelset's roll rate or inclinometer, else from phi_w measured,
    phi_i = phi_w - sigma e_i/b; the trailing wheelset's else from the leading one's cross-level, 2a later.
    Quantities that are measured (yw, phiw, gauge) are kept. Raises ValueError where nothing tells y_w.
    """
    notes: list[str] = []
    speed = float((s[-1] - s[0]) / (dt * (s.size - 1)))
    work = _Work(dict(q), s, dt, model, geometry, natural_frequency(model, speed), raw, notes)
    _sides(work)
    rolls = _rolls(work)
    columns = _freed(work, rolls)
    versions: dict[int, FloatArray] = {}
    if "yw" not in q:
        versions = _versions(work, columns, rolls)
        columns["yw"] = _smooth(work, _combined(list(versions.values())), speed)
    else:
        columns["yw"] = q["yw"]
    if rolls[0] is not None:
        columns["phiw"] = q["phiw"] if "phiw" in q else _smooth(work, rolls[0], speed)
    if "gauge" in work.q:
        columns["gauge"] = q["gauge"] if "gauge" in q else _smooth(work, work.q["gauge"], speed)
    settle = 0 if "yw" in q else round(SETTLE / work.natural / dt)
    return Rails(columns, versions, work.natural, settle, tuple(notes))


def _sides(work: _Work) -> None:
    """e_i and the gauge from the sensors of both wheels: e -/+ g/2 on the right and on the left."""
    gauges = []
    for i in (1, 2):
        right, left = work.q.pop(f"e{i}_right", None), work.q.pop(f"e{i}_left", None)
        if right is None or left is None:
            if right is not None or left is not None:
                work.notes.append(f"e{i}: one wheel's sensor alone does not tell the gauge from the displacement")
            continue
        work.q.setdefault(f"e{i}", 0.5 * (right + left))
        gauges.append(left - right if i == 1 else work.ahead(left - right))
    if gauges and "gauge" not in work.q:
        work.q["gauge"] = _combined(gauges)


def _combined(versions: list[FloatArray]) -> FloatArray:
    """The mean of what is there; the ends where only one is."""
    known = np.stack(versions)
    count = np.sum(np.isfinite(known), axis=0)
    return np.asarray(np.nansum(known, axis=0) / np.maximum(count, 1))


def _rolls(work: _Work) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """Cross-level phi_w at the leading wheelset, roll of both wheelsets [rad]; None where nothing tells it."""
    geometry, q = work.geometry, work.q
    lean = [geometry.roll[i] * q[f"e{i + 1}"] / geometry.half_gauge if f"e{i + 1}" in q else 0.0 for i in (0, 1)]
    first, second = _roll(work, 1), _roll(work, 2)
    phiw = q.get("phiw")
    if phiw is None and first is not None:
        phiw = first + work.slow_free(np.broadcast_to(lean[0], work.s.shape))
    elif phiw is None and second is not None:
        phiw = work.ahead(second + work.slow_free(np.broadcast_to(lean[1], work.s.shape)))
        phiw = np.where(np.isfinite(phiw), phiw, 0.0)
    if phiw is None:
        work.notes.append(
            "nothing tells the roll: g phi_w stays in the accelerations, and the rail position is wrong by it"
        )
        return None, None, None
    first = phiw - lean[0] if first is None else first
    second = work.behind(phiw) - lean[1] if second is None else second
    return phiw, first, second


def _roll(work: _Work, i: int) -> FloatArray | None:
    """The roll of a wheelset from its gyro, its inclinometer, or both: each where it is good."""
    rate, angle = work.q.get(f"roll_rate{i}"), work.q.get(f"inclination{i}")
    if rate is None:
        return angle
    if angle is None:
        return work.integral(rate, 1, work.natural / 2)
    slow = work.model.crossover
    return work.integral(rate, 1, slow) + angle - work.integral(angle, 0, slow)


def _freed(work: _Work, rolls: tuple[FloatArray | None, FloatArray | None, FloatArray | None]) -> dict[str, FloatArray]:
    """The responses as columns of a run: accelerations with g phi added where it was felt."""
    phiw, first, second = rolls
    columns = {name: x for name, x in work.q.items() if name in MOTIONS}
    frame = None
    if "ayf" in columns and "ayf" in work.raw:
        if "roll_ratef" in work.q:
            frame = work.integral(work.q["roll_ratef"], 1, work.natural / 2)
        elif phiw is not None:
            frame = 0.5 * (phiw + work.behind(phiw))
    for name, roll in (("ay1", first), ("ay2", second), ("ayf", frame)):
        if name in columns and name in work.raw and roll is not None:
            columns[name] = columns[name] + GRAVITY * roll
    return columns


def _versions(
    work: _Work,
    columns: Mapping[str, FloatArray],
    rolls: tuple[FloatArray | None, FloatArray | None, FloatArray | None],
) -> dict[int, FloatArray]:
    """The lateral deviation from each wheelset that has both sensors, where the leading wheelset is."""
    r, found = work.geometry.rolling_radius, {}
    for i in (1, 2):
        if f"ay{i}" not in columns or f"e{i}" not in columns:
            continue
        there = work.integral(columns[f"ay{i}"], 2) - work.slow_free(columns[f"e{i}"])
        if rolls[0] is not None:
            there = there - r * work.slow_free(rolls[0] if i == 1 else work.behind(rolls[0]))
        found[i] = there if i == 1 else work.ahead(there)
    if not found:
        raise ValueError("nothing tells the lateral position of the rails: map yw, or ay1 and e1 (ay2 and e2)")
    return found


def _smooth(work: _Work, x: FloatArray, speed: float) -> FloatArray:
    """A track column less what is shorter than the shortest wavelength kept."""
    return lowpass(x, work.dt, speed / (CUT_SHORT * work.model.shortest))
