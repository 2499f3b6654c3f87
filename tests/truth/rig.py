"""One mass on a test bench: m z'' + c z' + k z = gain u(t) + effects, driven or free, and its campaigns.

    python -m tests.truth.rig OUT --effect "dry_friction force=40 slip_speed=0.01" --seed 1 [--free]

input force: u is the force. base_displacement: the base moves by x = gain u, springs and effects see z - x.
base_acceleration: z is measured from the base, the mass feels -m gain u.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from tests.truth.effects import Effect, check_together, parse, sense
from tests.truth.files import campaign_text, write_run
from tests.truth.laws import Array
from tests.truth.placed import Group, grouped

Rate = Callable[[Array, float, Array], Array]


@dataclass(frozen=True)
class Rig:
    """A mass, its declared spring and damper, and the gain from u to the force."""

    m: float = 95.0
    k: float = 6.0e4
    c: float = 150.0
    gain: float = 1.0
    input: str = "force"  # or base_displacement, base_acceleration

    def text(self) -> str:
        """Text of its design file."""
        k = f"mass: {self.m:.12g}, stiffness: {self.k:.12g}, damping: {self.c:.12g}, gain: {self.gain:.12g}"
        return f"name: rig, declared values\nvehicle: {{rig: {{{k}, input: {self.input}}}}}\n"


def respond(
    rig: Rig,
    t: Array,
    u: Array | None = None,
    effects: Sequence[Effect] = (),
    start: tuple[float, float] = (0.0, 0.0),
    steps: int | None = None,
    lively: float = 5e-3,
) -> dict[str, Array]:
    """z, vz, az at the times t [s]; u between the samples is a not-a-knot spline; start is (z, v).

    `lively` is the size of z that the number of steps per sample is chosen for.
    """
    check_together(effects)
    groups = grouped([list(effects)], lambda _, place: (rig.k, rig.c) if place == "rig" else (0.0, 0.0))
    end = 2
    for g in groups:
        g.states = slice(end, end := end + g.kind.states)
    rate = _rate(rig, groups)
    n = steps or _steps(rig, rate, end, float(t[1] - t[0]), max(lively, abs(start[0])))
    given = _input(t, u, n)
    x = np.zeros(end)
    x[:2] = start
    out = np.zeros((len(t), 3))
    for k in range(len(t)):
        h = (t[k + 1] - t[k]) / n if k + 1 < len(t) else 0.0
        for j in range(n):
            at, i = t[k] + j * h, 2 * (k * n + j)
            k_1 = rate(x, at, given[i])
            if j == 0:
                out[k] = x[0], x[1], k_1[1]
            if not h:
                break
            k_2 = rate(x + 0.5 * h * k_1, at + 0.5 * h, given[i + 1])
            k_3 = rate(x + 0.5 * h * k_2, at + 0.5 * h, given[i + 1])
            k_4 = rate(x + h * k_3, at + h, given[i + 2])
            x = x + h / 6.0 * (k_1 + 2.0 * (k_2 + k_3) + k_4)
            for g in (g for g in groups if "blow_off" in g.p):
                x[g.states] = np.clip(x[g.states], -g.p["blow_off"], g.p["blow_off"])
    return sense(dict(zip(("z", "vz", "az"), out.T, strict=True)), t, effects)


def _rate(rig: Rig, groups: Sequence[Group]) -> Rate:
    def rate(x: Array, t: float, u: Array) -> Array:
        base = (u[0], u[1]) if rig.input == "base_displacement" else (0.0, 0.0)
        z, v = x[0] - rig.gain * base[0], x[1] - rig.gain * base[1]
        force = -rig.k * z - rig.c * v
        if rig.input != "base_displacement":
            force += rig.gain * u[0] * (1.0 if rig.input == "force" else -rig.m)
        dx = np.zeros_like(x)
        for g in groups:
            if g.kind.law is None:
                continue
            F, own = g.kind.law(g.p, np.array([[z]]), np.array([[v]]), x[g.states].reshape(-1, 1, 1), t)
            force += F[0, 0]
            if own is not None:
                dx[g.states] = own.ravel()
        dx[0], dx[1] = x[1], force / rig.m
        return dx

    return rate


def _input(t: Array, u: Array | None, n: int) -> Array:
    """u and du/dt at the samples and 2 n - 1 points between each two."""
    if u is None:
        return np.zeros((2 * n * len(t) + 1, 2))
    fine = np.append((t[:-1, None] + np.diff(t)[:, None] * np.arange(2 * n) / (2 * n)).ravel(), t[-1])
    spline = CubicSpline(t, u, bc_type="not-a-knot")
    return np.stack([spline(fine), spline(fine, 1)], axis=1)


def _steps(rig: Rig, rate: Rate, rows: int, dt: float, lively: float) -> int:
    """Steps per sample that keep |lambda| h below 1, at rest and where z is about `lively`."""
    rng, worst = np.random.default_rng(0), 0.0
    size = np.zeros(rows)
    size[:2] = lively, lively * np.sqrt(abs(rig.k) / rig.m + 1.0)
    no_input = np.zeros(2)
    for k in range(12):
        x = rng.normal(0.0, 1.0, rows) * np.append(size[:2], np.ones(rows - 2)) * min(k, 1)
        eye = np.eye(rows) * 1e-4 * (size + 1e-3 * size[0])
        columns = [(rate(x + d, 0.0, no_input) - rate(x - d, 0.0, no_input)) / (2.0 * d.max()) for d in eye]
        worst = max(worst, float(np.abs(np.linalg.eigvals(np.stack(columns, axis=1))).max()))
    return max(1, int(np.ceil(worst * dt)))


# -------------------------------------------------------------------------------------------------- campaigns


@dataclass(frozen=True)
class Bench:
    """Specification of a rig campaign; both runs have their own excitation, or their own release."""

    effects: Sequence[Effect] = ()
    seed: int = 0
    name: str = "rig truth"
    declared: Rig = field(default_factory=Rig)
    rig: Rig | None = None  # the true one; stiffness within 20 %, damping within 50 %, gain 5 % where None
    free: bool = False
    seconds: tuple[float, float] = (10.0, 8.0)
    rate: float = 1000.0
    columns: Sequence[str] = ("z", "az")
    noise: float = 0.01  # share of each column's standard deviation
    input_noise: float = 0.0  # the same of u
    amplitude: float = 4e-3  # m: the release, or the standard deviation the drive gives the linear rig about


def excitation(bench: Bench, rig: Rig, t: Array, rng: np.random.Generator) -> Array:
    """A multisine from a fifth of the resonance to four times it, in the unit of u."""
    own = np.sqrt(rig.k / rig.m) / (2.0 * np.pi)
    f = np.geomspace(0.2 * own, 4.0 * own, 40) * rng.uniform(0.98, 1.02, 40)
    signal = np.cos(2.0 * np.pi * f * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, 40)).sum(axis=1)
    scale: float = bench.amplitude / respond(rig, t, signal)["z"].std()
    return np.asarray(scale * signal)


def bench_runs(bench: Bench) -> tuple[Rig, dict[str, dict[str, Array]]]:
    """The true rig and its two runs as recorded."""
    rng = np.random.default_rng([bench.seed, 21])
    d = bench.declared
    k, c, gain = (1.0 + rng.uniform(-w, w) for w in (0.2, 0.5, 0.05))
    rig = bench.rig or replace(d, k=d.k * k, c=d.c * c, gain=d.gain * gain)
    runs: dict[str, dict[str, Array]] = {}
    noise: dict[str, float] = {}  # the sensors of both runs are those of the first
    for i, (name, seconds) in enumerate(zip("ab", bench.seconds, strict=True)):
        own = np.random.default_rng([bench.seed, 22, i])
        t = np.arange(round(seconds * bench.rate)) / bench.rate
        if bench.free:
            u, start = None, (bench.amplitude * own.uniform(0.7, 1.4) * own.choice([-1.0, 1.0]), 0.0)
        else:
            u, start = excitation(bench, rig, t, own), (0.0, 0.0)
        seen = respond(rig, t, u, bench.effects, start)
        runs[name] = {"t": t}
        if u is not None:
            runs[name]["u"] = u + bench.input_noise * float(u.std()) * own.standard_normal(len(t))
        for x in bench.columns:
            sd = noise.setdefault(x, bench.noise * float(seen[x].std()))
            runs[name][x] = seen[x] + own.normal(0.0, sd, len(t))
    return rig, runs


def write(bench: Bench, folder: Path) -> Rig:
    """rig.yaml, campaign.yaml and both runs; returns the true rig, which no file names."""
    rig, runs = bench_runs(bench)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.yaml").write_text(bench.declared.text())
    noise = {x: f"{bench.noise * runs['a'][x].std():.3g}" for x in bench.columns}
    (folder / "campaign.yaml").write_text(campaign_text(bench.name, "rig.yaml", noise))
    drive = {"force": "N", "base_displacement": "m", "base_acceleration": "m/s^2"}[bench.declared.input]
    units = {"t": "s", "u": drive, "z": "m", "vz": "m/s", "az": "m/s^2"}
    for name, run in runs.items():
        write_run(folder / f"run_{name}.csv.gz", run, units, time="%.7g")
    return rig


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.truth.rig", description=__doc__)
    p.add_argument("out", type=Path)
    p.add_argument("--effect", action="append", default=[], metavar='"KIND NAME=NUMBER ..." at the rig')
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--free", action="store_true", help="a free decay")
    p.add_argument("--input", choices=["force", "base_displacement", "base_acceleration"], default="force")
    p.add_argument("--noise", type=float, default=0.01)
    given = p.parse_args(words)
    known = [text if "at=" in text else f"{text} at=rig" for text in given.effect]
    bench = Bench([parse(text) for text in known], given.seed, free=given.free, noise=given.noise)
    true = write(replace(bench, name=given.out.name, declared=replace(bench.declared, input=given.input)), given.out)
    print(f"true: stiffness {true.k:.6g}, damping {true.c:.6g}, gain {true.gain:.6g}")


if __name__ == "__main__":
    main()
