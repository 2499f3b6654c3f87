"""A mass on a spring and a damper between limit stops, pushed by a measured force: Exudyn's own objects alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from exudyn import OutputVariableType as Output
from exudyn import itemInterface as items
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tests.third_program.multibody import Multibody

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Rig:
    """Mass [kg], stiffness [N/m], damping [N*s/m]; gap [m] and stiffness [N/m] of the stops, none where None."""

    mass: float
    stiffness: float
    damping: float
    stop: tuple[float, float] | None = None


def simulate(rig: Rig, t: Floats, force: Floats, per_sample: int = 4) -> dict[str, Floats]:
    """z, vz, az from rest under a force [N] at the times t [s]."""
    system = Multibody()
    mbs = system.mbs
    node = mbs.AddNode(items.Node1D(referenceCoordinates=[0.0]))
    mbs.AddObject(items.ObjectMass1D(nodeNumber=node, mass=rig.mass))
    marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    stops = {}
    if rig.stop is not None:
        gap, stiffness = rig.stop
        states = mbs.AddNode(items.NodeGenericData(initialCoordinates=[0.0, 0.0, 0.0], numberOfDataCoordinates=3))
        stops = {"nodeNumber": states, "useLimitStops": True, "limitStopsStiffness": stiffness}
        stops |= {"limitStopsLower": -gap, "limitStopsUpper": gap}
    mbs.AddObject(
        items.CoordinateSpringDamperExt(
            markerNumbers=[system.origin, marker], stiffness=rig.stiffness, damping=rig.damping, **stops
        )
    )
    step = float(t[1] - t[0]) / per_sample
    steps = per_sample * (len(t) - 1)
    forces = CubicSpline(t, force)(t[0] + step * np.arange(steps + 1)).tolist()
    mbs.AddLoad(
        items.LoadCoordinate(
            markerNumber=marker, load=0.0, loadUserFunction=lambda mbs, at, load: forces[min(round(at / step), steps)]
        )
    )
    kinds = {"z": Output.Coordinates, "vz": Output.Coordinates_t, "az": Output.Coordinates_tt}
    sensors = {
        name: mbs.AddSensor(items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
        for name, kind in kinds.items()
    }
    system.integrate(step, steps, per_sample)
    return {name: system.sensor_values(sensor)[0] for name, sensor in sensors.items()}
