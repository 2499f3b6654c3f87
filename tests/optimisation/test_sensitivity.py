"""What the results hang on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import ResponseTable, evaluate_in_process
from railui.optimisation.sensitivity import one_at_a_time, sobol
from railui.optimisation.study import load_study
from railui.ride_quality.evaluation import ride
from tests.execution.small import write_study


def test_a_change_is_that_of_the_ride_between_its_two_neighbours(tmp_path: Path) -> None:
    one = load_study(write_study(tmp_path, length=200))
    x = np.array([3e4, 2e4])
    rows = {row["path"]: row for row in one_at_a_time(one, cases_of(one), x, evaluate_in_process(1))}
    values = dict(zip([v.path for v in one.variables], x, strict=True))

    def margin(path: str, factor: float) -> float:
        base = one.design.with_values(values)
        rides = []
        for scenario in one.cases.scenario:
            design = base.with_values(scenario)
            design = design.with_values({path: factor * design.value(path)})
            rides += [ride(design, one.cases.track[0], 40.0, seed=s)["flange_margin"] for s in (1, 2)]
        return float(min(rides))

    for path in ("vehicle.frame.mass", "contact.leading.conicity", "contact.flange_clearance"):
        assert rows[path]["objectives"][1] == pytest.approx(margin(path, 1.05) - margin(path, 0.95), rel=1e-9)
    assert rows["contact.flange_clearance"]["objectives"][0] == 0.0  # comfort knows no flange
    assert rows["contact.flange_clearance"]["objectives"][1] > 0


def test_sobols_indices_of_a_product_are_those_of_its_formula(tmp_path: Path) -> None:
    one = load_study(write_study(tmp_path, length=200))

    def product(cases: object, rows: list[np.ndarray], keys: list[str]) -> ResponseTable:  # type: ignore[type-arg]
        columns = [cases_[0].vehicle.model.columns[v.path] for v in one.variables]
        u = [
            (np.log(rows[0][:, columns[0]]) - np.log(5e3)) / np.log(40.0),
            (rows[0][:, columns[1]] - 10e3) / 50e3,
        ]
        values = np.repeat((u[0] * u[1])[:, None], len(rows), axis=1)
        return ResponseTable(
            {key: values for key in keys}, np.ones_like(values), np.full(values.shape, "", dtype=object)
        )

    cases_ = cases_of(one)
    found = sobol(one, cases_, product, 1024)  # type: ignore[arg-type]
    # f = u v of even u, v: V_u = 1/48, V = 7/144, so first 3/7 and total 4/7
    for row in found["variables"]:
        assert row["first"][0] == pytest.approx(3 / 7, abs=0.03) and row["total"][0] == pytest.approx(4 / 7, abs=0.03)
