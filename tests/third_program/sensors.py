"""Sensors of a vehicle in Exudyn, by the names of a campaign's channels."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from exudyn import OutputVariableType as Output
from numpy.typing import NDArray

from tests.third_program.road import Road
from tests.third_program.scene import Body, Scene

Floats = NDArray[np.float64]
ACROSS, ABOUT_Z = 1, 2  # components of a vector


class Sensors:
    """Channels to be read once the scene has marched; `road` gives the rails that displacements count from."""

    def __init__(self, scene: Scene, road: Road) -> None:
        self.scene, self.road = scene, road
        self.channels: dict[str, Callable[[], Floats]] = {}

    def acceleration(self, name: str, body: Body, at: tuple[float, float, float] | None = None) -> None:
        """Lateral acceleration of a point of a body, its centre where none is given [m/s^2]."""
        self._add(name, self.scene.watch(body, at or (body.x, 0.0, body.height), Output.Acceleration), ACROSS)

    def yaw_rate(self, name: str, body: Body) -> None:
        """Yaw rate of a body [rad/s]."""
        self._add(name, self.scene.watch(body, (body.x, 0.0, body.height), Output.AngularVelocity), ABOUT_Z)

    def wheelset(self, index: int, body: Body, springs: Sequence[int], what: Output) -> None:
        """e, ay, psi and d of a wheelset counted from 0; `springs` are its axle boxes', `what` gives their stretch."""
        number, centre = index + 1, (body.x, 0.0, body.height)
        y = self.scene.watch(body, centre, Output.Displacement)
        rails = self.road.rails[index][:: self.road.per_sample]
        rest = np.array([r.y + body.height * r.phi for r in rails])
        stretch = [self.scene.watch_joint(spring, what) for spring in springs]
        self.channels[f"e{number}"] = lambda: self.scene.seen(y)[ACROSS] - rest
        self.channels[f"d{number}"] = lambda: -np.mean([self.scene.seen(x)[ACROSS] for x in stretch], axis=0)
        self.acceleration(f"ay{number}", body)
        self._add(f"psi{number}", self.scene.watch(body, centre, Output.Rotation), ABOUT_Z)

    def _add(self, name: str, sensor: int, component: int) -> None:
        self.channels[name] = lambda: self.scene.seen(sensor)[component]

    def read(self) -> dict[str, Floats]:
        """Channels [sample]."""
        return {name: np.asarray(channel()) for name, channel in self.channels.items()}
