"""What a search leaves in its directory."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from railui.execution.session import Session
from railui.execution.threads import ThreadRunner
from railui.io.problems import FileProblems
from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import response_table
from railui.optimisation.optimise import optimise
from railui.optimisation.study import load_study
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import load_design
from tests.execution.small import write_study


def test_the_outcome_is_read_back_and_the_knee_rides_as_it_was_judged(tmp_path: Path) -> None:
    one, out = load_study(write_study(tmp_path, population=8, generations=2)), tmp_path / "out"
    with Session(one, out, ThreadRunner(2)) as session:
        found = optimise(one, evaluator=session.evaluator, watch=session.watch)
        session.finish(found)
    again, design = load_study(out / "study.yaml"), load_design(out / "knee.yaml")
    assert (again.variables, again.cases, again.objectives) == (one.variables, one.cases, one.objectives)
    assert [(c.key, c.bound) for c in again.constraints] == [("linear_damping", 0.02)]
    assert again.design.resolved() == one.design.resolved()
    best = json.loads((out / "result.json").read_text("utf-8"))["pareto"][found["knee"]]
    numbers = response_table(cases_of(one), np.array([list(best["variables"].values())]), ["flange_margin"])
    case = ride(design, one.cases.track[0], 40.0, seed=1)
    assert case["flange_margin"] == numbers.values["flange_margin"][0, 0]
    rows = list(csv.DictReader((out / "front.csv").read_text("utf-8").splitlines()))
    assert [row["design"] for row in rows][:2] == ["baseline", "0" if found["knee"] else "0, knee"]
    assert float(rows[1]["flange_margin worst [1]"]) == found["pareto"][0]["objectives"][1]


def test_a_search_answered_from_a_store_is_the_search_without_one(tmp_path: Path) -> None:
    one = load_study(write_study(tmp_path, population=8, generations=2))
    with Session(one, tmp_path / "out", ThreadRunner(2)) as session:
        stored = optimise(one, evaluator=session.evaluator)
    plain = optimise(one, jobs=1)
    assert {k: v for k, v in stored.items() if k != "seconds"} == {k: v for k, v in plain.items() if k != "seconds"}


def test_a_directory_with_foreign_files_is_refused(tmp_path: Path) -> None:
    one, out = load_study(write_study(tmp_path)), tmp_path / "out"
    out.mkdir()
    (out / "letter.txt").write_text("dear", "utf-8")
    with pytest.raises(FileProblems, match=r"letter\.txt"):
        Session(one, out, ThreadRunner(1))
