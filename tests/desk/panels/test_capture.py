"""Capture and Track panels: a logger on a serial line is recorded, replayed and made a campaign, with keys only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.capture.protocol.load import link_load
from railui.capture.recorder.replay import Replay, decode
from railui.cli.capture.logger import _build_logger
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.capture import CapturePanel
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.track import TrackPanel
from railui.desk.presenters.recording_text import channel_rows, strip_plot
from railui.desk.services.recording import RecordingBuffer, RecordingStatus, recording_status
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.timeline import Timeline
from tests.capture.ports import LoggerPlayer, small_logger
from tests.desk.conftest import REPOSITORY, OpenDesk

pytestmark = pytest.mark.asyncio


async def test_a_logger_on_a_serial_line_is_recorded_and_replayed(
    open_desk: OpenDesk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ports").mkdir()
    async with open_desk() as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("escape", "f6")
        panel.port = "/dev/no-such-port"
        await keys.press("s")
        assert panel.job is None and "no-such-port" in panel.lines[-1]
        with LoggerPlayer(tmp_path / "ports") as player:
            panel.port = str(player.add("logger", small_logger(drop=0.03)))
            await keys.pilot.press("s")
            await keys.wait_until(lambda: panel.status is not None and panel.status.counts["gaps"] > 0)
            assert panel.query_one("#losses").display and not panel.query_one(Timeline).display
            await keys.pilot.press("m", *"weld", "enter")
            await keys.wait_until(lambda: panel.status is not None and bool(panel.status.markers))
            await keys.wait_until(lambda: panel.status is not None and panel.status.seconds > 3.5, 90)
            assert panel.status is not None
            rows = {bar.name: bar for bar in panel.query_one("#losses", Bars).rows}
            assert int(rows["samples"].text) > 300 and int(rows["lost"].text) > 0 and 0 < rows["link"].fraction < 1
            meter = panel.query_one("#channels", Bars).rows[1]  # 3 m/s^2 of 32.767, 21 dB below full scale
            assert 0.5 < meter.fraction <= (meter.mark or 0.0) < 0.8 and "m/s²" in meter.text
            strip = panel.query_one("#strip1", Plot).data
            assert len(strip.lines[0].x) > 100 and np.isnan(strip.lines[0].y).any()  # no line crosses a gap
            labels = [limit.label for limit in strip.limits]
            assert "weld" in labels and len(labels) > 1
            await keys.pilot.press("k")
            await keys.wait_until(lambda: panel.job is None)
        assert panel.directory is not None
        assert len((panel.directory / "run_001.csv").read_text().splitlines()) > 300

        assert [each.path for each in panel.recordings] == [panel.directory]
        await keys.press("p")
        await keys.wait_until(lambda: panel.playback is not None and panel.playback.position > 0.2)
        await keys.pilot.press("space")
        playback, timeline = panel.playback, panel.query_one(Timeline)
        assert playback is not None and not playback.is_playing and timeline.has_focus
        assert playback.run.markers[0][1] == "weld" and len(timeline.gaps) == len(playback.gaps) > 0
        position = playback.position
        await keys.pilot.pause(0.2)
        assert playback.position == position  # it is paused
        await keys.press("end")
        await keys.wait_until(lambda: playback.position == playback.run.duration)
        assert panel.status is not None and panel.status.counts["samples"] == len(playback.run.t)
        assert panel.status.counts["gaps"] == len(playback.gaps)
        await keys.press("comma", "greater_than_sign")
        assert playback.speed == 2.0 and playback.position == max(0.0, playback.run.duration - 5.0)
        await keys.pilot.click(Timeline, offset=(timeline.size.width // 2 + 1, 1))
        await keys.wait_until(lambda: 0.4 < playback.position / playback.run.duration < 0.6)
        assert "▾" in timeline.line_text(400).plain and "×" in timeline.line_text(400).plain
        await keys.press("k")
        assert panel.playback is None and not timeline.display


async def test_a_link_that_falls_silent_is_named_while_it_is_recorded(
    open_desk: OpenDesk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("railui.capture.recorder.link_watch.MAX_SILENCE", 0.5)
    (tmp_path / "ports").mkdir()
    async with open_desk() as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("escape", "f6")
        with LoggerPlayer(tmp_path / "ports") as player:
            panel.port = str(player.add("logger", small_logger()))
            await keys.pilot.press("s")
            await keys.wait_until(lambda: panel.status is not None and panel.status.counts["samples"] > 100)
            assert "link is silent" not in panel._port_text().plain
            with player._lock:
                await keys.wait_until(lambda: "the link is silent" in panel._port_text().plain)
            await keys.wait_until(lambda: "link is silent" not in panel._port_text().plain)
            await keys.pilot.press("k")
            await keys.wait_until(lambda: panel.job is None)


async def test_a_strip_is_interrupted_at_a_gap_and_a_meter_names_clipping() -> None:
    t = np.delete(np.arange(400) / 200, slice(100, 200))
    values = np.clip(np.sin(9 * t) * 40, -32.767, 32.767)[:, None]
    counts = {"samples": 300}
    status = RecordingStatus(t, values, counts, 2.0, ("ay",), ("m/s^2",), 200.0, full_scales=(32.767,))
    plot = strip_plot(status, 0, 2.0)
    (line,), (gap,) = plot.lines, plot.limits
    assert np.flatnonzero(np.isnan(line.y)).tolist() == [100] and gap.label == "gap 0.505 s" and gap.value == t[99]
    (meter,) = channel_rows(status)
    assert meter.text.startswith("clipped") and meter.mark == 1.0 and meter.is_emphasised
    slow = RecordingStatus(t, 40.0 + 1e-3 * values, counts, 2.0, ("speed",), ("m/s",), 200.0, full_scales=(np.nan,))
    axis = strip_plot(slow, 0, 2.0).y
    assert axis.low is not None and axis.high is not None and 0.7 < axis.high - axis.low < 0.9  # noise is no wave


async def test_the_link_load_is_that_of_the_frames_of_the_logger(tmp_path: Path) -> None:
    for form, block in (("binary", 20), ("text", 1)):
        sender = replace(small_logger(5.0), form=form, block=block)
        raw = tmp_path / f"{form}.bin"
        raw.write_bytes(b"".join(data for _, data in sender.transmit()))
        buffer, replay = RecordingBuffer(), Replay(raw, tmp_path)
        replay.on_rows = buffer.append
        replay.advance(raw.stat().st_size)
        status = recording_status(replay, buffer, 9600)
        expected = link_load(list(sender.channels), sender.rate, 9600, block, form).utilisation
        assert status.link_load == pytest.approx(expected)
        replay.close()


async def test_recordings_become_a_campaign_without_leaving_the_desk(
    open_desk: OpenDesk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, seed, speed in (("monday", 1, 40.0), ("tuesday", 2, 31.0)):
        home = tmp_path / "railui-capture" / name
        home.mkdir(parents=True)
        logger = _build_logger(REPOSITORY / "designs/test_bogie.yaml", "erri_b176_high", speed, 30.0, seed, 0.05)
        (home / "raw.bin").write_bytes(b"".join(data for _, data in logger.transmit()))
        decode(home / "raw.bin", home)
    sensors = (REPOSITORY / "designs/maps/demo_logger.yaml").read_text()
    (tmp_path / "map.yaml").write_text(
        sensors.replace("../test_bogie.yaml", str(REPOSITORY / "designs/test_bogie.yaml"))
    )
    async with open_desk() as keys:
        panel = keys.desk.query_one(CapturePanel)
        await keys.press("escape", "f6")
        panel.query_one("#recordings", Bars).focus()
        await keys.press("e", "C")
        assert panel.job is None  # a recording for validation is missing
        await keys.press("down", "e", "e", "C", "enter", "enter")
        await keys.wait_until(lambda: panel.job is None)
        assert panel.roles == {"railui-capture/tuesday": "adjust", "railui-capture/monday": "validate"}
        campaign = keys.desk.query_one(CampaignPanel)
        await keys.wait_until(lambda: campaign.campaign is not None)
        assert keys.desk.panel is campaign and (tmp_path / "campaign/run_b.csv.gz").exists()


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


async def test_the_track_of_the_form_is_shown_unless_another_was_chosen(open_desk: OpenDesk, bogie: Path) -> None:
    first, second, chosen = (f"erri_b176_low length=400 seed={seed}" for seed in (1, 2, 3))
    async with open_desk(bogie) as keys:
        design, panel = keys.desk.query_one(DesignPanel), keys.desk.query_one(TrackPanel)
        for track in (first, second):
            design.set("case.track", track)
            await keys.press("f2", "f5")
            await keys.wait_until_idle()
            assert panel.analysis is not None and panel.analysis.name == track
            assert panel.assessment is not None
        panel._on_track_chosen(chosen)
        assert panel.assessment is None and not panel.query_one("#sections", Bars).rows
        await keys.wait_until_idle()
        design.set("case.track", first)
        await keys.press("f2", "f5")
        await keys.wait_until_idle()
        assert panel.track_name == chosen
