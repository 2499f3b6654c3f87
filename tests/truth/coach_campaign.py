"""Simulated campaigns of the coach of 17 degrees of freedom, many vehicles side by side.

The suspension is that of `coach.rate`, probed once per vehicle for its matrix; contact, force laws and sensors are
evaluated on top of it. Nothing here uses the program's own equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.interpolate import CubicSpline

from tests.truth.coach import FRAMES, V_PLACES, WHEELSETS, Coach, rate
from tests.truth.files import write_run
from tests.truth.laws import Array, beyond, saturation
from tests.truth.tracks import met, recorder_noise

DESIGN = Path(__file__).parents[2] / "designs/manchester_coach.yaml"
WARM = 8.0  # s ahead of every run
RATE, STEPS = 200.0, 2
RAILS = 16  # y_w, its rate, phi_w, its rate at four wheelsets
# declared paths in the design file, the field of the coach, and how far the true one may be from it
SPREAD = {
    "contact.wheels.conicity": ("lam", 0.2),
    "contact.wheels.longitudinal_creep": ("kappa_x", 0.2),
    "contact.wheels.lateral_creep": ("kappa_y", 0.2),
    "contact.wheels.gravitational_stiffness": ("epsilon", 0.2),
    "contact.spin_creep": ("kappa_s", 0.15),
}
NOISE = {"e": 5e-5, "d": 2e-5, "ay": 0.03, "rf": 3e-4}
FLOOR = {"floor_front": 9.5, "floor_middle": 0.0, "floor_rear": -9.5}  # x of the accelerometers [m]
FLOOR_DEPTH = 0.6  # below the body's centre of mass [m]
ALL = ("e1", "e2", "e3", "e4", "ay1", "ay2", "ay3", "ay4", "d1", "d2", "d3", "d4")
ALL = (*ALL, "ay_front", "ay_rear", "rf_front", "rf_rear", "floor_front", "floor_middle", "floor_rear")
ACCELEROMETERS = ("ay_front", "ay_rear", "rf_front", "rf_rear", "floor_front", "floor_middle", "floor_rear")
Force = Callable[[Array, Array, Array, float], tuple[Array, Array]]  # z, v, own state, t to force and the state's rate


@dataclass(frozen=True)
class Law:
    """Force law at a location, on one joint of it or on all (None)."""

    kind: str
    at: str
    number: int | None
    parameters: Mapping[str, float] = field(default_factory=dict)

    def record(self) -> dict[str, Any]:
        """As it stands in a design file."""
        place = {} if self.number is None else {"wheelset": self.number}
        return {"kind": self.kind, "at": self.at, **place, **self.parameters}


def numbers_of(at: str) -> tuple[int, ...]:
    """Numbers of the joints of a location."""
    return (1, 2, 3, 4) if at.startswith(("primary", "contact")) else (1, 2) if at != "body" else (0,)


def row_at(c: Coach, at: str, number: int) -> Array:
    """Motion of a joint [17]: of the lower body less the upper one; by virtual work also where its force acts."""
    row = np.zeros(V_PLACES)
    if at.startswith("primary"):
        wheel, bogie, side = WHEELSETS[number - 1], (number - 1) // 2, 1 if number % 2 else -1
        if at == "primary_yaw":
            row[[wheel + 1, FRAMES[bogie] + 1]] = 1.0, -1.0
        else:
            row[[wheel, FRAMES[bogie], FRAMES[bogie] + 1, FRAMES[bogie] + 2]] = 1.0, -1.0, -side * c.a, -(c.r - c.h_f)
    elif at.startswith("secondary"):
        frame, side = FRAMES[number - 1], 1 if number == 1 else -1
        if at == "secondary_yaw":
            row[[frame + 1, 1]] = 1.0, -1.0
        else:
            row[[frame, frame + 2, 0, 1, 2]] = 1.0, c.secondary_h - c.h_f, -1.0, -side * c.a_c, -(c.secondary_h - c.h)
    else:
        row[{"body": 0, "frame": FRAMES[number - 1]}[at]] = 1.0
    return row


def linear_stiffness(c: Coach, at: str) -> float:
    """Declared lateral stiffness of a joint."""
    return 2.0 * c.primary[1] if at == "primary_lateral" else 2.0 * c.secondary[1]


class Coaches:
    """Coaches side by side: states [34 + 8, vehicle], the last ones the laws' own."""

    def __init__(self, coaches: Sequence[Coach], laws: Sequence[Sequence[Law]]) -> None:
        self.coaches = coaches
        self.suspension = np.stack([_suspension(c) for c in coaches])  # [vehicle, 17, 34 + 16]
        self.inverse_mass = np.stack([_inverse_mass(c) for c in coaches], axis=1)  # [17, vehicle]
        names = ("b", "r", "N", "I_yw", "I_zw", "m_w", "lam", "kappa_x", "kappa_y", "kappa_s")
        names = (*names, "epsilon", "delta", "sigma", "friction", "clearance", "flange")
        self.p = {x: np.array([getattr(c, x) for c in coaches]) for x in names}
        self.stops = np.array([c.stop for c in coaches]).T
        rows = [[row_at(c, "secondary_lateral", n) for c in coaches] for n in (1, 2)]
        self.stop_rows = np.array(rows).transpose(0, 2, 1)  # [bogie, 17, vehicle]
        self.joints = [
            (k, i, law, row_at(coaches[k], law.at, number))
            for k, some in enumerate(laws)
            for law in some
            if law.at != "contact"
            for i, number in enumerate(numbers_of(law.at) if law.number is None else (law.number,))
        ]
        self.cubic = np.zeros((4, len(coaches)))
        for k, some in enumerate(laws):
            for law in some:
                if law.kind == "nonlinear_conicity":
                    rows = slice(None) if law.number is None else law.number - 1
                    self.cubic[rows, k] = law.parameters["cubic"]

    def rate(self, x: Array, V: Array, rails: Array, t: float) -> Array:
        """x' at speeds [vehicle] over rails [16, vehicle], with rates in time."""
        q, v = x[:V_PLACES], x[V_PLACES : 2 * V_PLACES]
        inputs = np.concatenate([x[: 2 * V_PLACES], rails])
        a = np.einsum("kij,jk->ik", self.suspension, inputs)
        Q_y, Q_psi = self._contact(q[9::2], q[10::2], v[9::2], v[10::2], V, rails.reshape(4, 4, -1).transpose(1, 0, 2))
        a[9::2] += Q_y / self.p["m_w"]
        a[10::2] += Q_psi / self.p["I_zw"]
        own = np.zeros((len(x) - 2 * V_PLACES, x.shape[1]))
        gap, stiffness = self.stops
        force = -stiffness * beyond(np.einsum("nik,ik->nk", self.stop_rows, q), gap)
        a += np.einsum("nik,nk->ik", self.stop_rows, force) * self.inverse_mass
        for k, i, law, row in self.joints:
            z, dz, state = float(row @ q[:, k]), float(row @ v[:, k]), float(x[2 * V_PLACES + i, k])
            of_law, own[i, k] = _force(law, self.coaches[k], z, dz, state, t)
            a[:, k] += of_law * row * self.inverse_mass[:, k]
        return np.concatenate([v, a, own])

    def _contact(self, y: Array, psi: Array, vy: Array, vpsi: Array, V: Array, rails: Array) -> tuple[Array, Array]:
        """Q_y, Q_psi [wheelset, vehicle] with the gyroscopic moments, wheel by wheel; rails [4, wheelset, vehicle]."""
        p = self.p
        b, r, N, sigma = p["b"], p["r"], p["N"], p["sigma"]
        y_w, dy_w, phi_w, dphi_w = rails
        e = y - y_w - r * phi_w
        phi, dphi = phi_w - sigma * e / b, dphi_w - sigma * (vy - dy_w - r * dphi_w) / b
        radius = p["lam"] * e + self.cubic * e**3
        T, Y = [], []
        for side in (-1.0, 1.0):  # the right wheel, the left one
            gamma = p["delta"] - side * (-phi_w + p["epsilon"] * e / b)
            u_x = side * radius / r + side * b * vpsi / V
            u_y = vy / V - r * dphi / V - psi
            u_n = (side * gamma - phi) / r + vpsi / V
            T_x, T_y = p["kappa_x"] * N * u_x, p["kappa_y"] * N * u_y + p["kappa_s"] * N * u_n
            factor = saturation(np.hypot(T_x, T_y) / (p["friction"] * N))
            T.append(factor * T_x)
            Y.append(-side * N * gamma + factor * T_y)
        flange = p["flange"] * beyond(e, p["clearance"])
        G = p["I_yw"] * V * sigma / (b * r)
        return -Y[0] - Y[1] - flange + G * vpsi, b * (T[0] - T[1]) + b * psi * (Y[0] - Y[1]) - G * vy


