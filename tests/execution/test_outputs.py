"""Files of a search in its directory."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from railui.execution.lock import Lock, lock_holder
from railui.execution.session import Session, status
from railui.execution.threads import ThreadRunner
from railui.io.problems import FileProblems
from railui.optimisation.cases import cases_of
from railui.optimisation.evaluation import response_table
from railui.optimisation.optimise import optimise
from railui.optimisation.study_reader import load_study
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import load_design
from tests.execution.small import write_study


def test_the_files_are_read_back_and_the_knee_gives_the_result_of_the_search(tmp_path: Path) -> None:
    study, out = load_study(write_study(tmp_path, population=8, generations=2)), tmp_path / "out"
    with Session(study, out, ThreadRunner(2)) as session:
        document = optimise(study, evaluator=session.evaluator, progress=session.progress())
        session.finish(document)
    again, design = load_study(out / "study.yaml"), load_design(out / "knee.yaml")
    assert (again.variables, again.cases, again.objectives) == (study.variables, study.cases, study.objectives)
    assert [(c.key, c.bound) for c in again.constraints] == [("linear_damping", 0.02)]
    assert again.design.content() == study.design.content()
    knee = json.loads((out / "result.json").read_text("utf-8"))["pareto"][document["knee"]]
    table = response_table(cases_of(study), np.array([list(knee["variables"].values())]), ["flange_margin"])
    single = ride(design, study.cases.track[0], 40.0, seed=1)
    assert single["flange_margin"] == table.values["flange_margin"][0, 0]
    rows = list(csv.DictReader((out / "front.csv").read_text("utf-8").splitlines()))
    assert [row["design"] for row in rows][:2] == ["baseline", "0" if document["knee"] else "0, knee"]
    assert float(rows[1]["flange_margin worst [1]"]) == document["pareto"][0]["objectives"][1]
    fresh = document["pareto"][0]["fresh"]
    assert int(rows[1]["linear_damping >= 0.02, fresh sets met [1]"]) == fresh["met"][0]
    assert int(rows[1]["fresh sets failed [1]"]) == 0
    change = rows[1]["flange_margin worst, fresh minus baseline, standard error [1]"]
    assert float(change) == fresh["minus_baseline"]["standard_error"][1]
    assert status(out)["evaluations"] == document["evaluations"] == 16


def test_a_search_with_a_cache_gives_the_result_of_one_without(tmp_path: Path) -> None:
    study = load_study(write_study(tmp_path, population=8, generations=2))
    with Session(study, tmp_path / "out", ThreadRunner(2)) as session:
        cached = optimise(study, evaluator=session.evaluator)
    plain = optimise(study, jobs=1)
    assert {k: v for k, v in cached.items() if k != "seconds"} == {k: v for k, v in plain.items() if k != "seconds"}


def test_a_directory_with_foreign_files_is_refused(tmp_path: Path) -> None:
    study, out = load_study(write_study(tmp_path)), tmp_path / "out"
    out.mkdir()
    (out / "letter.txt").write_text("dear", "utf-8")
    with pytest.raises(FileProblems, match=r"letter\.txt"):
        Session(study, out, ThreadRunner(1))


def test_the_holder_of_a_directory_is_known_where_its_lock_may_only_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_file = Path.open

    def open_readable(path: Path, mode: str = "r", **options: Any) -> Any:
        if mode != "r":
            raise PermissionError(13, "Permission denied", str(path))
        return open_file(path, mode, **options)

    lock = Lock(tmp_path)
    monkeypatch.setattr(Path, "open", open_readable)
    holder = lock_holder(tmp_path)
    lock.release()
    assert holder is not None and holder.is_alive and holder.pid == os.getpid()
