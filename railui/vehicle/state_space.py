"""State space of the linear vehicle: matrices with names and units of states, inputs and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.vehicle.channels import channel_unit
from railui.vehicle.dofs import is_lateral
from railui.vehicle.linear import linearisation_notes
from railui.vehicle.model import Model
from railui.vehicle.transfer import linearise

# inputs of a wheelset, with their units: the slopes are those along the track
INPUTS: Final = (("yw", "m"), ("dyw_ds", "1"), ("phiw", "rad"), ("dphiw_ds", "rad/m"), ("gauge", "m"))


@dataclass(frozen=True, eq=False)
class StateSpace:
    """Linear vehicle at one speed: x' = A x + B u, y = C x + D u.

    The inputs are those of every wheelset: the lateral deviation yw of the track under it, its slope along the track,
    the cross-level phiw, its slope, and the gauge. Wheelset i meets the track a time delays[i] after the leading one.

    Attributes
    ----------
    name : str
        Name of the design.
    speed : float
        Speed [m/s].
    A : array [state, state]
    B : array [state, input]
    C : array [output, state]
    D : array [output, input]
    states, inputs, outputs : tuple of str
        Names, such as y1 and dy1_dt, yw.1 and dyw_ds.1, e1.
    state_units, input_units, output_units : tuple of str
        SI units; "" of the states of effects.
    delays : array [wheelset]
        Times [s] after which the wheelsets meet the track.
    notes : tuple of str
        Effects that are not linear and are left out.

    Examples
    --------
    >>> from railui.vehicle.resolve import resolve_model
    >>> space = state_space(resolve_model("designs/check_bogie.yaml"), 40.0, ["e1", "ayf"])
    >>> space.A.shape, space.B.shape, space.inputs[5], space.output_units
    ((12, 12), (12, 10), 'yw.2', ('m', 'm/s^2'))
    """

    name: str
    speed: float
    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    delays: FloatArray
    notes: tuple[str, ...] = ()

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return A, B, C, D, as scipy.signal.StateSpace and control.ss take them."""
        return self.A, self.B, self.C, self.D

    def arrays(self) -> dict[str, Any]:
        """Return matrices, names, units, speed [m/s] and delays [s] by the names of a file."""
        names = {key: list(getattr(self, key)) for key in ("states", "inputs", "outputs")}
        units = {key: list(getattr(self, key)) for key in ("state_units", "input_units", "output_units")}
        matrices = dict(zip("ABCD", self.matrices(), strict=True))
        return {**matrices, **names, **units, "speed": self.speed, "delays": self.delays, "name": self.name}


def state_space(model: Model, speed: float, channels: Sequence[str]) -> StateSpace:
    """Return the state space of a vehicle with its linear effects at a speed [m/s].

    Parameters
    ----------
    model : Model
    speed : float
    channels : sequence of str
        Outputs, which the vehicle must have.
    """
    linear = linearise(model, speed, channels)
    wheelsets = range(1, len(linear.delays) + 1)
    dofs = model.vehicles().degrees_of_freedom(model.single_batch())
    units = ["m" if is_lateral(dof) else "rad" for dof in dofs]
    more = len(linear.A) - 2 * len(dofs)
    return StateSpace(
        name=model.design.name,
        speed=speed,
        A=linear.A,
        B=_by_column(linear.B),
        C=linear.C,
        D=_by_column(linear.D),
        states=(*dofs, *(f"d{dof}_dt" for dof in dofs), *(f"effect_state_{k}" for k in range(1, more + 1))),
        inputs=tuple(f"{name}.{i}" for i in wheelsets for name, _ in INPUTS),
        outputs=tuple(channels),
        state_units=(*units, *(f"{unit}/s" for unit in units), *[""] * more),
        input_units=tuple(unit for _ in wheelsets for _, unit in INPUTS),
        output_units=tuple(map(channel_unit, channels)),
        delays=linear.delays,
        notes=tuple(linearisation_notes(model)),
    )


def _by_column(slopes: FloatArray) -> FloatArray:
    """Return slopes [wheelset, 5, n] as a matrix [n, input]."""
    return np.ascontiguousarray(slopes.reshape(-1, slopes.shape[-1]).T)