def _suspension(c: Coach) -> Array:
    """Accelerations [17, 34 + 16] of the suspension alone, after states and the rails in time: wheels without load."""
    alone = replace(c, N=0.0, I_yw=0.0)
    columns = []
    for j in range(2 * V_PLACES + RAILS):
        x, rails = np.zeros(2 * V_PLACES), np.zeros(RAILS)
        (x if j < 2 * V_PLACES else rails)[j if j < 2 * V_PLACES else j - 2 * V_PLACES] = 1.0
        columns.append(rate(alone, x, 1.0, rails.reshape(4, 4), full=False)[V_PLACES:])
    return np.stack(columns, axis=1)


def _inverse_mass(c: Coach) -> Array:
    masses = [c.m, c.I_z, c.I_x, *(2 * [c.m_f, c.I_zf, c.I_xf]), *(4 * [c.m_w, c.I_zw])]
    return np.asarray(1.0 / np.array(masses))


def _force(law: Law, c: Coach, z: float, v: float, w: float, t: float) -> tuple[float, float]:
    """Force along the motion of a joint, and the rate of the law's own state."""
    p = law.parameters
    if law.kind == "free_play":
        return linear_stiffness(c, law.at) * float(np.clip(z, -p["half_width"], p["half_width"])), 0.0
    if law.kind == "cubic_stiffness":
        return -p["stiffness"] * z**3, 0.0
    if law.kind == "bump_stop":
        return -p["stiffness"] * (z - float(np.clip(z, -p["gap"], p["gap"]))), 0.0
    if law.kind == "dry_friction":
        return -p["force"] * float(np.tanh(v / p["slip_speed"])), 0.0
    if law.kind == "quadratic_damper":
        return -p["damping"] * abs(v) * v, 0.0
    if law.kind == "viscous_damper":
        return -p["damping"] * v, 0.0
    if law.kind == "hysteresis":
        return -p["yield"] * w, (p["stiffness"] / p["yield"]) * (v - 0.5 * (abs(v) * abs(w) * w + v * w * w))
    if law.kind == "maxwell_damper":
        return -w, p["stiffness"] * v - p["stiffness"] / p["damping"] * w
    if law.kind == "rumble":
        omega, phase = _harmonics(int(p["seed"]))
        return p["force"] * float(np.sqrt(2 / len(omega)) * np.cos(omega * t + phase).sum()), 0.0
    if law.kind == "switching_damper":
        return -p["damping"] * (1.0 if np.sin(2 * np.pi * t / p["period"]) > 0 else 0.0) * v, 0.0
    raise ValueError(law.kind)


