"""Bytes to frames: what is sent comes through, what is damaged does not, however the bytes arrive."""

from __future__ import annotations

import contextlib
import math
import struct
from zlib import crc32

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st

from railui.capture.protocol import text, wire
from railui.capture.protocol.frames import Channel, Damaged, Frame, Hello, Mark, Refused, Samples, Status
from railui.capture.protocol.link import Link
from tests.capture.soak import CHANNELS, soak

ABOUT = (0xDEADBEEF, 200.0, "box", "2.1", CHANNELS)
BODY, LINE = wire.hello_body(*ABOUT), text.hello_text(*ABOUT)
LAYOUT, LINES = wire.layout_of(BODY), text.layout_of(LINE)


def through(data: bytes) -> list[Frame]:
    return Link().feed(data)


def test_a_sample_frame_is_head_values_crc_in_cobs() -> None:
    payload = struct.pack("<BHII2h", 2, 0x1A2B, 7, 350_000, 120, -3400)
    by_hand = cobs.encode(payload + struct.pack("<I", crc32(payload))) + b"\0"
    assert wire.sample(0x1A2B, 7, 350_000, struct.pack("<2h", 120, -3400)) == by_hand


def test_every_kind_comes_through_as_it_was_sent() -> None:
    data = struct.pack("<6h", 1, -2, 3, -32768, 32767, 0)
    sent = [
        wire.hello(0, BODY),
        wire.sample(LAYOUT, 1, 5000, data),
        wire.block(LAYOUT, 2, 10_000, 2, data + data),
        wire.status(LAYOUT, 3, 15_000, 4, -3.5, 12.25),
        wire.status(LAYOUT, 4, 15_000, 4),
        wire.mark(LAYOUT, 5, 20_000, "trackside", 1.75e9, "km 12.3"),
    ]
    hello, *rest = through(b"\0" + b"".join(sent))
    assert isinstance(hello, Hello) and (hello.boot, hello.rate, hello.device) == (0xDEADBEEF, 200.0, "box")
    assert hello.channels == CHANNELS
    assert rest == [
        Samples(LAYOUT, 1, 5000, 1, data),
        Samples(LAYOUT, 2, 10_000, 2, data + data),
        Status(LAYOUT, 3, 15_000, 4, -3.5, 12.25),
        Status(LAYOUT, 4, 15_000, 4, None, None),
        Mark(LAYOUT, 5, 20_000, "trackside", 1.75e9, "km 12.3"),
    ]
    assert hello.values(data)[0].tolist() == pytest.approx([0.001, -0.002, 0.003, -32.768, 32.767, 0.0])


def test_lines_of_text_say_the_same() -> None:
    sent = [
        text.hello(0, LINE),
        text.sample(LINES, 1, 5000, [1, 2.5, math.nan, -4, 5, 6]),
        text.status(LINES, 2, 6000, 1, None, 12.3),
        text.mark(LINES, 3, 7000, "button", 0.0, "bridge, north end"),
    ]
    hello, sample, status, mark = through(b"".join(sent).replace(b"\n", b"\r\n"))
    assert isinstance(hello, Hello) and hello.channels[0] == Channel("c0", "m/s^2", "f", 0.001, 0.0)
    assert isinstance(sample, Samples) and sample.data[1] == 2.5 and math.isnan(float(sample.data[2]))
    assert status == Status(LINES, 2, 6000, 1, None, 12.3)
    assert mark == Mark(LINES, 3, 7000, "button", 0.0, "bridge, north end")


def test_channels_of_several_types_lie_side_by_side() -> None:
    channels = (Channel("a", "m", "i", 0.5), Channel("b", "V", "f"), Channel("c", "1", "B", 1.0, -10.0))
    hello = Hello(0, 0, 0, 100.0, "", "", channels)
    found = hello.values(struct.pack("<ifBifB", 7, 0.25, 3, -8, math.inf, 255))
    assert found[:, 0].tolist() == [3.5, -4.0] and found[0, 1] == 0.25 and math.isnan(found[1, 1])
    assert found[:, 2].tolist() == [-7.0, 245.0]


