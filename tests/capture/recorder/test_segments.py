"""Frames to segments: what is missing is counted exactly, what belongs to another logger is another segment."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railui.arrays import FloatArray
from railui.capture.protocol import wire
from railui.capture.protocol.frames import Channel
from railui.capture.recorder.assembly import MOST_HELD, Assembly
from railui.capture.recorder.clock import fit_clock
from railui.capture.recorder.segments import Rows, Segment
from railui.capture.simulator.logger import Faults, Logger

RATE = 200.0
CHANNELS = tuple(Channel(f"c{i}", "m/s^2", "h", 0.001) for i in range(4))


def logger(samples: int = 2000, block: int = 1, form: str = "binary", **more: float) -> Logger:
    random = np.random.default_rng(5)
    series = {c.name: random.normal(size=samples) for c in CHANNELS}
    known = {k: more.pop(k) for k in ("drift", "start") if k in more}
    made = Logger(CHANNELS, series, RATE, block, form, Faults(**more))  # type: ignore[arg-type]
    return dataclasses.replace(made, **known)  # type: ignore[arg-type]


def heard(sender: Logger) -> tuple[Assembly, list[tuple[Segment, Rows]]]:
    assembly = Assembly()
    rows = []
    for _, data in sender.sent():
        if data:
            rows += assembly.feed(data)
        else:
            assembly.reconnect()
    return assembly, rows


def times(rows: list[tuple[Segment, Rows]], segment: int = 1) -> FloatArray:
    return np.concatenate([r.t for s, r in rows if s.number == segment])


@pytest.mark.parametrize("form", ["binary", "text"])
def test_samples_come_through_with_their_times(form: str) -> None:
    sender = logger(form=form)
    assembly, rows = heard(sender)
    found = np.concatenate([r.values for _, r in rows])
    wanted = np.stack(list(sender.series.values()), axis=1)
    assert np.max(np.abs(found - wanted)) <= (0.00051 if form == "binary" else 1e-8)
    assert np.max(np.abs(times(rows) - np.arange(2000) / RATE)) < 1e-6
    assert assembly.counts.lost == 0 and assembly.counts.gaps == 0


@settings(max_examples=15, deadline=None)
@given(
    st.integers(0, 2**31),
    st.sampled_from(["binary", "text"]),
    st.sampled_from([1, 7]),
    st.floats(0, 0.2),
    st.floats(0, 0.2),
)
def test_missing_by_number_is_truly_missing(seed: int, form: str, block: int, drop: float, damage: float) -> None:
    sender = logger(400, block, form, drop=drop, damage=damage, junk=0.05, repeat=0.05, seed=seed)
    assembly, _ = heard(sender)
    truth, counts = sender.truth, assembly.counts
    # what was lost after the last frame that came through has no later number to show it
    tail = sender._number - (assembly._expected or 0)
    assert counts.lost + tail == truth.dropped + truth.damaged
    assert counts.samples + counts.missing <= 400
    assert assembly.total().frames == truth.frames + truth.repeated - _unread(assembly, truth.damaged, truth.repeated)


def _unread(assembly: Assembly, damaged: int, repeated: int) -> int:
    """Frames that were sent and are not whole: damaged ones, and those damaged that were sent twice."""
    return damaged + (repeated - assembly.counts.repeated)


def test_a_gap_stays_a_gap() -> None:
    assembly, rows = heard(logger(pause=3.0))
    t = times(rows)
    assert assembly.counts.gaps == 1 and assembly.counts.missing == 200
    assert np.max(np.diff(t)) == pytest.approx(1.005)


def test_time_and_number_go_on_where_their_counters_wrap() -> None:
    assembly, rows = heard(logger(start=2**32 - 3_000_000))
    assert len(assembly.segments) == 1 and assembly.counts.gaps == 0
    assert times(rows)[-1] == pytest.approx(1999 / RATE, abs=1e-6)
    late = Assembly()
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_of(body), bytes(8)
    late.feed(
        wire.hello(2**32 - 2, body) + wire.sample(layout, 2**32 - 1, 0, data) + wire.sample(layout, 0, 5000, data)
    )
    assert late.counts.lost == 0 and late.counts.samples == 2


def test_a_silence_longer_than_the_counter_is_told_by_the_numbers() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_of(body), bytes(8)
    assembly = Assembly()
    missing = 1_000_000  # 5000 s: the 32 bits of microseconds wrap after 4295 s
    rows = assembly.feed(wire.hello(0, body) + wire.sample(layout, 1, 0, data))
    rows += assembly.feed(wire.sample(layout, 2 + missing, 5000 * (missing + 1) % 2**32, data))
    assert times(rows)[-1] == pytest.approx((missing + 1) / RATE)
    assert assembly.counts.lost == missing and assembly.counts.missing == missing


def test_a_clock_that_runs_back_begins_a_segment() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_of(body), bytes(8)
    assembly = Assembly()
    assembly.feed(wire.hello(0, body) + wire.sample(layout, 1, 9_000_000, data) + wire.sample(layout, 2, 1000, data))
    assert assembly.counts.clock_jumps == 1 and [s.samples for s in assembly.segments] == [1, 1]


def test_a_restart_begins_a_segment_and_loses_nothing_that_came() -> None:
    assembly, rows = heard(logger(restart=4.0))
    assert [s.why for s in assembly.segments] == ["begin", "restart"]
    assert assembly.counts.restarts == 1 and assembly.counts.lost == 0
    assert sum(r.t.size for _, r in rows) == 2000 and times(rows, 2)[0] == 0.0


def test_other_channels_in_mid_run_begin_a_segment_of_their_own() -> None:
    assembly, rows = heard(logger(relayout=4.0))
    _, second = assembly.segments
    assert second.why == "other channels" and len(second.hello.channels) == 3
    assert {r.values.shape[1] for s, r in rows if s is second} == {3} and assembly.counts.lost == 0


def test_samples_wait_for_their_hello_within_bounds() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    layout, data = wire.layout_of(body), bytes(8)
    assembly = Assembly()
    count = 100_000
    for n in range(count):
        assembly.feed(wire.sample(layout, n, 5000 * n % 2**32, data))
    assert assembly._held_bytes <= MOST_HELD and assembly.counts.unnamed > 0
    rows = assembly.feed(wire.hello(count, body))
    assert sum(r.t.size for _, r in rows) == count - assembly.counts.unnamed > 10_000
    assert assembly.counts.lost == 0


def test_samples_that_do_not_fit_their_hello_are_refused() -> None:
    body = wire.hello_body(1, RATE, "x", "1", CHANNELS)
    assembly = Assembly()
    assembly.feed(wire.hello(0, body) + wire.sample(wire.layout_of(body), 1, 0, bytes(6)))
    assert assembly.counts.samples == 0 and "8 bytes" in assembly.total().reasons[0]


def test_blocks_of_a_clock_that_is_off_leave_no_gap_between_them() -> None:
    assembly, rows = heard(logger(20_000, block=100, drift=0.004))
    steps = np.diff(times(rows))
    assert assembly.counts.gaps == 0 and assembly.total().refused == 0
    assert np.max(np.abs(steps[10_000:] * RATE - 1.004)) < 2e-3


def test_a_reconnect_goes_on_with_the_same_clock_in_a_new_segment() -> None:
    assembly, rows = heard(logger(unplug=4.0))
    assert [s.why for s in assembly.segments] == ["begin", "reconnect"] and assembly.counts.reconnects == 1
    assert times(rows, 2)[0] > times(rows, 1)[-1]


def test_the_drift_of_a_clock_is_found_though_samples_arrive_late() -> None:
    random = np.random.default_rng(1)
    there = np.arange(0.0, 600.0, 1.0)
    here = 1000.0 + there * (1 + 50e-6) + random.exponential(0.02, there.size)
    fit = fit_clock(list(zip(there, here, strict=True)))
    assert fit is not None and fit.drift == pytest.approx(50e-6, abs=10e-6) and fit.drift_sd < 10e-6
