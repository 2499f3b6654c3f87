"""Texts of the desk on results: independent test, rivals, multiple shooting, loss of stability."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from railui.desk.presenters.critical_speeds import critical_speeds_text
from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_plots import force_plot
from railui.desk.presenters.loop_text import multiple_shooting_note, run_text
from railui.desk.presenters.stability_plots import cycles_plot, modes_text
from railui.desk.presenters.verdict_rows import no_next_run_text
from railui.desk.presenters.verdict_stages import loop_stages
from railui.report.loop.force_evaluation import SuspensionForce
from railui.running_stability.mode_tracking import TrackedMode


@pytest.mark.parametrize(("files", "result"), [([], "none"), (["run_b.csv"], "div.")])
def test_a_model_that_diverges_on_the_test_run_is_shown_as_such(files: list[str], result: str) -> None:
    history = LoopHistory()
    test = {"nrmse_after": None, "floor": None, "files": files}
    report = {"test": test, "corrections": [], "effects": [], "ranking": []}
    history.finished = cast(Any, SimpleNamespace(report=report))
    assert loop_stages(history, False)[-1].result == result


@pytest.mark.parametrize(("undecided", "text"), [([], "no rival"), ([False], "is rejected"), ([False, True], "hunts")])
def test_the_reason_for_no_next_run_depends_on_the_rivals(undecided: list[bool], text: str) -> None:
    rivals = [{"undecided": each} for each in undecided]
    assert text in no_next_run_text({"rivals": [{}, *rivals] if rivals else []})


def test_the_note_on_multiple_shooting_gives_the_reason() -> None:
    reason = "the model falls out of step with the motion"
    note = multiple_shooting_note({"windows": {"runs": ["a.csv"], "seconds": 1.5, "reason": reason}})
    assert note.startswith("The model falls out of step with the motion on a.csv: ") and "1.5 s" in note
    assert multiple_shooting_note({"windows": None}) == ""


def test_a_yaw_location_has_a_moment() -> None:
    x = np.linspace(-1.0, 1.0, 5)
    assert force_plot(SuspensionForce("", x, x, x, "rad", "N*m")).y.name == "moment"


@pytest.mark.parametrize(
    ("roots", "text"),
    [
        ((-1 + 5j, -1 + 5j, -2 + 5j), "not up to 30 m/s"),
        ((-1 + 5j, -1 + 0j, 2 + 0j), "from 23.3 m/s"),
        ((-1 + 5j, 1 + 5j, 2 + 5j), "from 15.0 m/s"),
        ((1 + 5j, 1 + 5j, 2 + 5j), "from 10 m/s"),
    ],
)
def test_the_loss_of_stability_counts_real_roots(roots: tuple[complex, ...], text: str) -> None:
    mode = TrackedMode("yaw", np.array([10.0, 20.0, 30.0]), np.array(roots), np.ones((3, 1), complex), ("psi",), 1.0)
    row = modes_text([mode], [], 10.0, lambda _: cast(Any, ""), 80, 10).plain.splitlines()[1]
    assert row.rstrip().endswith(text)


def test_a_critical_speed_that_was_not_reached_has_the_end_of_its_search() -> None:
    text = critical_speeds_text({kind: {"speed": None} for kind in ("linear", "nonlinear", "ride")}, None, "", 60)
    assert [line.split()[-2] for line in text.plain.splitlines()] == ["150", "90", "90"]


def test_a_critical_speed_that_failed_has_its_reason() -> None:
    failed = {"speed": None, "failure": "the fastest motion needs 9e9 steps per sample of 0.02 s"}
    known = {"linear": {"speed": 50.0}, "nonlinear": failed, "ride": {"speed": 40.0, "decided_by": "comfort"}}
    lines = critical_speeds_text(known, known, "", 60).plain.splitlines()
    assert lines[1].split() == ["nonlinear", "failed", "base", "failed"]
    assert lines[3].startswith("nonlinear: the fastest motion needs")
    assert cycles_plot(known, known).placeholder == failed["failure"]
    assert not cycles_plot(known, known).lines


@pytest.mark.parametrize(
    ("counts", "text"),
    [({"gaps": 1, "missing_rows": 99}, "1 gap, 99 missing rows"), ({"gaps": 2, "stuck": 1}, "2 gaps, 1 stuck part")],
)
def test_data_losses_of_a_run_are_counted_in_words(counts: dict[str, int], text: str) -> None:
    class Run(SimpleNamespace):
        def __len__(self) -> int:
            return 6000

    run = Run(rate=100.0, responses=("ay1",), counts=counts, notes=())
    assert run_text(cast(Any, SimpleNamespace(runs=[run])), 0).plain.endswith(text)
