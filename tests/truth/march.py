"""Runs of a batch of bogies: fourth-order Runge-Kutta steps from sample to sample, and sensor signals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.truth.bogie import ORDER, Bogie, Vehicle
from tests.truth.effects import Effect, sense
from tests.truth.laws import Array
from tests.truth.road import Point, Road, Table

CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "psi1", "psi2", "Qy", "Qpsi")
ASTRAY = 0.2  # m or rad: a vehicle beyond this is taken out and its channels are NaN from there
BLOCK = 500  # samples whose inputs are worked out at a time


def steps_for(bogie: Bogie, V: float, dt: float, product: float = 1.2) -> int:
    """Steps per sample that keep |lambda| h below `product`, at rest, at seven lively states and at seven halts.

    A stop is steep beyond its edge and a Bouc-Wen element as steep as it is fast: rest is not representative. Friction
    that has aged is steepest at a halt: deflected, without speed, its own states of any size.
    """
    rng = np.random.default_rng(0)
    lively = [_state(bogie, rng, speed=0.08) for _ in range(7)]
    halts = [_state(bogie, rng, speed=0.0) for _ in range(7)]
    rest = np.zeros((bogie.size, bogie.count))
    worst = max(float(np.abs(np.linalg.eigvals(bogie.jacobian(V, x))).max()) for x in (rest, *lively, *halts))
    return max(2, int(np.ceil(worst * dt / product)))


def _state(bogie: Bogie, rng: np.random.Generator, speed: float) -> Array:
    """A random state of each vehicle; speed: standard deviation of the velocities."""
    x = np.zeros((bogie.size, bogie.count))
    x[:6] = rng.normal(0.0, 8e-3, (6, bogie.count))
    x[6:12] = rng.normal(0.0, speed, (6, bogie.count))
    for g in bogie.groups:
        x[g.states] = rng.uniform(-1.0, 1.0, x[g.states].shape)
    return x


def march(bogie: Bogie, roads: Sequence[Road], steps: int, state: Array | None = None) -> tuple[Array, Array, Array]:
    """States, accelerations and coach forces at the samples: [sample, row, vehicle].

    All runs share the times of the longest one; state: [row, vehicle] in the order inside.
    """
    t = max((road.run.t for road in roads), key=len)
    x = np.zeros((bogie.size, bogie.count)) if state is None else state.copy()
    X, A, Q = (np.zeros((len(t), rows, bogie.count)) for rows in (bogie.size, 6, 2))
    gone = np.zeros(bogie.count, bool)
    fractions = np.arange(2 * steps) / (2 * steps)
    with np.errstate(all="ignore"):
        for first in range(0, len(t), BLOCK):
            k = np.arange(first, min(first + BLOCK, len(t)))
            dt = np.append(np.diff(t), 0.0)[k]
            times = np.append((t[k, None] + dt[:, None] * fractions).ravel(), t[k[-1]] + dt[-1])
            rows = np.stack([road(times) for road in roads], axis=2)
            for i, sample in enumerate(k):
                at = 2 * steps * i
                X[sample] = x
                for j in range(at, at + 2 * steps, 2):
                    p = [Point(times[m], rows[m]) for m in (j, j + 1, j + 2)]
                    F, inner, sec = bogie.forces(x, p[0])
                    k_1 = np.concatenate([x[6:12], F / bogie.inertia, inner])
                    if j == at:
                        A[sample], Q[sample] = k_1[6:12], sec
                    x = _runge_kutta(bogie, x, k_1, dt[i] / steps, p[1], p[2])
            gone |= ~(np.abs(x[:6]).max(axis=0) < ASTRAY)
            x[:, gone] = 0.0
            for out in (X, A, Q):
                out[k[0] : k[-1] + 1, :, gone] = np.nan
    return X, A, Q


def _runge_kutta(bogie: Bogie, x: Array, k_1: Array, h: float, middle: Point, end: Point) -> Array:
    k_2 = bogie.rate(x + (0.5 * h) * k_1, middle)
    k_3 = bogie.rate(x + (0.5 * h) * k_2, middle)
    k_4 = bogie.rate(x + h * k_3, end)
    x = x + (h / 6.0) * (k_1 + 2.0 * (k_2 + k_3) + k_4)
    bogie.settle(x)
    return x


def observe(bogie: Bogie, k: int, road: Road, X: Array, A: Array, Q: Array) -> dict[str, Array]:
    """Channels of vehicle k from its states, accelerations and coach forces [sample, row]."""
    p = road(road.run.t)
    u = X[:, bogie.rails] if bogie.contact.yields else np.zeros((len(X), 2))
    e = X[:, 2:4] - p[:, 0:2] - u
    lean = bogie.a[k] * X[:, 1]
    d1, d2 = X[:, 2] - X[:, 0] - lean, X[:, 3] - X[:, 0] + lean
    result = (e[:, 0], e[:, 1], A[:, 2], A[:, 3], A[:, 0], X[:, 7], d1, d2, X[:, 4], X[:, 5], Q[:, 0], Q[:, 1])
    return dict(zip(CHANNELS, result, strict=True))


def simulate_many(
    vehicles: Sequence[Vehicle],
    tables: Sequence[Table],
    effects: Sequence[Sequence[Effect]] | None = None,
    steps: int | None = None,
    state: Array | None = None,
) -> list[dict[str, Array]]:
    """Channels of each vehicle on its own table; state [12] or [12, vehicle]: q then q', model order."""
    longest = max((run.t for run in tables), key=len)
    if not all(np.allclose(run.t, longest[: len(run.t)], rtol=0.0, atol=1e-9) for run in tables):
        raise ValueError("runs side by side share their sample times; simulate the others apart")
    effects = [[] for _ in vehicles] if effects is None else effects
    drives = [" ".join(w for w, q in (("y", t.Qy), ("psi", t.Qpsi)) if q is not None) for t in tables]
    bogie = Bogie(vehicles, effects, drives)
    roads = [Road(run, v.a, v.r) for run, v in zip(tables, vehicles, strict=True)]
    dt = float(np.diff(tables[0].t[:2])[0])
    steps = steps or steps_for(bogie, min(float(run.v.min()) for run in tables), dt)
    X, A, Q = march(bogie, roads, steps, inside(bogie, state))
    out = []
    for k, (run, road) in enumerate(zip(tables, roads, strict=True)):
        n = len(run.t)
        seen = observe(bogie, k, road, X[:n, :, k], A[:n, :, k], Q[:n, :, k])
        out.append(sense(seen, run.t, effects[k]))
    return out


def simulate(
    vehicle: Vehicle,
    run: Table,
    effects: Sequence[Effect] = (),
    steps: int | None = None,
    state: Array | None = None,
) -> dict[str, Array]:
    """Channels of one vehicle along a table; steps None: as many per sample as the stiffest term wants."""
    return simulate_many([vehicle], [run], [effects], steps, state)[0]


def inside(bogie: Bogie, state: Array | None) -> Array:
    """A state in the model's order, [12] or [12, vehicle], effects' rows below, as the batch keeps it."""
    x = np.zeros((bogie.size, bogie.count))
    if state is not None:
        given = np.asarray(state, float).reshape(len(state), -1)
        x[:6], x[6:12] = given[:6][ORDER], given[6:12][ORDER]
        x[12 : len(given)] = given[12:]
    return x