@pytest.mark.parametrize(
    ("frame", "why"),
    [
        (wire.framed(wire.HEAD.pack(9, LAYOUT, 0) + b"x"), "kind"),
        (wire.framed(wire.HEAD.pack(wire.HELLO, LAYOUT ^ 1, 0) + BODY), "low 16 bits"),
        (wire.framed(wire.HEAD.pack(wire.STATUS, LAYOUT, 0) + b"12"), "does not hold"),
        (text.line("S,zz,1,2,3"), "does not hold"),
        (text.line(f"H,0000,0,1,200,box,1,1000000,{'a;m;1;0'}"), "1000000 channels"),
        (text.line(f"S,{LINES:04x},-1,2,3"), "counter"),
    ],
)
def test_a_whole_frame_that_makes_no_sense_is_refused_with_the_reason(frame: bytes, why: str) -> None:
    link = Link()
    link.feed(wire.sample(1, 0, 0, b"ab") if frame.endswith(b"\0") else text.sample(1, 0, 0, [1.0]))
    assert link.feed(frame) == []
    assert link.heard.refused == 1 and why in link.heard.reasons[0]


def test_a_hello_that_claims_65535_channels_takes_no_memory_and_is_refused() -> None:
    at = BODY.index(b"\x02c0") - wire.PER_CHANNEL.size - 2
    huge = BODY[:at] + b"\xff\xff" + BODY[at + 2 :]
    with pytest.raises(Refused, match="claims 65535 channels"):
        wire.decode(wire.hello(0, huge)[:-1])


@pytest.mark.parametrize(
    "channels",
    [
        (),
        (Channel("a,b", "m"),),
        (Channel("a", "m"), Channel("a", "m")),
        (Channel("a", "m", "h", 0.0),),
        (Channel("t", "s"),),
    ],
)
def test_a_hello_that_no_run_could_be_made_of_is_refused(channels: tuple[Channel, ...]) -> None:
    body = wire.hello_body(1, 200.0, "x", "1", channels)
    with pytest.raises(Refused):
        wire.decode(wire.hello(0, body)[:-1])


pieces = st.lists(
    st.one_of(
        st.binary(max_size=60),
        st.builds(lambda n: wire.sample(LAYOUT, n, 5000 * n % 2**32, bytes(12)), st.integers(0, 2**32 - 1)),
        st.builds(lambda n: text.sample(LINES, n, 0, [float(n)] * 6), st.integers(0, 999)),
        st.just(wire.hello(0, BODY)),
        st.just(text.hello(0, LINE)),
    ),
    max_size=12,
)


@settings(max_examples=300, deadline=None)
@given(pieces, st.lists(st.integers(1, 50), max_size=30))
def test_how_bytes_are_cut_into_reads_makes_no_difference(parts: list[bytes], cuts: list[int]) -> None:
    data = b"".join(parts)
    whole, piecewise = Link(), Link()
    expected = whole.feed(data)
    found: list[Frame] = []
    at = 0
    for cut in [*cuts, len(data) + 1]:
        found += piecewise.feed(data[at : at + cut])
        at += cut
    assert found == expected and piecewise.heard == whole.heard and piecewise.form == whole.form


@settings(max_examples=500, deadline=None)
@given(st.binary(max_size=400))
def test_no_bytes_make_the_readers_fail_otherwise_than_by_saying_so(data: bytes) -> None:
    for read in (wire.decode, text.decode):
        for candidate in (data, wire.framed(data)[:-1], text.line(data.decode("latin-1"))[:-1]):
            with contextlib.suppress(Damaged, Refused):
                read(candidate)


def test_of_twenty_thousand_damaged_frames_none_is_taken_for_a_whole_one() -> None:
    found = soak(20_000, seed=3)
    assert found.frames >= 20_000 and found.wrong == 0 and found.refused > 19_000


def test_junk_without_an_end_takes_no_memory() -> None:
    link = Link()
    junk = np.random.default_rng(0).integers(1, 10, 100_000, dtype=np.uint8).tobytes()
    for _ in range(50):
        link.feed(junk)
    held = sum(len(cutter._rest) for cutter in link._forms.values())
    assert held <= wire.MOST_CODED + text.MOST_LINE and link.heard.frames == 0
    assert [type(f) for f in link.feed(b"\0" + wire.hello(0, BODY))] == [Hello]


def test_the_first_whole_frame_decides_the_form() -> None:
    link = Link()
    assert link.form is None
    link.feed(b"garbage\n\0garbage")
    assert link.form is None
    link.feed(b"\n" + text.hello(0, LINE))
    assert link.form == "text"
    assert link.feed(b"\0" + wire.hello(0, BODY)) == []