@cache
def _harmonics(seed: int) -> tuple[Array, Array]:
    """Angular frequencies and phases of an unmeasured random force, flat up to 8 Hz."""
    rng = np.random.default_rng([seed, 7])
    return 2 * np.pi * 8.0 * (np.arange(40) + rng.random(40)) / 40, rng.uniform(0, 2 * np.pi, 40)


@dataclass(frozen=True)
class Order:
    """Specification of a campaign: run a for estimation, run b for validation; conicity: that of the nominal design."""

    seed: int
    laws: tuple[Law, ...] = ()
    name: str = "coach"
    channels: tuple[str, ...] = ALL
    speeds: tuple[float, float] = (45.0, 36.0)
    seconds: tuple[float, float] = (60.0, 45.0)
    conicity: float = 0.1


def drawn(order: Order) -> Coach:
    """A true coach round the declared one."""
    rng = np.random.default_rng([order.seed, 11])
    c = replace(Coach(), lam=order.conicity)
    values: dict[str, Any] = {x: getattr(c, x) * (1 + rng.uniform(-w, w)) for x, w in SPREAD.values()}
    u = rng.uniform(-1.0, 1.0, 3)
    values["primary"] = (c.primary[0] * (1 + 0.1 * u[0]), c.primary[1] * (1 + 0.1 * u[1]), c.primary[2])
    values["secondary_c"] = (0.0, c.secondary_c[1] * (1 + 0.25 * u[2]), c.secondary_c[2])
    return replace(c, **values)


