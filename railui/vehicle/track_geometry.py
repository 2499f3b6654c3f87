"""Geometry by which the wheelsets of a vehicle meet the track."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.vehicle.design import Design
from railui.vehicle.model import Model


@dataclass(frozen=True)
class TrackGeometry:
    """Geometry of the wheelsets of a vehicle on its track; of a test bench there is none.

    Attributes
    ----------
    distances
        Distance of each wheelset behind the first [m].
    rolling_radius, half_gauge
        Of the first wheelset [m].
    half_wheelbase
        Of a bogie [m], else NaN.
    """

    distances: tuple[float, ...] = ()
    rolling_radius: float = 0.0
    half_gauge: float = 0.0
    half_wheelbase: float = float("nan")

    @property
    def is_bogie(self) -> bool:
        """True for a bogie, whose channels satisfy kinematic relations through its frame."""
        return self.half_wheelbase == self.half_wheelbase

    def under_wheelsets(self, s: FloatArray, track: Sequence[FloatArray]) -> list[FloatArray]:
        """Return track columns [n] at distances s [n] in m as they are, then as every further wheelset meets them."""
        return [*track, *(np.interp(s - behind, s, x) for behind in self.distances[1:] for x in track)]

    @property
    def wheelbase(self) -> float:
        """Distance of the second wheelset behind the first [m]; 0 of a single one."""
        return self.distances[1] if len(self.distances) > 1 else 0.0


def track_geometry(design: Design) -> TrackGeometry:
    """Return the geometry by which a vehicle meets its track."""
    if not design.is_on_track:
        return TrackGeometry()
    values, distances = design.values, Model(design).wheelset_distances()
    if design.structure is None:
        r, b = values["vehicle.geometry.rolling_radius"], values["vehicle.geometry.half_gauge"]
        return TrackGeometry(distances, r, b, values["vehicle.geometry.half_wheelbase"])
    path = design.structure.wheelsets[0].part.number_path
    return TrackGeometry(distances, values[path("rolling_radius")], values[path("half_gauge")])
