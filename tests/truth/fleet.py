"""A made fleet: bogies over a year on three track sections, with weather, loads, wear, ageing and planted faults.

Vehicles differ from the declared one and from each other. Rubber and oil follow the temperature, rubber stiffens under
load, the creep follows the weather of the day, wheels wear until they are re-profiled, sensors drift a little. Two
sections deteriorate between two recordings of the track. Faults of known size begin at known days on some vehicles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth.bogie import Vehicle
from tests.truth.campaign import DECAY, DECLARED, RESPONSES, WARM, Order, decay, noisy
from tests.truth.effects import Effect, effect
from tests.truth.files import NOISE
from tests.truth.laws import Array
from tests.truth.march import simulate_many
from tests.truth.road import Table
from tests.truth.tracks import quantities, recorder_noise, speed_profile

SECTIONS = ("north", "middle", "south")
LENGTH = 800.0  # m of a section's track, of which runs use what their speed needs
LEAD = 250.0  # m of track ahead of a section, for the first seconds
RECORD_DAYS = 91.0  # between two recordings of the track
GRID = 0.25  # m
DEFECTS = {"north": ((150.0, 60.0), (260.0, 130.0)), "south": ((210.0, 200.0),)}  # place [m], first day
DEFECT_GROWTH = 1.2e-5  # m per day
DEFECT_LENGTH = 5.0  # m
ROUGHNESS_GROWTH = {"north": 4e-4, "south": 6e-4}  # of the spectrum's amplitude per day, from the first defect on
KILOMETRES_PER_DAY = 550.0
WEAR = 1.6e-6  # share of the conicity per kilometre since re-profiling
REPROFILED_EVERY = 100e3  # km, about
SENSOR_DRIFT = 0.01  # standard deviation of a healthy sensor's gain after a year
STEPS = 2
CHUNK = 800  # runs that are simulated at a time


@dataclass(frozen=True)
class Fault:
    """A fault that grows linearly from `onset` [day] over `ramp` days to its size, and stays.

    kind: yaw_damper and rubber (share of the value), clearance (half-width [m]), sensor (share of the gain).
    """

    vehicle: int
    kind: str
    size: float
    onset: float
    ramp: float = 120.0
    wheelset: int | None = None
    channel: str = ""

    def at(self, day: float) -> float:
        """Size on a day."""
        return self.size * float(np.clip((day - self.onset) / self.ramp, 0.0, 1.0))


@dataclass(frozen=True)
class FleetOrder:
    """Specification of a fleet; `every`: days between two runs of a vehicle."""

    vehicles: int = 60
    days: int = 365
    every: int = 1
    seed: int = 0
    seconds: float = 12.0
    rate: float = 200.0
    speed: float = 36.0
    faults: Sequence[Fault] = ()
    channels: Sequence[str] = ("ay1", "ay2", "ayf", "rf", "d1", "d2")
    declared: Vehicle = DECLARED
    track_faults: bool = True


@dataclass(frozen=True)
class FleetRun:
    """A run as recorded, with its metadata; temperature [degC], mileage [km], load as a share of the payload."""

    vehicle: int
    day: int
    section: str
    temperature: float
    load: float
    mileage: float
    columns: dict[str, Array] = field(repr=False)


def planted_faults(seed: int, vehicles: int, kinds: Sequence[tuple[str, Sequence[float]]]) -> list[Fault]:
    """One fault on each of the first vehicles of a random order: every size of every kind once."""
    rng = np.random.default_rng([seed, 41])
    order = iter(rng.permutation(vehicles).tolist())
    faults = []
    for kind, sizes in kinds:
        for size in sizes:
            wheelset = int(rng.integers(1, 3)) if kind == "clearance" else None
            channel = str(rng.choice(["ay1", "ay2", "ayf"])) if kind == "sensor" else ""
            onset = float(rng.integers(120, 200))
            faults.append(Fault(next(order), kind, size, onset, wheelset=wheelset, channel=channel))
    return faults


def temperature(seed: int, day: int) -> float:
    """Temperature [degC] of a day that begins in January: seasons and weather."""
    rng = np.random.default_rng([seed, 42, day])
    return float(10.0 - 11.0 * np.cos(2.0 * np.pi * (day - 15.0) / 365.0) + 3.0 * rng.standard_normal())


@dataclass(frozen=True)
class Member:
    """A vehicle of the fleet with what belongs to it alone."""

    vehicle: Vehicle
    profiled: tuple[float, ...]  # km at which its wheels were re-profiled
    start: float  # km on the first day
    wear: float  # its own, over the usual one
    drift: dict[str, float]  # of its sensors' gains in a year

    def since_profiled(self, mileage: float) -> float:
        """Kilometres since the last re-profiling."""
        return mileage - max((x for x in self.profiled if x <= mileage), default=0.0)


def members(order: FleetOrder) -> list[Member]:
    """The vehicles: within some per cent of one another, a little further from the declared one."""
    found = []
    for k in range(order.vehicles):
        for attempt in range(100):
            rng = np.random.default_rng([order.seed, 43, k, attempt])
            d = order.declared

            def near(x: float, width: float, rng: np.random.Generator = rng) -> float:
                return x * float(np.exp(width * rng.standard_normal()))

            vehicle = replace(
                d,
                c_y=near(d.c_y, 0.03),
                c_x=near(d.c_x, 0.03),
                k_y=near(d.k_y, 0.06),
                k_psi=near(d.k_psi, 0.06),
                lam=tuple(near(x, 0.04) for x in d.lam),
            )
            if decay(_in_service(vehicle, order, 0.25, 25.0, 0.0, 1.0), order.speed + 2.0) > DECAY:
                break
        start = float(rng.uniform(0.0, REPROFILED_EVERY))
        profiled = tuple(np.arange(1, 6) * REPROFILED_EVERY * float(rng.uniform(0.9, 1.1)))
        drift = {c: SENSOR_DRIFT * float(rng.standard_normal()) for c in order.channels}
        found.append(Member(vehicle, profiled, start, near(1.0, 0.2), drift))
    return found


def _in_service(v: Vehicle, order: FleetOrder, wear: float, degrees: float, load: float, creep: float) -> Vehicle:
    """A vehicle with worn wheels at a temperature, a load and a creep of the day."""
    cold = degrees - 15.0
    return replace(
        v,
        c_y=v.c_y * (1.0 - 0.003 * cold) * (1.0 + 0.02 * load),
        c_x=v.c_x * (1.0 - 0.003 * cold),
        k_y=v.k_y * (1.0 - 0.005 * cold),
        k_psi=v.k_psi * (1.0 - 0.005 * cold),
        m_b=v.m_b * (1.0 + 0.03 * load),
        lam=tuple(x * (1.0 + wear) for x in v.lam),
        kappa_x=tuple(x * creep for x in v.kappa_x),
        kappa_y=tuple(x * creep for x in v.kappa_y),
    )


class Line:
    """The track sections as they are on a day, and as they were recorded last."""

    def __init__(self, order: FleetOrder) -> None:
        self.order = order
        grid = np.arange(-LEAD, LENGTH, GRID)
        self.grid = grid
        self.base, self.extra = {}, {}
        for i, section in enumerate(SECTIONS):
            for into, which in ((self.base, 0), (self.extra, 1)):
                rails = quantities("low", 1200.0, int(order.seed * 100 + 10 * which + i))
                into[section] = {name: one.along(grid + LEAD) for name, one in rails.items()}
        self._true = cache(self._at)
        self._record = cache(self._recorded)

    def true(self, section: str, day: int) -> CubicSpline:
        """Track of a day [yw, phiw, gauge] over the distance."""
        return self._true(section, 7 * (day // 7))

    def record(self, section: str, day: int) -> CubicSpline:
        """The last recording of the track."""
        return self._record(section, int(day // RECORD_DAYS))

    def _columns(self, section: str, day: float) -> dict[str, Array]:
        rails = {name: x.copy() for name, x in self.base[section].items()}
        places = DEFECTS.get(section, ()) if self.order.track_faults else ()
        for place, first in places:
            rails["yw"] += max(day - first, 0.0) * DEFECT_GROWTH * np.exp(-(((self.grid - place) / DEFECT_LENGTH) ** 2))
        if places:
            share = ROUGHNESS_GROWTH[section] * max(day - min(first for _, first in places), 0.0)
            for name in rails:
                rails[name] += share * self.extra[section][name]
        return rails

    def _at(self, section: str, day: int) -> CubicSpline:
        rails = self._columns(section, float(day))
        return CubicSpline(self.grid, np.stack([rails[x] for x in ("yw", "phiw", "gauge")], axis=1))

    def _recorded(self, section: str, number: int) -> CubicSpline:
        rails = self._columns(section, number * RECORD_DAYS)
        rng = np.random.default_rng([self.order.seed, 44, SECTIONS.index(section), number])
        for name in rails:
            rails[name] = rails[name] + recorder_noise(self.grid, NOISE[name][0], 2.5, rng)
        return CubicSpline(self.grid, np.stack([rails[x] for x in ("yw", "phiw", "gauge")], axis=1))


@dataclass(frozen=True)
class State:
    """A vehicle in one run: as it is, its effects, the gains of its sensors, and the metadata of the run."""

    vehicle: int
    day: int
    section: str
    degrees: float
    load: float
    mileage: float
    true: Vehicle
    effects: tuple[Effect, ...]
    gains: dict[str, float]


@dataclass(frozen=True)
class _Run:
    state: State
    table: Table


def fleet_runs(order: FleetOrder) -> Iterator[FleetRun]:
    """All runs of a fleet, simulated many at a time; in the order of days, those with a clearance apart."""
    fleet, line = members(order), Line(order)
    pending: dict[tuple[object, ...], list[_Run]] = {}
    for day in range(0, order.days, order.every):
        for k in range(order.vehicles):
            run = _run(order, state_of(order, fleet[k], k, day), line)
            group = pending.setdefault(tuple((e.kind, e.at, e.wheelset) for e in run.state.effects), [])
            group.append(run)
            if len(group) == CHUNK:
                yield from _simulated(order, line, group)
                group.clear()
    for group in pending.values():
        if group:
            yield from _simulated(order, line, group)


def state_of(order: FleetOrder, member: Member, k: int, day: int) -> State:
    """Vehicle k on a day."""
    rng = np.random.default_rng([order.seed, 45, k, day])
    section = SECTIONS[(day // order.every + k) % len(SECTIONS)]
    degrees = temperature(order.seed, day)
    weather = np.random.default_rng([order.seed, 46, day])  # of the whole line
    creep = (0.8 if weather.random() < 0.3 else 1.0) * float(np.exp(0.03 * rng.standard_normal()))
    load = float(rng.uniform(0.0, 1.0))
    mileage = member.start + KILOMETRES_PER_DAY * day
    wear = WEAR * member.wear * member.since_profiled(mileage)
    vehicle = _in_service(member.vehicle, order, wear, degrees, load, creep)
    gains = {c: 1.0 + x * day / 365.0 for c, x in member.drift.items()}
    effects: list[Effect] = []
    for fault in order.faults:
        size = fault.at(day) if fault.vehicle == k else 0.0
        if size == 0.0:
            continue
        if fault.kind == "yaw_damper":
            vehicle = replace(vehicle, k_psi=vehicle.k_psi * (1.0 - size))
        elif fault.kind == "rubber":
            vehicle = replace(vehicle, c_y=vehicle.c_y * (1.0 + size))
        elif fault.kind == "clearance":
            effects.append(effect("free_play", "primary_lateral", fault.wheelset, half_width=size))
        elif fault.kind == "sensor":
            gains[fault.channel] *= 1.0 - size
    return State(k, day, section, degrees, load, mileage, vehicle, tuple(effects), gains)


def _run(order: FleetOrder, state: State, line: Line) -> _Run:
    rng = np.random.default_rng([order.seed, 48, state.vehicle, state.day])
    t = np.arange(-round(WARM * order.rate), round(order.seconds * order.rate)) / order.rate
    v, s = speed_profile(order.speed + float(rng.uniform(-1.5, 1.5)), t, rng, 0.5)
    rails = line.true(state.section, state.day)(s)
    return _Run(state, Table(t, s, v, rails[:, 0], rails[:, 1], rails[:, 2]))


def _simulated(order: FleetOrder, line: Line, runs: Sequence[_Run]) -> Iterator[FleetRun]:
    true = [run.state.true for run in runs]
    seen = simulate_many(true, [run.table for run in runs], [run.state.effects for run in runs], STEPS)
    warm = round(WARM * order.rate)
    usual = Order(rate=order.rate, noise=dict.fromkeys(("yw", "phiw", "gauge"), 0.0))
    for run, channels in zip(runs, seen, strict=True):
        x, table = run.state, run.table
        rng = np.random.default_rng([order.seed, 47, x.vehicle, x.day])
        record = line.record(x.section, x.day)(table.s[warm:])
        clean = {"t": table.t[warm:], "s": table.s[warm:], "v": table.v[warm:]}
        clean |= {name: record[:, i] for i, name in enumerate(("yw", "phiw", "gauge"))}
        clean |= {c: x.gains[c] * channels[c][warm:] for c in RESPONSES if c in order.channels}
        yield FleetRun(x.vehicle, x.day, x.section, x.degrees, x.load, x.mileage, noisy(clean, usual, rng))
