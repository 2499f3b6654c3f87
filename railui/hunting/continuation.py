"""Limit cycles by shooting, stable or not, continued along their branch round the fold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.hunting.tangent_track import SPACING, Motion, TangentTrackRuns, half_range
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource
from railui.vehicle.linear import STRAIGHT

NUDGE: Final = 1e-6  # of a scaled unknown: of the slopes
CLOSE: Final = 1e-7  # of the motion: what a period may leave open
NEWTON: Final = 12  # steps
FIRST: Final = 0.02  # step along the branch, of the scaled unknowns
LARGEST: Final = 0.15
MOST: Final = 80  # cycles of a branch


@dataclass(frozen=True)
class Cycle:
    """A limit cycle: speed [m/s], amplitude [m], frequency [Hz], the largest Floquet multiplier but that of 1."""

    speed: float
    amplitude: float
    frequency: float
    multiplier: float

    def as_dict(self) -> dict[str, float]:
        """The cycle as a row of the JSON."""
        return {
            "speed": self.speed,
            "amplitude": self.amplitude,
            "frequency": self.frequency,
            "multiplier": self.multiplier,
        }


def continue_branch(track: TangentTrackRuns, hunts: Motion, smallest: float, highest: float) -> list[Cycle]:
    """The branch of a limit cycle from where it is stable, round the fold, to an amplitude [m] or a speed [m/s].

    `hunts`: one steady motion, a little above the fold. Unknown are the state at the beginning of a period, its
    length L and the speed V: what a period leaves open is brought to nothing by Newton's steps, the monodromy matrix
    by differences in the kernel's lanes, and the branch is followed by its own arc length, so that it may turn back
    in speed. Empty where no cycle closes (motions that do not repeat themselves). Source: Keller 1977; Seydel,
    Practical Bifurcation and Stability Analysis, 7.
    """
    shooting = _Shooting.of(track, hunts)
    u = np.append(hunts.states[0], [hunts.speeds[0] / hunts.frequencies[0], hunts.speeds[0]]) / shooting.scale
    one = shooting.closed(u, None)
    if one is None:
        return []
    lower = one[0].copy()
    lower[-1] *= 1 - 2e-4
    two = shooting.closed(lower, None)
    if two is None:
        return []
    found, step = [one[1], two[1]], FIRST
    u, direction = two[0], (two[0] - one[0]) / np.linalg.norm(two[0] - one[0])
    while len(found) < MOST and step > 1e-4:
        tried = shooting.closed(u + step * direction, direction)
        if tried is None or np.linalg.norm(tried[0] - u) > 3 * step:
            step *= 0.4
            continue
        if found[-1].amplitude < 4 * smallest and tried[1].amplitude > found[-1].amplitude:
            break  # through rest, where the branch begins, to its own mirror image
        direction = (tried[0] - u) / np.linalg.norm(tried[0] - u)
        u, step = tried[0], min(1.5 * step, LARGEST)
        found.append(tried[1])
        if tried[1].amplitude < smallest or tried[1].speed > highest:
            break
    return found


@dataclass(frozen=True, eq=False)
class _Shooting:
    """The period of one vehicle as a function of scaled unknowns: state, length of the period, speed."""

    track: TangentTrackRuns
    scale: FloatArray
    table: FloatArray
    steps: int
    samples: int

    @classmethod
    def of(cls, track: TangentTrackRuns, hunts: Motion) -> _Shooting:
        speed, frequency = float(hunts.speeds[0]), float(hunts.frequencies[0])
        samples = max(40, round(speed / frequency / SPACING))
        flat = TrackSource(Track(np.arange(float(samples + 1)), np.zeros(samples + 1)), STRAIGHT.name)
        steps = track.vehicles.steps(track.single, 0.8 * speed, 1.2 * speed, 1.25 * SPACING / speed)[0]
        table = Excitation(flat, 1.0).table(track.model.half_wheelbase(), steps)
        series, _ = track.run(hunts.states, np.array([speed]), table, speed, SPACING / speed, steps)
        size = np.abs(series[0, len(track.wheelsets) :]).max(axis=1)
        scale = np.where(size > 0, size, 1.0)
        return cls(track, np.append(scale, [speed / frequency, speed]), table, steps, samples)

    def period(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """What the period leaves open, its slopes, the direction of the flow (all scaled), and e over the period."""
        n, wheels = self.track.states, len(self.track.wheelsets)
        x, length, speed = (u * self.scale)[:n], u[n] * self.scale[n], u[n + 1] * self.scale[n + 1]
        states = np.tile(x, (n + 2, 1))
        states[1 : n + 1] += NUDGE * np.diag(self.scale[:n])
        speeds = np.full(n + 2, speed)
        speeds[n + 1] *= 1 + NUDGE
        series, _ = self.track.run(states, speeds, self.table, speed, length / self.samples / speed, self.steps)
        ends = series[:, wheels:, -1] / self.scale[:n]
        flow = (series[0, wheels:, -1] - series[0, wheels:, -2]) * self.samples / self.scale[:n]
        slopes = np.empty((n, n + 2))
        slopes[:, :n] = (ends[1 : n + 1] - ends[0]).T / NUDGE - np.eye(n)
        slopes[:, n] = flow / u[n]
        slopes[:, n + 1] = (ends[n + 1] - ends[0]) / (NUDGE * u[n + 1])
        return ends[0] - u[:n], slopes, flow, series[0, :wheels]

    def closed(self, start: FloatArray, along: FloatArray | None) -> tuple[FloatArray, Cycle] | None:
        """The cycle near a start: at its speed, or where `along` is given in the plane across the branch."""
        u, n = start.copy(), self.track.states
        phase: FloatArray | None = None
        for _ in range(NEWTON):
            left, slopes, flow, e = self.period(u)
            if not np.all(np.isfinite(slopes)) or u[n] <= 0 or u[n + 1] <= 0:
                return None
            phase = flow / np.linalg.norm(flow) if phase is None else phase
            if np.abs(left).max() < CLOSE:
                return u, self._cycle(u, slopes, e)
            across = np.zeros(n + 2) if along is None else along
            if along is None:
                across[-1] = 1.0
            rows = np.vstack([slopes, np.append(phase, [0.0, 0.0]), across])
            right = np.concatenate([-left, [-phase @ (u - start)[:n], -across @ (u - start)]])
            try:
                u = u + np.linalg.solve(rows, right)
            except np.linalg.LinAlgError:
                return None
        return None

    def _cycle(self, u: FloatArray, slopes: FloatArray, e: FloatArray) -> Cycle:
        n = self.track.states
        length, speed = u[n] * self.scale[n], u[n + 1] * self.scale[n + 1]
        multipliers = np.linalg.eigvals(slopes[:, :n] + np.eye(n))
        others = np.delete(multipliers, np.argmin(np.abs(multipliers - 1.0)))
        return Cycle(float(speed), float(half_range(e[None])[0]), float(speed / length), float(np.abs(others).max()))
