"""Vehicles on a track: structure, wheelset positions and initial states of a ride."""

from __future__ import annotations

import numpy as np

from railui.arrays import FloatArray
from railui.core import Batch, Vehicles
from railui.track import LinePositions, Spacing, wheelset_distances
from railui.track.excitation import Excitation
from railui.vehicle.dofs import is_lateral
from railui.vehicle.model import Model

HALF_GAUGE = ".half_gauge"


def vehicles_on(model: Model, excitation: Excitation) -> Vehicles:
    """Return the structure of a vehicle on a track; on a line with curves its bodies follow the line."""
    return model.vehicles(line=excitation.track.has_curves)


def spacings(model: Model, rows: FloatArray, excitation: Excitation) -> list[Spacing]:
    """Return the key of the input table of each of n vehicles [n, row]: wheelset spacing, or positions on a line."""
    if not excitation.track.has_curves:
        return list(model.wheelset_spacings(rows))
    return list(line_positions(model, rows))


def line_positions(model: Model, rows: FloatArray) -> list[LinePositions]:
    """Return the positions of the bodies of n vehicles [n, row] on a line with curves."""
    positions = model.vehicles(line=True).line_positions(model.batch(rows))
    wheelsets = map(wheelset_distances, model.wheelset_spacings(rows))
    gauges = half_gauges(model, rows).tolist()
    return [LinePositions(w, tuple(p), b) for w, p, b in zip(wheelsets, positions, gauges, strict=True)]


def half_gauges(model: Model, rows: FloatArray) -> FloatArray:
    """Return the mean half_gauge b [n] in m of the wheelsets, over which cant counts."""
    columns = [i for path, i in model.columns.items() if path.endswith(HALF_GAUGE)]
    return np.asarray(rows[:, columns].mean(axis=1))


def on_rails(model: Model, batch: Batch, excitation: Excitation) -> Batch:
    """Return vehicles that start at the lateral deviation of the first sample, all bodies alike.

    A track that begins at zero needs no initial states.
    """
    if excitation.start == 0.0:
        return batch
    vehicles = vehicles_on(model, excitation)
    states = np.zeros(vehicles.state_count(batch))
    states[[i for i, dof in enumerate(vehicles.degrees_of_freedom(batch)) if is_lateral(dof)]] = excitation.start
    return batch.with_initial_states(states)