def write_campaigns(orders: Sequence[Order], folders: Sequence[Path]) -> None:
    """Simulate campaigns of the same lengths side by side and write each into its folder, with its truth."""
    coaches = [drawn(order) for order in orders]
    model = Coaches(coaches, [order.laws for order in orders])
    for i, letter in enumerate("ab"):
        runs = [
            met(o.speeds[i], o.seconds[i], 100 * o.seed + i, "low", rate=RATE, before=WARM, spread=0.8) for o in orders
        ]
        states, accelerations = _march(model, runs)
        for k, (order, folder) in enumerate(zip(orders, folders, strict=True)):
            folder.mkdir(parents=True, exist_ok=True)
            _write_run(order, coaches[k], runs[k], states[:, :, k], accelerations[:, :, k], folder, letter, i)
    for order, coach, folder in zip(orders, coaches, folders, strict=True):
        _write_texts(order, coach, folder)


def _march(model: Coaches, runs: Sequence[Any]) -> tuple[Array, Array]:
    """States and accelerations [sample, coordinate, vehicle] by fourth-order Runge-Kutta from rest."""
    n = len(runs[0].t)
    at = np.arange(2 * STEPS * (n - 1) + 1) / (2 * STEPS)
    c = model.coaches[0]
    behind = (0.0, 2 * c.a, 2 * c.a_c, 2 * c.a_c + 2 * c.a)
    rails, speed = np.zeros((len(at), RAILS, len(runs))), np.zeros((len(at), len(runs)))
    for k, run in enumerate(runs):
        s, v = (CubicSpline(np.arange(n), x)(at) for x in (run.s, run.v))
        speed[:, k] = v
        lateral, cross = (CubicSpline(run.s, x) for x in (run.yw, run.phiw))
        for w, distance in enumerate(behind):
            under = np.maximum(s - distance, run.s[0])
            moving = s - distance >= run.s[0]
            columns = (lateral(under), v * lateral(under, 1) * moving, cross(under), v * cross(under, 1) * moving)
            for j, column in enumerate(columns):
                rails[:, 4 * w + j, k] = column
    dt = 1.0 / RATE / STEPS
    x = np.zeros((2 * V_PLACES + 4, len(runs)))
    states, accelerations = [], []
    for i in range(0, len(at), 2):
        t = runs[0].t[0] + at[i] / RATE
        s1 = model.rate(x, speed[i], rails[i], t)
        if i % (2 * STEPS) == 0:
            states.append(x[: 2 * V_PLACES])
            accelerations.append(s1[V_PLACES : 2 * V_PLACES])
        if i + 2 >= len(at):
            break
        s2 = model.rate(x + dt / 2 * s1, speed[i + 1], rails[i + 1], t + dt / 2)
        s3 = model.rate(x + dt / 2 * s2, speed[i + 1], rails[i + 1], t + dt / 2)
        s4 = model.rate(x + dt * s3, speed[i + 2], rails[i + 2], t + dt)
        x = x + dt / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
    return np.array(states), np.array(accelerations)


