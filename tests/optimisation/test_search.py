"""Every search method finds a better design."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.optimisation.optimise import optimise
from railui.optimisation.search import SearchState
from railui.progress import Progress
from tests.optimisation.studies import small_study

CASES = "{track: [erri_b176_low length=300], speed: [40 m/s], seed: [1], scenario: [{}]}"
ACCELERATION = "{minimise: weighted_acceleration, over: mean}"


def least_acceleration(directory: Path, method: str) -> float:
    study = small_study(directory, cases=CASES, constraints="[]", objectives=f"[{ACCELERATION}]", method=method)
    result = optimise(study)
    assert result["failed"] == 0
    least = min(design["objectives"][0] for design in result["pareto"])
    assert least < result["baseline"]["objectives"][0]
    return float(least)


def test_cmaes_and_differential_evolution_find_the_same_least_acceleration(tmp_path: Path) -> None:
    cmaes = least_acceleration(tmp_path, "{kind: cmaes, population: 16, generations: 12, seed: 1}")
    evolution = least_acceleration(tmp_path, "{kind: de, population: 16, generations: 12, seed: 1}")
    random_search = least_acceleration(tmp_path, "{kind: de, population: 256, generations: 2, seed: 1}")
    assert cmaes == pytest.approx(evolution, rel=0.01)
    assert cmaes <= random_search * 1.001


def test_no_design_on_a_front_of_three_objectives_dominates_another(tmp_path: Path) -> None:
    more = "{maximise: flange_margin, over: worst}, {maximise: linear_damping, over: worst}"
    method = "{kind: nsga3, population: 24, generations: 4, seed: 1}"
    objectives = f"[{ACCELERATION}, {more}]"
    result = optimise(small_study(tmp_path, cases=CASES, constraints="[]", objectives=objectives, method=method))
    front = np.array([design["objectives"] for design in result["pareto"]]) * [1.0, -1.0, -1.0]
    assert len(front) > 3
    for i, design in enumerate(front):
        dominated = np.all(front <= design, axis=1) & np.any(front < design, axis=1)
        assert not dominated.any(), i


def test_progress_receives_the_state_after_every_generation(tmp_path: Path) -> None:
    messages: list[str] = []
    states: list[SearchState] = []

    class Recorder(Progress):
        def message(self, text: str) -> None:
            messages.append(text)

        def event(self, event: object) -> None:
            assert isinstance(event, SearchState)
            states.append(event)

    result = optimise(small_study(tmp_path, cases=CASES), progress=Recorder())
    assert [state.activity for state in states] == messages
    assert messages[0].startswith("generation 1 of 3: 8 designs, 0 failed")
    assert [state.evaluations for state in states[:3]] == [8, 16, 24]
    assert messages[2].endswith(f", {result['nondominated']} on the front")
