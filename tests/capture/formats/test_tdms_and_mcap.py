"""TDMS of LabVIEW and MCAP of robotics: values, times and units as they were written."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from railui.capture.formats import read_recordings
from railui.io.problems import FileProblems

T = np.arange(2000) / 200.0


def test_tdms_waveforms_of_two_rates_are_joined(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    start = np.datetime64("2026-11-22T10:00:00.000000")
    fast = {"wf_increment": 0.005, "wf_start_offset": 0.0, "wf_start_time": start, "unit_string": "m/s^2"}
    slow = {"wf_increment": 0.02, "wf_start_time": start + np.timedelta64(1_000_000, "us"), "unit_string": "rad/s"}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("rack", "ay1", np.sin(3 * T), fast),
                nptdms.ChannelObject("rack", "rf", np.cos(2 * (1.0 + np.arange(300) / 50.0)), slow),
            ]
        )
    (recording,) = read_recordings(tmp_path / "a.tdms")
    assert recording.units == {"ay1": "m/s^2", "rf": "rad/s"}
    assert np.array_equal(recording.channels["ay1"], np.sin(3 * T)) and np.allclose(recording.t, T)
    rf = recording.channels["rf"]
    assert np.array_equal(np.isnan(rf), (T < 1.0 - 1e-9) | (T > 6.98 + 1e-9))
    inner = (T > 2) & (T < 6)
    assert np.max(np.abs(rf - np.cos(2 * T))[inner]) < 1e-4


def test_tdms_channels_with_a_time_channel_are_read_to_the_microsecond(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    stamps = np.datetime64("2026-11-22T10:00:00.000000") + (np.arange(2000) * 5000).astype("timedelta64[us]")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        channels = {"Time": stamps, "v": 40 + np.sin(T), "state": np.arange(2000, dtype=np.int16)}
        writer.write_segment([nptdms.ChannelObject("log", name, x) for name, x in channels.items()])
    (recording,) = read_recordings(tmp_path / "a.tdms")
    assert np.allclose(recording.t - 1795341600.0, T, rtol=0, atol=5e-7)
    assert np.array_equal(recording.channels["v"], 40 + np.sin(T))


def write_mcap(path: Path, topics: dict[str, list[tuple[float, dict[str, object]]]]) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    with path.open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        for topic, messages in topics.items():
            channel = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
            for t, content in messages:
                ns = round(1e9 * t)
                writer.add_message(channel, log_time=ns + 777, publish_time=ns, data=json.dumps(content).encode())
        writer.finish()


def test_numbers_of_mcap_messages_become_channels(tmp_path: Path) -> None:
    imu = [(1.7e9 + t, {"acc": {"y": float(np.sin(t))}, "frame": "axle"}) for t in T]
    speed = [
        (0.0, {"header": {"stamp": {"sec": 1_700_000_000 + int(t), "nanosec": round(1e9 * (t % 1))}}, "v": 40.0 + t})
        for t in np.arange(0.0, 8.0, 0.02)
    ]
    write_mcap(tmp_path / "a.mcap", {"/imu": imu, "/speed": speed})
    (recording,) = read_recordings(tmp_path / "a.mcap")
    assert set(recording.channels) == {"imu.acc.y", "speed.v"}
    assert np.allclose(recording.t - 1.7e9, T, rtol=0, atol=1e-6)
    assert np.allclose(recording.channels["imu.acc.y"], np.sin(T), atol=1e-12)
    known = (T > 0.5) & (T < 7.4)
    assert np.max(np.abs(recording.channels["speed.v"] - 40 - T)[known]) < 1e-3
    assert np.all(np.isnan(recording.channels["speed.v"][T > 7.985]))


def test_an_mcap_without_its_end_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    write_mcap(tmp_path / "a.mcap", {"/imu": [(t, {"y": float(t)}) for t in T + 1.0]})
    data = (tmp_path / "a.mcap").read_bytes()
    writer_module = pytest.importorskip("mcap.writer")
    with (tmp_path / "b.mcap").open("wb") as stream:
        writer = writer_module.Writer(stream, use_chunking=False)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(topic="/imu", message_encoding="json", schema_id=schema)
        for t in T + 1.0:
            ns = round(1e9 * t)
            writer.add_message(channel, log_time=ns, publish_time=ns, data=json.dumps({"y": t}).encode())
        writer.finish()
    whole = (tmp_path / "b.mcap").read_bytes()
    (tmp_path / "b.mcap").write_bytes(whole[: len(whole) // 3])
    (recording,) = read_recordings(tmp_path / "b.mcap")
    assert 400 < recording.t.size < 1000 and np.allclose(recording.channels["imu.y"], recording.t)
    assert any("has no end" in note for note in recording.notes)
    (tmp_path / "a.mcap").write_bytes(data[:300])
    with pytest.raises(FileProblems):
        read_recordings(tmp_path / "a.mcap")
