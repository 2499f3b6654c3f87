"""Response time of the interface: the longest gap of a 10 ms heartbeat during computations."""

from __future__ import annotations

import asyncio
import gc
import subprocess
import sys
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest

from railui.desk.heartbeat import tune_interpreter
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.design import DesignPanel
from railui.desk.widgets.form import Form
from tests.desk.conftest import REPOSITORY, Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio
MAX_GAP = 0.100  # s
TRIES = 5
# an idle process, whose delays are those of the machine
IDLE = """
import sys, threading, time
longest, last, going = 0.0, time.perf_counter(), True
def listen():
    global going
    sys.stdin.read()
    going = False
threading.Thread(target=listen, daemon=True).start()
while going:
    time.sleep(0.010)
    now = time.perf_counter()
    longest, last = max(longest, now - last), now
print(longest)
"""


@pytest.fixture(autouse=True)
def tuned_interpreter() -> Iterator[None]:
    """Tune the interpreter as `railui desk` does."""
    before = sys.getswitchinterval(), gc.get_threshold()
    tune_interpreter()
    yield
    sys.setswitchinterval(before[0])
    gc.set_threshold(*before[1])


def gap_text(longest: float, idle: float) -> str:
    """Return both gaps as text."""
    return f"longest gap {1e3 * longest:.0f} ms, of an idle process {1e3 * idle:.0f} ms"


async def smallest_gap(keys: Keyboard, work: Callable[[], Awaitable[None]]) -> tuple[float, float]:
    """Return the longest gap in the best of a few tries, and that of an idle process at the same time.

    Garbage of other tests is collected before.
    """
    gaps = []
    for _ in range(TRIES):
        gc.collect()
        with subprocess.Popen([sys.executable, "-c", IDLE], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as idle:
            await asyncio.sleep(0.2)
            keys.desk.heartbeat.reset()
            await work()
            longest = keys.desk.heartbeat.longest_gap
            waited, _ = idle.communicate()
        gaps.append((longest, float(waited)))
        if longest < MAX_GAP:
            break
    return min(gaps, key=lambda pair: pair[0] - pair[1])


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_moving_a_slider_does_not_block_the_interface(
    open_desk: OpenDesk, bogie: Path, size: tuple[int, int], capsys: pytest.CaptureFixture[str]
) -> None:
    async with open_desk(bogie, size=size) as keys:
        panel = keys.desk.query_one(DesignPanel)
        panel.query_one(Form).select("vehicle.secondary.lateral_damping")
        await keys.wait_until_idle()

        async def slide() -> None:
            for _ in range(10):
                await keys.pilot.press("right")
                await asyncio.sleep(0.15)

        longest, idle = await smallest_gap(keys, slide)
        with capsys.disabled():
            print(f"\nheartbeat, moving a slider at {size}: {gap_text(longest, idle)}")
        assert longest < MAX_GAP + idle and keys.desk.heartbeat.beats > 50


@pytest.mark.parametrize("size", [(80, 24), (160, 48)])
async def test_switching_panels_does_not_block_the_interface(
    open_desk: OpenDesk, bogie: Path, size: tuple[int, int], capsys: pytest.CaptureFixture[str]
) -> None:
    async with open_desk(bogie, size=size) as keys:

        async def walk() -> None:
            for key in ("f3", "f4", "f5", "f6", "f2", "v"):
                await keys.pilot.press(key)
                await asyncio.sleep(0.3)

        await walk()  # draw each panel once
        await keys.wait_until_idle()
        longest, idle = await smallest_gap(keys, walk)
        with capsys.disabled():
            print(f"\nheartbeat, switching panels at {size}: {gap_text(longest, idle)}")
        assert longest < MAX_GAP + idle


async def test_a_running_loop_does_not_block_the_interface(
    open_desk: OpenDesk, capsys: pytest.CaptureFixture[str]
) -> None:
    async with open_desk(REPOSITORY / "designs/campaigns/worn_axle_box", size=(120, 40)) as keys:
        panel = keys.desk.query_one(CampaignPanel)

        async def calibrate() -> None:
            await keys.pilot.press("s")
            await keys.wait_until(
                lambda: len(panel.history.scores) > 100
            )  # calibrated, and about half of the score test
            await keys.pilot.press("k")
            await keys.wait_until(lambda: panel.job is None)

        longest, idle = await smallest_gap(keys, calibrate)
        with capsys.disabled():
            print(f"\nheartbeat, calibration and score test: {gap_text(longest, idle)}")
        assert longest < MAX_GAP + idle
