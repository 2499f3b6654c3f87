"""A desk without a terminal: its own state directory, keys counted, waiting until its threads have answered."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import pytest
from textual.pilot import Pilot

from railui.desk.app import Desk

REPOSITORY = Path(__file__).parents[2]
QUIET = 4  # rounds without work after which nothing is on its way any more


class Keys:
    """A hand on the keys of a desk: counts what it presses."""

    def __init__(self, desk: Desk, pilot: Pilot[None]) -> None:
        self.desk, self.pilot, self.count = desk, pilot, 0

    async def press(self, *keys: str) -> None:
        """Presses keys, then waits until what they asked for has been answered."""
        for key in keys:
            self.count += 1
            await self.pilot.press(key)
        await self.settle()

    async def type(self, text: str) -> None:
        """Types a text: as many keys as it has letters."""
        names = {" ": "space", "/": "slash", ".": "full_stop", "*": "asterisk", "_": "underscore", "-": "minus"}
        await self.press(*(names.get(letter, letter) for letter in text))

    async def settle(self) -> None:
        """Until no thread works for the screen and all is drawn."""
        quiet = 0
        while quiet < QUIET:
            busy = any(not worker.is_finished for worker in self.desk.workers)
            await self.desk.workers.wait_for_complete()
            await self.pilot.pause(0.01)
            await self.pilot.pause()
            quiet = 0 if busy else quiet + 1

    async def until(self, seen: Callable[[], bool], seconds: float = 300.0) -> None:
        """Until something is seen on the desk."""
        for _ in range(int(seconds / 0.05)):
            if seen():
                return
            await asyncio.sleep(0.05)
        raise AssertionError("it was never seen")


Sitting = Callable[..., AbstractAsyncContextManager[Keys]]


@pytest.fixture
def sit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Sitting:
    """Sits down at a desk: `async with sit(path, size=(120, 40)) as keys`."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    @asynccontextmanager
    async def desk(
        path: Path | None = None, size: tuple[int, int] = (120, 40), plain: bool = False
    ) -> AsyncIterator[Keys]:
        app = Desk(path, plain=plain)
        async with app.run_test(size=size) as pilot:
            keys = Keys(app, pilot)
            await keys.settle()
            yield keys

    return desk


@pytest.fixture
def bogie(tmp_path: Path) -> Path:
    """A design of one's own to change."""
    return Path(shutil.copy(REPOSITORY / "designs/test_bogie.yaml", tmp_path))
