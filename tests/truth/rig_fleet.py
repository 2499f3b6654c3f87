"""A made fleet of one-mass rigs on a driven support: exact linear responses, one rig whose spring softens.

    m z'' + c z' + k z = -m gain u(t), z from the support, u its acceleration

python -m tests.truth.rig_fleet OUT
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lsim

from tests.truth.files import write_run
from tests.truth.laws import Array
from tests.truth.rig import Rig

UNITS = {"t": "s", "u": "m/s^2", "z": "m", "az": "m/s^2"}
NOMINAL = Rig(m=95.0, k=6.0e4, c=150.0, gain=1.0, input="base_acceleration")
OVERSAMPLING = 8


@dataclass(frozen=True)
class RigFleet:
    """Specification: the last rig loses `loss` of its stiffness linearly from `onset` [run] to the last run."""

    rigs: int = 4
    runs: int = 36
    seed: int = 0
    loss: float = 0.12
    onset: int = 18
    seconds: float = 4.0
    rate: float = 100.0
    noise: float = 0.02


def response(rig: Rig, t: Array, u: Array) -> tuple[Array, Array]:
    """z and z'' from rest, exact for an acceleration that is linear between eight points per sample."""
    a = np.array([[0.0, 1.0], [-rig.k / rig.m, -rig.c / rig.m]])
    fine = np.interp(np.linspace(t[0], t[-1], OVERSAMPLING * (len(t) - 1) + 1), t, u)
    times = np.linspace(t[0], t[-1], len(fine))
    _, z, x = lsim((a, [[0.0], [-rig.gain]], [[1.0, 0.0]], [[0.0]]), fine, times)
    az = a[1, 0] * x[:, 0] + a[1, 1] * x[:, 1] - rig.gain * fine
    return np.asarray(z[::OVERSAMPLING]), np.asarray(az[::OVERSAMPLING])


def temperature(order: RigFleet, number: int) -> float:
    """Temperature [degC] of a run."""
    rng = np.random.default_rng([order.seed, 61, number])
    return float(15.0 + 8.0 * np.sin(2.0 * np.pi * number / 25.0) + 2.0 * rng.standard_normal())


def stiffness(order: RigFleet, rig: int, number: int) -> float:
    """Stiffness [N/m] of a rig in a run: of its own, softer in the warmth, and fading on the last rig."""
    rng = np.random.default_rng([order.seed, 62, rig])
    own = NOMINAL.k * float(np.exp(0.03 * rng.standard_normal()))
    span = max(order.runs - 1 - order.onset, 1)
    fade = order.loss * float(np.clip((number - order.onset) / span, 0.0, 1.0)) if rig == order.rigs - 1 else 0.0
    return own * (1.0 - 0.002 * (temperature(order, number) - 15.0)) * (1.0 - fade)


def run_of(order: RigFleet, rig: int, number: int) -> dict[str, Array]:
    """Columns of a run as recorded."""
    rng = np.random.default_rng([order.seed, 63, rig, number])
    t = np.arange(round(order.seconds * order.rate)) / order.rate
    f = np.geomspace(0.8, 12.0, 25) * rng.uniform(0.98, 1.02, 25)
    u = np.cos(2.0 * np.pi * f * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, 25)).sum(axis=1)
    ramp = np.clip(t / 0.3, 0.0, 1.0)
    u *= 0.5 * ramp / u.std()
    true = Rig(NOMINAL.m, stiffness(order, rig, number), NOMINAL.c, NOMINAL.gain, NOMINAL.input)
    z, az = response(true, t, u)
    noisy = {"z": z + order.noise * z.std() * rng.standard_normal(len(t))}
    noisy["az"] = az + order.noise * az.std() * rng.standard_normal(len(t))
    return {"t": t, "u": u, **noisy}


def write(order: RigFleet, out: Path) -> None:
    """fleet.yaml, rig.yaml, runs.csv and the runs."""
    (out / "runs").mkdir(parents=True, exist_ok=True)
    (out / "rig.yaml").write_text(NOMINAL.text())
    index = ["file,vehicle,time,temperature [degC]"]
    for number in range(order.runs):
        for rig in range(order.rigs):
            name = f"runs/rig{rig + 1}_{number + 1:02d}.csv.gz"
            write_run(out / name, run_of(order, rig, number), UNITS, time="%.7g")
            index.append(f"{name},rig{rig + 1},{number + 1},{temperature(order, number):.1f}")
    (out / "runs.csv").write_text("\n".join(index) + "\n")
    (out / "fleet.yaml").write_text(fleet_text(order))


def fleet_text(order: RigFleet) -> str:
    """Text of fleet.yaml."""
    rigs = "\n".join(f"  rig{k + 1}: rig" for k in range(order.rigs))
    return f"""# Four rigs of one kind, a run a day each (simulated): the spring of the last one softens from run 19 on.
schema: railui.fleet/1
name: four rigs (simulated)
types:
  rig: {{vehicle: rig.yaml, watch: [free_play, dry_friction]}}
vehicles:
{rigs}
runs: {{index: runs.csv}}
triggers: {{min_duration: 3 s}}
limits:
  - {{parameter: vehicle.rig.stiffness, below: 50e3}}
settings: {{block_days: 1, reference_runs: 3, baseline_blocks: 12}}
"""


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.truth.rig_fleet", description=__doc__)
    p.add_argument("out", type=Path)
    p.add_argument("--seed", type=int, default=0)
    given = p.parse_args(words)
    write(RigFleet(seed=given.seed), given.out)


if __name__ == "__main__":
    main()
