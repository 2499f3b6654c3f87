"""Initial-state estimation: the state of the vehicle at the first sample, and phases of rotating parts."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.campaign.settings.estimation import InitialStateSettings
from railui.core import adds_body
from railui.identification.context import Context
from railui.identification.estimation.modulating_functions import dominant_period
from railui.identification.prediction import Predictor
from railui.runs.units import DERIVATIVE_ORDERS
from railui.track import COLUMNS_PER_WHEELSET, FIRST_WHEELSET_COLUMN
from railui.vehicle.dofs import is_lateral
from railui.vehicle.model import Model
from railui.vehicle.track_geometry import track_geometry

DIFFERENCE_STEP = 1e-3  # of a usual motion, and rad: for derivatives
QUARTER_TURN = 0.5 * np.pi
ITERATIONS = 2  # of Gauss-Newton
NEGLIGIBLE = 1e-13  # of the scaled normal matrix: less is rounding
PHASE_ITERATIONS = 2  # more where phases are estimated, the first of all in sine and cosine
SAMPLES_PER_STATE = 8  # at least
RIG_ITERATIONS = 10  # of Gauss-Newton, for a rig
PART_SHARES = (0.1, 0.3, 1.0)  # of the first seconds, on which a state far from linear is estimated in turn
START_FACTORS = (1.0, 0.7, 0.5, 1.4, 2.0)  # of a harmonic motion: a nonlinear spring is no linear one
GRID_STEPS = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0)  # of a start, in the usual motion of a linear rig
GRID_STARTS = 3  # of the grid that are iterated
HUNTING_ITERATIONS = 5  # of Gauss-Newton on each
NONLINEAR_ITERATIONS = 5  # of Gauss-Newton with the laws of a vehicle's suspension, on each
SUFFICIENT_GAIN = 1e-2  # relative gain of the misfit below which they end
MIN_PART_SAMPLES = 30
STEP_SHARES = (1.0, 0.3, 0.1, 0.03)  # of a step that are tried
MIN_GAIN = 1e-6  # the same for a rig and for a hunting vehicle
START_SAMPLES, START_PERIODS = 6, 0.1  # at least, from which the measured motion of a rig is read
RIG_RATE_SHARE = 0.1  # usual rate of a rig: this share of its usual motion per sample


def estimate_initial_state(context: Context, model: Model, segment: Segment) -> FloatArray:
    """Estimate the state [q, q'] at the first sample of a segment by Gauss-Newton least squares.

    Where the motion is prescribed there is none; the states of effects settle in the part that is cut off.

    Offsets of the channels are estimated jointly; a ridge of usual motions determines what the sensors do not. A rig
    may swing far beyond the linear range of its effects: its estimate starts at the measured motion and is iterated.
    """
    if segment.kind == "bench":
        return np.zeros(model.vehicles().state_count(model.single_batch()))
    problem = _InitialStateProblem(context, model, segment)
    if segment.kind == "rig":
        return problem.solve_from_motion()
    if may_hunt(model, segment):
        return problem.solve_hunting(problem.solve(())[0])
    return problem.solve_damped()


def may_hunt(model: Model, segment: Segment) -> bool:
    """True for a vehicle of bodies that hunts on a segment, bounded by creep or flanges, or is fitted as if it did."""
    if model.design.structure is None or not model.limits_hunting:
        return False
    on_segment = model.on_segment(*segment.segment_key)
    return segment.window_of is not None or max(on_segment.growth_rate(v) for v in segment.speeds) > 0.0


def estimate_phases(context: Context, model: Model, segment: Segment) -> Model:
    """Return the model with its phases on a segment: as fitted there, or else estimated jointly with the initial state.

    Notes
    -----
    First as amounts of sine and cosine,

        F_0 sin(s/r_e + phase) = F_0 cos(phase) sin(s/r_e) + F_0 sin(phase) cos(s/r_e),

    whose linear estimate has no local minima, then as angles of the complete vehicle.
    """
    where = segment.segment_key[0]
    unknown = [path for path in model.run_dependent_paths() if f"{path}@{where}" not in model.phases]
    if not unknown:
        return model
    scoped = [f"{path}@{where}" for path in unknown]
    model = model.with_path_values(scoped, np.zeros(len(unknown)))
    return model.with_path_values(scoped, _InitialStateProblem(context, model, segment).solve(unknown)[1])


class _InitialStateProblem:
    """Least-squares problem of the initial state and phases over the first seconds of a segment."""

    def __init__(self, context: Context, model: Model, segment: Segment) -> None:
        settings = context.settings.initial_state
        self.context = context
        self.model = model.on_segment(*segment.segment_key)
        self.segment = segment
        self.channels = segment.channels
        self.vehicles = model.vehicles(segment.coach_forces)
        self.states = self.vehicles.state_count(self.model.single_batch())
        self.scale = state_scale(settings, segment, self.model)
        self.predictor = Predictor(self.model, segment)
        steps = self.predictor.steps
        wanted = max(round(settings.initial_state_duration / segment.dt), SAMPLES_PER_STATE * len(self.scale))
        samples = min(segment.samples, wanted)
        table = segment.table(self.model.wheelset_spacing(), steps)
        self.table = np.ascontiguousarray(table[: 2 * steps * (samples - 1) + 1])
        self.usual = state_on_rails(self.model, self.table[0], self.states)
        share = settings.min_channel_noise_share
        columns = segment.columns
        self.sd = np.array([max(context.noise.get(c, 0.0), share * columns[c].std(), 1e-12) for c in self.channels])
        self.measured = segment.measured(self.channels)[:, :samples] / self.sd[:, None]

    def solve(self, rotating: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """Estimate the state [state] and the angles [rotating] in the middle of the segment; zeros: diverged."""
        state = self.usual.copy()
        angles = np.zeros(len(rotating))
        count = len(self.scale)
        for iteration in range(ITERATIONS + (PHASE_ITERATIONS if rotating else 0)):
            in_quadrature = bool(rotating) and iteration == 0
            tried, active = _quadrature(len(rotating)) if in_quadrature else _perturbed(angles)
            series = self._series(state, rotating, tried, active)
            if series is None:
                return np.zeros(self.states), np.zeros(len(rotating))
            rows = (series[1:] - series[0]) / DIFFERENCE_STEP
            rows[count:] *= DIFFERENCE_STEP if in_quadrature else 1.0  # the full amount, not a derivative
            solution = self._least_squares(series[0], rows, state)
            state = state.copy()
            state[:count] += self.scale * solution[:count]
            amounts = solution[count:]
            angles = np.arctan2(amounts[1::2], amounts[::2]) if in_quadrature else angles + amounts
        return state, angles

    def solve_damped(self) -> FloatArray:
        """Estimate the state [state] by full steps of Gauss-Newton, or on growing parts where these go astray.

        Over some seconds a clearance, or friction that sticks, is far from linear: a full step may lead further away.
        """
        state, is_converged = self._take_full_steps(self.usual)
        if is_converged:
            return state
        by_parts = self._solve_by_parts(self.usual, NONLINEAR_ITERATIONS, SUFFICIENT_GAIN)
        return min((state, by_parts), key=self.misfit_share)

    def _take_full_steps(self, state: FloatArray) -> tuple[FloatArray, bool]:
        """Take full steps as long as the misfit falls; True: a further one would lower it by little."""
        least, tried = np.inf, state
        for _ in range(NONLINEAR_ITERATIONS):
            series = self._perturbed_series(tried)
            cost = np.inf if series is None else self._cost(series[0], tried)
            if series is None or cost >= least:
                return state, False
            state, least = tried, cost
            step, predicted = self._step(series, state)
            tried = state + step
            if least - predicted < SUFFICIENT_GAIN * least:
                return tried, True
        return state, False

    def solve_from_motion(self) -> FloatArray:
        """Estimate the state [state] of a rig by damped iterations from its measured motion; zeros: diverged."""
        state = np.zeros(self.states)
        state[: len(self.scale)] = _measured_start(self.segment)
        if "z" in self.channels:
            return self._iterate(state, RIG_ITERATIONS)
        first = self._part(PART_SHARES[0])
        state = min((factor * state for factor in START_FACTORS), key=first.misfit_share)
        state = self._solve_by_parts(state, RIG_ITERATIONS)
        follows = self.misfit_share(state) <= self.context.settings.windows.followed_misfit
        if follows or self.segment.window_of is not None:
            return state
        others = [self._solve_by_parts(start, RIG_ITERATIONS) for start in first.best_starts()]
        return min((state, *others), key=self.misfit_share)

    def best_starts(self) -> FloatArray:
        """Select the states [n, state] with the least misfit from a grid of displacements and rates of a rig.

        Under a strongly nonlinear law neither follows from the acceleration as in a harmonic motion.
        """
        steps = np.array([0.0, *GRID_STEPS, *(-x for x in GRID_STEPS)])
        starts = np.zeros((len(steps) ** 2, self.states))
        rate = 2.0 * np.pi / dominant_period(self.segment)
        starts[:, 0] = self.scale[0] * np.repeat(steps, len(steps))
        starts[:, 1] = self.scale[0] * rate * np.tile(steps, len(steps))
        batch = self.model.batch(np.tile(self.model.row, (len(starts), 1)))
        series, diverged = self.predictor.simulate(
            self.channels, batch=batch.with_initial_states(starts), vehicles=self.vehicles, table=self.table
        )
        residual = self.measured - series / self.sd[None, :, None]
        misfit = np.sum((residual - residual.mean(axis=2, keepdims=True)) ** 2, axis=(1, 2))
        order = np.argsort(np.where(diverged < 0, misfit, np.inf))
        return starts[order[:GRID_STARTS]]

    def misfit_share(self, state: FloatArray) -> float:
        """Squared residual of a state over the squared signal, both without their means; infinite: diverged."""
        series = self._perturbed_series(state)
        signal = np.sum((self.measured - self.measured.mean(axis=1, keepdims=True)) ** 2)
        return np.inf if series is None else self._cost(series[0], self.usual) / max(float(signal), 1e-300)

    def solve_hunting(self, state: FloatArray) -> FloatArray:
        """Estimate the state [state] of a hunting vehicle, whose flanges make it far from linear over some seconds.

        state: the linear estimate, which is iterated, unless one by parts fits better.
        """
        if self.misfit_share(state) > self.context.settings.windows.followed_misfit:
            by_parts = self._solve_by_parts(self.usual, HUNTING_ITERATIONS)
            state = by_parts if self.misfit_share(by_parts) < self.misfit_share(state) else state
        return self._iterate(state, HUNTING_ITERATIONS)

    def _solve_by_parts(self, state: FloatArray, iterations: int, min_gain: float = MIN_GAIN) -> FloatArray:
        """Estimate the state [state] by damped iterations from one, on growing parts of the first seconds."""
        for share in PART_SHARES:
            state = self._part(share)._iterate(state, iterations, min_gain)
        return state

    def _part(self, share: float) -> _InitialStateProblem:
        """Return the problem of the first part of these seconds."""
        part = copy(self)
        samples = min(max(round(share * self.measured.shape[1]), MIN_PART_SAMPLES), self.measured.shape[1])
        part.table = np.ascontiguousarray(self.table[: 2 * self.predictor.steps * (samples - 1) + 1])
        part.measured = self.measured[:, :samples]
        return part

    def _iterate(self, state: FloatArray, iterations: int, min_gain: float = MIN_GAIN) -> FloatArray:
        """Take damped steps of Gauss-Newton from a state as long as they lower the misfit by a relative gain."""
        series = self._perturbed_series(state)
        if series is None:
            return self.solve(())[0]
        for _ in range(iterations):
            cost = self._cost(series[0], state)
            step, predicted = self._step(series, state)
            if cost - predicted < min_gain * cost:
                return state + step
            for share in STEP_SHARES:
                tried = state + share * step
                further = self._perturbed_series(tried)
                if further is not None and self._cost(further[0], tried) < cost:
                    break
            else:
                return state
            state, series = tried, further
        return state

    def _step(self, series: FloatArray, state: FloatArray) -> tuple[FloatArray, float]:
        """Return the step of Gauss-Newton [state] from a state, and the cost that its linear model predicts."""
        rows = (series[1:] - series[0]) / DIFFERENCE_STEP
        solution = self._least_squares(series[0], rows, state)
        step = np.zeros_like(state)
        step[: len(self.scale)] = self.scale * solution
        return step, self._cost(series[0] + np.tensordot(solution, rows, 1), state + step)

    def _cost(self, simulated: FloatArray, state: FloatArray) -> float:
        """Squared residuals without their means, and the ridge."""
        residual = self.measured - simulated
        residual = residual - residual.mean(axis=1, keepdims=True)
        deviation = (state - self.usual)[: len(self.scale)] / self.scale
        return float(np.sum(residual**2) + np.sum(deviation**2))

    def _perturbed_series(self, state: FloatArray) -> FloatArray | None:
        """Simulate weighted channels [lane, channel, n] from a state and from each perturbed one; None: diverged."""
        return self._series(state, (), *_perturbed(np.zeros(0)))

    def _series(
        self, state: FloatArray, rotating: Sequence[str], tried: FloatArray, active: FloatArray
    ) -> FloatArray | None:
        """Simulate weighted channels [lane, channel, n]: from the state, from each perturbed state, at further angles.

        tried: angles [lane, rotating], the present ones first; active: amounts [lane, rotating]. None: diverged.
        """
        model, count = self.model, len(self.scale)
        lanes = np.array([0] * (count + 1) + list(range(1, len(tried))))
        starts = np.tile(state, (len(lanes), 1))
        starts[1 : count + 1, :count] += np.diag(DIFFERENCE_STEP * self.scale)
        rows = np.tile(model.row, (len(lanes), 1))
        key = self.segment.segment_key
        model.set_on_segment(rows, *key, {f"{p}@{key.name}": tried[lanes, k] for k, p in enumerate(rotating)})
        batch = model.batch(rows)
        batch.amounts[:, [int(p.split(".")[1]) for p in rotating]] = active[lanes]
        series, diverged = self.predictor.simulate(
            self.channels, batch=batch.with_initial_states(starts), vehicles=self.vehicles, table=self.table
        )
        return None if np.any(diverged >= 0) else series / self.sd[None, :, None]

    def _least_squares(self, simulated: FloatArray, rows: FloatArray, state: FloatArray) -> FloatArray:
        """Solve for the amount of each row [row, channel, n] in the residual; the initial state has a ridge.

        Every channel has an offset of its own, which is eliminated with the means.
        """
        count = len(self.scale)
        a = (rows - rows.mean(axis=2, keepdims=True)).reshape(len(rows), -1)
        gram = a @ a.T
        right = a @ (self.measured - simulated).ravel()
        gram[np.arange(count), np.arange(count)] += 1.0
        right[:count] -= (state - self.usual)[:count] / self.scale
        scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
        scaled = gram * np.outer(scale, scale)
        return np.asarray(scale * np.linalg.lstsq(scaled, scale * right, rcond=NEGLIGIBLE)[0])


def _measured_start(segment: Segment) -> FloatArray:
    """Displacement and rate of a rig at the first sample, from a parabola through the first samples.

    Where only a speed or an acceleration was measured, the motion counts as harmonic: z = -z'' / w^2.
    """
    name = segment.channels[0]
    x, w = segment.columns[name], 2.0 * np.pi / dominant_period(segment)
    count = min(len(x), max(START_SAMPLES, round(START_PERIODS * dominant_period(segment) / segment.dt)))
    value, slope, _ = np.polynomial.polynomial.polyfit(np.arange(count) * segment.dt, x[:count] - x.mean(), 2)
    starts = {"z": (value, slope), "vz": (-slope / w**2, value), "az": (-value / w**2, -slope / w**2)}
    return np.array(starts[name])


def _quadrature(count: int) -> tuple[FloatArray, FloatArray]:
    """Angles and amounts [lane, rotating]: none, then each alone in sine and in cosine."""
    active = np.vstack([np.zeros((1, count)), np.repeat(np.eye(count), 2, axis=0)])
    return active * np.concatenate([[0.0], np.tile([0.0, QUARTER_TURN], count)])[:, None], active


def _perturbed(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Angles and amounts [lane, rotating]: as they are, then each a little further."""
    tried = angles + DIFFERENCE_STEP * np.eye(1 + len(angles), len(angles), k=-1)
    return tried, np.ones_like(tried)


def state_on_rails(model: Model, row: FloatArray, states: int) -> FloatArray:
    """State [state] of a vehicle of bodies whose wheelsets run on the middle of the rails in an input row; else zeros.

    From there the estimate of its initial state begins: rollers, or a misaligned track, may carry it far to one side.
    """
    state, structure = np.zeros(states), model.design.structure
    if structure is None:
        return state
    radius = track_geometry(model.design).rolling_radius
    under = row[FIRST_WHEELSET_COLUMN:][: COLUMNS_PER_WHEELSET * len(structure.wheelsets)].reshape(
        -1, COLUMNS_PER_WHEELSET
    )
    lateral = dict(zip((w.name for w in structure.wheelsets), under[:, 0] + radius * under[:, 2], strict=True))
    # rollers carry a wheelset along with their own speed
    moving = {w.name: row[1] * x for w, x in zip(structure.wheelsets, under[:, 1], strict=True) if w.is_on_rollers}
    dofs = model.vehicles().degrees_of_freedom(model.single_batch())
    for i, dof in enumerate(dofs):
        if is_lateral(dof):
            name = dof.partition(".")[2]
            state[i] = lateral.get(name, float(np.mean(list(lateral.values()))))
            state[len(dofs) + i] = moving.get(name, 0.0)
    return state


def state_scale(settings: InitialStateSettings, segment: Segment, model: Model) -> FloatArray:
    """Usual displacements and rates [state] of the estimated part of an initial state; none of a bench."""
    if segment.kind == "bench":
        return np.zeros(0)
    if segment.kind == "rig":
        name = segment.channels[0]
        per_radian = dominant_period(segment) / (2.0 * np.pi)
        usual = float(np.std(segment.columns[name])) * per_radian ** DERIVATIVE_ORDERS.get(name, 0)
        displacement = np.array([max(usual, 1e-12)])
        return np.concatenate([displacement, displacement / segment.dt * RIG_RATE_SHARE])
    if model.design.structure is not None:
        lateral = [is_lateral(dof) for dof in model.vehicles().degrees_of_freedom(model.single_batch())]
        return np.concatenate(
            [
                np.where(lateral, settings.initial_displacement, settings.initial_yaw),
                np.where(lateral, settings.initial_velocity, settings.initial_yaw_rate),
            ]
        )
    has_coach = any(adds_body(e.kind) for e in model.effects) and not segment.coach_forces
    displacements = [settings.initial_displacement, settings.initial_yaw] * 3
    rates = [settings.initial_velocity, settings.initial_yaw_rate] * 3
    if has_coach:
        displacements.append(settings.initial_displacement)
        rates.append(settings.initial_velocity)
    return np.array([*displacements, *rates])
