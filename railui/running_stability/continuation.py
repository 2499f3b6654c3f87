"""Limit cycles by shooting, stable or unstable, continued along their branch through the saddle-node bifurcation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.running_stability.tangent_track import SAMPLE_SPACING, Motion, TangentTrackRuns, half_range, level_track

PERTURBATION: Final = 1e-6  # of a scaled unknown, for the differences of the Jacobian
CLOSURE_TOLERANCE: Final = 1e-7  # of the scaled state, between both ends of a period
MAX_NEWTON_ITERATIONS: Final = 12
FIRST_STEP: Final = 0.02  # arc length of the scaled unknowns
MIN_STEP: Final = 1e-4
MAX_STEP: Final = 0.15
STEP_REDUCTION: Final = 0.4
STEP_GROWTH: Final = 1.5
MAX_CYCLES: Final = 80  # of a branch
START_OFFSET: Final = 2e-4  # relative decrease of speed from the first to the second cycle
MIN_SAMPLES_PER_PERIOD: Final = 40
MIN_SPEED_FACTOR: Final = 0.8  # of the speed of the motion, for which the steps per sample must suffice
MAX_SPEED_FACTOR: Final = 1.2


@dataclass(frozen=True)
class Cycle:
    """Limit cycle: speed [m/s], amplitude [m], frequency [Hz], largest Floquet multiplier except the trivial 1."""

    speed: float
    amplitude: float
    frequency: float
    multiplier: float

    def as_dict(self) -> dict[str, float]:
        """Return the cycle as a row of the JSON result."""
        return {
            "speed": self.speed,
            "amplitude": self.amplitude,
            "frequency": self.frequency,
            "multiplier": self.multiplier,
        }


def continue_branch(runs: TangentTrackRuns, motion: Motion, min_amplitude: float, max_speed: float) -> list[Cycle]:
    """Continue the branch of a limit cycle from a stable cycle through the saddle-node bifurcation.

    Unknowns are the state at the beginning of a period, its length L and the speed V. Newton's method closes the
    period; the monodromy matrix comes from differences in SIMD batches. The branch is followed by its arc length, so
    that it may turn back in speed.

    Parameters
    ----------
    runs : TangentTrackRuns
        Vehicle.
    motion : Motion
        One steady motion slightly above the nonlinear critical speed.
    min_amplitude : float
        Amplitude [m] at which the branch ends.
    max_speed : float
        Speed [m/s] at which the branch ends.

    Returns
    -------
    list of Cycle
        Empty if no period closes (motions that are not periodic).

    References
    ----------
    Keller 1977; Seydel, Practical Bifurcation and Stability Analysis, 7.
    """
    shooting = _Shooting.for_motion(runs, motion)
    start = np.append(motion.states[0], [motion.speeds[0] / motion.frequencies[0], motion.speeds[0]]) / shooting.scale
    first = shooting.solve(start, None)
    if first is None:
        return []
    slower = first[0].copy()
    slower[-1] *= 1 - START_OFFSET
    second = shooting.solve(slower, None)
    if second is None:
        return []
    branch, step = [first[1], second[1]], FIRST_STEP
    u, direction = second[0], _unit_vector(second[0] - first[0])
    while len(branch) < MAX_CYCLES and step > MIN_STEP:
        solution = shooting.solve(u + step * direction, direction)
        if solution is None or np.linalg.norm(solution[0] - u) > 3 * step:
            step *= STEP_REDUCTION
            continue
        next_u, cycle = solution
        if branch[-1].amplitude < 4 * min_amplitude and cycle.amplitude > branch[-1].amplitude:
            break  # past the equilibrium, where the branch begins, to its own mirror image
        direction = _unit_vector(next_u - u)
        u, step = next_u, min(STEP_GROWTH * step, MAX_STEP)
        branch.append(cycle)
        if cycle.amplitude < min_amplitude or cycle.speed > max_speed:
            break
    return branch


def _unit_vector(x: FloatArray) -> FloatArray:
    return np.asarray(x / np.linalg.norm(x))


@dataclass(frozen=True, eq=False)
class _Shooting:
    """Period of one vehicle as a function of scaled unknowns: state, length of the period, speed."""

    runs: TangentTrackRuns
    scale: FloatArray
    table: FloatArray
    steps: int
    samples: int

    @classmethod
    def for_motion(cls, runs: TangentTrackRuns, motion: Motion) -> _Shooting:
        """Choose scales, samples and steps for periods near one motion."""
        speed, frequency = float(motion.speeds[0]), float(motion.frequencies[0])
        samples = max(MIN_SAMPLES_PER_PERIOD, round(speed / frequency / SAMPLE_SPACING))
        slowest, fastest = MIN_SPEED_FACTOR * speed, MAX_SPEED_FACTOR * speed
        longest_dt = 1.25 * SAMPLE_SPACING / speed  # that at the lowest speed
        sampling = runs.sampling(slowest, fastest, longest_dt)
        samples, steps = samples * sampling.refinement, sampling.steps
        table = level_track(samples + 1, 1.0).table(runs.model.wheelset_spacing(), steps)
        series, _ = runs.run(motion.states, np.array([speed]), table, speed, sampling.spacing / speed, steps)
        size = np.abs(series[0, len(runs.wheelsets) :]).max(axis=1)
        scale = np.where(size > 0, size, 1.0)
        return cls(runs, np.append(scale, [speed / frequency, speed]), table, steps, samples)

    def period(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the closure error of a period, its Jacobian, the direction of the flow (all scaled), and e."""
        n, wheelsets = self.runs.states, len(self.runs.wheelsets)
        x, length, speed = (u * self.scale)[:n], u[n] * self.scale[n], u[n + 1] * self.scale[n + 1]
        states = np.tile(x, (n + 2, 1))
        states[1 : n + 1] += PERTURBATION * np.diag(self.scale[:n])
        speeds = np.full(n + 2, speed)
        speeds[n + 1] *= 1 + PERTURBATION
        dt = length / self.samples / speed
        series, _ = self.runs.run(states, speeds, self.table, speed, dt, self.steps)
        ends = series[:, wheelsets:, -1] / self.scale[:n]
        flow = (series[0, wheelsets:, -1] - series[0, wheelsets:, -2]) * self.samples / self.scale[:n]
        jacobian = np.empty((n, n + 2))
        jacobian[:, :n] = (ends[1 : n + 1] - ends[0]).T / PERTURBATION - np.eye(n)
        jacobian[:, n] = flow / u[n]
        jacobian[:, n + 1] = (ends[n + 1] - ends[0]) / (PERTURBATION * u[n + 1])
        return ends[0] - u[:n], jacobian, flow, series[0, :wheelsets]

    def solve(self, start: FloatArray, tangent: FloatArray | None) -> tuple[FloatArray, Cycle] | None:
        """Return the cycle near a start: at its speed, or with a `tangent` in the plane normal to the branch."""
        u, n = start.copy(), self.runs.states
        phase: FloatArray | None = None
        normal = np.zeros(n + 2) if tangent is None else tangent
        if tangent is None:
            normal[-1] = 1.0
        for _ in range(MAX_NEWTON_ITERATIONS):
            error, jacobian, flow, e = self.period(u)
            if not np.all(np.isfinite(jacobian)) or u[n] <= 0 or u[n + 1] <= 0:
                return None
            phase = flow / np.linalg.norm(flow) if phase is None else phase
            if np.abs(error).max() < CLOSURE_TOLERANCE:
                return u, self._cycle(u, jacobian, e)
            rows = np.vstack([jacobian, np.append(phase, [0.0, 0.0]), normal])
            right = np.concatenate([-error, [-phase @ (u - start)[:n], -normal @ (u - start)]])
            try:
                u = u + np.linalg.solve(rows, right)
            except np.linalg.LinAlgError:
                return None
        return None

    def _cycle(self, u: FloatArray, jacobian: FloatArray, e: FloatArray) -> Cycle:
        n = self.runs.states
        length, speed = u[n] * self.scale[n], u[n + 1] * self.scale[n + 1]
        multipliers = np.linalg.eigvals(jacobian[:, :n] + np.eye(n))
        others = np.delete(multipliers, np.argmin(np.abs(multipliers - 1.0)))
        return Cycle(float(speed), float(half_range(e[None])[0]), float(speed / length), float(np.abs(others).max()))
