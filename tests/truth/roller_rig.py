"""One wheelset on a roller rig by Newton and Euler: contact wheel by wheel on rollers of finite radius, plain numpy.

Axes x forward, y right, z down. The rollers turn at the circumferential speed V and are shifted together by u(t) to
the right; springs and dampers join the axle boxes to the ground. A yawed wheelset stands off the top of its rollers:
its contact points follow from equal normals of wheel and roller, and its normal forces lean along the track.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from tests.truth.files import write_run
from tests.truth.laws import Array, beyond, saturation
from tests.truth.tracks import recorder_noise

DESIGN = Path(__file__).parents[2] / "designs/roller_rig.yaml"
RATE, STEPS = 200.0, 3
WARM = 4.0  # s of an excited run before its record
NOISE = {"e1": 2e-5, "ay1": 0.03, "d1": 2e-5, "turn": 2e-5}  # sensors, and of the recorded shift of the rollers
SHIFT_NOISE = 5e-6
UNITS = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "e1": "m", "ay1": "m/s^2", "d1": "m", "turn": "rad"}
# path in the design, field, and the share by which a drawn rig may differ
SPREAD = {
    "contact.wheels.conicity": ("lam", 0.2),
    "contact.wheels.longitudinal_creep": ("kappa_x", 0.2),
    "contact.wheels.lateral_creep": ("kappa_y", 0.2),
    "contact.wheels.gravitational_stiffness": ("epsilon", 0.2),
    "contact.spin_creep": ("kappa_s", 0.1),
    "vehicle.elements.box_damper.lateral_damping": ("c_y", 0.2),
}


@dataclass(frozen=True)
class Rig:
    """Numbers of the wheelset and its rig, SI; springs and dampers of one side."""

    m: float = 1200.0
    I_z: float = 750.0
    I_y: float = 90.0
    b: float = 0.75
    r: float = 0.46
    R: float = 0.685
    N: float = 50e3
    k_x: float = 0.5e6
    k_y: float = 0.2e6
    c_y: float = 500.0
    base: float = 1.0
    lam: float = 0.15
    kappa_x: float = 150.0
    kappa_y: float = 140.0
    kappa_s: float = 0.25
    epsilon: float = 6.0
    delta: float = 0.05
    sigma: float = 0.05
    friction: float = 0.35
    clearance: float = 7e-3
    flange: float = 14.6e6


def rate(c: Rig, x: Array, V: Array | float, u: Array | float, du: Array | float, *, linear: bool = False) -> Array:
    """x' of x = [y, psi, y', psi'] [4, ...] with the rollers shifted by u at the rate du."""
    y, psi, vy, vpsi = x
    e, de = y - u, vy - du
    lean, leaning = -c.sigma * e / c.b, -c.sigma * de / c.b
    G = c.I_y * V / c.r  # spin of the axle
    force = -2 * c.k_y * y - 2 * c.c_y * vy + G * vpsi * c.sigma / c.b
    moment = -2 * c.k_x * c.base**2 * psi - G * vy * c.sigma / c.b
    for side in (1.0, -1.0):  # the right wheel, the left one
        gamma = c.delta + side * c.epsilon * e / c.b  # slope of the tread at the contact, down and outwards
        # material of the wheel relative to that of the roller, per V
        slip_x = -side * (c.lam * e / c.r + c.b * vpsi / V)
        slip_y = (de - c.r * leaning) / V - psi
        spin = (-side * gamma - lean) / c.r - side * gamma / c.R + vpsi / V
        F_x, F_y = -c.kappa_x * c.N * slip_x, -c.kappa_y * c.N * slip_y - c.kappa_s * c.N * spin
        if not linear:
            factor = saturation(np.hypot(F_x, F_y) / (c.friction * c.N))
            F_x, F_y = factor * F_x, factor * F_y
        # the wheel's centre is at -side b psi; equal normals: angle - side gamma psi = -contact/R
        centre = -side * c.b * psi
        contact = (centre + c.r * side * gamma * psi) * c.R / (c.R + c.r)
        F_x, F_y = F_x + c.N * contact / c.R, F_y - side * gamma * c.N
        force = force + F_y
        moment = moment - side * c.b * F_x + contact * F_y
    if not linear:
        force = force - c.flange * beyond(e, np.asarray(c.clearance))
    return np.array([vy, vpsi, force / c.m, moment / c.I_z])


