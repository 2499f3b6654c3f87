"""Screenshots of the desk for README and docs: `make shots`.

Writes docs/shots/NAME.svg. The desk works on the bundled designs; nothing is drawn by hand.
"""

from __future__ import annotations

import asyncio
import os
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from textual.pilot import Pilot

from railui.api.fleet import update_fleet
from railui.desk.app import Desk
from railui.desk.heartbeat import tune_interpreter
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.capture import CapturePanel
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.map_page import MapPage
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.panels.shelf_page import ShelfPage, ShelfTable
from railui.desk.panels.speed_page import SpeedPage
from railui.desk.panels.stability_page import StabilityPage
from railui.desk.panels.vehicle_page import VehiclePage
from railui.desk.widgets.heat_map import HeatMap
from tests.truth.rig_fleet import RigFleet, write

REPOSITORY = Path(__file__).parents[2]
OUT = REPOSITORY / "docs/shots"
FONT = re.compile(r"@font-face \{.*?\}\s*", re.DOTALL)


def take(desk: Desk, name: str) -> None:
    """Write the screen as SVG with a font of the reader, so that nothing is loaded from elsewhere."""
    svg = FONT.sub("", desk.export_screenshot(title="railui", simplify=True))
    svg = svg.replace("Fira Code", "DejaVu Sans Mono")
    OUT.mkdir(exist_ok=True)
    (OUT / f"{name}.svg").write_text(svg, "utf-8")
    print(f"docs/shots/{name}.svg", flush=True)


