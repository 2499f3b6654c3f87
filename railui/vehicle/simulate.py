"""Time simulation of one vehicle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.track.excitation import Excitation
from railui.vehicle.model import Model
from railui.vehicle.on_track import on_rails, spacings, vehicles_on


def simulate_series(
    model: Model, excitation: Excitation, channels: Sequence[str], *, steps: int | None = None, jobs: int | None = 1
) -> tuple[FloatArray, int | None]:
    """Simulate a vehicle that starts at rest on the rails.

    Parameters
    ----------
    model : Model
    excitation : Excitation
    channels : sequence of str
    steps : int, optional
        RK4 steps per sample; as many as the vehicle requires by default.
    jobs : int or None
        Threads; None for all.

    Returns
    -------
    array [channel, sample]
    int or None
        Sample at which the vehicle diverged; None if it did not.

    Raises
    ------
    ValueError
        For an unknown channel, and for a vehicle too stiff to integrate.
    """
    vehicles, batch = vehicles_on(model, excitation), on_rails(model, model.single_batch(), excitation)
    if steps is None:
        steps = vehicles.required_steps(batch, excitation.speed, excitation.speed, excitation.dt)[0]
    table = excitation.table(spacings(model, model.row[None], excitation)[0], steps)
    series, diverged = vehicles.simulate(batch, table, excitation.dt, steps, channels, jobs=jobs)
    return np.asarray(series[0]), int(diverged[0]) if diverged[0] >= 0 else None
