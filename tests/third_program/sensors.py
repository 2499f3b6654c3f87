"""Sensors of a vehicle in Exudyn, by the names of a campaign's channels."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from exudyn import OutputVariableType as Output
from numpy.typing import NDArray

from tests.third_program.multibody import Body, Multibody
from tests.third_program.rail_table import RailTable

Floats = NDArray[np.float64]
ACROSS, ABOUT_Z = 1, 2  # components of a vector


class Sensors:
    """Channels of a system, read after its integration; `table` gives the rails that displacements count from."""

    def __init__(self, system: Multibody, table: RailTable) -> None:
        self.system, self.table = system, table
        self.channels: dict[str, Callable[[], Floats]] = {}

    def acceleration(self, name: str, body: Body, at: tuple[float, float, float] | None = None) -> None:
        """Lateral acceleration of a point of a body, its centre where none is given [m/s^2]."""
        self._add(
            name, self.system.add_point_sensor(body, at or (body.x, 0.0, body.height), Output.Acceleration), ACROSS
        )

    def yaw_rate(self, name: str, body: Body) -> None:
        """Yaw rate of a body [rad/s]."""
        self._add(name, self.system.add_point_sensor(body, (body.x, 0.0, body.height), Output.AngularVelocity), ABOUT_Z)

    def wheelset(self, index: int, body: Body, springs: Sequence[int], what: Output) -> None:
        """Add e, ay, psi and d of a wheelset counted from 0; `what` is the output of its axle boxes' springs."""
        number, centre = index + 1, (body.x, 0.0, body.height)
        y = self.system.add_point_sensor(body, centre, Output.Displacement)
        rails = self.table.rails[index][:: self.table.per_sample]
        rest = np.array([r.y + body.height * r.phi for r in rails])
        deflection = [self.system.add_joint_sensor(spring, what) for spring in springs]
        self.channels[f"e{number}"] = lambda: self.system.sensor_values(y)[ACROSS] - rest
        self.channels[f"d{number}"] = lambda: (
            -np.mean([self.system.sensor_values(x)[ACROSS] for x in deflection], axis=0)
        )
        self.acceleration(f"ay{number}", body)
        self._add(f"psi{number}", self.system.add_point_sensor(body, centre, Output.Rotation), ABOUT_Z)

    def _add(self, name: str, sensor: int, component: int) -> None:
        self.channels[name] = lambda: self.system.sensor_values(sensor)[component]

    def read(self) -> dict[str, Floats]:
        """Channels [sample]."""
        return {name: np.asarray(channel()) for name, channel in self.channels.items()}
