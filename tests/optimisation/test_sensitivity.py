"""Sensitivities of a design and of the objectives."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import pytest

from railui.optimisation.cases import Case, cases_of
from railui.optimisation.evaluation import ResponseTable, evaluate_in_process
from railui.optimisation.sensitivity import one_at_a_time, sobol
from railui.optimisation.sobol_intervals import index_intervals, width_warnings
from railui.optimisation.study_reader import load_study
from railui.ride_quality.evaluation import ride
from tests.execution.small import write_study
from tests.optimisation.studies import small_study


def test_a_sensitivity_is_the_difference_of_two_perturbed_simulations(tmp_path: Path) -> None:
    study = load_study(write_study(tmp_path, length=200))
    x = np.array([3e4, 2e4])
    rows = {row["path"]: row for row in one_at_a_time(study, cases_of(study), x, evaluate_in_process(1))}
    values = dict(zip([v.path for v in study.variables], x, strict=True))

    def worst_margin(path: str, factor: float) -> float:
        margins = []
        for scenario in study.cases.scenario:
            design = study.design.with_values(values).with_values(scenario)
            design = design.with_values({path: factor * design.value(path)})
            margins += [ride(design, study.cases.track[0], 40.0, seed=s)["flange_margin"] for s in (1, 2)]
        return float(min(margins))

    for path in ("vehicle.frame.mass", "contact.leading.conicity", "contact.flange_clearance"):
        difference = worst_margin(path, 1.05) - worst_margin(path, 0.95)
        assert rows[path]["objectives"][1] == pytest.approx(difference, rel=1e-9)
    assert rows["contact.flange_clearance"]["objectives"][0] == 0.0  # comfort does not depend on the clearance
    assert rows["contact.flange_clearance"]["objectives"][1] > 0


def test_sobol_indices_of_a_product_equal_the_analytical_ones(tmp_path: Path) -> None:
    study = load_study(write_study(tmp_path, length=200))
    cases = cases_of(study)
    columns = [cases[0].vehicle.model.columns[v.path] for v in study.variables]

    def product(_: Sequence[Case], rows: Sequence[np.ndarray], keys: Collection[str]) -> ResponseTable:
        u = (np.log(rows[0][:, columns[0]]) - np.log(5e3)) / np.log(40.0)
        v = (rows[0][:, columns[1]] - 10e3) / 50e3
        values = np.repeat((u * v)[:, None], len(rows), axis=1)
        reasons = np.full(values.shape, "", dtype=object)
        return ResponseTable(dict.fromkeys(keys, values), np.ones_like(values), reasons)

    indices = sobol(study, cases, product, 1024)
    # f = u v with uniform u, v: V_u = 1/48, V = 7/144, so first 3/7 and total 4/7
    for row in indices["variables"]:
        assert row["first"][0] == pytest.approx(3 / 7, abs=0.03)
        assert row["total"][0] == pytest.approx(4 / 7, abs=0.03)
        for key, exact in (("first", 3 / 7), ("total", 4 / 7)):
            low, high = row[f"{key}_interval"][0]
            assert low < exact < high and 0.05 < high - low < 0.25
    assert indices["confidence"] == 0.95 and not width_warnings(indices)
    few = sobol(study, cases, product, 32)
    widths = [high - low for row in few["variables"] for low, high in row["first_interval"]]
    (warning,) = width_warnings(few)
    assert max(widths) > 0.3 and "give more samples than 32, such as --samples 128" in warning
    assert few == sobol(study, cases, product, 32)  # the resamples have a seed


def test_intervals_contain_the_index_about_as_often_as_stated() -> None:
    rng, trials, hits = np.random.default_rng(4), 60, np.zeros((2, 2))
    exact = np.array([[0.2, 0.8], [0.2, 0.8]])  # f = u + 2 v: no interaction
    for seed in range(trials):
        a, b = rng.random((2, 128)), rng.random((2, 128))
        mixed = [np.stack([b[0], a[1]]), np.stack([a[0], b[1]])]
        f, g, *h = ((u + 2 * v)[None] for u, v in (a, b, *mixed))
        low, high = index_intervals(f, g, np.stack(h), seed).swapaxes(0, 1)[:, :, 0]
        hits += (low < exact) & (exact < high)
    assert (hits / trials > 0.87).all()  # 0.95; 0.87 is three standard deviations of 60 trials below


def test_an_objective_that_does_not_vary_has_no_intervals() -> None:
    constant = np.ones((1, 16))
    assert np.isnan(index_intervals(constant, constant, np.ones((2, 1, 16)), 1)).all()


ONE = "[{minimise: weighted_acceleration, over: mean}]"
ONE_VARIABLE = "{vehicle.secondary.yaw_damping: [5 kN*m*s/rad, 200 kN*m*s/rad]}"


@pytest.mark.parametrize(
    "parts", [{"objectives": ONE}, {"variables": ONE_VARIABLE}, {"objectives": ONE, "variables": ONE_VARIABLE}]
)
def test_sobol_indices_of_one_objective_or_one_variable(tmp_path: Path, parts: dict[str, str]) -> None:
    study = small_study(tmp_path, **parts)
    cases = cases_of(study)
    columns = [cases[0].vehicle.model.columns[v.path] for v in study.variables]

    def total(_: Sequence[Case], rows: Sequence[np.ndarray], keys: Collection[str]) -> ResponseTable:
        values = np.repeat(np.log(rows[0][:, columns]).sum(axis=1)[:, None], len(rows), axis=1)
        reasons = np.full(values.shape, "", dtype=object)
        return ResponseTable(dict.fromkeys(keys, values), np.ones_like(values), reasons)

    indices = sobol(study, cases, total, 256)
    assert [v["path"] for v in indices["variables"]] == [v.path for v in study.variables]
    for row in indices["variables"]:
        assert len(row["first"]) == len(row["total"]) == len(study.objectives)
    assert sum(row["first"][0] for row in indices["variables"]) == pytest.approx(1.0, abs=0.05)
