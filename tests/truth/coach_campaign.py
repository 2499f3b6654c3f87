"""Simulated campaigns of the coach of 17 degrees of freedom, many vehicles side by side.

The suspension is that of `coach.rate`, probed once per vehicle for its matrix; contact, force laws and sensors are
evaluated on top of it. Nothing here uses the program's own equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.interpolate import CubicSpline

from tests.truth.campaign import pink
from tests.truth.coach import FRAMES, V_PLACES, WHEELSETS, Coach, rate, state_matrix
from tests.truth.coach_joints import JointEffects, row_at, steps_for
from tests.truth.effects import Effect
from tests.truth.files import write_run
from tests.truth.laws import Array, beyond, saturation
from tests.truth.tracks import met, recorder_noise

DESIGN = Path(__file__).parents[2] / "designs/manchester_coach.yaml"
WARM = 8.0  # s ahead of every run
RATE, STEPS = 200.0, 2
WIDEST = 0.1  # m, rad: a coach that moves further has left the rails
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
NOMINAL_CONICITY = 0.1
ACCELEROMETERS = ("ay_front", "ay_rear", "rf_front", "rf_rear", "floor_front", "floor_middle", "floor_rear")


class Coaches:
    """Coaches side by side: states [34 + those of the effects, vehicle]."""

    def __init__(self, coaches: Sequence[Coach], effects: Sequence[Sequence[Effect]]) -> None:
        self.coaches = coaches
        self.suspension = np.stack([_suspension(c) for c in coaches])  # [vehicle, 17, 34 + 16]
        self.inverse_mass = np.stack([_inverse_mass(c) for c in coaches], axis=1)  # [17, vehicle]
        names = ("b", "r", "N", "I_yw", "I_zw", "m_w", "lam", "kappa_x", "kappa_y", "kappa_s")
        names = (*names, "epsilon", "delta", "sigma", "friction", "clearance", "flange")
        self.p = {x: np.array([getattr(c, x) for c in coaches]) for x in names}
        self.stops = np.array([c.stop for c in coaches]).T
        rows = [[row_at(c, "secondary_lateral", n) for c in coaches] for n in (1, 2)]
        self.stop_rows = np.array(rows).transpose(0, 2, 1)  # [bogie, 17, vehicle]
        self.effects = JointEffects(coaches, effects, self.inverse_mass)
        self.cubic = np.zeros((4, len(coaches)))
        for k, some in enumerate(effects):
            for one in some:
                if one.kind == "nonlinear_conicity":
                    rows = slice(None) if one.wheelset is None else one.wheelset - 1
                    self.cubic[rows, k] = one.parameters["cubic"]

    def rate(self, x: Array, V: Array, rails: Array, t: float) -> Array:
        """x' at speeds [vehicle] over rails [16, vehicle], with rates in time."""
        q, v = x[:V_PLACES], x[V_PLACES : 2 * V_PLACES]
        inputs = np.concatenate([x[: 2 * V_PLACES], rails])
        a = (self.suspension @ inputs.T[:, :, None])[:, :, 0].T
        Q_y, Q_psi = self._contact(q[9::2], q[10::2], v[9::2], v[10::2], V, rails.reshape(4, 4, -1).transpose(1, 0, 2))
        a[9::2] += Q_y / self.p["m_w"]
        a[10::2] += Q_psi / self.p["I_zw"]
        gap, stiffness = self.stops
        force = -stiffness * beyond(np.einsum("nik,ik->nk", self.stop_rows, q), gap)
        a += np.einsum("nik,nk->ik", self.stop_rows, force) * self.inverse_mass
        of_effects, own_rates = self.effects.accelerations(q, v, x[2 * V_PLACES :], t)
        return np.concatenate([v, a + of_effects, own_rates])

    def _contact(self, y: Array, psi: Array, vy: Array, vpsi: Array, V: Array, rails: Array) -> tuple[Array, Array]:
        """Q_y, Q_psi [wheelset, vehicle] with the gyroscopic moments, wheel by wheel; rails [4, wheelset, vehicle]."""
        p = self.p
        b, r, N, sigma = p["b"], p["r"], p["N"], p["sigma"]
        y_w, dy_w, phi_w, dphi_w = rails
        e = y - y_w - r * phi_w
        phi, dphi = phi_w - sigma * e / b, dphi_w - sigma * (vy - dy_w - r * dphi_w) / b
        radius = p["lam"] * e * (1.0 + self.cubic * e**2)
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


