"""Rigid bodies, connectors and constraints of Exudyn for a vehicle on rails, and their integration in time.

Axes x forward, y right, z down, heights upwards from the rails; the frame of reference runs with the vehicle, so that
nothing moves along x but by small displacements. Every body has six degrees of freedom and feels gravity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import exudyn
import numpy as np
from exudyn import OutputVariableType as Output
from exudyn import itemInterface as items
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Law = Callable[[float, float], float]  # relative displacement [m] and velocity [m/s] to force [N]
Forces = Callable[[float, Sequence[float], Sequence[float]], list[float]]

G = 9.81
ROLL, PITCH, YAW = 3, 4, 5  # rotations among the six co-ordinates of a body, behind x, y, z
TOLERANCE = 1e-9  # of Newton's iterations, relative and absolute


@dataclass(frozen=True)
class Body:
    """A rigid body by its numbers in Exudyn, and the place of its centre of mass [m]."""

    node: int
    number: int
    x: float
    height: float

    def local(self, x: float, y: float, height: float) -> list[float]:
        """Local co-ordinates of a point of the vehicle at rest."""
        return [x - self.x, y, self.height - height]


class Multibody:
    """A multibody system of Exudyn under construction, then its solution."""

    def __init__(self) -> None:
        self.container = exudyn.SystemContainer()
        self.mbs = self.container.AddSystem()
        ground = self.mbs.AddObject(items.ObjectGround())
        self.ground = Body(-1, ground, 0.0, 0.0)
        self.origin = self.mbs.AddMarker(
            items.MarkerNodeCoordinate(nodeNumber=self.mbs.AddNode(items.NodePointGround()), coordinate=0)
        )

    # ------------------------------------------------------------------------------------------- bodies

    def add_body(self, mass: float, inertia: tuple[float, float, float], x: float, height: float) -> Body:
        """Add a rigid body: mass [kg], moments of inertia about x, y, z [kg*m^2]."""
        node = self.mbs.AddNode(items.NodeRigidBodyRxyz(referenceCoordinates=[x, 0.0, -height, 0.0, 0.0, 0.0]))
        number = self.mbs.AddObject(
            items.ObjectRigidBody(nodeNumber=node, mass=mass, inertia=[*inertia, 0.0, 0.0, 0.0])
        )
        marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=number))
        self.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0.0, 0.0, G]))
        return Body(int(node), int(number), x, height)

    def add_weight(self, body: Body, force: float) -> None:
        """Add a steady force downwards [N] on the centre of a body."""
        marker = self._point(body, body.x, 0.0, body.height)
        self.mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=[0.0, 0.0, force]))

    def _point(self, body: Body, x: float, y: float, height: float) -> int:
        return int(
            self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body.number, localPosition=body.local(x, y, height)))
        )

    def _points(self, lower: Body, upper: Body, at: tuple[float, float, float]) -> list[int]:
        return [self._point(body, *at) for body in (lower, upper)]

    def _coordinate(self, body: Body, coordinate: int) -> int:
        return int(self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=body.node, coordinate=coordinate)))

    # --------------------------------------------------------------------------------------- connectors

    def add_spring(
        self,
        lower: Body,
        upper: Body,
        at: tuple[float, float, float],
        k: Sequence[float],
        c: Sequence[float],
        load: float = 0.0,
        law: Law | None = None,
    ) -> int:
        """Add a spring and damper along the fixed axes x, y, z that carries a load [N]; `law` acts along y as well."""
        points, offset = self._points(lower, upper, at), _preload(k, load)

        def force(mbs, t, number, z, v, k, c, offset):  # type: ignore[no-untyped-def]
            whole = k * (z - offset) + c * v
            whole[1] += law(z[1], v[1])  # type: ignore[misc]
            return whole

        more = {} if law is None else {"springForceUserFunction": _arrays(force)}
        return int(
            self.mbs.AddObject(
                items.CartesianSpringDamper(
                    markerNumbers=points, stiffness=list(k), damping=list(c), offset=offset, **more
                )
            )
        )

    def add_mean_frame_spring(
        self,
        lower: Body,
        upper: Body,
        at: tuple[float, float, float],
        k: Sequence[float],
        c: Sequence[float],
        load: float = 0.0,
    ) -> int:
        """Add a spring and damper of six directions in the mean frame of both ends, acting half way between them."""
        points, offset = self._points(lower, upper, at), [*_preload(k, load), 0.0, 0.0, 0.0]
        return int(
            self.mbs.AddObject(
                items.RigidBodySpringDamper(
                    markerNumbers=points,
                    stiffness=np.diag(k),
                    damping=np.diag(c),
                    offset=offset,
                    useIntrinsicFormulation=True,
                )
            )
        )

    def add_torsional_spring(self, lower: Body, upper: Body, k: float, c: float) -> int:
        """Add a torsional spring and damper about z between two bodies [N*m/rad, N*m*s/rad]."""
        points = self._points(lower, upper, (upper.x, 0.0, upper.height))
        return int(self.mbs.AddObject(items.TorsionalSpringDamper(markerNumbers=points, stiffness=k, damping=c)))

    def add_friction(self, body: Body, coordinate: int, force: float, zone: float) -> int:
        """Add dry friction [N] of one co-ordinate against the ground, linear below the speed `zone` [m/s]."""
        return int(
            self.mbs.AddObject(
                items.CoordinateSpringDamperExt(
                    markerNumbers=[self.origin, self._coordinate(body, coordinate)],
                    dynamicFrictionForce=force,
                    frictionProportionalZone=zone,
                )
            )
        )

    # -------------------------------------------------------------------------- constraints and contact

    def fix(self, body: Body, *coordinates: int) -> None:
        """Constrain co-ordinates of a body to their values at rest."""
        for coordinate in coordinates:
            self.mbs.AddObject(
                items.CoordinateConstraint(markerNumbers=[self.origin, self._coordinate(body, coordinate)])
            )

    def constrain_roll(self, body: Body, per_lateral: float, offset: Callable[[float], tuple[float, float]]) -> None:
        """Constrain the roll of a body to offset(t) less its lateral displacement times `per_lateral` [rad/m].

        offset returns the angle [rad] and its rate.
        """
        # Exudyn: factor1 q_1 - q_0 - offset = 0, q_0 the roll and q_1 the displacement
        self.mbs.AddObject(
            items.CoordinateConstraint(
                markerNumbers=[self._coordinate(body, ROLL), self._coordinate(body, 1)],
                factor1=-per_lateral,
                offsetUserFunction=lambda mbs, t, number, given: -offset(t)[0],
                offsetUserFunction_t=lambda mbs, t, number, given: -offset(t)[1],
            )
        )

    def add_forces(self, bodies: Sequence[Body], forces: Forces) -> None:
        """Add forces on all co-ordinates of bodies as a function of time, co-ordinates and their rates."""
        n = 6 * len(bodies)
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[body.node for body in bodies],
                massMatrix=np.zeros((n, n)),
                forceUserFunction=lambda mbs, t, number, q, v: forces(t, q, v),
            )
        )

    # ------------------------------------------------------------------------------- sensors and march

    def add_point_sensor(self, body: Body, at: tuple[float, float, float], what: Output) -> int:
        """Add a sensor of a vector in fixed axes at a point of a body."""
        return int(
            self.mbs.AddSensor(
                items.SensorBody(
                    bodyNumber=body.number, localPosition=body.local(*at), storeInternal=True, outputVariableType=what
                )
            )
        )

    def add_joint_sensor(self, number: int, what: Output = Output.Displacement) -> int:
        """Add a sensor of a connector."""
        return int(
            self.mbs.AddSensor(items.SensorObject(objectNumber=number, storeInternal=True, outputVariableType=what))
        )

    def integrate(self, step: float, steps: int, per_sample: int) -> None:
        """Integrate from rest by the trapezoidal rule, constraints on velocities; sensors keep the samples."""
        self.mbs.Assemble()
        settings, end = exudyn.SimulationSettings(), steps * step
        time = settings.timeIntegration
        time.numberOfSteps, time.endTime, time.verboseMode, time.adaptiveStep = steps, end, 0, False
        time.newton.relativeTolerance = time.newton.absoluteTolerance = TOLERANCE
        time.newton.useModifiedNewton = True
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = per_sample * step
        settings.show.computationTime = False
        if not self.mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2):
            raise ArithmeticError("Exudyn's iterations do not converge: take more steps per sample")

    def sensor_values(self, sensor: int) -> Floats:
        """Values of a sensor [component, sample]."""
        return np.asarray(self.mbs.GetSensorStoredData(sensor))[:, 1:].T


def _preload(k: Sequence[float], load: float) -> list[float]:
    """Return the offset x, y, z [m] of a spring that carries a load [N] at rest."""
    return [0.0, 0.0, -load / k[2] if load else 0.0]


def _arrays(force):  # type: ignore[no-untyped-def]
    """The force law with its vectors as arrays."""
    return lambda mbs, t, number, *vectors: force(mbs, t, number, *(np.array(x) for x in vectors))
