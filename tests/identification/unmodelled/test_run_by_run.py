"""Differences between the estimation runs: the parameter that differs, and that no parameter is fitted elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import chain, islice

import pytest

from railui.identification.context import create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.validation import validate
from railui.identification.unmodelled.run_by_run import RunDifference, find_run_difference
from railui.identification.unmodelled.run_difference import difference_between_estimation_runs
from tests.blind.simulated import recorded
from tests.identification.unmodelled.test_run_dependence import ADEQUATE, Case, Scenario
from tests.truth.campaign import Campaign, campaigns

CASES: dict[str, tuple[Mapping[str, float], ...]] = {
    "worn rails": ({}, {"lam": 1.15}, {}),
    "worn rails and a stronger damper": ({}, {"lam": 1.3, "k_y": 2.0}, {}),
    "worn rails on two runs": ({}, {"lam": 1.15}, {"lam": 1.15}),
    "one vehicle": ({}, {}, {}),
}
CONICITIES = {f"contact.{w}.conicity" for w in ("leading", "trailing")}


@cache
def simulated() -> dict[str, list[Campaign]]:
    """Simulate the campaigns of all cases side by side."""
    orders = {name: Scenario(runs, (40.0, 31.0, 35.0)).orders() for name, runs in CASES.items()}
    parts = iter(campaigns(list(chain.from_iterable(orders.values()))))
    return {name: list(islice(parts, len(of_case))) for name, of_case in orders.items()}


def case(name: str) -> Case:
    """Calibrate on two estimation runs, of which the vehicles may differ; the last is the validation run."""
    parts = simulated()[name]
    selected = {letter: part.runs[letter] for part, letter in zip(parts, "abc", strict=True)}
    dataset = recorded(replace(parts[0], runs=selected))
    roles: Sequence[str] = ("adjust", "adjust", "validate")
    segments = tuple(replace(s, role=roles[s.run_index]) for s in dataset.segments)
    context = create_context(replace(dataset, segments=segments), jobs=2)
    return Case(context, calibrate(context))


def difference(of: Case) -> RunDifference | None:
    return find_run_difference(of.context, of.fit)


def test_the_conicity_of_one_estimation_run_differs() -> None:
    worn = case("worn rails")
    found = difference(worn)
    assert found is not None and found.dependence is not None and set(found.dependence.ratios) == CONICITIES
    a, b, c = found.dependence.runs
    assert b.value / a.value == pytest.approx(1.15, rel=0.02) and c.value == a.value
    common = validate(worn.context, worn.fit.model, worn.dataset.selection)
    assert found.validation.nrmse < 0.5 * common.nrmse
    discrepancy = difference_between_estimation_runs(
        worn.context, worn.fit, common, found.validation.nrmse / ADEQUATE * 1.05
    )
    assert discrepancy is not None and (discrepancy.at, discrepancy.wheelset) == ("contact", None)
    assert discrepancy.validation is common  # of the calibrated model


def test_the_dependence_is_validated_with_its_parameter_alone_apart() -> None:
    """The validation run is as the shorter estimation run, of which all other parameters are those of the longer."""
    worn = case("worn rails on two runs")
    found = difference(worn)
    assert found is not None and found.dependence is not None and set(found.dependence.ratios) == CONICITIES
    alone, apart = found.dependence.validation.nrmse, found.validation.nrmse
    assert alone != apart and alone == pytest.approx(apart, rel=0.1)
    assert alone < 0.5 * validate(worn.context, worn.fit.model, worn.dataset.selection).nrmse


def test_runs_that_differ_in_more_than_one_parameter_name_none() -> None:
    found = difference(case("worn rails and a stronger damper"))
    assert found is not None and found.dependence is None


def test_runs_of_one_vehicle_do_not_differ() -> None:
    assert difference(case("one vehicle")) is None
