"""Simulations are computed off the thread of the interface; loops and searches in processes of their own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from textual.message import Message

from railui.core.vehicles import Vehicles
from railui.desk.messages import JobDone
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.design import DesignPanel
from railui.desk.services.child_job import run_in_child
from railui.desk.services.jobs import BackgroundJob
from railui.desk.widgets.dialogs import QuestionDialog
from railui.desk.widgets.form import Form
from tests.desk.computations import count, fail, wait_for_ever
from tests.desk.conftest import OpenDesk

pytestmark = pytest.mark.asyncio
SECONDS = 300.0  # for a process to start on a busy machine
METHODS = ("simulate", "ride_statistics", "eigenvalues")


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch) -> set[threading.Thread]:
    """Threads that call the kernel."""
    found: set[threading.Thread] = set()

    def recorded(method: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            found.add(threading.current_thread())
            return method(*arguments, **options)

        return call

    for name in METHODS:
        monkeypatch.setattr(Vehicles, name, recorded(getattr(Vehicles, name)))
    return found


async def test_rides_and_pages_are_computed_off_the_interface(
    open_desk: OpenDesk, bogie: Path, threads: set[threading.Thread]
) -> None:
    async with open_desk(bogie, size=(160, 48)) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.query_one(Form).select("vehicle.secondary.lateral_damping")
        for key in ("right", "right", "f3", "f4", "f5", "f6", "f2", "v"):
            await keys.pilot.press(key)
        await keys.wait_until_idle()
    assert threads and threading.main_thread() not in threads


async def test_a_loop_runs_in_a_process_of_its_own_that_is_paused_and_stopped(
    open_desk: OpenDesk, short_campaign: Path, threads: set[threading.Thread]
) -> None:
    async with open_desk(short_campaign, size=(120, 40)) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        threads.clear()
        await keys.pilot.press("s")
        await keys.wait_until(lambda: panel.history.iteration is not None)
        await keys.pilot.press("p")
        assert panel.job is not None and panel.job.is_paused
        await keys.pilot.press("ctrl+q")  # asks first, because it runs
        await keys.wait_until(lambda: isinstance(keys.desk.screen, QuestionDialog), 10.0)
        await keys.pilot.press("c", "k")
        await keys.wait_until(lambda: panel.job is None)
        assert panel.finished is None and panel.history.activity == "stopped"
    assert not threads


class Owner:
    """Widget that keeps the messages posted to it."""

    def __init__(self) -> None:
        self.posted: list[Any] = []
        self.arrived = threading.Semaphore(0)

    def run_worker(self, function: Callable[[], None], **_: object) -> None:
        threading.Thread(target=function).start()

    def post_message(self, message: Message) -> None:
        self.posted.append(message)
        self.arrived.release()


def job_of(owner: Owner, function: Callable[..., Any], *arguments: object) -> BackgroundJob:
    """Start a job that runs a function in a process."""
    return BackgroundJob(
        owner,  # type: ignore[arg-type]
        "job",
        lambda job: JobDone(job.name, run_in_child(job, function, *arguments)),
    )


async def test_a_process_delivers_events_messages_and_its_result() -> None:
    owner = Owner()
    job_of(owner, count, 3)
    for _ in range(5):
        assert owner.arrived.acquire(timeout=SECONDS)
    assert [each.event for each in owner.posted[:3]] == [0, 1, 2]
    assert owner.posted[3].text == "counted" and owner.posted[4].result == 3


@pytest.mark.parametrize(("name", "text"), [("file", "no file"), ("killed", "ended with code -9")])
async def test_the_failure_of_a_process_is_reported(name: str, text: str) -> None:
    owner = Owner()
    job_of(owner, fail, name)
    assert owner.arrived.acquire(timeout=SECONDS) and owner.arrived.acquire(timeout=SECONDS)
    assert text in owner.posted[1].text and not owner.posted[1].is_stopped


async def test_a_process_that_does_not_stop_is_killed() -> None:
    owner = Owner()
    job = job_of(owner, wait_for_ever)
    assert owner.arrived.acquire(timeout=SECONDS)
    job.stop(0.1)
    assert owner.arrived.acquire(timeout=SECONDS) and owner.posted[1].is_stopped
