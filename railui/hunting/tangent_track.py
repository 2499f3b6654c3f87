"""Vehicles let loose on straight level track: what becomes of their motion, each at its own speed."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, Vehicles
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource
from railui.vehicle.linear import STRAIGHT, is_lateral
from railui.vehicle.model import Model

Bools = NDArray[np.bool_]

SPACING: Final = 0.1  # m between two samples
PIECE: Final = 250.0  # m between two looks at the motion
LONGEST: Final = 20e3  # m that a vehicle is followed
STEADY: Final = 1e-5  # of the amplitude, from piece to piece, twice: it will not change any more


@dataclass(frozen=True, eq=False)
class Motion:
    """Vehicles in motion: their speeds [n] m/s, states [n, states], amplitudes [n] m, frequencies [n] Hz.

    Amplitude: half the range of e, of the wheelset that moves most; infinite for a vehicle off the rails.
    """

    speeds: FloatArray
    states: FloatArray
    amplitudes: FloatArray = field(default_factory=lambda: np.zeros(0))
    frequencies: FloatArray = field(default_factory=lambda: np.zeros(0))
    steady: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __len__(self) -> int:
        return len(self.speeds)

    def select(self, rows: NDArray[np.int64] | Bools | list[int]) -> Motion:
        """Some of the vehicles."""
        parts = (self.amplitudes, self.frequencies, self.steady)
        return Motion(self.speeds[rows], self.states[rows], *(x[rows] if len(x) else x for x in parts))  # type: ignore[arg-type]


class TangentTrackRuns:
    """One vehicle on straight track, sixteen speeds and states side by side."""

    def __init__(self, model: Model, jobs: int | None = 1) -> None:
        self.model, self.jobs = model, jobs
        self.vehicles: Vehicles = model.vehicles()
        self.single: Batch = model.single()
        self.states: int = self.vehicles.states(self.single)
        self.dofs = self.vehicles.freedoms(self.single)
        self.wheelsets = [c for c in self.vehicles.channels(self.single) if re.fullmatch(r"e\d+", c)]
        self._tables: dict[int, FloatArray] = {}

    def let_go(self, speeds: FloatArray, states: FloatArray) -> Motion:
        """Vehicles at these speeds [n] in these states, [states] for all or [n, states]."""
        speeds = np.asarray(speeds, dtype=float)
        return Motion(speeds, np.ascontiguousarray(np.broadcast_to(states, (len(speeds), self.states))))

    def aside(self, displacement: float) -> FloatArray:
        """The state of a vehicle that stands so far [m] beside the middle of the track, all its bodies."""
        state = np.zeros(self.states)
        lateral = [i for i, d in enumerate(self.dofs) if is_lateral(d)]
        state[lateral] = displacement
        return state

    def piece(self, motion: Motion) -> Motion:
        """The motion one piece of track further on."""
        n, slowest, fastest = len(motion), float(motion.speeds.min()), float(motion.speeds.max())
        steps = self.vehicles.steps(self.single, slowest, fastest, SPACING / slowest)[0]
        series, lost = self.run(motion.states, motion.speeds, self._table(steps), fastest, SPACING / fastest, steps)
        e = series[:, : len(self.wheelsets)]
        amplitudes = half_range(e)
        amplitudes[lost >= 0] = np.inf
        before = motion.amplitudes if len(motion.amplitudes) else np.full(n, np.nan)
        with np.errstate(invalid="ignore"):
            steady = np.abs(amplitudes - before) <= STEADY * amplitudes
        frequencies = _frequencies(e, SPACING / motion.speeds)
        states = np.where((lost >= 0)[:, None], 0.0, series[:, len(self.wheelsets) :, -1])
        return Motion(motion.speeds, states, amplitudes, frequencies, steady)

    def run(
        self, states: FloatArray, speeds: FloatArray, table: FloatArray, fastest: float, dt: float, steps: int
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """Displacements, then all states, [vehicle, channel, sample], from states [n, states] at speeds [n].

        table: of level track at any speed; dt [s] between samples at the speed `fastest` [m/s].
        """
        names = [*self.wheelsets, *(f"state.{i}" for i in range(self.states))]
        batch = self.single.select(np.zeros(len(speeds), dtype=int))
        batch = replace(batch, speed_scale=np.ascontiguousarray(speeds / fastest))
        level = table.copy()
        level[:, 1] = fastest
        return self.vehicles.simulate(batch.with_initial(states), level, dt, steps, names, jobs=self.jobs)

    def settled(self, motion: Motion, floor: float, longest: float = LONGEST) -> Motion:
        """The motion when it has become steady or died: fallen below an amplitude `floor` [m].

        Vehicles that do neither are told as they are after `longest` [m].
        """
        rows, now, known = np.arange(len(motion)), motion, np.zeros(len(motion), dtype=bool)
        out = Motion(motion.speeds, motion.states.copy(), np.zeros(len(motion)), np.zeros(len(motion)), known.copy())
        for _ in range(int(longest / PIECE)):
            following = self.piece(now)
            twice = following.steady & now.steady if len(now.steady) else following.steady & False
            for name in ("states", "amplitudes", "frequencies", "steady"):
                getattr(out, name)[rows] = getattr(following, name)
            over = twice | (following.amplitudes < floor) | ~np.isfinite(following.amplitudes)
            rows, now = rows[~over], following.select(~over)
            if not rows.size:
                break
        return out

    def _table(self, steps: int) -> FloatArray:
        if steps not in self._tables:
            places = int(PIECE / SPACING) + 1
            flat = TrackSource(Track(SPACING * np.arange(float(places)), np.zeros(places)), STRAIGHT.name)
            self._tables[steps] = Excitation(flat, 1.0).table(self.model.half_wheelbase(), steps)
        return self._tables[steps]


def half_range(e: FloatArray) -> FloatArray:
    """Half the range [n] of displacements [n, wheelset, sample], of the wheelset that moves most."""
    return np.asarray(np.max(_peak(e) + _peak(-e), axis=1) / 2)


def _peak(x: FloatArray) -> FloatArray:
    """The largest value along the last axis, of the parabola through its sample and the two beside it."""
    k = np.clip(np.argmax(x, axis=-1), 1, x.shape[-1] - 2)[..., None]
    left, top, right = (np.take_along_axis(x, k + i, axis=-1)[..., 0] for i in (-1, 0, 1))
    bend = left - 2 * top + right
    rise = np.where(bend < 0, -((right - left) ** 2) / np.where(bend < 0, 8 * bend, 1.0), 0.0)
    return np.asarray(np.max(x, axis=-1) + np.where((top >= left) & (top >= right), rise, 0.0))


def _frequencies(e: FloatArray, dt: FloatArray) -> FloatArray:
    """Frequency [n] of the wheelset that moves most, by the crossings of its middle upwards; 0 without two."""
    found = np.zeros(len(e))
    for i, each in enumerate(e):
        x = each[int(np.argmax(np.ptp(each, axis=1)))]
        x = x - 0.5 * (x.max() + x.min())
        k = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
        if len(k) > 1:
            at = k + x[k] / (x[k] - x[k + 1])
            found[i] = (len(k) - 1) / ((at[-1] - at[0]) * dt[i])
    return found
