"""Pages of the map and of the vehicle, with keys only; their numbers are those of the commands."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import railui
from railui.api.map_rows import map_rows
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.map_page import MapPage
from railui.desk.panels.vehicle_page import VehiclePage
from railui.desk.presenters.design_results import load_track
from railui.desk.presenters.schematic import DRAWN_MOTION, Part, largest_motion, outlines, ride_motion
from railui.desk.widgets.heat_map import SHADES, HeatMap
from railui.desk.widgets.plot import Plot
from tests.desk.conftest import Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio


async def shown_map(keys: Keyboard) -> tuple[DesignPanel, MapPage, HeatMap]:
    """Show the page of the map and wait until the map is complete."""
    panel, page = keys.desk.query_one(DesignPanel), keys.desk.query_one(MapPage)
    panel.show_page("map")
    await keys.wait_until(lambda: page.current is not None and page.current.is_complete)
    await keys.wait_until_idle()
    return panel, page, page.query_one(HeatMap)


async def test_a_map_shows_what_ride_computes_and_its_cursor_sets_the_form(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(120, 40)) as keys:
        panel, page, picture = await shown_map(keys)
        data, known = picture.data, page.current
        assert data is not None and known is not None and data.own == (30e3, 40.0)
        screen = "\n".join(strip.text for strip in picture._strips)
        assert "blank: no result" in screen and "secondary lateral damping" in screen and "●" in screen
        picture.focus()
        await keys.press("left", "left", "down")
        assert picture.at is not None
        x, speed = data.x[picture.at[0]], data.y[picture.at[1]]
        changed = panel.draft.design.with_values({known.x.path: float(x)}) if panel.draft else None
        assert changed is not None
        ride = railui.ride(changed, panel.conditions.track, float(speed))
        assert data.z[picture.at[1], picture.at[0]] == pytest.approx(ride["weighted_acceleration"], rel=1e-12)
        await keys.press("enter")
        assert panel.conditions.speed == speed and panel.draft is not None
        assert panel.draft.design.value(known.x.path) == x
        assert page.current is known and picture.data is not None and picture.data.own == (x, speed)  # no new map
        await keys.press("v")
        assert picture.data.title == "score" and np.nanmax(picture.data.z) > 50

        panel.show_page("vehicle")
        vehicle = keys.desk.query_one(VehiclePage)
        await keys.wait_until(lambda: vehicle.motion is not None)
        vehicle.is_playing = False
        vehicle.seconds = 0.0
        vehicle.draw()
        upper = vehicle.query_one("#schematic", Plot)
        assert vehicle.mode is not None and vehicle.mode.name in str(upper.border_title)
        assert upper.data.y.name == "-y, left side up"  # y is to the right
        before = upper.data.lines[2].y
        await keys.pilot.press("p")
        await keys.wait_until(lambda: vehicle.seconds > 0.1)
        assert not np.array_equal(before, upper.data.lines[2].y)  # it moves
        await keys.pilot.press("p", "V")
        assert vehicle.mode is None and "Ride at" in str(upper.border_title)
        ride_series = railui.simulate(panel.draft.design, panel.conditions.track, panel.conditions.speed, ("e1",))
        motion = vehicle.motion
        assert motion is not None  # displacement relative to the track is that of the wheelset less that of the track
        relative = motion.ride["wheelset 1"][0] - motion.track
        assert np.allclose(relative, ride_series["e1"], atol=1e-6)
        vehicle.leave()


async def test_rows_of_a_map_that_is_computed_again_are_not_mixed(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(120, 40)) as keys:
        panel, page = keys.desk.query_one(DesignPanel), keys.desk.query_one(MapPage)
        panel.show_page("map")
        await keys.wait_until(lambda: page.current is not None and len(page.current.rows) > 1)
        job = page.map_job.job
        assert job is not None
        while not job.is_finished:  # its rows wait for the desk
            time.sleep(0.01)
        page.show(panel.results)
        await keys.wait_until(lambda: page.current is not None and page.current.is_complete)
        await keys.wait_until_idle()
        assert page.current is not None and panel.draft is not None
        axes, source = (page.axes["x"].axis, page.axes["y"].axis), load_track(panel.conditions.track)
        expected = list(map_rows(panel.draft.design, *axes, [page.quantity], source, panel.conditions.speed))
        for row, right in zip(page.current.rows, expected, strict=True):
            np.testing.assert_array_equal(row[page.quantity], right[page.quantity])


async def test_the_legend_of_a_map_is_whole_on_a_small_terminal(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(80, 24)) as keys:
        _, _, picture = await shown_map(keys)
        legend = picture._strips[1].text.split()
        assert legend[::2] == list(SHADES) and len(legend) == 2 * len(SHADES) - 1
        assert str(picture.border_subtitle).endswith("v quantity")


async def test_a_part_is_drawn_where_it_moves() -> None:
    axle = Part("wheelset 1", 2.0, 0.4, 0.75, True)
    (x, y), *_ = outlines(axle, 0.1, 0.2)  # 0.1 m to the right, its right end backwards
    assert np.allclose(x, [2.15, 1.85]) and np.allclose(y, [-0.65, 0.85])
    motion = ride_motion(["y1", "psi1"], {"z.wheelset.1": np.array([0.0, 2e-3]), "psi1": np.array([0.0, 1e-3])})
    assert largest_motion([axle], motion) == pytest.approx(2e-3 + 0.4e-3) and DRAWN_MOTION > 0
