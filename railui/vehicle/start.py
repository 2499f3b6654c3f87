"""Initial states of rides: vehicles start at rest on the rails."""

from __future__ import annotations

import numpy as np

from railui.core import Batch
from railui.track.excitation import Excitation
from railui.vehicle.dofs import is_lateral
from railui.vehicle.model import Model


def on_rails(model: Model, batch: Batch, excitation: Excitation) -> Batch:
    """Return vehicles that start at the lateral deviation of the first sample, all bodies alike.

    A track that begins at zero needs no initial states.
    """
    if excitation.start == 0.0:
        return batch
    vehicles = model.vehicles()
    states = np.zeros(vehicles.state_count(batch))
    states[[i for i, dof in enumerate(vehicles.degrees_of_freedom(batch)) if is_lateral(dof)]] = excitation.start
    return batch.with_initial_states(states)
