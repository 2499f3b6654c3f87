"""Exudyn: a body of six co-ordinates under RK44, all forces in one user function, in Python or by numba."""

from __future__ import annotations

from collections.abc import Callable

import exudyn
import numpy as np
from exudyn.itemInterface import NodeGenericODE2, ObjectGenericODE2

from tests.bench.peers import numba_peer, scipy_peer
from tests.bench.peers.bogie import written
from tests.bench.peers.job import Answers, Job

VERSION = f"Exudyn {exudyn.__version__}"


def force_of(job: Job, compiled: bool) -> Callable[..., object]:
    """The force user function of a design: masses are one, so forces are accelerations."""
    if not compiled:
        accelerations = written(job.full, scipy_peer.factor, scipy_peer.beyond, scipy_peer.as_it_is)
        half, rows = 2.0 / job.dt, job.track.tolist()

        def of(c):  # type: ignore[no-untyped-def]
            own = c.tolist()
            return lambda mbs, t, item, q, v: accelerations((*q, *v), own, rows[round(t * half)])

        return of
    accelerations = written(job.full, numba_peer.factor, numba_peer.beyond, numba_peer.inlined)
    half, track = 2.0 / job.dt, job.track

    @numba_peer.njit(fastmath=True, error_model="numpy")
    def force(t, q, v, c, track):  # type: ignore[no-untyped-def]
        r = track[round(t * half)]
        x = (q[0], q[1], q[2], q[3], q[4], q[5], v[0], v[1], v[2], v[3], v[4], v[5])
        return accelerations(x, c, (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7]))

    return lambda c: lambda mbs, t, item, q, v: force(t, np.array(q), np.array(v), c, track)


def prepare(job: Job, compiled: bool) -> Callable[[], Answers]:
    """The job, design after design; the solution of every sample is kept by a sensor."""
    of, columns = force_of(job, compiled), np.ascontiguousarray(job.c.T)
    all_at_once = written(job.full, scipy_peer.factors, lambda e, h: e - np.clip(e, -h, h), scipy_peer.as_it_is)
    rows = job.track[::2].T

    def ride(c):  # type: ignore[no-untyped-def]
        container = exudyn.SystemContainer()
        mbs = container.AddSystem()
        zero = [0.0] * 6
        node = mbs.AddNode(NodeGenericODE2("", zero, zero, zero, 6))
        mbs.AddObject(ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.eye(6), forceUserFunction=of(c)))
        sensors = [
            mbs.AddSensor(exudyn.itemInterface.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
            for kind in (exudyn.OutputVariableType.Coordinates, exudyn.OutputVariableType.Coordinates_t)
        ]
        mbs.Assemble()
        settings = exudyn.SimulationSettings()
        time = settings.timeIntegration
        time.numberOfSteps, time.endTime, time.verboseMode = job.samples - 1, (job.samples - 1) * job.dt, 0
        time.adaptiveStep = False
        time.explicitIntegration.computeEndOfStepAccelerations = False
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = job.dt
        settings.displayComputationTime = False
        mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
        result = [mbs.GetSensorStoredData(sensor)[:, 1:].T for sensor in sensors]
        mbs.Reset()
        return np.vstack(result)

    def rides() -> Answers:
        result = []
        for c in columns:
            x = ride(c)
            result.append((x[2] - rows[0], x[4] - rows[4], all_at_once(x, c, rows)[0]))
        series = np.array(result).transpose(1, 0, 2)
        return job.of_series(series[:2], series[2])

    return rides
