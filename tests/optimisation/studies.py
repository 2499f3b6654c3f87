"""Small studies on disk for the tests of the search."""

from __future__ import annotations

from pathlib import Path

from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study

HOME = Path(__file__).parents[2]
BOGIE = HOME / "designs/test_bogie.yaml"
CHECK_BOGIE = HOME / "designs/check_bogie.yaml"
TEXT = """\
name: small
vehicle: {vehicle}
variables: {variables}
cases: {cases}
objectives: {objectives}
constraints: {constraints}
method: {method}
"""
DEFAULTS = {
    "variables": "{vehicle.secondary.yaw_damping: [5 kN*m*s/rad, 200 kN*m*s/rad], "
    "vehicle.secondary.lateral_damping: [10e3, 60e3]}",
    "cases": "{track: [erri_b176_low length=300], speed: [40 m/s], seed: [1, 2], "
    "scenario: [{}, {contact.leading.conicity: 0.3, contact.trailing.conicity: 0.3}]}",
    "objectives": "[{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]",
    "constraints": '["linear_damping >= 0.02"]',
    "method": "{kind: nsga2, population: 8, generations: 3, seed: 1}",
}


def small_study(directory: Path, vehicle: Path | str = BOGIE, **parts: str) -> Study:
    """Write and read a study; `parts` replace the defaults."""
    path = directory / "study.yaml"
    path.write_text(TEXT.format(**DEFAULTS | parts, vehicle=vehicle), "utf-8")
    return load_study(path)
