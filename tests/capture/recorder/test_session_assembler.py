"""Frames to sessions: missing data are counted exactly, another logger begins another session."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railui.arrays import FloatArray
from railui.capture.protocol import wire
from railui.capture.protocol.messages import Channel
from railui.capture.recorder.clock import fit_clock
from railui.capture.recorder.postponed_frames import MAX_PENDING_BYTES
from railui.capture.recorder.replay import decode
from railui.capture.recorder.session_assembler import SessionAssembler
from railui.capture.recorder.sessions import LoggerSession, Rows
from railui.capture.simulator.logger import Faults, SimulatedLogger

RATE = 200.0
CHANNELS = tuple(Channel(f"c{i}", "m/s^2", "h", 0.001) for i in range(4))


def logger(samples: int = 2000, block: int = 1, form: str = "binary", **more: float) -> SimulatedLogger:
    random = np.random.default_rng(5)
    series = {c.name: random.normal(size=samples) for c in CHANNELS}
    known = {k: more.pop(k) for k in ("drift", "start") if k in more}
    result = SimulatedLogger(CHANNELS, series, RATE, block, form, Faults(**more))  # type: ignore[arg-type]
    return dataclasses.replace(result, **known)  # type: ignore[arg-type]


def assemble(sender: SimulatedLogger) -> tuple[SessionAssembler, list[tuple[LoggerSession, Rows]]]:
    assembly = SessionAssembler()
    rows = []
    for _, data in sender.transmit():
        if data:
            rows += assembly.feed(data)
        else:
            rows += assembly.reconnect()
    return assembly, rows + assembly.close()


def times(rows: list[tuple[LoggerSession, Rows]], session: int = 1) -> FloatArray:
    return np.concatenate([r.t for s, r in rows if s.number == session])


@pytest.mark.parametrize("form", ["binary", "text"])
def test_samples_are_decoded_with_their_times(form: str) -> None:
    sender = logger(form=form)
    assembly, rows = assemble(sender)
    values = np.concatenate([r.values for _, r in rows])
    wanted = np.stack(list(sender.series.values()), axis=1)
    assert np.max(np.abs(values - wanted)) <= (0.00051 if form == "binary" else 1e-8)
    assert np.max(np.abs(times(rows) - np.arange(2000) / RATE)) < 1e-6
    assert assembly.counts.lost_frames == 0 and assembly.counts.gaps == 0


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 2**31),
    st.sampled_from(["binary", "text"]),
    st.sampled_from([1, 7]),
    st.floats(0, 0.2),
    st.floats(0, 0.2),
)
def test_lost_frames_are_counted_exactly(seed: int, form: str, block: int, drop: float, damage: float) -> None:
    sender = logger(400, block, form, drop=drop, damage=damage, junk=0.05, repeat=0.05, seed=seed)
    assembly, _ = assemble(sender)
    sent = sender.sent_counts
    counts = assembly.counts
    # frames lost after the last received one have no later number
    tail = sender.next_frame_number - (assembly.next_frame_number or 0)
    assert counts.lost_frames + tail == sent.dropped + sent.damaged
    assert counts.samples + counts.missing_samples <= 400
    assert assembly.link_statistics().frames == sent.frames + sent.repeated - _invalid_frames(
        assembly, sent.damaged, sent.repeated
    )


def _invalid_frames(assembly: SessionAssembler, damaged: int, repeated: int) -> int:
    """Return the sent frames that are invalid: damaged ones, and damaged ones that were repeated."""
    return damaged + (repeated - assembly.counts.repeated_frames)


def test_gap_is_counted_and_remains() -> None:
    assembly, rows = assemble(logger(pause=3.0))
    t = times(rows)
    assert assembly.counts.gaps == 1 and assembly.counts.missing_samples == 200
    assert np.max(np.diff(t)) == pytest.approx(1.005)


def test_time_and_number_continue_when_their_counters_wrap() -> None:
    assembly, rows = assemble(logger(start=2**32 - 3_000_000))
    assert len(assembly.sessions) == 1 and assembly.counts.gaps == 0
    assert times(rows)[-1] == pytest.approx(1999 / RATE, abs=1e-6)
    late = SessionAssembler()
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8)
    late.feed(
        wire.encode_hello(2**32 - 2, body)
        + wire.encode_sample(layout, 2**32 - 1, 0, data)
        + wire.encode_sample(layout, 0, 5000, data)
    )
    assert late.counts.lost_frames == 0 and late.counts.samples == 2


def test_silence_longer_than_the_counter_follows_from_the_frame_numbers() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8)
    assembly = SessionAssembler()
    missing = 1_000_000  # 5000 s: the 32 bits of microseconds wrap after 4295 s
    rows = assembly.feed(wire.encode_hello(0, body) + wire.encode_sample(layout, 1, 0, data))
    rows += assembly.feed(wire.encode_sample(layout, 2 + missing, 5000 * (missing + 1) % 2**32, data))
    assert times(rows)[-1] == pytest.approx((missing + 1) / RATE)
    assert assembly.counts.lost_frames == missing and assembly.counts.missing_samples == missing


def test_clock_that_runs_back_begins_a_session() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8)
    assembly = SessionAssembler()
    assembly.feed(
        wire.encode_hello(0, body)
        + wire.encode_sample(layout, 1, 9_000_000, data)
        + wire.encode_sample(layout, 2, 1000, data)
    )
    assert assembly.counts.clock_jumps == 1 and [s.samples for s in assembly.sessions] == [1, 1]


def test_restart_begins_a_session_without_loss() -> None:
    assembly, rows = assemble(logger(restart=4.0))
    assert [s.reason for s in assembly.sessions] == ["begin", "restart"]
    assert assembly.counts.restarts == 1 and assembly.counts.lost_frames == 0
    assert sum(r.t.size for _, r in rows) == 2000 and times(rows, 2)[0] == 0.0


def test_other_channels_begin_a_session() -> None:
    assembly, rows = assemble(logger(relayout=4.0))
    _, second = assembly.sessions
    assert second.reason == "other channels" and len(second.hello.channels) == 3
    assert {r.values.shape[1] for s, r in rows if s is second} == {3} and assembly.counts.lost_frames == 0


def test_samples_wait_for_their_hello_in_limited_memory() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8)
    assembly = SessionAssembler()
    count = 100_000
    for n in range(count):
        assembly.feed(wire.encode_sample(layout, n, 5000 * n % 2**32, data))
    assert assembly.pending_bytes <= MAX_PENDING_BYTES and assembly.counts.frames_without_hello > 0
    rows = assembly.feed(wire.encode_hello(count, body))
    assert sum(r.t.size for _, r in rows) == count - assembly.counts.frames_without_hello > 10_000
    assert assembly.counts.lost_frames == 0


def test_samples_that_contradict_their_hello_are_refused() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    assembly = SessionAssembler()
    assembly.feed(wire.encode_hello(0, body) + wire.encode_sample(wire.layout_hash(body), 1, 0, bytes(6)))
    assert assembly.counts.samples == 0 and "8 bytes" in assembly.link_statistics().reasons[0]


def test_clock_error_leaves_no_gaps_between_blocks() -> None:
    assembly, rows = assemble(logger(20_000, block=100, drift=0.004))
    steps = np.diff(times(rows))
    assert assembly.counts.gaps == 0 and assembly.link_statistics().refused == 0
    assert np.max(np.abs(steps[10_000:] * RATE - 1.004)) < 2e-3


def test_reconnect_begins_a_session_on_the_same_clock() -> None:
    assembly, rows = assemble(logger(unplug=4.0))
    assert [s.reason for s in assembly.sessions] == ["begin", "reconnect"] and assembly.counts.reconnects == 1
    assert times(rows, 2)[0] > times(rows, 1)[-1]


def test_clock_drift_is_estimated_from_samples_that_arrive_late() -> None:
    random = np.random.default_rng(1)
    there = np.arange(0.0, 600.0, 1.0)
    here = 1000.0 + there * (1 + 50e-6) + random.exponential(0.02, there.size)
    fit = fit_clock(list(zip(there, here, strict=True)))
    assert fit is not None and fit.drift == pytest.approx(50e-6, abs=10e-6) and fit.drift_sd < 10e-6


@pytest.mark.parametrize("at", [300, 595])
def test_a_clock_that_is_set_forward_keeps_the_model_of_before(at: int) -> None:
    random = np.random.default_rng(2)
    there = np.arange(0.0, 600.0, 1.0)
    here = 1000.0 + there * (1 + 50e-6) + random.exponential(0.02, there.size)
    there[at:] += 600.0
    fit = fit_clock(list(zip(there, here, strict=True)))
    assert fit is not None and fit.drift == pytest.approx(50e-6, abs=40e-6)
    assert fit.host_time(0.0) == pytest.approx(1000.0, abs=0.02)


@pytest.mark.parametrize("rate", [0.5, 10.0])
def test_samples_that_a_dead_line_held_back_and_a_replay_are_no_clock_that_is_set(rate: float) -> None:
    host = np.arange(0.0, 60.0, 1.0)
    logger_time = rate * host
    host[30:40] = 40.0  # of a line that was dead for ten seconds
    fit = fit_clock(list(zip(logger_time, 1000.0 + host, strict=True)))
    assert fit is not None and 1.0 / (1.0 + fit.drift) == pytest.approx(rate, rel=0.15)


def test_drift_within_its_uncertainty_is_not_applied() -> None:
    random = np.random.default_rng(1)
    there = np.arange(0.0, 60.0, 1.0)
    fit = fit_clock(list(zip(there, 1000.0 + there + random.exponential(0.02, there.size), strict=True)))
    assert fit is not None and not fit.is_significant
    assert fit.host_time(50.0) - fit.host_time(0.0) == pytest.approx(50.0, abs=1e-12)


class SameBootLogger(SimulatedLogger):
    """Logger without a counter of its starts."""

    def _restart(self) -> None:
        boot = self._boot
        super()._restart()
        self._boot = boot
        self._configure(self._configured)


@pytest.mark.parametrize("form", ["binary", "text"])
@pytest.mark.parametrize("has_reconnect", [True, False])
@pytest.mark.parametrize("at", [3.0, 7.0])
def test_a_restart_with_the_same_boot_loses_nothing(form: str, has_reconnect: bool, at: float) -> None:
    plain = logger(form=form, restart=at)
    fields = {f.name: getattr(plain, f.name) for f in dataclasses.fields(plain)}
    faults = dataclasses.replace(plain.faults, unplug=at if has_reconnect else 0.0)
    assembly, rows = assemble(SameBootLogger(**fields | {"faults": faults}))
    assert assembly.counts.restarts == 1 and assembly.counts.lost_frames == 0
    assert assembly.counts.samples == 2000 and assembly.counts.repeated_frames == 0
    assert sum(r.t.size for _, r in rows) == 2000 and [s.start for s in assembly.sessions] == [0, 1]
    assert assembly.sessions[1].reason == ("reconnect after a restart" if has_reconnect else "restart")
    assert times(rows, 2)[0] == 0.0


def test_late_repetitions_are_no_restart() -> None:
    frames = [data for _, data in logger(1500).transmit()]
    for k in (20, 400, 900):
        frames[k:k] = frames[k - 7 : k]
    assembly = SessionAssembler()
    assembly.feed(b"".join(frames))
    assert assembly.counts.restarts == 0 and assembly.counts.repeated_frames == 21
    assert assembly.counts.samples == 1500 and len(assembly.sessions) == 1


@pytest.mark.parametrize(
    ("rate", "block"), [(208.0, 20), (205.0, 50), (212.0, 20), (192.0, 20), (200.2, 255), (209.0, 2)]
)
def test_blocks_of_a_sensor_off_its_stated_rate_have_even_times(rate: float, block: int) -> None:
    assembly, rows = assemble(logger(20_000, block=block, drift=200.0 / rate - 1))
    assert len(assembly.sessions) == 1 and assembly.counts.gaps == 0 and assembly.counts.samples == 20_000
    assert assembly.link_statistics().refused == 0
    # stamps are whole microseconds
    assert np.max(np.abs(times(rows) - np.arange(20_000) / rate)) < 2e-6
    found = assembly.sessions[0].true_rate
    assert found == pytest.approx(rate, rel=1e-6) if rate != 200.2 else found is None


def test_a_missing_sample_between_blocks_is_a_gap() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8 * 20)
    assembly = SessionAssembler()
    rows = assembly.feed(wire.encode_hello(0, body))
    for k in range(30):
        rows += assembly.feed(wire.encode_block(layout, k + 1, 100_000 * k + (5000 if k > 20 else 0), 20, data))
    rows += assembly.close()
    assert assembly.counts.gaps == 1 and assembly.counts.missing_samples == 1
    assert np.max(np.abs(times(rows)[:420] - np.arange(420) / RATE)) < 1e-9


@pytest.mark.parametrize("minutes", [10, 35, 36, 50, 71, 72, 100, 143, 215])
@pytest.mark.parametrize("block", [1, 20])
def test_a_line_dead_for_any_time_is_one_gap(minutes: int, block: int) -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8 * block)
    assembly = SessionAssembler()
    rows = assembly.feed(wire.encode_hello(0, body))
    dead = 12_000 * minutes // block
    for k in (*range(200), *range(200 + dead, 400 + dead)):
        time = round(5000 * block * k) % 2**32
        if block == 1:
            rows += assembly.feed(wire.encode_sample(layout, k + 1, time, data))
        else:
            rows += assembly.feed(wire.encode_block(layout, k + 1, time, block, data))
    rows += assembly.close()
    assert assembly.counts.clock_jumps == 0 and len(assembly.sessions) == 1
    assert assembly.counts.gaps == 1 and assembly.counts.missing_samples == dead * block
    assert times(rows)[-1] == pytest.approx(((400 + dead) * block - 1) / RATE, abs=1e-6)


def test_a_slow_logger_with_statuses_keeps_its_time_over_a_dead_line() -> None:
    body = wire.hello_body(1, 1.0, "x", "1", CHANNELS)
    layout = wire.layout_hash(body)
    assembly = SessionAssembler()
    rows = assembly.feed(wire.encode_hello(0, body))
    dead = 67 * 60
    for k in (*range(100), *range(100 + dead, 200 + dead)):
        time = 1_000_000 * k % 2**32
        rows += assembly.feed(wire.encode_sample(layout, 2 * k + 1, time, bytes(8)))
        rows += assembly.feed(wire.encode_status(layout, 2 * k + 2, time, 0))
    assert times(rows)[-1] == pytest.approx(199 + dead) and assembly.counts.missing_samples == dead


def test_clipping_is_reported_by_channel(tmp_path: Path) -> None:
    sender = logger(4000)
    sender.series["c1"][:] = np.clip(sender.series["c1"], -1.0, 1.0)  # type: ignore[index]
    sender = dataclasses.replace(sender)
    (tmp_path / "raw.bin").write_bytes(b"".join(data for _, data in sender.transmit()))
    report = decode(tmp_path / "raw.bin", tmp_path / "out").report()
    assert report["segments"][0]["clipped"] == ["c1"]
    assert any("segment 1: c1 is clipped at 1 m/s^2" in note or "at -1 m/s^2" in note for note in report["notes"])


def test_the_end_of_a_recording_is_no_arrival_for_the_drift(tmp_path: Path) -> None:
    """Twelve seconds of a logger without drift, then five of silence."""
    frames = list(logger(2400).transmit())
    data, events, done = b"", [{"at": 0, "event": "open", "mono": 0.0, "wall_s": 1e9}], 0
    for at, frame in frames:
        if int(at) > done:
            done = int(at)
            events.append({"at": len(data), "event": "tick", "mono": at})
        data += frame
    events.append({"at": len(data), "event": "close", "mono": 17.0})
    (tmp_path / "raw.bin").write_bytes(data)
    (tmp_path / "journal.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))
    (segment,) = decode(tmp_path / "raw.bin", tmp_path / "out").report()["segments"]
    assert abs(segment["drift"]) < 1e-6 and abs(segment["begins"] - 1e9) < 0.01


def test_half_the_stated_rate_and_a_clock_set_forward_are_named(tmp_path: Path) -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_hash(body), bytes(8)
    frames = [wire.encode_sample(layout, k + 1, 10_000 * k + (600_000_000 if k > 500 else 0), data) for k in range(900)]
    (tmp_path / "raw.bin").write_bytes(wire.encode_hello(0, body) + b"".join(frames))
    notes = decode(tmp_path / "raw.bin", tmp_path / "out").report()["notes"]
    assert "segment 1 has 100 samples/s, its hello states 200: correct it" in notes
    assert any(note.startswith("1 times the logger's time advanced by more than a second without a") for note in notes)
