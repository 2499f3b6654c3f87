"""Runs of a vehicle from given initial states on straight level track, each at its own speed."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.core import Batch, NoResultError, Vehicles
from railui.core.vehicles import MAX_STEPS_PER_SAMPLE
from railui.track import Track
from railui.track.excitation import Excitation, TrackSource
from railui.vehicle.dofs import is_lateral
from railui.vehicle.linear import STRAIGHT_TRACK
from railui.vehicle.model import Model

BoolArray = NDArray[np.bool_]

SAMPLE_SPACING: Final = 0.1  # m, of vehicles that MAX_STEPS_PER_SAMPLE resolve
STIFF_REMEDY: Final = "raise the mass, soften the stiffest element or raise the slip speed of dry friction"
MAX_REFINEMENT: Final = 64  # parts of SAMPLE_SPACING at which stiff vehicles are sampled
SEGMENT_LENGTH: Final = 250.0  # m over which amplitude and frequency are evaluated
MAX_DISTANCE: Final = 20e3  # m after which a run ends
AMPLITUDE_TOLERANCE: Final = 1e-5  # relative change from segment to segment, twice in a row, of a steady motion


@dataclass(frozen=True, eq=False)
class Motion:
    """Motions of n runs.

    Attributes
    ----------
    speeds : FloatArray
        Speeds [n] in m/s.
    states : FloatArray
        States [n, state].
    amplitudes : FloatArray
        Half the range [n] in m of e of the wheelset that moves most; infinite for a vehicle off the rails.
    frequencies : FloatArray
        Frequencies [n] in Hz.
    is_steady : BoolArray
        True [n] if the amplitude does not change any more.
    """

    speeds: FloatArray
    states: FloatArray
    amplitudes: FloatArray = field(default_factory=lambda: np.zeros(0))
    frequencies: FloatArray = field(default_factory=lambda: np.zeros(0))
    is_steady: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __len__(self) -> int:
        return len(self.speeds)

    def select(self, rows: NDArray[np.int64] | BoolArray | list[int]) -> Motion:
        """Return some of the motions."""
        parts = (self.amplitudes, self.frequencies, self.is_steady)
        return Motion(self.speeds[rows], self.states[rows], *(x[rows] if len(x) else x for x in parts))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Sampling:
    """Sampling of a run: parts into which SAMPLE_SPACING is divided, and RK4 steps per sample."""

    refinement: int
    steps: int

    @property
    def spacing(self) -> float:
        """Distance of the samples [m]."""
        return SAMPLE_SPACING / self.refinement


class TangentTrackRuns:
    """Runs of one vehicle on straight track; speeds and initial states share SIMD batches."""

    def __init__(self, model: Model, jobs: int | None = 1) -> None:
        self.model = model
        self.jobs = jobs
        self.vehicles: Vehicles = model.vehicles()
        self.single: Batch = model.single_batch()
        self.states: int = self.vehicles.state_count(self.single)
        self.dofs = self.vehicles.degrees_of_freedom(self.single)
        self.wheelsets = [c for c in self.vehicles.channel_names(self.single) if re.fullmatch(r"e\d+", c)]
        self._tables: dict[int, FloatArray] = {}

    def start(self, speeds: FloatArray, states: FloatArray) -> Motion:
        """Return motions at these speeds [n] m/s in these states, [state] for all or [n, state]."""
        speeds = np.asarray(speeds, dtype=float)
        return Motion(speeds, np.ascontiguousarray(np.broadcast_to(states, (len(speeds), self.states))))

    def displaced_state(self, displacement: float) -> FloatArray:
        """Return the state [state] with all bodies at a lateral offset [m] from the track centre line."""
        state = np.zeros(self.states)
        lateral = [i for i, d in enumerate(self.dofs) if is_lateral(d)]
        state[lateral] = displacement
        return state

    def advance(self, motion: Motion) -> Motion:
        """Simulate one segment of track and return the motion at its end."""
        n, slowest, fastest = len(motion), float(motion.speeds.min()), float(motion.speeds.max())
        sampling = self.sampling(slowest, fastest, SAMPLE_SPACING / slowest)
        e, states, has_diverged = self._segment(motion, fastest, sampling)
        amplitudes = half_range(e)
        amplitudes[has_diverged] = np.inf
        previous = motion.amplitudes if len(motion.amplitudes) else np.full(n, np.nan)
        with np.errstate(invalid="ignore"):
            is_steady = np.abs(amplitudes - previous) <= AMPLITUDE_TOLERANCE * amplitudes
        frequencies = _frequencies(e, sampling.spacing / motion.speeds)
        return Motion(motion.speeds, states, amplitudes, frequencies, is_steady)

    def sampling(self, slowest: float, fastest: float, dt: float) -> Sampling:
        """Return the sampling that the vehicle needs between two speeds [m/s], `dt` [s] apart at SAMPLE_SPACING.

        NoResultError for a vehicle too stiff even for the finest one.
        """
        limit = MAX_STEPS_PER_SAMPLE * MAX_REFINEMENT
        try:
            steps = self.vehicles.required_steps(self.single, slowest, fastest, dt, limit=limit)[0]
        except NoResultError as error:
            reason, separator, _ = str(error).partition("; ")
            if not separator:
                raise
            raise NoResultError(f"limit cycles at {slowest:.4g} m/s: {reason}; {STIFF_REMEDY}") from None
        refinement = 1
        while steps > MAX_STEPS_PER_SAMPLE:  # a power of two, or three times one
            refinement, steps = 2 * refinement, steps // 2
        return Sampling(refinement, steps)

    def _segment(
        self, motion: Motion, fastest: float, sampling: Sampling
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Simulate one segment of track, in as many parts of equal numbers of samples as the sampling is refined.

        Return displacements [n, wheelset, sample], the states [n, state] at its end, and which vehicles diverged [n].
        """
        dt, table = sampling.spacing / fastest, self._table(sampling.steps)
        states, has_diverged, parts = motion.states, np.zeros(len(motion), dtype=bool), []
        for part in range(sampling.refinement):
            series, diverged_at = self.run(states, motion.speeds, table, fastest, dt, sampling.steps)
            has_diverged |= diverged_at >= 0
            states = np.where(has_diverged[:, None], 0.0, series[:, len(self.wheelsets) :, -1])
            parts.append(series[:, : len(self.wheelsets), min(part, 1) :])
        return np.concatenate(parts, axis=2) if len(parts) > 1 else parts[0], states, has_diverged

    def run(
        self, states: FloatArray, speeds: FloatArray, table: FloatArray, fastest: float, dt: float, steps: int
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """Simulate runs from initial states.

        Parameters
        ----------
        states : FloatArray
            Initial states [n, state].
        speeds : FloatArray
            Speeds [n] in m/s.
        table : FloatArray
            Input table of level track at any speed.
        fastest : float
            Speed [m/s] to which `dt` refers.
        dt : float
            Time between samples [s] at the speed `fastest`.
        steps : int
            RK4 steps per sample.

        Returns
        -------
        tuple of FloatArray, NDArray
            Displacements, then all states, [n, channel, sample], and the sample of divergence [n] (-1: none).
        """
        names = [*self.wheelsets, *(f"state.{i}" for i in range(self.states))]
        batch = self.single.select(np.zeros(len(speeds), dtype=int))
        batch = replace(batch, speed_scale=np.ascontiguousarray(speeds / fastest))
        level = table.copy()
        level[:, 1] = fastest
        return self.vehicles.simulate(batch.with_initial_states(states), level, dt, steps, names, jobs=self.jobs)

    def settle(self, motion: Motion, min_amplitude: float, max_distance: float = MAX_DISTANCE) -> Motion:
        """Simulate until each motion is steady or its amplitude falls below `min_amplitude` [m].

        A motion that does neither is returned as it is after `max_distance` [m].
        """
        n = len(motion)
        rows, now = np.arange(n), motion
        settled = Motion(motion.speeds, motion.states.copy(), np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool))
        for _ in range(int(max_distance / SEGMENT_LENGTH)):
            following = self.advance(now)
            is_steady = following.is_steady & now.is_steady if len(now.is_steady) else following.is_steady & False
            for name in ("states", "amplitudes", "frequencies", "is_steady"):
                getattr(settled, name)[rows] = getattr(following, name)
            has_ended = is_steady | (following.amplitudes < min_amplitude) | ~np.isfinite(following.amplitudes)
            rows, now = rows[~has_ended], following.select(~has_ended)
            if not rows.size:
                break
        return settled

    def _table(self, steps: int) -> FloatArray:
        """Return the input table of one segment of level track, of SAMPLE_SPACING."""
        if steps not in self._tables:
            samples = int(SEGMENT_LENGTH / SAMPLE_SPACING) + 1
            level = level_track(samples, SAMPLE_SPACING)
            self._tables[steps] = level.table(self.model.wheelset_spacing(), steps)
        return self._tables[steps]


