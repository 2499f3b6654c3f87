"""A day's work: the demo logger is recorded, an instant marked, the run read again; with keys alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.desk.panels.capture import CapturePanel
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.track import TrackPanel
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.plot import Plot
from tests.desk.conftest import Sitting

pytestmark = pytest.mark.asyncio


async def test_the_demo_is_recorded_and_marked_within_ten_keys(
    sit: Sitting, bogie: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(bogie.parent)
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("f6")
        await keys.pilot.press("s")
        await keys.until(lambda: panel.state is not None and panel.state.seconds > 2.0, 90)
        await keys.pilot.press("m", *"weld", "enter")  # f6, s, m and a word and enter, k: nine
        await keys.until(lambda: panel.state is not None and bool(panel.state.marks))
        assert panel.state is not None and panel.state.marks[0][1] == "weld"
        rows = {bar.name: bar for bar in panel.query_one("#losses", Bars).rows}
        assert int(rows["samples"].text) > 300 and rows["lost"].text == "0" and 0.5 < rows["line"].share < 1.0
        assert len(panel.query_one("#strip1", Plot).picture.lines[0].x) > 100
        await keys.pilot.press("k")
        await keys.until(lambda: panel.study is None)
        assert panel.directory is not None
    (run,) = (bogie.parent / panel.directory).glob("run_*.csv")
    assert len(run.read_text().splitlines()) > 300


async def test_a_port_that_is_not_there_is_told(sit: Sitting, bogie: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(bogie.parent)
    async with sit(bogie) as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("f6")
        panel.port = "/dev/no-such-port"
        await keys.press("s")
        assert panel.study is None and "no-such-port" in panel.lines[-1]


async def test_a_track_is_chosen_and_ridden_on_within_twelve_keys(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie) as keys:
        design = keys.desk.query_one(DesignPanel)
        assert design.looks is not None
        before = design.looks[0].quality["weighted_acceleration"]
        await keys.press("f5", "o")
        await keys.type("_high")
        await keys.press("enter", "u")
        assert keys.desk.query_one(TrackPanel).found is not None
        assert design.case.track.startswith("erri_b176_high") and keys.count <= 12
        assert design.looks[0].quality["weighted_acceleration"] > 1.3 * before