@dataclass(frozen=True)
class Order:
    """Specification of a campaign: run a for estimation, run b for validation."""

    seed: int
    effects: tuple[Effect, ...] = ()
    name: str = "coach"
    channels: tuple[str, ...] = ALL
    speeds: tuple[float, float] = (45.0, 36.0)
    seconds: tuple[float, float] = (60.0, 45.0)
    track: str = "low"  # ERRI B176
    noise: float = 1.0  # factor on the standard deviations of the sensors
    stated: float = 1.0  # standard deviations in the campaign file over the true ones; 0: none are stated
    pink: bool = False  # sensors' noise with a 1/f spectrum
    unmeasured: float = 0.0  # N: standard deviation of a random force on both frames
    spread: Mapping[str, float] = field(default_factory=dict)  # field of the coach to the width of its draw
    conicity: float = NOMINAL_CONICITY  # of the nominal design; above it the coach may hunt
    realisation: int = 0  # of the noise of sensors and track, on the same motion

    def all_effects(self, run: int) -> list[Effect]:
        """The effects of a run, with the unmeasured force and the seed of a random force."""
        extra = [Effect("frame_rumble", "frame", None, {"force": self.unmeasured})] if self.unmeasured else []
        seeds = np.random.default_rng([self.seed, 12, run]).integers(2**31, size=len(self.effects) + 1)
        return [
            replace(e, parameters={**e.parameters, "seed": int(seed)}) if e.kind == "frame_rumble" else e
            for e, seed in zip([*self.effects, *extra], seeds, strict=False)
        ]


def drawn(order: Order) -> Coach:
    """A true coach round the nominal one, stable a little above both speeds."""
    rng = np.random.default_rng([order.seed, 11])
    for _ in range(100):
        c = _drawn(order, rng)
        may_hunt = order.conicity > NOMINAL_CONICITY
        if may_hunt or np.linalg.eigvals(state_matrix(c, max(order.speeds) + 3.0)).real.max() < 1e-6:
            return c
    raise ValueError(f"no stable coach near the nominal one at {order.speeds} m/s: lower the speeds")


def _drawn(order: Order, rng: np.random.Generator) -> Coach:
    c = replace(Coach(), lam=order.conicity)
    values: dict[str, Any] = {x: getattr(c, x) * (1 + rng.uniform(-w, w)) for x, w in SPREAD.values()}
    u = rng.uniform(-1.0, 1.0, 3)
    values["primary"] = (c.primary[0] * (1 + 0.1 * u[0]), c.primary[1] * (1 + 0.1 * u[1]), c.primary[2])
    values["secondary_c"] = (0.0, c.secondary_c[1] * (1 + 0.25 * u[2]), c.secondary_c[2])
    values |= {x: getattr(c, x) * (1 + rng.uniform(-w, w)) for x, w in order.spread.items()}
    return replace(c, **values)


def true_values(c: Coach) -> dict[str, float]:
    """Numbers of a true coach that differ from the nominal ones, by their paths in design files."""
    values = {path: getattr(c, x) for path, (x, _) in SPREAD.items()} | {
        "contact.wheels.contact_angle": c.delta,
        "vehicle.elements.primary.longitudinal_stiffness": c.primary[0],
        "vehicle.elements.primary.lateral_stiffness": c.primary[1],
        "vehicle.elements.lateral_damper.lateral_damping": c.secondary_c[1],
    }
    return {path: float(x) for path, x in values.items()}