def level_track(samples: int, spacing: float) -> Excitation:
    """Return straight level track of so many samples `spacing` [m] apart, at 1 m/s."""
    track = Track(spacing * np.arange(float(samples)), np.zeros(samples))
    return Excitation(TrackSource(track, STRAIGHT_TRACK.name), 1.0)


def half_range(e: FloatArray) -> FloatArray:
    """Return half the range [n] of displacements [n, wheelset, sample] of the wheelset that moves most."""
    return np.asarray(np.max(_peak(e) + _peak(-e), axis=1) / 2)


def _peak(x: FloatArray) -> FloatArray:
    """Return the maximum along the last axis, of the parabola through the largest sample and its two neighbours."""
    k = np.clip(np.argmax(x, axis=-1), 1, x.shape[-1] - 2)[..., None]
    left, top, right = (np.take_along_axis(x, k + i, axis=-1)[..., 0] for i in (-1, 0, 1))
    curvature = left - 2 * top + right
    rise = np.where(curvature < 0, -((right - left) ** 2) / np.where(curvature < 0, 8 * curvature, 1.0), 0.0)
    return np.asarray(np.max(x, axis=-1) + np.where((top >= left) & (top >= right), rise, 0.0))


def _frequencies(e: FloatArray, dt: FloatArray) -> FloatArray:
    """Return the frequency [n] of the wheelset that moves most, from upward crossings of its middle; 0 without two."""
    frequencies = np.zeros(len(e))
    for i, wheelsets in enumerate(e):
        x = wheelsets[int(np.argmax(np.ptp(wheelsets, axis=1)))]
        x = x - 0.5 * (x.max() + x.min())
        k = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
        if len(k) > 1:
            crossing = k + x[k] / (x[k] - x[k + 1])
            frequencies[i] = (len(k) - 1) / ((crossing[-1] - crossing[0]) * dt[i])
    return frequencies