def growth(c: Rig, V: float) -> float:
    """Growth rate [1/s] of the least stable small motion at a speed, from differences of `rate`."""
    h = 1e-6
    A = np.stack([rate(c, h * x, V, 0.0, 0.0, linear=True) / h for x in np.eye(4)], axis=1)
    return float(np.linalg.eigvals(A).real.max())


def critical_speed(c: Rig) -> float:
    """Linear critical speed [m/s]: the lowest at which a small motion grows."""
    speeds = np.arange(2.0, 200.0, 0.5)
    i = next(i for i, V in enumerate(speeds) if growth(c, V) > 0.0)
    return float(brentq(lambda V: growth(c, V), speeds[i - 1], speeds[i]))


def march(c: Rig, V: Array, u: Array, starts: Array) -> tuple[Array, Array]:
    """States and their rates [sample, 4, run] by fourth-order Runge-Kutta over samples [n, run] of speed and shift."""
    n = len(V)
    at = np.arange(2 * STEPS * (n - 1) + 1) / (2 * STEPS)
    spline, speed = CubicSpline(np.arange(n) / RATE, u), CubicSpline(np.arange(n), V)(at)
    shift, moving = spline(at / RATE), spline(at / RATE, 1)
    h, x = 1.0 / RATE / STEPS, starts
    states, slopes = [], []
    for i in range(0, len(at), 2):
        s1 = rate(c, x, speed[i], shift[i], moving[i])
        if i % (2 * STEPS) == 0:
            states.append(x)
            slopes.append(s1)
        if i + 2 >= len(at):
            break
        s2 = rate(c, x + h / 2 * s1, speed[i + 1], shift[i + 1], moving[i + 1])
        s3 = rate(c, x + h / 2 * s2, speed[i + 1], shift[i + 1], moving[i + 1])
        s4 = rate(c, x + h * s3, speed[i + 2], shift[i + 2], moving[i + 2])
        x = x + h / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
    return np.array(states), np.array(slopes)


@dataclass(frozen=True)
class RigRun:
    """One run: mean speed, by how much it is swept up and down, rms shift of the rollers, and the initial state."""

    speed: float
    sweep: float = 0.0
    shift: float = 4e-3
    seconds: float = 40.0
    start: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    role: str = "adjust"


@dataclass(frozen=True)
class Order:
    """Specification of a campaign on the rig."""

    seed: int
    runs: tuple[RigRun, ...] = (
        RigRun(39.0, 3.0),
        RigRun(34.0, 0.0, 0.0, 15.0, (5e-3, 0.0, 0.0, 0.0)),
        RigRun(30.0, 3.0),
        RigRun(36.0, 2.0, seconds=30.0, role="validate"),
    )
    channels: tuple[str, ...] = ("e1", "ay1", "d1", "turn")
    nominal: Rig = field(default_factory=Rig)
    adjust: tuple[str, ...] = (
        "contact.wheels",
        "contact.spin_creep",
        "vehicle.elements.box_damper.lateral_damping",
    )  # its springs are known
    name: str = "wheelset on a roller rig"


def drawn(order: Order) -> Rig:
    """A true rig round the nominal one."""
    rng = np.random.default_rng([order.seed, 17])
    return replace(
        order.nominal, **{x: getattr(order.nominal, x) * (1 + rng.uniform(-w, w)) for x, w in SPREAD.values()}
    )


def shaken(rms: float, t: Array, rng: np.random.Generator, lowest: float = 0.4, highest: float = 12.0) -> Array:
    """Random shift of the rollers: harmonics whose amplitude falls with the frequency, of a given rms."""
    if not rms:
        return np.zeros(len(t))
    f = np.arange(lowest, highest, 1.0 / max(float(t[-1] - t[0]), 10.0))
    amplitude = 1.0 / f
    amplitude *= rms / np.sqrt(0.5 * (amplitude**2).sum())
    phase = rng.uniform(0.0, 2.0 * np.pi, len(f))
    return np.cos(2.0 * np.pi * np.outer(t, f) + phase) @ amplitude


