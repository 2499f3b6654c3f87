"""A small study on disk, searched by the command in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"
STUDY = """\
name: small
vehicle: {vehicle}
variables:
  vehicle.secondary.yaw_damping: [5 kN*m*s/rad, 200 kN*m*s/rad]
  vehicle.secondary.lateral_damping: [10e3, 60e3]
cases:
  track: [erri_b176_low length={length}]
  speed: [40 m/s]
  seed: [1, 2]
  scenario: [{{}}, {{contact.leading.conicity: 0.3, contact.trailing.conicity: 0.3}}]
objectives: [{{minimise: weighted_acceleration, over: mean}}, {{maximise: flange_margin, over: worst}}]
constraints: ["linear_damping >= 0.02"]
method: {{population: {population}, generations: {generations}, seed: 1}}
"""


def write_study(
    directory: Path, length: int = 300, population: int = 16, generations: int = 4, vehicle: Path = BOGIE
) -> Path:
    """Write a study file."""
    path = directory / "study.yaml"
    text = STUDY.format(length=length, population=population, generations=generations, vehicle=vehicle)
    path.write_text(text, "utf-8")
    return path


def railui(*arguments: object) -> list[str]:
    """Return the command line of a railui process."""
    return [sys.executable, "-m", "railui", *map(str, arguments)]


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a railui process to its end."""
    return subprocess.run(railui(*arguments), capture_output=True, text=True, timeout=240)


def result(directory: Path) -> dict[str, Any]:
    """Read the result of a search without its duration and inputs."""
    document: dict[str, Any] = json.loads((directory / "result.json").read_text("utf-8"))
    return {key: value for key, value in document.items() if key not in ("seconds", "inputs")}
