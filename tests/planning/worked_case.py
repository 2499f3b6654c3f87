"""The worked case of docs/plan.md: one vehicle, one cost, two campaigns, of which the planned one finds the effect.

python -m tests.planning.worked_case
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import close_loop
from railui.report.loop.sentence import sentence
from tests.truth.campaign import RESPONSES, Order, campaign, write
from tests.truth.effects import effect

CUBIC = 15e3  # 1/m^2, of the conicity of worn wheels
SECONDS = 60.0


@dataclass(frozen=True)
class Version:
    """Sensors and speeds [m/s] of a campaign; the second run is for validation."""

    sensors: tuple[str, ...]
    speeds: tuple[float, float]


USUAL = Version(("ay1", "ayf"), (30.0, 25.0))
PLANNED = Version(("rf", "d1"), (40.0, 25.0))


@cache
def identify(version: Version, seed: int = 5) -> tuple[str, str]:
    """Simulate the campaign of a vehicle with worn wheels, and return the verdict of the loop and its sentence."""
    order = Order(
        effects=(effect("nonlinear_conicity", "contact", None, cubic=CUBIC),),
        seed=seed,
        speeds=version.speeds,
        seconds=(SECONDS, SECONDS),
        without=[c for c in RESPONSES if c not in version.sensors],
    )
    with tempfile.TemporaryDirectory() as folder:
        write(campaign(order), Path(folder))
        result = close_loop(read_dataset(load_campaign(folder)), jobs=2)
    return str(result.verdict), sentence(result)


if __name__ == "__main__":
    for version in (USUAL, PLANNED):
        print(" ".join(version.sensors), version.speeds, *identify(version))