def write_campaigns(orders: Sequence[Order], folders: Sequence[Path]) -> None:
    """Simulate campaigns of the same lengths side by side and write each into its folder, with its truth.

    A coach that derails leaves its folder without its texts.
    """
    coaches = [drawn(order) for order in orders]
    steps = max(steps_of(order) for order in orders)
    derailed = set()
    for i, letter in enumerate("ab"):
        model = Coaches(coaches, [order.all_effects(i) for order in orders])
        runs = [
            met(o.speeds[i], o.seconds[i], 100 * o.seed + i, o.track, rate=RATE, before=WARM, spread=0.8)
            for o in orders
        ]
        states, accelerations = _march(model, runs, steps)
        for k, (order, folder) in enumerate(zip(orders, folders, strict=True)):
            folder.mkdir(parents=True, exist_ok=True)
            if np.isnan(states[:, :, k]).any():
                derailed.add(k)
                continue
            _write_run(order, coaches[k], runs[k], states[:, :, k], accelerations[:, :, k], folder, letter, i)
    for k, (order, coach, folder) in enumerate(zip(orders, coaches, folders, strict=True)):
        if k not in derailed:
            _write_texts(order, coach, folder)


def steps_of(order: Order) -> int:
    """Integration steps per sample that a campaign needs."""
    c = drawn(order)
    return max(STEPS, steps_for(c, order.effects, _inverse_mass(c), 1.0 / RATE))


def _march(model: Coaches, runs: Sequence[Any], steps: int = STEPS) -> tuple[Array, Array]:
    """States and accelerations [sample, coordinate, vehicle] by fourth-order Runge-Kutta from rest; NaN: derailed."""
    n = len(runs[0].t)
    at = np.arange(2 * steps * (n - 1) + 1) / (2 * steps)
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
    dt = 1.0 / RATE / steps
    x = np.zeros((2 * V_PLACES + model.effects.states, len(runs)))
    states, accelerations = [], []
    derailed = np.zeros(len(runs), bool)
    for i in range(0, len(at), 2):
        t = runs[0].t[0] + at[i] / RATE
        s1 = model.rate(x, speed[i], rails[i], t)
        if i % (2 * steps) == 0:
            states.append(x[: 2 * V_PLACES])
            accelerations.append(s1[V_PLACES : 2 * V_PLACES])
        if i + 2 >= len(at):
            break
        s2 = model.rate(x + dt / 2 * s1, speed[i + 1], rails[i + 1], t + dt / 2)
        s3 = model.rate(x + dt / 2 * s2, speed[i + 1], rails[i + 1], t + dt / 2)
        s4 = model.rate(x + dt * s3, speed[i + 2], rails[i + 2], t + dt)
        x = x + dt / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
        derailed |= ~(np.abs(x[:V_PLACES]).max(axis=0) < WIDEST)
        x[:, derailed] = 0.0
    found = np.array(states)
    found[:, :, derailed] = np.nan
    return found, np.array(accelerations)


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
    rng = np.random.default_rng([order.seed, 13, i, order.realisation])
    warm = round(WARM * RATE)
    channels = _sensed(c, run, states, accelerations)
    columns = {"t": run.t, "s": run.s, "v": run.v, "yw": run.yw, "phiw": run.phiw}
    for name in order.channels:
        sd = order.noise * _sd(name)
        columns[name] = channels[name] + (sd * pink(len(run.t), rng) if order.pink else rng.normal(0, sd, len(run.t)))
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
    noise = {"yw": 2e-5, "phiw": 2e-5} | {name: order.noise * _sd(name) for name in order.channels}
    text = {
        "name": order.name,
        "vehicle": "vehicle.yaml",
        "runs": [{"file": "run_a.csv.gz", "role": "adjust"}, {"file": "run_b.csv.gz", "role": "validate"}],
        "channels": {name: declared[name] for name in order.channels if name in declared},
        **({"noise": {name: order.stated * sd for name, sd in noise.items()}} if order.stated else {}),
    }
    (folder / "campaign.yaml").write_text(yaml.safe_dump(text, sort_keys=False), encoding="utf-8")
    truth = {"effects": [one.record() for one in order.effects], "values": true_values(coach)}
    (folder / "truth.yaml").write_text(yaml.safe_dump(truth), encoding="utf-8")
