"""High-accuracy reference: the same rate by DOP853, restarted at samples and at corners of force laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from tests.truth.bogie import Bogie, Vehicle
from tests.truth.effects import Effect
from tests.truth.laws import Array
from tests.truth.march import inside, observe
from tests.truth.road import Point, Road, Table

Event = Callable[[float, Array], float]
EDGE = {"free_play": "half_width", "bump_stop": "gap"}  # kinds with a corner in the force, and where
SHORT = 1e-9  # s: carries the run over a corner, whose error is of the order of the square of this


def reference(
    vehicle: Vehicle,
    run: Table,
    effects: Sequence[Effect] = (),
    state: Array | None = None,
    rtol: float = 1e-11,
    atol: float = 1e-14,
) -> dict[str, Array]:
    """Channels at the samples of a short run; sensors are left as they are."""
    drives = " ".join(w for w, q in (("y", run.Qy), ("psi", run.Qpsi)) if q is not None)
    bogie, road = Bogie([vehicle], [effects], [drives]), Road(run, vehicle.a, vehicle.r)
    x = inside(bogie, state)[:, 0]
    events = corners(bogie, road, effects)

    def rate(t: float, now: Array) -> Array:
        return bogie.rate(now[:, None], Point(t, road(np.array([t]))[0][:, None]))[:, 0]

    states, accelerations, coach = [], [], []
    for k, t in enumerate(run.t):
        for start, end in pairwise(stops(run, vehicle.a, k)):
            x = _span(rate, start, end, x, events, rtol, atol)
        F, _, sec = bogie.forces(x[:, None], Point(float(t), road(np.array([t]))[0][:, None]))
        states.append(x)
        accelerations.append((F / bogie.inertia)[:, 0])
        coach.append(sec[:, 0])
    return observe(bogie, 0, road, np.array(states), np.array(accelerations), np.array(coach))


def stops(run: Table, a: float, k: int) -> list[float]:
    """Times from sample k - 1 to k, with those when the trailing wheelset passes a knot of the splines."""
    if k == 0:
        return []
    s, t = run.s[k - 1 : k + 1], run.t[k - 1 : k + 1]
    knots = run.s[(run.s > s[0] - 2.0 * a) & (run.s < s[1] - 2.0 * a)] + 2.0 * a
    return [float(x) for x in (t[0], *np.interp(knots, s, t), t[1])]


def _span(
    rate: Callable[[float, Array], Array],
    t: float,
    end: float,
    x: Array,
    events: list[Event],
    rtol: float,
    atol: float,
) -> Array:
    """From t to end, stopping at each event and stepping over it."""
    while end - t > 2.0 * SHORT:
        result = solve_ivp(
            rate,
            (t, end),
            x,
            "DOP853",
            events=events or None,
            rtol=rtol,
            atol=atol,
            first_step=0.25 * (end - t),
        )
        if result.status < 0:
            raise ArithmeticError(f"DOP853 stopped at {result.t[-1]} s: {result.message}")
        t, x = float(result.t[-1]), result.y[:, -1]
        if result.status == 1:
            middle = x + 0.5 * SHORT * rate(t, x)
            t, x = t + SHORT, x + SHORT * rate(t + 0.5 * SHORT, middle)
    return x


def corners(bogie: Bogie, road: Road, effects: Sequence[Effect]) -> list[Event]:
    """Functions of time and state that pass zero where a force law has a corner: flange, free play, stop."""
    events: list[Event] = []

    def add(motion: Callable[[float, Array], float], edge: float) -> None:
        for side in (edge, -edge):

            def event(t: float, x: Array, side: float = side) -> float:
                return motion(t, x) - side

            event.terminal = True  # type: ignore[attr-defined]
            events.append(event)

    def lateral(i: int) -> Callable[[float, Array], float]:
        def e(t: float, x: Array) -> float:
            rest = road(np.array([t]))[0, i]
            u = x[bogie.rails][i] if bogie.contact.yields else 0.0
            return float(x[2 + i] - rest - u)

        return e

    def at(place: str, i: int) -> Callable[[float, Array], float]:
        return lambda t, x: float(bogie.motion(place, x[:6, None], x[bogie.coach][:1] if bogie.coached else 0.0)[i, 0])

    for i in (0, 1):
        if np.isfinite(bogie.contact.c["h"][i, 0]):
            add(lateral(i), float(bogie.contact.c["h"][i, 0]))
    for one in (e for e in effects if e.kind in EDGE):
        for i in range(2)[one.rows]:
            add(at(one.at, i), float(one.parameters[EDGE[one.kind]]))
    return events
