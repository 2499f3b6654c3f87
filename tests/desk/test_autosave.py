"""Autosave: what was not saved survives a crash, a signal and a closed terminal, and is offered at the next start."""

from __future__ import annotations

import json
import os
import pickle
import pty
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.services.autosave import Autosave, ended_sessions
from railui.desk.services.verdict_file import VerdictUnreadableError, read_verdict
from railui.desk.widgets.dialogs import QuestionDialog
from railui.vehicle.design_reader import load_design
from tests.desk.conftest import REPOSITORY, OpenDesk

MASS = "vehicle.frame.mass"
TRACK = "erri_b176_low length=200 seed=1"
END_OF_ALTERNATE_SCREEN, END_OF_MOUSE = b"\x1b[?1049l", b"\x1b[?1003l"


@pytest.fixture
def state(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """State directory of its own, with a short track."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    directory = tmp_path / "state/railui"
    directory.mkdir(parents=True)
    (directory / "desk.json").write_text(json.dumps({"track": TRACK}))
    return directory


def test_a_session_is_offered_only_after_its_process_has_ended(state: Path) -> None:
    session = Autosave()
    session.put("plan.json", lambda: {"a": 1})
    assert session.flush()
    assert ended_sessions() == []  # it is running
    session.close()
    (ended,) = ended_sessions()
    plan = ended.read("plan")
    assert plan is not None and plan["a"] == 1 and ended.read("form") is None


def test_a_session_without_unsaved_work_leaves_nothing_behind(state: Path) -> None:
    session = Autosave()
    session.put("form.json", lambda: {"a": 1})
    session.drop("form.json")
    session.close()
    assert ended_sessions() == [] and not session.directory.exists()


def test_only_the_newest_content_of_a_part_is_written(state: Path) -> None:
    session = Autosave()
    for number in range(50):
        session.put("plan.json", lambda number=number: {"number": number})  # type: ignore[misc]
    session.close()
    plan = ended_sessions()[0].read("plan")
    assert plan is not None and plan["number"] == 49


def test_a_failing_part_does_not_end_the_others(state: Path) -> None:
    def fails() -> dict[str, int]:
        raise RuntimeError("on purpose")

    session = Autosave()
    session.put("search.json", fails)
    session.put("plan.json", lambda: {"a": 1})
    session.close()
    assert ended_sessions()[0].read("plan") is not None
    assert "on purpose" in (state / "desk.log").read_text()


def test_a_damaged_part_is_not_offered(state: Path) -> None:
    session = Autosave()
    session.put("plan.json", lambda: {"a": 1})
    session.close()
    (session.directory / "plan.json").write_text("{not json")
    assert ended_sessions()[0].read("plan") is None


class Harmful:
    """Object whose reading would run a command."""

    def __reduce__(self) -> tuple[Callable[[str], int], tuple[str]]:
        return os.system, ("true",)


@pytest.mark.parametrize("data", [b"", b"not a pickle", pickle.dumps(Harmful()), pickle.dumps(("0.0.0", None))])
def test_a_verdict_that_is_not_one_is_refused(data: bytes) -> None:
    with pytest.raises(VerdictUnreadableError):
        read_verdict(data)


@pytest.mark.asyncio
async def test_form_plan_and_search_survive_the_end_of_the_process(
    open_desk: OpenDesk, bogie: Path, state: Path
) -> None:
    async with open_desk(bogie) as keys:
        panel, optimise = keys.desk.query_one(DesignPanel), keys.desk.query_one(OptimisePanel)
        panel.set(MASS, "3000 kg")
        panel.set("case.speed", "50 m/s")
        await keys.wait_until_idle()
        await keys.press("f4")
        assert optimise.plan is not None
        directory = str(bogie.parent / "study")
        for path, value in (("population", 8), ("generations", 2), ("seeds", "1"), ("scenarios", "none")):
            optimise.set_plan(optimise.plan.with_value(path, value))
        track = TRACK.removesuffix(" seed=1")
        optimise.set_plan(optimise.plan.with_value("directory", directory).with_value("track", track))
        optimise.is_edited = True
        await keys.press("s")
        await keys.wait_until(lambda: optimise.result is not None)
        await keys.wait_until_idle()
        plan, (x, objectives) = optimise.plan, optimise.front()
        assert panel.draft is not None
        shown = panel.draft.design.content()
    async with open_desk(bogie) as keys:
        panel, optimise = keys.desk.query_one(DesignPanel), keys.desk.query_one(OptimisePanel)
        assert isinstance(keys.desk.screen, QuestionDialog)
        assert "the design test_bogie.yaml, not saved" in keys.desk.screen.question
        assert "a search of 2 generations, finished" in keys.desk.screen.question
        assert panel.draft is not None and not panel.draft.is_modified
        await keys.press("r")
        assert panel.draft.design.content() == shown and panel.draft.is_modified
        assert panel.conditions.speed == 50.0
        restored = optimise.plan
        assert restored is not None and restored.bounds == plan.bounds and restored.directory == directory
        assert (optimise.front()[0] == x).all() and (optimise.front()[1] == objectives).all()
        await keys.press("f4", "f")
        await keys.press("ctrl+s")
        assert load_design(bogie).value(MASS) == 3000.0
        await keys.press("ctrl+q")
    assert len(ended_sessions()) == 1 and ended_sessions()[0].read("form") is None  # saved; the search is still offered


@pytest.mark.asyncio
async def test_a_restored_form_does_not_replace_a_file_that_was_changed_since_and_can_be_deleted(
    open_desk: OpenDesk, bogie: Path, state: Path
) -> None:
    async with open_desk(bogie) as keys:
        keys.desk.query_one(DesignPanel).set(MASS, "3000 kg")
        await keys.wait_until_idle()
    changed = bogie.read_text() + "# changed\n"
    bogie.write_text(changed)
    async with open_desk(bogie) as keys:
        await keys.press("r", "ctrl+s")
        assert isinstance(keys.desk.screen, QuestionDialog) and "changed by another" in keys.desk.screen.question
        assert bogie.read_text() == changed
        await keys.press("c")
    async with open_desk(bogie) as keys:
        await keys.press("d")
        draft = keys.desk.query_one(DesignPanel).draft
        assert draft is not None and not draft.is_modified
    assert ended_sessions() == []


class PtyDesk:
    """Desk of a process of its own on a pseudo-terminal."""

    def __init__(self, file: Path, state: Path) -> None:
        self.master, slave = pty.openpty()
        os.set_inheritable(slave, True)
        environment = os.environ | {
            "XDG_STATE_HOME": str(state.parent), "TERM": "xterm-256color", "PYTHONPATH": str(REPOSITORY),
            "COLUMNS": "100", "LINES": "30",
        }  # fmt: skip
        self.process = subprocess.Popen(
            [sys.executable, "-c", START, str(file)], stdin=slave, stdout=slave, stderr=slave, env=environment,
            start_new_session=True,
        )  # fmt: skip
        os.close(slave)
        self.output = b""
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        while True:
            try:
                self.output += os.read(self.master, 65536)
            except OSError:
                return

    def write(self, keys: str) -> None:
        os.write(self.master, keys.encode())

    def wait_until(self, condition: Callable[[], bool], seconds: float = 240.0) -> None:
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, self.output[-2000:]
            assert self.process.poll() is None or condition(), self.output[-2000:]
            time.sleep(0.05)


# the terminal becomes the controlling one, so that closing it sends SIGHUP
START = """
import fcntl, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
from pathlib import Path
from railui.desk.app import run
sys.exit(run(Path(sys.argv[1])))
"""


def stored_text(state: Path) -> str:
    """Return the stored forms as text."""
    return "".join(path.read_text() for path in sorted(state.glob("sessions/*/form.json")))


@pytest.mark.parametrize("end", ["kill", "terminate", "hang up"])
def test_a_form_survives_the_end_of_its_process_on_a_terminal(bogie: Path, state: Path, end: str) -> None:
    desk = PtyDesk(bogie, state)
    desk.wait_until(lambda: b"SATISFACTORY" in desk.output)
    desk.write("/")
    desk.wait_until(lambda: b"Find a parameter" in desk.output)
    desk.write("mass of the bogie frame")
    time.sleep(1.0)
    desk.write("\r")
    desk.wait_until(lambda: b"Mass of the bogie frame" in desk.output)
    desk.write("3000\r")
    desk.wait_until(lambda: "mass: 3000" in stored_text(state))
    if end == "kill":
        desk.process.kill()
    elif end == "terminate":
        desk.process.send_signal(signal.SIGTERM)
    else:
        os.close(desk.master)
    desk.process.wait(60)
    if end == "terminate":
        assert desk.process.returncode == 128 + signal.SIGTERM
        desk.reader.join(5)
        assert END_OF_ALTERNATE_SCREEN in desk.output and END_OF_MOUSE in desk.output
    assert load_design(bogie).value(MASS) == 2900.0
    (session,) = ended_sessions()
    assert session.read("form") is not None
    if end != "kill":
        return  # the next start is the same
    again = PtyDesk(bogie, state)
    again.wait_until(lambda: b"restore it" in again.output)
    again.write("r")
    again.wait_until(lambda: "mass: 3000" in stored_text(state) and not session.directory.exists())
    again.write("\x13")  # ctrl+s
    again.wait_until(lambda: load_design(bogie).value(MASS) == 3000.0)
    again.process.kill()
    again.process.wait(60)
