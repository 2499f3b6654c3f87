"""Every kind of search finds what the others find."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.optimisation.optimise import optimise
from railui.optimisation.study import Study, load_study

BOGIE = Path(__file__).parents[2] / "designs/test_bogie.yaml"
DAMPING = "vehicle.secondary.yaw_damping"
LATERAL = "vehicle.secondary.lateral_damping"
CASES = "cases: {track: [erri_b176_low length=300], speed: [40 m/s], seed: [1], scenario: [{}]}\n"


def study(home: Path, variables: str, objectives: str, method: str) -> Study:
    path = home / "study.yaml"
    path.write_text(
        f"name: kinds\nvehicle: {BOGIE}\nvariables: {{{variables}}}\n{CASES}"
        f"objectives: [{objectives}]\nmethod: {{{method}, seed: 1}}\n",
        "utf-8",
    )
    return load_study(path)


TWO = f"{DAMPING}: [5e3, 200e3], {LATERAL}: [10e3, 60e3]"
SMOOTH = "{minimise: weighted_acceleration, over: mean}"


def best(home: Path, variables: str, method: str) -> float:
    found = optimise(study(home, variables, SMOOTH, method))
    assert found["failed"] == 0
    least = min(row["objectives"][0] for row in found["pareto"])
    assert least < found["baseline"]["objectives"][0]
    return float(least)


def test_cmaes_and_differential_evolution_find_the_same_least_acceleration(tmp_path: Path) -> None:
    by_cmaes = best(tmp_path, TWO, "kind: cmaes, population: 16, generations: 12")
    by_de = best(tmp_path, TWO, "kind: de, population: 16, generations: 12")
    scattered = best(tmp_path, TWO, "kind: de, population: 256, generations: 2")
    assert by_cmaes == pytest.approx(by_de, rel=0.01)
    assert by_cmaes <= scattered * 1.001


def test_three_aims_give_a_front_in_which_nobody_beats_another(tmp_path: Path) -> None:
    aims = f"{SMOOTH}, {{maximise: flange_margin, over: worst}}, {{maximise: linear_damping, over: worst}}"
    found = optimise(study(tmp_path, TWO, aims, "kind: nsga3, population: 24, generations: 4"))
    signs = np.array([1.0, -1.0, -1.0])
    front = np.array([row["objectives"] for row in found["pareto"]]) * signs
    assert len(front) > 3
    for i, one in enumerate(front):
        beaten = np.all(front <= one, axis=1) & np.any(front < one, axis=1)
        assert not beaten.any(), i
