"""Transfer functions of the linear vehicle from the track under the leading wheelset to its channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.core import Batch
from railui.track.input_table import COLUMNS_PER_WHEELSET, FIRST_WHEELSET_COLUMN, IRREGULARITIES
from railui.vehicle.linear import linear_effects, state_matrices
from railui.vehicle.model import Model

DERIVATIVE_COLUMNS: Final = {0: 1, 2: 3}  # of the columns of a wheelset: yw and dyw, phiw and dphiw
VALUE_COLUMNS: Final = (0, 2, 4)  # yw, phiw, gauge
SHORT_TIME: Final = 1e-9  # s between two samples, of which the first one is read
FREQUENCIES_PER_CALL: Final = 4096
# m, rad, m/s; differences about rest lose no digits, and it is below any slip speed or clearance
PERTURBATION: Final = 1e-9


@dataclass(frozen=True, eq=False)
class LinearVehicle:
    """Linear equations of a vehicle at one speed: x' = A x + sum B_i u_i(t - tau_i), y = C x + sum D_i u_i(t - tau_i).

    u_i: yw, dyw/ds, phiw, dphiw/ds and gauge at wheelset i, which meets the track later than the leading one by tau_i.

    Attributes
    ----------
    channels : tuple of str
        Names of y.
    speed : float
        Speed [m/s].
    A : array [state, state]
    B : array [wheelset, 5, state]
    C : array [channel, state]
    D : array [wheelset, 5, channel]
    delays : array [wheelset]
        tau_i [s].
    """

    channels: tuple[str, ...]
    speed: float
    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    delays: FloatArray

    @property
    def roots(self) -> ComplexArray:
        """Eigenvalues of A [1/s], largest real part first."""
        roots = np.linalg.eigvals(self.A).astype(complex)
        return roots[np.argsort(-roots.real)]

    def transfer(self, frequency: FloatArray) -> ComplexArray:
        """Return the transfer functions [frequency, channel, input] at frequencies [Hz].

        The inputs are yw [m], phiw [rad] and gauge [m] at the leading wheelset:
        H = sum_i exp(-j w tau_i) (C (j w I - A)^-1 (b_i + j w/V b'_i) + d_i + j w/V d'_i).
        """
        parts = [
            self._transfer(np.asarray(frequency[i : i + FREQUENCIES_PER_CALL], dtype=float))
            for i in range(0, max(len(frequency), 1), FREQUENCIES_PER_CALL)
        ]
        return np.concatenate(parts)

    def _transfer(self, frequency: FloatArray) -> ComplexArray:
        jw: ComplexArray = np.asarray(2j * np.pi * frequency, dtype=np.complex128)
        state = self._at_inputs(jw, self.B)
        matrices = jw[:, None, None] * np.eye(len(self.A)) - self.A
        motions = np.linalg.solve(matrices, np.swapaxes(state, 1, 2))
        return np.asarray(self.C @ motions + np.swapaxes(self._at_inputs(jw, self.D), 1, 2))

    def _at_inputs(self, jw: ComplexArray, columns: FloatArray) -> ComplexArray:
        """Return [frequency, input, n] of columns [wheelset, 5, n] for unit harmonics of yw, phiw, gauge."""
        phase = np.exp(-jw[:, None] * self.delays)  # [frequency, wheelset]
        by_input = []
        for value in VALUE_COLUMNS:
            part: ComplexArray = np.asarray(phase @ columns[:, value], dtype=np.complex128)
            if value in DERIVATIVE_COLUMNS:
                part = part + (jw / self.speed)[:, None] * (phase @ columns[:, DERIVATIVE_COLUMNS[value]])
            by_input.append(part)
        return np.stack(by_input, axis=1)


def linearise(model: Model, speed: float, channels: Sequence[str]) -> LinearVehicle:
    """Return the linear equations of a vehicle with its linear effects at a speed [m/s].

    The state matrix has the kernel's exact derivatives about zero, the others central differences.

    >>> from railui.vehicle.resolve import resolve_model
    >>> vehicle = linearise(resolve_model("designs/check_bogie.yaml"), 40.0, ["e1"])
    >>> complex(vehicle.roots[0].round(5)), vehicle.delays.tolist()
    ((-4.41556+22.55234j), [0.0, 0.064])
    """
    delays = np.array(model.wheelset_distances()) / speed
    columns = [
        FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * i + j
        for i in range(len(delays))
        for j in range(COLUMNS_PER_WHEELSET)
    ]
    width = FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * len(delays) + 2
    rows = np.zeros((2 * len(columns), width))
    rows[:, 1] = speed
    for k, column in enumerate(columns):
        rows[2 * k : 2 * k + 2, column] = (PERTURBATION, -PERTURBATION)
    shape = (len(delays), COLUMNS_PER_WHEELSET, -1)
    return LinearVehicle(
        tuple(channels),
        speed,
        state_matrices(model, model.row[None], np.array([speed]))[0],
        _differences(_input_derivatives(model, rows)).reshape(shape),
        _differences(_channels_at_states(model, speed, width, channels)).T,
        _differences(_channels_at_inputs(model, rows, channels)).reshape(shape),
        delays,
    )


def _differences(values: FloatArray) -> FloatArray:
    """Return slopes [k, n] from values [2 k, n] at pairs of positive and negative perturbations."""
    return np.asarray((values[::2] - values[1::2]) / (2 * PERTURBATION))


def _linear_batch(model: Model, count: int) -> Batch:
    batch = model.batch(np.tile(model.row, (count, 1)))
    amounts = np.tile(np.asarray(linear_effects(model), dtype=float), (count, 1))
    return Batch(batch.numbers, batch.effects, amounts)


def _input_derivatives(model: Model, rows: FloatArray) -> FloatArray:
    """Return the state derivatives [row, state] at rest under rows of the input table."""
    vehicles, batch = model.vehicles(), _linear_batch(model, 1)
    rest = np.zeros((1, vehicles.state_count(batch)))
    return np.concatenate([vehicles.state_derivatives(batch, row, rest) for row in rows])


def _channels_at_states(model: Model, speed: float, width: int, channels: Sequence[str]) -> FloatArray:
    """Return the channels [2 x state, channel] of perturbed states on level track."""
    vehicles = model.vehicles()
    states = vehicles.state_count(_linear_batch(model, 1))
    perturbed = np.zeros((2 * states, states))
    for k in range(states):
        perturbed[2 * k : 2 * k + 2, k] = (PERTURBATION, -PERTURBATION)
    row = np.zeros(width)
    row[1] = speed
    batch = _linear_batch(model, 2 * states).with_initial_states(perturbed)
    series, _ = vehicles.simulate(batch, np.tile(row, (3, 1)), SHORT_TIME, 1, channels)
    return np.asarray(series[:, :, 0])


def _channels_at_inputs(model: Model, rows: FloatArray, channels: Sequence[str]) -> FloatArray:
    """Return the channels [row, channel] at rest under rows of the input table."""
    vehicles, batch = model.vehicles(), _linear_batch(model, 1)
    values = [vehicles.simulate(batch, np.tile(row, (3, 1)), SHORT_TIME, 1, channels)[0] for row in rows]
    return np.concatenate(values)[:, :, 0]


def acting_inputs(vehicle: LinearVehicle) -> list[str]:
    """Return the irregularities that act on a vehicle or show in its channels: yw, phiw; gauge seldom."""
    names = []
    for name, value in zip(IRREGULARITIES, VALUE_COLUMNS, strict=True):
        columns = [value, *([DERIVATIVE_COLUMNS[value]] if value in DERIVATIVE_COLUMNS else [])]
        if np.any(vehicle.B[:, columns]) or np.any(vehicle.D[:, columns]):
            names.append(name)
    return names
