"""Campaigns of vehicles simulated by Exudyn, each with one effect that its design lacks.

python -m tests.third_program.campaign OUT [NAME ...]: a directory per campaign, with the truth in truth.yaml
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from exudyn.physics import RegularizedFriction
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tests.third_program import bogie, coach, numbers, rig
from tests.third_program.agreement import eased, multisine
from tests.third_program.multibody import Law
from tests.third_program.rail_table import Run
from tests.truth.files import write_run
from tests.truth.tracks import recorder_noise, speed_profile

Floats = NDArray[np.float64]
Columns = dict[str, Floats]

RATE, BENCH_RATE = 200.0, 1000.0  # samples per second
WARM = 8.0  # s ahead of every run on rails
TRACK_NOISE, TRACK_BAND = 2e-5, 2.5  # m or rad, at wavelengths above [m]
NOISE = {"e": 5e-5, "d": 2e-5, "ay": 0.03, "rf": 3e-4, "floor": 0.03}  # standard deviation by kind of channel, SI
BENCH_NOISE = {"z": 4e-5, "az": 0.03}
UNUSED = ("psi", "ay_body")
PLAIN_UNITS = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad", "u": "N", "z": "m", "az": "m/s^2"}
UNITS = {"e": "m", "d": "m", "ay": "m/s^2", "rf": "rad/s", "floor": "m/s^2"}


@dataclass(frozen=True)
class Case:
    """A campaign: kind of vehicle, true values by path, the unmodelled effect as in a design file, its two runs."""

    vehicle: str
    effect: Mapping[str, Any]
    true: Mapping[str, float]
    seed: int
    speeds: tuple[float, float] = (40.0, 32.0)
    seconds: tuple[float, float] = (50.0, 35.0)


BOGIE_TRUE = {
    "contact.leading.conicity": 0.18,
    "contact.trailing.conicity": 0.17,
    "contact.leading.longitudinal_creep": 155.0,
    "contact.trailing.longitudinal_creep": 160.0,
    "contact.leading.lateral_creep": 145.0,
    "contact.trailing.lateral_creep": 140.0,
    "contact.leading.gravitational_stiffness": 7.0,
    "contact.trailing.gravitational_stiffness": 6.6,
    "vehicle.primary.lateral_stiffness": 2.8e6,
    "vehicle.primary.longitudinal_stiffness": 8.5e6,
    "vehicle.secondary.lateral_damping": 26e3,
    "vehicle.secondary.yaw_damping": 34e3,
}
COACH_TRUE = {
    "contact.wheels.conicity": 0.115,
    "contact.wheels.longitudinal_creep": 125.0,
    "contact.wheels.lateral_creep": 115.0,
    "contact.wheels.gravitational_stiffness": 6.8,
    "vehicle.elements.primary.lateral_stiffness": 3.6e6,
    "vehicle.elements.primary.longitudinal_stiffness": 33e6,
    "vehicle.elements.lateral_damper.lateral_damping": 27e3,
}
RIG, RIG_TRUE = rig.Rig(95.0, 6.0e4, 150.0), rig.Rig(95.0, 6.4e4, 190.0)
CASES = {
    "bogie_friction": Case(
        "bogie",
        {"kind": "dry_friction", "at": "secondary_lateral", "force": 1000.0, "slip_speed": 3e-3},
        BOGIE_TRUE,
        seed=1,
    ),
    "bogie_clearance": Case(
        "bogie", {"kind": "free_play", "at": "primary_lateral", "half_width": 0.3e-3}, BOGIE_TRUE, seed=2
    ),
    "coach_friction": Case(
        "coach",
        {"kind": "dry_friction", "at": "secondary_lateral", "force": 5e3, "slip_speed": 0.01},
        COACH_TRUE,
        seed=3,
        speeds=(45.0, 36.0),
        seconds=(40.0, 30.0),
    ),
    "rig_stop": Case(
        "rig", {"kind": "bump_stop", "at": "rig", "gap": 5e-3, "stiffness": 9e4}, {}, 4, seconds=(10.0, 8.0)
    ),
}


# ------------------------------------------------------------------------------------------- simulation


def friction(force: float, zone: float) -> Law:
    """Exudyn's own regularised friction: smooth up to the speed `zone` [m/s], then constant [N]."""
    return lambda z, v: float(RegularizedFriction(v, force, 0.0, zone, zone))


def clearance(half_width: float, stiffness: float) -> Law:
    """The force that takes a linear spring [N/m] away inside a clearance [m]."""
    return lambda z, v: -stiffness * min(max(z, -half_width), half_width)


def simulate_vehicle(case: Case, run: Run) -> Columns:
    """Channels of a bogie or a coach with its effect."""
    effect = case.effect
    if case.vehicle == "coach":
        law = friction(effect["force"], effect["slip_speed"])
        return coach.simulate(numbers.coach(case.true), run, law)
    vehicle = numbers.bogie(case.true)
    if effect["kind"] == "free_play":
        return bogie.simulate(vehicle, run, bogie.Unmodelled(primary=clearance(effect["half_width"], vehicle.lateral)))
    return bogie.simulate(vehicle, run, bogie.Unmodelled(friction=(effect["force"], effect["slip_speed"])))