async def wait_until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds, at most twenty minutes."""
    for _ in range(24_000):
        if condition():
            return
        await asyncio.sleep(0.05)
    raise SystemExit("the condition was not met")


async def wait_until_idle(desk: Desk, pilot: Pilot[None]) -> None:
    """Wait until no background job runs."""
    for _ in range(3):
        await desk.workers.wait_for_complete()
        await pilot.pause(0.1)


async def design() -> None:
    desk = Desk(REPOSITORY / "designs/test_bogie.yaml")
    async with desk.run_test(size=(132, 40)) as pilot:
        await wait_until_idle(desk, pilot)
        panel = desk.query_one(DesignPanel)
        panel.action_keep()
        panel.set("vehicle.primary.lateral_stiffness", "7 MN/m")
        panel.action_keep()
        panel.set("vehicle.secondary.lateral_damping", "60 kN*s/m")
        panel.pane.form.select("vehicle.secondary.lateral_damping")
        await wait_until_idle(desk, pilot)
        take(desk, "design")
        panel.action_keep()
        panel.show_page("shelf")
        table = desk.query_one(ShelfTable)
        table.focus()
        await pilot.press("down", "down")
        await wait_until(lambda: len(desk.query_one(ShelfPage).evaluated) == 3)
        await wait_until_idle(desk, pilot)
        take(desk, "shelf")
        await pilot.press("l")
        page = desk.query_one(StabilityPage)
        await wait_until(lambda: len(page.known.results) == 2 and all(len(r) == 2 for r in page.known.results.values()))
        await wait_until_idle(desk, pilot)
        take(desk, "stability")
        await pilot.press("right_square_bracket")
        speed = desk.query_one(SpeedPage)
        await wait_until(lambda: len(speed.bands) == 2 and all(band.is_complete for band in speed.bands.values()))
        await wait_until_idle(desk, pilot)
        take(desk, "speed")
        panel.show_page("map")
        maps = desk.query_one(MapPage)
        await wait_until(lambda: maps.current is not None and maps.current.is_complete)
        desk.query_one(HeatMap).focus()
        await pilot.press("right", "up")
        await pilot.pause(0.2)
        take(desk, "map")
        panel.show_page("vehicle")
        vehicle = desk.query_one(VehiclePage)
        await wait_until(lambda: vehicle.motion is not None)
        vehicle.is_playing, vehicle.seconds = False, 0.5
        vehicle.draw()
        await pilot.pause(0.2)
        take(desk, "vehicle")
        panel.show_page("overview")
        panel.pane.form.focus()
        await pilot.resize_terminal(80, 24)
        await wait_until_idle(desk, pilot)
        take(desk, "small")
        await pilot.resize_terminal(160, 48)
        await wait_until_idle(desk, pilot)
        take(desk, "large")
        await pilot.resize_terminal(100, 30)
        desk.theme = "ansi-dark"
        await wait_until_idle(desk, pilot)
        take(desk, "sixteen-colours")
        desk.theme = "textual-dark"
        await pilot.resize_terminal(132, 40)
        await pilot.press("ctrl+z", "ctrl+z", "f5")
        await wait_until_idle(desk, pilot)
        take(desk, "track")


async def optimise() -> None:
    desk = Desk(REPOSITORY / "designs/studies/test_bogie.yaml")
    async with desk.run_test(size=(132, 40)) as pilot:
        await wait_until_idle(desk, pilot)
        search = desk.query_one(OptimisePanel)
        assert search.plan is not None
        search.set_plan(search.plan.with_value("directory", "railui-study/test_bogie"))
        await pilot.press("s")
        await wait_until(lambda: search.result is not None)
        await pilot.press("f")
        await wait_until_idle(desk, pilot)
        take(desk, "optimise")


async def campaign() -> None:
    desk = Desk(REPOSITORY / "designs/campaigns/worn_axle_box")
    async with desk.run_test(size=(132, 40)) as pilot:
        await wait_until_idle(desk, pilot)
        panel = desk.query_one(CampaignPanel)
        await pilot.press("s")
        await wait_until(lambda: len(panel.history.refits) > 0)
        take(desk, "trace")
        await wait_until(lambda: panel.finished is not None)
        await wait_until_idle(desk, pilot)
        take(desk, "verdict")
        await pilot.press("left_square_bracket")
        await wait_until_idle(desk, pilot)
        take(desk, "campaign")


async def plain() -> None:
    desk = Desk(REPOSITORY / "designs/test_bogie.yaml", is_plain=True)
    async with desk.run_test(size=(100, 30)) as pilot:
        await wait_until_idle(desk, pilot)
        desk.query_one(DesignPanel).set("vehicle.primary.lateral_stiffness", "7 MN/m")
        await wait_until_idle(desk, pilot)
        take(desk, "plain")


async def capture() -> None:
    desk = Desk(REPOSITORY / "designs/test_bogie.yaml")
    async with desk.run_test(size=(132, 40)) as pilot:
        await wait_until_idle(desk, pilot)
        panel = desk.query_one(CapturePanel)
        await pilot.press("f6", "s")
        await wait_until(lambda: panel.status is not None and panel.status.seconds > 6)
        await pilot.press("m", *"weld", "enter")
        await wait_until(lambda: panel.status is not None and panel.status.seconds > 10)
        take(desk, "capture")
        await pilot.press("k")
        await wait_until(lambda: panel.job is None)
        await pilot.press("p")
        await wait_until(lambda: panel.playback is not None and panel.playback.position > 8)
        await pilot.press("p")
        await pilot.pause(0.2)
        take(desk, "replay")


async def fleet() -> None:
    write(RigFleet(), Path("rigs"))
    update_fleet("rigs")
    desk = Desk(Path("rigs/fleet.yaml"))
    async with desk.run_test(size=(132, 40)) as pilot:
        await wait_until_idle(desk, pilot)
        take(desk, "fleet")


if __name__ == "__main__":
    tune_interpreter()
    wanted = sys.argv[1:]
    for part in (design, optimise, campaign, capture, fleet, plain):
        if wanted and part.__name__ not in wanted:
            continue
        # a desk would offer the session of the one before
        with tempfile.TemporaryDirectory() as scratch:
            os.environ["XDG_STATE_HOME"] = scratch
            os.chdir(scratch)
            asyncio.run(part())
            os.chdir(REPOSITORY)
