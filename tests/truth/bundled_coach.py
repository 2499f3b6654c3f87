"""The bundled simulated campaign of a coach, designs/campaigns/worn_centre_guide, by the independent coach model.

    python -m tests.truth.bundled_coach designs/campaigns/worn_centre_guide

Three runs of 40 s. The true coach has dry friction between frames and body, which the nominal vehicle has not, and
another contact, other primary springs and other dampers. No wheel-rail displacement is measured: a coach seldom has it.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.truth.coach import V_PLACES, Coach
from tests.truth.coach_campaign import (
    FLOOR,
    FLOOR_DEPTH,
    NOISE,
    RATE,
    WARM,
    Coaches,
    Order,
    _march,
    _sensed,
    drawn,
)
from tests.truth.coach_joints import row_at
from tests.truth.effects import Effect
from tests.truth.files import write_run
from tests.truth.laws import Array
from tests.truth.tracks import met, recorder_noise

SEED = 51
FRICTION = Effect("dry_friction", "secondary_lateral", None, {"force": 3e3, "slip_speed": 0.01})
SPEEDS = {"a": 45.0, "b": 34.0, "c": 40.0}  # m/s; the last run validates
SECONDS = 40.0
YAW_DAMPING = (60e3, 69e3)  # N*s/m of a yaw damper, nominal and true
SIDES = {"front": 1, "rear": 2}
UNITS = {"ay": "m/s^2", "fl": "m/s^2", "rf": "rad/s", "sw": "m"}
CHANNELS = (
    *(f"ay{n}" for n in (1, 2, 3, 4)),
    *(f"{quantity}_{side}" for quantity in ("ay", "rf", "swing") for side in SIDES),
    *FLOOR,
)


def true_coach() -> Coach:
    """The coach that was simulated."""
    coach = drawn(Order(SEED))
    return replace(coach, secondary_c=(YAW_DAMPING[1], *coach.secondary_c[1:]))


def sd_of(channel: str) -> float:
    """Standard deviation of the noise of a channel."""
    return NOISE[{"fl": "ay", "sw": "d"}.get(channel[:2], channel[:2])]


def write(folder: Path) -> None:
    """Simulate the three runs side by side and write them; vehicle.yaml and campaign.yaml are written by hand."""
    coach = true_coach()
    runs = [
        met(speed, SECONDS, 100 * SEED + i, "low", rate=RATE, before=WARM, spread=0.8)
        for i, speed in enumerate(SPEEDS.values())
    ]
    states, accelerations = _march(Coaches([coach] * len(runs), [(FRICTION,)] * len(runs)), runs)
    for k, letter in enumerate(SPEEDS):
        measured = _measured(coach, runs[k], states[:, :, k], accelerations[:, :, k], k)
        units = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad"} | {c: UNITS[c[:2]] for c in CHANNELS}
        write_run(folder / f"run_{letter}.csv.gz", measured, units)


def _measured(coach: Coach, run, states: Array, accelerations: Array, k: int) -> dict[str, Array]:  # type: ignore[no-untyped-def]
    """Columns of a run, with the noise of sensors and recorder."""
    rng, warm = np.random.default_rng([SEED, 13, k]), round(WARM * RATE)
    signals = _sensed(coach, run, states, accelerations)
    for side, number in SIDES.items():
        signals[f"swing_{side}"] = states[:, :V_PLACES] @ row_at(coach, "secondary_lateral", number)
    columns = {"t": run.t, "s": run.s, "v": run.v, "yw": run.yw, "phiw": run.phiw}
    columns |= {name: signals[name] + rng.normal(0.0, sd_of(name), len(run.t)) for name in CHANNELS}
    columns = {name: x[warm:] for name, x in columns.items()}
    return columns | {name: columns[name] + recorder_noise(columns["s"], 2e-5, 2.5, rng) for name in ("yw", "phiw")}


if __name__ == "__main__":
    assert FLOOR_DEPTH == 0.6  # as campaign.yaml says
    write(Path(sys.argv[1]))