def _sensed(c: Coach, run: Any, states: Array, accelerations: Array) -> dict[str, Array]:
    """Channels of one run."""
    out: dict[str, Array] = {}
    lateral, cross = (CubicSpline(run.s, x) for x in (run.yw, run.phiw))
    for w, (at, behind) in enumerate(zip(WHEELSETS, (0, 2 * c.a, 2 * c.a_c, 2 * c.a_c + 2 * c.a), strict=True)):
        under = np.maximum(run.s - behind, run.s[0])
        out[f"e{w + 1}"] = states[:, at] - lateral(under) - c.r * cross(under)
        out[f"ay{w + 1}"] = accelerations[:, at]
        out[f"d{w + 1}"] = states[:, :V_PLACES] @ row_at(c, "primary_lateral", w + 1)
    for name, frame in zip(("front", "rear"), FRAMES, strict=True):
        out[f"ay_{name}"], out[f"rf_{name}"] = accelerations[:, frame], states[:, V_PLACES + frame + 1]
    for name, x in FLOOR.items():
        out[name] = accelerations[:, 0] + x * accelerations[:, 1] - FLOOR_DEPTH * accelerations[:, 2]
    return out


def _sd(channel: str) -> float:
    """Standard deviation of the noise of a channel."""
    return NOISE[channel[0]] if channel[1:].isdigit() else NOISE["rf" if channel.startswith("rf") else "ay"]


def _write_run(
    order: Order, c: Coach, run: Any, states: Array, accelerations: Array, folder: Path, letter: str, i: int
) -> None:
    rng = np.random.default_rng([order.seed, 13, i])
    warm = round(WARM * RATE)
    channels = _sensed(c, run, states, accelerations)
    columns = {"t": run.t, "s": run.s, "v": run.v, "yw": run.yw, "phiw": run.phiw}
    columns |= {name: channels[name] + rng.normal(0.0, _sd(name), len(run.t)) for name in order.channels}
    columns = {name: x[warm:] for name, x in columns.items()}
    for name in ("yw", "phiw"):
        columns[name] = columns[name] + recorder_noise(columns["s"], 2e-5, 2.5, rng)
    units = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad"}
    units |= {name: _unit(name) for name in order.channels}
    write_run(folder / f"run_{letter}.csv.gz", columns, units)


def _unit(channel: str) -> str:
    if channel.startswith("rf"):
        return "rad/s"
    return "m" if channel[0] in "ed" else "m/s^2"


def _write_texts(order: Order, coach: Coach, folder: Path) -> None:
    design = DESIGN.read_text(encoding="utf-8").replace("{conicity: 0.1,", f"{{conicity: {order.conicity:g},")
    (folder / "vehicle.yaml").write_text(design, encoding="utf-8")
    declared: dict[str, Any] = {
        **{n: {"kind": "lateral_acceleration", "body": "body", "at": [x, 0.0, FLOOR_DEPTH]} for n, x in FLOOR.items()},
        **{f"ay_{n}": {"kind": "lateral_acceleration", "body": f"frame_{i}"} for i, n in ((1, "front"), (2, "rear"))},
        **{f"rf_{n}": {"kind": "yaw_rate", "body": f"frame_{i}"} for i, n in ((1, "front"), (2, "rear"))},
    }
    noise = {"yw": 2e-5, "phiw": 2e-5} | {name: _sd(name) for name in order.channels}
    text = {
        "name": order.name,
        "vehicle": "vehicle.yaml",
        "runs": [{"file": "run_a.csv.gz", "role": "adjust"}, {"file": "run_b.csv.gz", "role": "validate"}],
        "channels": {name: declared[name] for name in order.channels if name in declared},
        "noise": noise,
    }
    (folder / "campaign.yaml").write_text(yaml.safe_dump(text, sort_keys=False), encoding="utf-8")
    values = {path: getattr(coach, x) for path, (x, _) in SPREAD.items()}
    values["vehicle.elements.primary.longitudinal_stiffness"], values["vehicle.elements.primary.lateral_stiffness"] = (
        coach.primary[0],
        coach.primary[1],
    )
    values["vehicle.elements.lateral_damper.lateral_damping"] = coach.secondary_c[1]
    truth = {"laws": [law.record() for law in order.laws], "values": {k: float(v) for k, v in values.items()}}
    (folder / "truth.yaml").write_text(yaml.safe_dump(truth), encoding="utf-8")
