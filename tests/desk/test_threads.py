"""Simulations and eigenvalues of the desk are computed off the thread of the interface."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from railui.core.vehicles import Vehicles
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.design import DesignPanel
from railui.desk.widgets.form import Form
from tests.desk.conftest import REPOSITORY, OpenDesk

pytestmark = pytest.mark.asyncio
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


async def test_a_loop_runs_off_the_interface(open_desk: OpenDesk, threads: set[threading.Thread]) -> None:
    async with open_desk(REPOSITORY / "designs/campaigns/worn_axle_box", size=(120, 40)) as keys:
        panel = keys.desk.query_one(CampaignPanel)
        beats = keys.desk.heartbeat.beats
        await keys.pilot.press("s")
        await keys.wait_until(lambda: len(panel.history.scores) > 0)
        await keys.pilot.press("k")
        await keys.wait_until(lambda: panel.job is None)
        assert keys.desk.heartbeat.beats > beats + 10
    assert threads and threading.main_thread() not in threads
