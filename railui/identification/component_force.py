"""Force of a component of a vehicle under a prescribed motion, as on a bench."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.arrays import FloatArray
from railui.campaign.segment import Segment
from railui.core import Batch, Placement, Vehicles
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.kernel_rows import effect_row
from railui.vehicle.model import Model


def restoring_force(
    z: FloatArray, dt: float, effects: Sequence[PlacedEffect], k: float, c: float, preload: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the force [n] with which effects, a spring and a damper resist a motion z [n], and its speed [n].

    The kernel evaluates them as a component on a bench, whose motion is prescribed.
    """
    t = np.linspace(0.0, dt * (len(z) - 1), len(z))
    bench = Segment("", "", 0, {"t": t, "z": z, "F": np.zeros_like(z)}, dt, "bench")
    placed = [Placement(e.kind, "rig", None, len(effect_row(e)), e.against) for e in effects]
    vehicles = Vehicles("rig", placed, rig_input="motion")
    tail = np.array([[x for e in effects for x in effect_row(e)]])
    batch = Batch.from_arrays(np.array([[k, c, preload]]), tail, np.ones((1, len(effects))))
    steps = vehicles.required_steps(batch, 1.0, 1.0, dt)[0]
    channels, table = ["F", "v.rig.0"], bench.table(0.0, steps)
    force, v = require_convergence(*vehicles.simulate(batch, table, dt, steps, channels))
    return force, v


def require_convergence(series: FloatArray, diverged: NDArray[np.int64]) -> FloatArray:
    """Return the series [channel, n] of the first vehicle; ValueError where it diverged."""
    if diverged[0] >= 0:
        raise ValueError("the simulation diverges")
    return np.asarray(series[0])


def elements_at_port(model: Model, at: str, wheelset: int) -> tuple[list[PlacedEffect], float, float, float]:
    """Return the effects, the stiffness, the damping and the preload of a model at one port."""
    effects = [e for e in model.design.effects if e.at == at and e.wheelset in (None, wheelset)]
    k, c = model.local_elements[(at, wheelset)]
    preload = model.design.values.get("vehicle.rig.preload", 0.0) if at == "rig" else 0.0
    return [e for e in effects if "rig" in core.effect_record(e.kind)["at"]], k, c, preload
