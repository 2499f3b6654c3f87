"""Dialogs on a small terminal: answers and key hints are on the screen, and texts scroll to their last line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from textual.app import App
from textual.pilot import Pilot
from textual.widgets import OptionList

import railui.desk.widgets.dialogs as module
from railui.desk.app import Desk
from railui.desk.session import ANSWERS
from railui.desk.widgets.dialogs import (
    ChoiceDialog,
    Dialog,
    DialogKeys,
    DifferenceDialog,
    HelpDialog,
    InputDialog,
    ProblemsDialog,
    QuestionDialog,
)
from railui.io.problems import FileProblems, Problem

pytestmark = pytest.mark.asyncio
SMALL = (50, 15)
SENTENCE = "Most likely unmodelled effect: clearance in the lateral primary suspension of both wheelsets"
SESSION = "\n".join(
    ["The session ended with", *(f"- the verdict of bogie {i}: {SENTENCE}" for i in range(8)), "THE END"]
)
REPLACED = {"w": "write it anyway: the changes of the other program are lost", "n": "another name", "c": "cancel"}
DIFFERENCE = [*(f"+ line {i}" for i in range(60)), "- THE END"]
PROBLEMS = FileProblems([Problem("a.yaml", i, 1, "vehicle.mass", SENTENCE, "correct it") for i in range(1, 20)])
DIALOGS: dict[type[Dialog], Callable[[], Dialog]] = {
    QuestionDialog: lambda: QuestionDialog(SESSION, ANSWERS),
    DifferenceDialog: lambda: DifferenceDialog(f"{SENTENCE}?", DIFFERENCE, REPLACED),
    InputDialog: lambda: InputDialog("Export all pictures and tables to a new directory", "bogie"),
    ChoiceDialog: lambda: ChoiceDialog("Find a parameter", [(str(i), f"parameter {i}") for i in range(60)]),
    ProblemsDialog: lambda: ProblemsDialog("a.yaml", PROBLEMS),
    HelpDialog: lambda: HelpDialog([f"## Help\n{SENTENCE}"] * 9, [("a", "Start")] * 9),
}


class Screens(App[None]):
    """Application without a panel, with the styles of the desk."""

    CSS_PATH = str(Path(module.__file__).parents[1] / str(Desk.CSS_PATH))
    is_plain = False


def _screen(pilot: Pilot[None]) -> str:
    """Return the text on the screen."""
    return "\n".join("".join(s.text for s in line) for line in pilot.app.screen._compositor.render_strips())


async def _open(pilot: Pilot[None], dialog: Dialog) -> None:
    pilot.app.push_screen(dialog)
    for _ in range(4):
        await pilot.pause()


async def test_every_dialog_is_tested() -> None:
    assert {*DIALOGS} == {*Dialog.__subclasses__(), *QuestionDialog.__subclasses__()}


@pytest.mark.parametrize("kind", DIALOGS)
async def test_a_small_terminal_has_the_answers_and_the_keys_of_a_dialog(kind: type[Dialog]) -> None:
    async with Screens().run_test(size=SMALL) as pilot:
        await _open(pilot, dialog := DIALOGS[kind]())
        inside = dialog.query_one(".dialog").content_region
        assert dialog.region.contains_region(inside)
        for keys in dialog.query(DialogKeys):
            assert inside.contains_region(keys.region)
            assert str(keys.render()).split()[0] in _screen(pilot) and "esc back" in _screen(pilot)
        for answers in dialog.query(OptionList):
            assert inside.contains_region(answers.region)
            if isinstance(dialog, QuestionDialog):
                assert answers.max_scroll_y == 0 and answers.region.height >= len(dialog.answers)


@pytest.mark.parametrize("kind", [QuestionDialog, DifferenceDialog])
async def test_a_long_question_scrolls_to_its_end_and_keeps_its_answers(kind: type[QuestionDialog]) -> None:
    async with Screens().run_test(size=SMALL) as pilot:
        await _open(pilot, dialog := DIALOGS[kind]())
        assert isinstance(dialog, kind)
        assert "THE END" not in _screen(pilot) and "page down" in _screen(pilot)
        await pilot.press(*["pagedown"] * 30)
        assert "THE END" in _screen(pilot)
        assert all(f" {key}  {text.split()[0]}" in _screen(pilot) for key, text in dialog.answers.items())
        await pilot.resize_terminal(120, 60)
        await pilot.pause()
        await pilot.pause()
        assert ("page down" in _screen(pilot)) == (kind is DifferenceDialog)


async def test_a_short_question_is_as_small_as_its_text() -> None:
    async with Screens().run_test(size=(80, 24)) as pilot:
        await _open(pilot, dialog := QuestionDialog("Stop and quit?", {"q": "stop and quit", "c": "cancel"}))
        assert dialog.query_one(".dialog").region.height == 6 and "page down" not in _screen(pilot)