def write_campaign(order: Order, folder: Path, text: str | None = None) -> Rig:
    """Simulate the runs and write the campaign; text: that of the nominal design. Returns the true rig."""
    folder.mkdir(parents=True, exist_ok=True)
    rig = drawn(order)
    for i, columns in enumerate(_simulate(order, rig)):
        write_run(folder / f"run_{'abcdefgh'[i]}.csv.gz", columns, UNITS)
    (folder / "vehicle.yaml").write_text(text or DESIGN.read_text(encoding="utf-8"), encoding="utf-8")
    has_shift = any(run.shift for run in order.runs)
    noise = {"yw": SHIFT_NOISE} if has_shift else {}
    campaign = {
        "name": order.name,
        "vehicle": "vehicle.yaml",
        "runs": [{"file": f"run_{'abcdefgh'[i]}.csv.gz", "role": run.role} for i, run in enumerate(order.runs)],
        "channels": {"turn": {"kind": "yaw_deflection", "joint": "box_spring_1"}} if "turn" in order.channels else {},
        "adjust": list(order.adjust),
        "noise": noise | {name: NOISE[name] for name in order.channels},
    }
    (folder / "campaign.yaml").write_text(yaml.safe_dump(campaign, sort_keys=False), encoding="utf-8")
    values = {path: float(getattr(rig, x)) for path, (x, _) in SPREAD.items()}
    truth = {"values": values, "critical_speed": critical_speed(rig)}
    (folder / "truth.yaml").write_text(yaml.safe_dump(truth), encoding="utf-8")
    return rig


def _simulate(order: Order, rig: Rig) -> list[dict[str, Array]]:
    """Columns of every run, all of them simulated side by side as long as the longest."""
    warm = round(WARM * RATE)
    t = np.arange(-warm, round(max(run.seconds for run in order.runs) * RATE)) / RATE
    generators = [np.random.default_rng([order.seed, 19, i]) for i in range(len(order.runs))]
    omega = 2.0 * np.pi / np.array([run.seconds for run in order.runs])
    mean, sweep = (np.array([getattr(run, x) for run in order.runs]) for x in ("speed", "sweep"))
    V, s = (
        mean + sweep * np.sin(np.outer(t, omega)),
        np.outer(t, mean) - sweep / omega * (np.cos(np.outer(t, omega)) - 1),
    )
    u = np.stack([shaken(run.shift, t, g) for run, g in zip(order.runs, generators, strict=True)], axis=1)
    starts = np.array([run.start for run in order.runs]).T
    states, slopes = march(rig, V, u, starts)
    all_columns = []
    for i, (run, rng) in enumerate(zip(order.runs, generators, strict=True)):
        first = 0 if any(run.start) else warm  # an initial offset is that of the first sample
        kept = slice(first, first + round(run.seconds * RATE))
        y, psi, a = states[:, 0, i], states[:, 1, i], slopes[:, 2, i]
        clean = {"e1": y - u[:, i], "ay1": a, "d1": y, "turn": psi}
        columns = {"t": t - t[first], "s": s[:, i] - s[first, i], "v": V[:, i]}
        columns["yw"] = u[:, i] + recorder_noise(s[:, i], SHIFT_NOISE, 2.5, rng) if run.shift else u[:, i]
        columns |= {name: clean[name] + rng.normal(0.0, NOISE[name], len(t)) for name in order.channels}
        all_columns.append({name: x[kept] for name, x in columns.items()})
    return all_columns


def main() -> None:
    """Write a campaign into a folder: `python -m tests.truth.roller_rig FOLDER --seed 44`."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=44)
    options = parser.parse_args()
    write_campaign(Order(options.seed), options.folder)


if __name__ == "__main__":
    main()
