"""Stages of a loop as columns of text: the check of the data, then the error after each stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rich.text import Text

from railui.desk.presenters.loop_history import LoopHistory
from railui.desk.presenters.loop_text import error_text

PENDING, RUNNING, DONE, FAILED = "pending", "running", "done", "failed"
MARKS: Final = {PENDING: "·", RUNNING: "▸", DONE: "✓", FAILED: "!"}
PLAIN_MARKS: Final = {PENDING: ".", RUNNING: ">", DONE: "+", FAILED: "!"}
STYLES: Final = {PENDING: "dim", RUNNING: "bold", DONE: "", FAILED: "bold red"}


@dataclass(frozen=True)
class Stage:
    """Stage of a loop: name, state, result in a few characters, detail."""

    name: str
    state: str
    result: str = ""
    detail: str = ""


def loop_stages(history: LoopHistory, is_running: bool) -> list[Stage]:
    """Return the stages of a loop: data, nominal model, calibration, effects, independent test."""
    totals, finished = history.totals, history.finished
    stages = [
        _data_stage(history),
        _error_stage(history, "Nominal", "declared", "model as it is"),
        _error_stage(history, "Calibrated", "before", _calibration_text(history)),
        _error_stage(history, "Effects", "after", _effects_text(history)),
        _test_stage(history),
    ]
    if finished is not None and "after" not in totals:
        return stages
    first = next((i for i, stage in enumerate(stages) if stage.state == PENDING), None)
    if is_running and first is not None:
        pending = stages[first]
        stages[first] = Stage(pending.name, RUNNING, "...", pending.detail)
    return stages


def _data_stage(history: LoopHistory) -> Stage:
    if history.dataset is None and not history.read_error:
        return Stage("Data", PENDING)
    serious = sum(finding.serious for finding in history.findings)
    is_at_fault = bool(history.read_error) or (history.stopped is not None)
    noun = "fault" if serious == 1 else "faults"
    result = "unreadable" if history.read_error else f"{serious} {noun}" if serious else "no fault"
    corrections = [] if history.finished is None else history.finished.report["corrections"]
    applied = sum(row["applied"] for row in corrections)
    detail = f"{applied} corrected" if applied else f"{len(history.campaign.runs) if history.campaign else 0} runs"
    return Stage("Data", FAILED if is_at_fault or (serious and not history.totals) else DONE, result, detail)


def _error_stage(history: LoopHistory, name: str, key: str, detail: str) -> Stage:
    if key not in history.totals:
        return Stage(name, PENDING, detail=detail if history.errors or key == "declared" else "")
    return Stage(name, DONE, error_text(history.totals[key]), detail)


def _calibration_text(history: LoopHistory) -> str:
    iteration = history.iteration
    if iteration is None:
        return ""
    return f"{len(iteration.paths)} fitted" if history.finished else f"iteration {iteration.iteration}"


def _effects_text(history: LoopHistory) -> str:
    if history.finished is not None:
        count = len(history.finished.report["effects"])
        return f"{count or 'none'} of {len(history.finished.report['ranking']) - 1}"
    if history.refits:
        return f"{len(history.refits)} refitted"
    return f"{len(history.scores)} tested" if history.scores else ""


def _test_stage(history: LoopHistory) -> Stage:
    if history.finished is None:
        return Stage("Test", PENDING)
    test = history.finished.report["test"]
    if not test["files"]:
        return Stage("Test", DONE, "none", "no run to spare")
    return Stage("Test", DONE, error_text(test["nrmse_after"]), f"noise {error_text(test['floor'])}")


def stages_text(stages: Sequence[Stage], width: int, is_plain: bool = False) -> Text:
    """Return three lines: marks with names, results, details; as many columns as stages."""
    column = max(8, width // max(len(stages), 1))
    marks = PLAIN_MARKS if is_plain else MARKS
    text = Text(no_wrap=True, overflow="crop")
    for part in ("name", "result", "detail"):
        for stage in stages:
            cell = f"{marks[stage.state]} {stage.name}" if part == "name" else f"  {getattr(stage, part)}"
            style = STYLES[stage.state] if part != "detail" else "dim"
            is_strong = part == "result" and stage.state == DONE
            text.append(f"{cell[: column - 1]:{column}}", f"{style} bold".strip() if is_strong else style)
        text.append("\n")
    text.rstrip()
    return text
