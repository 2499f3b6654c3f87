"""One vehicle along a road: the series of its channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from railui.arrays import FloatArray
from railui.track.excitation import Excitation
from railui.vehicle.model import Model


def simulate_series(
    model: Model, road: Excitation, channels: Sequence[str], *, steps: int | None = None, jobs: int | None = 1
) -> tuple[FloatArray, int | None]:
    """Series [channel, sample] of a vehicle that starts at rest, and the sample at which it diverged (None: never).

    `steps` of RK4 per sample, as many as it needs where None. Raises ValueError for an unknown channel, and for a
    vehicle too stiff to be stepped.
    """
    vehicles, batch = model.vehicles(), model.single()
    if steps is None:
        steps = vehicles.steps(batch, road.speed, road.speed, road.dt)[0]
    table = road.table(model.half_wheelbase(), steps)
    series, lost = vehicles.simulate(batch, table, road.dt, steps, channels, jobs=jobs)
    return np.asarray(series[0]), int(lost[0]) if lost[0] >= 0 else None
