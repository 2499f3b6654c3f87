"""Desk without a terminal: own state directory, key counter, waiting for background jobs."""

from __future__ import annotations

import asyncio
import shutil
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import pytest
from textual.pilot import Pilot

from railui.desk.app import Desk

REPOSITORY = Path(__file__).parents[2]
STIFFNESS = "vehicle.primary.lateral_stiffness"
IDLE_ROUNDS = 4  # rounds without work after which no message is pending


class Keyboard:
    """Keyboard of a desk that counts the keys pressed."""

    def __init__(self, desk: Desk, pilot: Pilot[None]) -> None:
        self.desk, self.pilot, self.count = desk, pilot, 0

    async def press(self, *keys: str) -> None:
        """Press keys and wait until their jobs are done."""
        for key in keys:
            self.count += 1
            await self.pilot.press(key)
        await self.wait_until_idle()

    async def type(self, text: str) -> None:
        """Type a text, one key per character."""
        names = {" ": "space", "/": "slash", ".": "full_stop", "*": "asterisk", "_": "underscore", "-": "minus"}
        await self.press(*(names.get(letter, letter) for letter in text))

    async def wait_until_idle(self) -> None:
        """Wait until no background job runs and everything is drawn."""
        quiet = 0
        while quiet < IDLE_ROUNDS:
            quiet = 0 if self.is_busy else quiet + 1
            await self.desk.workers.wait_for_complete()
            await asyncio.sleep(0.01)
        await self.pilot.pause()  # draws

    @property
    def is_busy(self) -> bool:
        """True if a background job runs or a message waits."""
        nodes = (self.desk, *self.desk.screen.walk_children(with_self=True))
        unfinished = any(not worker.is_finished for worker in self.desk.workers)
        return unfinished or any(node.message_queue_size for node in nodes)

    async def wait_until(self, condition: Callable[[], bool], seconds: float = 200.0) -> None:
        """Wait until a condition holds, for less time than a test may take."""
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, "the condition was not met"
            await asyncio.sleep(0.05)


OpenDesk = Callable[..., AbstractAsyncContextManager[Keyboard]]


@pytest.fixture
def open_desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> OpenDesk:
    """Return a function that opens a desk in an empty directory.

    `async with open_desk(path, size=(120, 40)) as keys: ...`
    """
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)

    @asynccontextmanager
    async def desk(
        path: Path | None = None, size: tuple[int, int] = (120, 40), plain: bool = False
    ) -> AsyncIterator[Keyboard]:
        app = Desk(path, is_plain=plain)
        async with app.run_test(size=size) as pilot:
            keys = Keyboard(app, pilot)
            await keys.wait_until_idle()
            yield keys

    return desk


@pytest.fixture
def bogie(tmp_path: Path) -> Path:
    """Copy of a design that a test may change."""
    return Path(shutil.copy(REPOSITORY / "designs/test_bogie.yaml", tmp_path))


@pytest.fixture
def study(bogie: Path) -> Path:
    """Small study of a bogie in the same directory."""
    path = bogie.with_name("springs.yaml")
    path.write_text(
        "schema: railui.study/1\nvehicle: test_bogie.yaml\n"
        f"variables: {{{STIFFNESS}: [1 MN/m, 8 MN/m], vehicle.secondary.lateral_damping: [10 kN*s/m, 90 kN*s/m]}}\n"
        "cases: {track: [erri_b176_low length=300], speed: [40 m/s], seed: [1], scenario: [{}]}\n"
        "objectives: [{minimise: weighted_acceleration, over: mean}, {maximise: flange_margin, over: worst}]\n"
        "method: {kind: nsga2, population: 16, generations: 4, seed: 1}\n"
    )
    return path
