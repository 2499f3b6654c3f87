"""Capture and Track panels: the demo logger is recorded and marked, a track is chosen, with keys only."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.desk.panels.capture import CapturePanel
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.track import TrackPanel
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.plot import Plot
from tests.desk.conftest import OpenDesk

pytestmark = pytest.mark.asyncio


async def test_the_demo_logger_is_recorded_and_marked_within_ten_keys(
    open_desk: OpenDesk, bogie: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bogie.parent)
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("f6")
        await keys.pilot.press("s")
        await keys.wait_until(lambda: panel.status is not None and panel.status.seconds > 2.0, 90)
        await keys.pilot.press("m", *"weld", "enter")  # f6, s, m, four letters, enter, k: nine
        await keys.wait_until(lambda: panel.status is not None and bool(panel.status.markers))
        assert panel.status is not None and panel.status.markers[0][1] == "weld"
        rows = {bar.name: bar for bar in panel.query_one("#losses", Bars).rows}
        assert int(rows["samples"].text) > 300 and rows["lost"].text == "0" and 0.5 < rows["link"].fraction < 1.0
        assert len(panel.query_one("#strip1", Plot).data.lines[0].x) > 100
        await keys.pilot.press("k")
        await keys.wait_until(lambda: panel.job is None)
        assert panel.directory is not None
    (run,) = (bogie.parent / panel.directory).glob("run_*.csv")
    assert len(run.read_text().splitlines()) > 300


async def test_a_missing_port_is_reported(open_desk: OpenDesk, bogie: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(bogie.parent)
    async with open_desk(bogie) as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("f6")
        panel.port = "/dev/no-such-port"
        await keys.press("s")
        assert panel.job is None and "no-such-port" in panel.lines[-1]


async def test_a_track_is_chosen_and_used_within_twelve_keys(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie) as keys:
        design = keys.desk.query_one(DesignPanel)
        assert design.results is not None
        before = design.results[0].quality["weighted_acceleration"]
        await keys.press("f5", "o")
        await keys.type("_high")
        await keys.press("enter", "u")
        assert keys.desk.query_one(TrackPanel).analysis is not None
        assert design.conditions.track.startswith("erri_b176_high") and keys.count <= 12
        assert design.results[0].quality["weighted_acceleration"] > 1.3 * before
