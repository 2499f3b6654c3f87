"""The next run: rivals of a loop, the chance that a run separates them, and the decision on a measured one."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.identification.context import Context
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.identification.structure.candidates import Candidate
from railui.planning.after import FinishedLoop, propose_runs
from railui.planning.decision import decide
from railui.planning.next_run import NextRun, equivalent_rivals, next_runs
from railui.planning.planned_runs import planned_runs, simulate_runs
from railui.planning.rivals import RivalModel, read_rivals, rival_models, rival_records, undecided, weak_effects
from railui.vehicle.effects import PlacedEffect
from tests.blind.simulated import simulated_campaign

SENSORS = ("ayf", "rf")
RUNS = planned_runs([30.0, 40.0], ["erri_b176_low seed=8"], 25.0)


def context() -> Context:
    return simulated_campaign().context


def rivals(stiffness: float) -> list[RivalModel]:
    """Return the nominal model and one with a spring across the secondary suspension, both known exactly."""
    model = context().nominal
    paths = ("vehicle.primary.lateral_stiffness",)
    none = np.zeros((1, 1))
    spring = PlacedEffect("spring", "secondary_lateral", None, {"stiffness": stiffness})
    return [
        RivalModel(None, model, paths, none),
        RivalModel(Candidate("spring", "secondary_lateral", None), model.with_effect(spring), paths, none),
    ]


def best(stiffness: float, **options: object) -> NextRun:
    return next_runs(context(), rivals(stiffness), RUNS, SENSORS, **options)[0]  # type: ignore[arg-type]


def test_a_large_difference_is_decided_and_a_small_one_is_not() -> None:
    assert best(1e6).probability > 0.99
    assert best(1e2).probability < 0.2
    assert best(1e2).prospects[0].z < best(1e5).prospects[0].z < best(1e6).prospects[0].z


def test_the_runs_in_which_the_rivals_differ_most_are_the_best() -> None:
    runs = planned_runs([20.0, 27.0, 34.0, 41.0, 48.0], ["erri_b176_low seed=8"], 25.0)
    every = next_runs(context(), rivals(4e4), runs, SENSORS)
    assert every[0].probability > every[-1].probability + 0.1
    found = next_runs(context(), rivals(4e4), runs, SENSORS, most=2)
    assert [r.run.name for r in found] == [r.run.name for r in every[:2]]
    assert [r.probability for r in found] == [r.probability for r in every[:2]]


def test_rivals_that_differ_in_a_run_that_is_not_assessed_are_not_equivalent() -> None:
    settings = context().settings.planning
    near, far = (factor * settings.equivalent_difference * (1.0 - np.eye(2)) for factor in (0.5, 1.5))
    assessed = [cast(Any, SimpleNamespace(differences=near, chance=np.full((2, 2), 0.1)))]
    assert equivalent_rivals(assessed, settings)[0, 1]
    assert not equivalent_rivals(assessed, settings, [near, far])[0, 1]


def test_uncertain_parameters_lower_the_chance() -> None:
    sure = rivals(1.2e5)
    wide = [replace(r, covariance=np.array([[(0.02 * r.values()[0]) ** 2]])) for r in sure]
    chances = [next_runs(context(), r, RUNS, SENSORS)[0].probability for r in (sure, wide)]
    assert chances[1] < chances[0]


def test_each_further_sensor_is_assessed_with_every_run() -> None:
    found = next_runs(context(), rivals(3e4), RUNS, ("ayf",), ("rf", "d1"))
    assert {run.sensors for run in found} == {("ayf",), ("ayf", "rf"), ("ayf", "d1")}
    assert len(found) == 3 * len(RUNS)
    assert [r.probability for r in found] == sorted((r.probability for r in found), reverse=True)


@pytest.mark.parametrize(("true", "sign"), [(0, 1), (1, -1)])
def test_a_measured_run_decides_for_the_model_that_made_it(true: int, sign: int) -> None:
    models = rivals(6e5)
    (segment,) = simulate_runs(context().campaign, models[true].model, RUNS[:1], SENSORS).segments
    rng = np.random.default_rng(7)
    noise = context().noise.draw(SENSORS, segment.samples, segment.dt, rng)
    columns = {**segment.columns, **{c: segment.columns[c] + x for c, x in zip(SENSORS, noise, strict=True)}}
    (decision,) = decide(context(), models, [replace(segment, columns=columns, tables={})])
    assert decision.is_clear and np.sign(decision.z) == sign


@cache
def finished(*effects: str) -> LoopResult:
    return close_loop(simulated_campaign(*effects).dataset, jobs=2)


def test_the_final_model_leads_and_the_rivals_are_read_back_as_written() -> None:
    result = finished("free_play at=primary_lateral half_width=0.3e-3")
    found = rival_models(result)
    assert (found[0].key["kind"], found[0].z) == ("free_play", 0.0)
    assert all(r.candidate != found[0].candidate for r in found[1:])
    assert [r.z for r in found[1:]] == sorted(r.z for r in found[1:])
    settings = result.context.settings.planning
    records = json.loads(json.dumps(rival_records(found, result.nominal, settings)))
    assert [r["undecided"] for r in records] == [False, *(r.z < settings.critical_z for r in found[1:])]
    for mine, read in zip(found, read_rivals(records, result.nominal), strict=True):
        assert read.key == mine.key and read.paths == mine.paths
        assert np.array_equal(read.values(), mine.values())
        assert np.allclose(read.covariance, mine.covariance, rtol=1e-12, atol=0.0)
        assert read.model.effects == mine.model.effects


def test_without_an_effect_the_rivals_are_weak_effects_to_first_order() -> None:
    result = finished()
    assert result.verdict == "none"
    found = rival_models(result)
    assert found[0].candidate is None
    weak = [r for r in found[1:] if len(r.model.effects) > len(result.nominal.effects)]
    assert weak and all(r.z < 0.0 for r in weak)
    assert undecided(found, result.context.settings.planning) == found


def test_a_weak_effect_below_the_range_of_its_parameter_is_no_rival() -> None:
    result = finished()
    settings = replace(result.context.settings.planning, weak_effect_score=0.0)
    flange = [replace(s, rho=0.1) for s in result.score_test.best if s.candidate.kind == "flange_contact"]
    strong = [replace(s, amount=abs(s.amount)) for s in flange]
    assert weak_effects(result.after, strong, settings)
    assert weak_effects(result.after, [replace(s, amount=1e-9 * s.amount) for s in strong], settings) == []


def test_a_chance_with_some_sensors_does_not_depend_on_the_sensors_that_might_be_added() -> None:
    alone = next_runs(context(), rivals(3e4), RUNS, ("ayf",))
    beside_others = [
        r for r in next_runs(context(), rivals(3e4), RUNS, ("ayf",), ("rf", "d1")) if r.sensors == ("ayf",)
    ]
    chances = {r.run.name: r.probability for r in alone}
    for run in beside_others:
        assert run.probability == pytest.approx(chances[run.run.name], rel=1e-6)


def spring_and_stop(gap: float) -> list[RivalModel]:
    """Return a spring, a stop of the same stiffness behind a gap [m], and neither."""
    model = context().nominal
    paths, none = ("vehicle.primary.lateral_stiffness",), np.zeros((1, 1))
    at = ("secondary_lateral", None)
    spring = PlacedEffect("spring", *at, {"stiffness": 6e5})
    stop = PlacedEffect("bump_stop", *at, {"stiffness": 6e5, "gap": gap})
    return [
        RivalModel(Candidate("spring", *at), model.with_effect(spring), paths, none),
        RivalModel(Candidate("bump_stop", *at), model.with_effect(stop), paths, none),
        RivalModel(None, model, paths, none),
    ]


def test_rivals_of_one_motion_count_as_one_and_do_not_lower_the_chance() -> None:
    found = next_runs(context(), spring_and_stop(1e-6), RUNS, SENSORS)
    assert [p.is_equivalent for p in found[0].prospects] == [True, False]
    assert found[0].probability > 0.99
    two = next_runs(context(), spring_and_stop(1e-6)[:2], RUNS, SENSORS)
    assert [r.probability for r in two] == [0.0] * len(RUNS)


def test_a_stop_with_a_clearance_is_not_the_spring() -> None:
    found = next_runs(context(), spring_and_stop(2e-3), RUNS, SENSORS)
    assert not any(p.is_equivalent for p in found[0].prospects)
    assert found[0].probability > 0.9


def test_a_load_state_is_a_run_of_its_own_with_the_values_of_the_state() -> None:
    rival = rivals(6e5)[1]
    laden = replace(rival.model.design, load_states={"laden": {"vehicle.frame.mass": 5000.0}})
    rival = replace(rival, model=replace(rival.model, design=laden))
    assert rival.in_load_state("laden").model.value("vehicle.frame.mass") == 5000.0
    assert rival.in_load_state("laden").model.effects == rival.model.effects
    assert rival.in_load_state(None) is rival
    with pytest.raises(ValueError, match="no load state 'empty'"):
        rival.in_load_state("empty")
    runs = planned_runs([30.0], ["erri_b176_low seed=8"], 25.0, loads=("laden",))
    assert [r.name for r in runs] == ["30 m/s, laden"]
    plain = replace(context().nominal.design, load_states=laden.load_states)
    other = replace(rivals(0.0)[0], model=replace(context().nominal, design=plain))
    (found,) = next_runs(context(), [other, rival], runs, SENSORS)
    assert found.probability > 0.9


def test_no_effect_is_decided_for_though_the_effect_could_shrink_to_nothing() -> None:
    plain, spring = rivals(6e5)
    path = "effects.0.stiffness"
    free = replace(spring, paths=(*spring.paths, path), covariance=np.diag([0.0, 1e5**2]))
    (found,) = next_runs(context(), [plain, free], RUNS[1:], SENSORS)
    assert found.probability > 0.9


def test_a_speed_at_which_a_rival_is_unstable_is_left_out(tmp_path: Path) -> None:
    loop = FinishedLoop(context(), tuple(rivals(6e5)), tmp_path)
    track = ["erri_b176_low seed=8"]
    (found,) = propose_runs(loop, [40.0, 90.0], track, 12.0)
    assert found.run.name == "40 m/s"
    with pytest.raises(ValueError, match=r"unstable at every speed \(90 m/s\)"):
        propose_runs(loop, [90.0], track, 12.0)
