"""Selection of sensors and runs: the budget holds, each step gains, the best pair starts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import pytest

from railui.planning.expectation import Choice, Expectation
from railui.planning.plan import Plan, candidate_runs, plan_document, plan_of_runs
from railui.planning.plan_file import PlanFile
from railui.planning.selection import attained_share, reference
from tests.planning.files import plan_file

NOISE = {"ayf": "0.02 m/s^2", "rf": "0.3 mrad/s", "ay1": "0.05 m/s^2"}


def made(file: PlanFile, speeds: Sequence[float], *, seed: int | None = None, jobs: int | None = None) -> Plan:
    runs = candidate_runs(file, speeds, ["erri_b176_low seed=3"], 20.0, seed)
    return plan_of_runs(file, runs, seed=seed, jobs=jobs)


@cache
def plan(more: str = "") -> Plan:
    return made(plan_file(NOISE, more), [25.0, 32.0, 40.0], jobs=2)


def test_without_a_budget_every_step_gains() -> None:
    steps = plan().steps
    shares = [step.share for step in steps]
    assert shares == sorted(shares) and len(set(shares)) == len(shares)
    assert 0.0 < shares[0] < shares[-1] <= 1.0
    costs = [step.cost for step in steps]
    assert costs[0] == 3.0  # one sensor and two runs
    assert costs == sorted(costs)


def test_the_first_step_is_the_best_sensor_and_pair_of_runs() -> None:
    found = plan()
    best = reference(found.everything)
    first = found.steps[0]

    def share(choice: Choice) -> float:
        critical = found.everything.critical_score
        campaign = found.file.campaign
        expected = Expectation(
            found.information, choice, campaign.settings, campaign.min_relative_gain, critical_score=critical
        )
        return attained_share(expected, best)

    others = [share(Choice((c,), (a,), b)) for c in found.file.sensors for a in range(3) for b in range(3) if a != b]
    assert first.share == pytest.approx(max(others))


def test_the_cost_stays_within_the_budget() -> None:
    found = plan("costs: {run: 2, ay1: 10}\nbudget: 6.5\n")
    assert found.steps[-1].cost <= 6.5
    assert "ay1" not in found.steps[-1].choice.channels
    assert len(found.steps[-1].choice.channels) == 2


def test_a_budget_for_nothing_is_noted_and_shows_what_everything_detects() -> None:
    found = plan("budget: 2\n")
    assert found.steps == () and found.chosen is None
    document = plan_document(found)
    assert document["selected"] is None and "the budget does not cover one sensor" in document["notes"][0]
    row = next(r for r in document["detectable"] if (r["kind"], r["at"]) == ("dry_friction", "secondary_lateral"))
    assert row["value"] == row["with_everything"]


def test_an_effect_of_a_sensor_that_is_not_selected_has_no_limit() -> None:
    document = plan_document(plan("costs: {ay1: 10}\nbudget: 5\n"))
    assert document["selected"]["sensors"] == ["ayf", "rf"]
    (row,) = [r for r in document["detectable"] if (r["kind"], r["at"]) == ("sensor_gain", "ay1")]
    assert row["value"] is None and row["with_everything"] is not None


def test_unstable_speeds_are_left_out_and_named() -> None:
    file = plan_file({"ayf": "0.02 m/s^2"})
    found = made(file, [25.0, 35.0, 110.0], jobs=2)
    assert found.unstable == ("110 m/s",)
    assert plan_document(found)["notes"] == ["left out: the nominal vehicle is unstable at 110 m/s"]
    with pytest.raises(ValueError, match=r"two are needed.*unstable at 110 m/s"):
        made(file, [35.0, 110.0])


def test_a_plan_is_the_same_on_any_number_of_threads() -> None:
    file = plan_file({"ayf": "0.02 m/s^2"})
    one, two = (plan_document(made(file, [30.0, 40.0], seed=3, jobs=jobs)) for jobs in (1, 2))
    assert one == two
