"""How a run begins: the state that the vehicle is in, and the angle of what turns; from its first seconds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import Segment, steps_for
from railui.vehicle.model import Model

START = 4.0  # seconds on which an initial state is estimated
SCALES = (5e-3, 3e-3)  # usual displacement [m] and yaw [rad], the ridge of the estimate
RATES = (0.05, 0.03)
NUDGE = 1e-3  # of a usual motion, and rad: for derivatives
QUARTER = 0.5 * np.pi
TURNS = 2  # of Gauss and Newton; two more where phases are estimated, of which the first is in sine and cosine


def estimate_initial_state(model: Model, stretch: Segment, noise: Mapping[str, float]) -> FloatArray:
    """The state [q, q'] with which a stretch begins, from its first 4 s by linear least squares, twice.

    Offsets of the channels are estimated along; a ridge of usual motions holds what the sensors do not see.
    """
    return _Beginning(model, stretch, noise).estimated(())[0]


def estimate_phases(model: Model, stretch: Segment, noise: Mapping[str, float]) -> Model:
    """The vehicle with its phases on this stretch: as fitted there, else estimated on its first 4 s.

    Beside the initial state: first as amounts of sine and cosine,

        F_0 sin(s/r_e + phase) = F_0 cos(phase) sin(s/r_e) + F_0 sin(phase) cos(s/r_e),

    of which the linear estimate is without wrong valleys, then as angles of the whole vehicle.
    """
    where = stretch.segment_key[0]
    own = [path for path in model.run_paths() if f"{path}@{where}" not in model.phases]
    if not own:
        return model
    scoped = [f"{path}@{where}" for path in own]
    model = model.with_row(scoped, np.zeros(len(own)))
    return model.with_row(scoped, _Beginning(model, stretch, noise).estimated(own)[1])


class _Beginning:
    """The first seconds of a stretch, against which vehicles begin in one state or another."""

    def __init__(self, model: Model, stretch: Segment, noise: Mapping[str, float]) -> None:
        self.model, self.stretch, self.channels = model.on(*stretch.segment_key), stretch, stretch.channels
        self.vehicles = model.vehicles(stretch.coach_forces)
        self.states = self.vehicles.states(self.model.single())
        self.scale = state_scale(stretch, self.model)
        self.steps = steps_for(self.model, stretch)
        self.samples = n = min(stretch.samples, max(round(START / stretch.dt), 8 * len(self.scale)))
        table = stretch.table(self.model.half_wheelbase(), self.steps)
        self.table = np.ascontiguousarray(table[: 2 * self.steps * (n - 1) + 1])
        columns = stretch.columns
        self.sd = np.array([max(noise.get(c, 0.0), 0.02 * columns[c].std(), 1e-12) for c in self.channels])
        self.x = stretch.measured(self.channels)[:, :n] / self.sd[:, None]

    def estimated(self, turning: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """The initial state [state] and the angles [turning] in the middle of the stretch; zeros where it diverges."""
        guess, angles, own = np.zeros(self.states), np.zeros(len(turning)), len(self.scale)
        for turn in range(TURNS + (2 if turning else 0)):
            first = bool(turning) and turn == 0
            tried, on = _quadrature(len(turning)) if first else _further(angles)
            series = self._series(guess, turning, tried, on)
            if series is None:
                return np.zeros(self.states), np.zeros(len(turning))
            rows = (series[1:] - series[0]) / NUDGE
            rows[own:] *= NUDGE if first else 1.0  # the whole of what turns
            found = self._solved(series[0], rows, guess)
            guess = guess.copy()
            guess[:own] += self.scale * found[:own]
            angles = np.arctan2(found[own + 1 :: 2], found[own::2]) if first else angles + found[own:]
        return guess, angles

    def _series(
        self, guess: FloatArray, turning: Sequence[str], tried: FloatArray, on: FloatArray
    ) -> FloatArray | None:
        """Weighted channels [lane, channel, n]: as guessed, then with each usual motion, then as the others are tried.

        tried: angles [lane, turning] as guessed and of the others, on: which of them turn.
        """
        model, own = self.model, len(self.scale)
        lanes = np.array([0] * (own + 1) + list(range(1, len(tried))))
        starts = np.tile(guess, (len(lanes), 1))
        starts[1 : own + 1, :own] += np.diag(NUDGE * self.scale)
        rows, (where, middle) = np.tile(model.row, (len(lanes), 1)), self.stretch.segment_key
        model.turn(rows, where, middle, {f"{p}@{where}": tried[lanes, k] for k, p in enumerate(turning)})
        batch = model.batch(rows)
        batch.amounts[:, [int(p.split(".")[1]) for p in turning]] = on[lanes]
        series, lost = self.vehicles.simulate(
            batch.with_initial(starts), self.table, self.stretch.dt, self.steps, self.channels
        )
        return None if np.any(lost >= 0) else series / self.sd[None, :, None]

    def _solved(self, z: FloatArray, rows: FloatArray, guess: FloatArray) -> FloatArray:
        """How much of each row [row, channel, n] is missing in what was guessed: usual motions, then the others."""
        own, channels, n = len(self.scale), *z.shape
        a = np.hstack([rows.reshape(len(rows), -1).T, np.kron(np.eye(channels), np.ones((n, 1)))])
        a = np.vstack([a, np.eye(a.shape[1])[:own]])
        b = np.concatenate([(self.x - z).ravel(), -guess[:own] / self.scale])
        return np.asarray(np.linalg.lstsq(a, b, rcond=None)[0][: len(rows)])


def _quadrature(count: int) -> tuple[FloatArray, FloatArray]:
    """Angles [lane, turning] and which turn: none, then each alone in sine and in cosine."""
    on = np.vstack([np.zeros((1, count)), np.repeat(np.eye(count), 2, axis=0)])
    return on * np.concatenate([[0.0], np.tile([0.0, QUARTER], count)])[:, None], on


def _further(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angles [lane, turning] and which turn: all as they are, then each a little further."""
    tried = angles + NUDGE * np.eye(1 + len(angles), len(angles), k=-1)
    return tried, np.ones_like(tried)


def state_scale(stretch: Segment, model: Model) -> FloatArray:
    """Usual displacements and rates [state] of what an initial state is estimated of."""
    return np.concatenate([_scales(stretch, model), _rates(stretch, model)])


def _scales(stretch: Segment, model: Model) -> FloatArray:
    if stretch.kind == "rig":
        column = stretch.columns[stretch.channels[0]]
        return np.array([max(float(np.std(column)), 1e-12)])
    coach = [SCALES[0]] if any(e.kind == "coach_mode" for e in model.effects) and not stretch.coach_forces else []
    return np.array([*SCALES * 3, *coach])


def _rates(stretch: Segment, model: Model) -> FloatArray:
    if stretch.kind == "rig":
        return _scales(stretch, model) / stretch.dt * 0.1
    coach = [RATES[0]] * (len(_scales(stretch, model)) - 6)
    return np.array([*RATES * 3, *coach])