def run_on_track(case: Case, index: int) -> Run:
    """A run over a synthetic track of railui's at a speed that wanders."""
    rng = np.random.default_rng([case.seed, 3, index])
    t = np.arange(-round(WARM * RATE), round(case.seconds[index] * RATE)) / RATE
    _, s = speed_profile(case.speeds[index], t, rng, 0.8)
    length = 100.0 * np.ceil((s[-1] - s[0] + 50.0) / 100.0)
    rails = eased(f"erri_b176_low length={length:g} seed={100 * case.seed + index} spacing=0.1").track
    columns = CubicSpline(rails.s, np.stack([rails.yw, rails.phiw], axis=1))(s - s[0])
    return Run(t, s, columns[:, 0], columns[:, 1])


def record_run(case: Case, index: int) -> tuple[Columns, dict[str, float]]:
    """A run with the noise of its recorder and sensors, and the standard deviation of that noise by column."""
    rng = np.random.default_rng([case.seed, 13, index])
    if case.vehicle == "rig":
        return _record_bench(case, index, rng)
    run = run_on_track(case, index)
    channels = {name: x for name, x in simulate_vehicle(case, run).items() if not name.startswith(UNUSED)}
    sd = {name: NOISE[_kind(name)] for name in channels}
    columns = {"t": run.t, "s": run.s, "v": run.speed(), "yw": run.yw, "phiw": run.phiw}
    columns |= {name: x + rng.normal(0.0, sd[name], len(x)) for name, x in channels.items()}
    columns = {name: x[round(WARM * RATE) :] for name, x in columns.items()}
    for name in ("yw", "phiw"):
        columns[name] = columns[name] + recorder_noise(columns["s"], TRACK_NOISE, TRACK_BAND, rng)
    return columns, {"yw": TRACK_NOISE, "phiw": TRACK_NOISE} | sd


def _record_bench(case: Case, index: int, rng: np.random.Generator) -> tuple[Columns, dict[str, float]]:
    t = np.arange(round(case.seconds[index] * BENCH_RATE)) / BENCH_RATE
    u = multisine(t, rng)
    channels = rig.simulate(replace(RIG_TRUE, stop=(case.effect["gap"], case.effect["stiffness"])), t, u)
    noisy = {name: channels[name] + rng.normal(0.0, sd, len(t)) for name, sd in BENCH_NOISE.items()}
    return {"t": t, "u": u} | noisy, dict(BENCH_NOISE)


def _kind(channel: str) -> str:
    return next(kind for kind in NOISE if channel.startswith(kind))


# ------------------------------------------------------------------------------------------------ files


def write(case: Case, folder: Path) -> None:
    """vehicle.yaml, campaign.yaml, both runs and truth.yaml, which the loop does not read."""
    folder.mkdir(parents=True, exist_ok=True)
    noise: dict[str, float] = {}
    for index, letter in enumerate("ab"):
        columns, noise = record_run(case, index)
        write_run(folder / f"run_{letter}.csv.gz", columns, {name: _unit(name) for name in columns}, "%.7g")
    (folder / "vehicle.yaml").write_text(_design(case), encoding="utf-8")
    declared = {name: x for name, x in _declared(case).items() if name in noise}
    campaign = {
        "name": f"{folder.name} by Exudyn",
        "vehicle": "vehicle.yaml",
        "runs": [{"file": "run_a.csv.gz", "role": "adjust"}, {"file": "run_b.csv.gz", "role": "validate"}],
        **({"channels": declared} if declared else {}),
        "noise": noise,
    }
    (folder / "campaign.yaml").write_text(yaml.safe_dump(campaign, sort_keys=False), encoding="utf-8")
    truth = {"effects": [dict(case.effect)], "values": dict(case.true)}
    (folder / "truth.yaml").write_text(yaml.safe_dump(truth), encoding="utf-8")


def _design(case: Case) -> str:
    if case.vehicle == "rig":
        own = f"mass: {RIG.mass:g}, stiffness: {RIG.stiffness:g}, damping: {RIG.damping:g}, gain: 1, input: force"
        return f"name: mass on a bench\nvehicle: {{rig: {{{own}}}}}\n"
    return (numbers.COACH if case.vehicle == "coach" else numbers.BOGIE).read_text(encoding="utf-8")


def _declared(case: Case) -> dict[str, Any]:
    """Sensors that have no name of their own, by channel."""
    if case.vehicle != "coach":
        return {}
    at_rest = [0.0, coach.FLOOR_DEPTH]
    floor = {name: ("body", {"at": [x, *at_rest]}) for name, x in coach.FLOOR.items()}
    frames = {f"ay_{end}": (f"frame_{i}", {}) for i, end in ((1, "front"), (2, "rear"))}
    rates = {f"rf_{end}": {"kind": "yaw_rate", "body": f"frame_{i}"} for i, end in ((1, "front"), (2, "rear"))}
    across = {n: {"kind": "lateral_acceleration", "body": b, **more} for n, (b, more) in (floor | frames).items()}
    return across | rates


def _unit(column: str) -> str:
    return PLAIN_UNITS.get(column) or UNITS[_kind(column)]


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.third_program.campaign", description=__doc__)
    p.add_argument("out", type=Path)
    p.add_argument("names", nargs="*", metavar="NAME", help=", ".join(CASES))
    given = p.parse_args(words)
    for name in given.names or CASES:
        write(CASES[name], given.out / name)


if __name__ == "__main__":
    main()
