"""Bytes to frames: valid frames are decoded, damaged ones rejected, whatever the division of the bytes."""

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
from railui.capture.protocol.link import Link
from railui.capture.protocol.messages import Channel, CorruptFrame, Frame, Hello, InvalidFrame, Mark, Samples, Status
from tests.capture.soak import CHANNELS, soak

DESCRIPTION = (0xDEADBEEF, 200.0, "box", "2.1", CHANNELS)
BODY = wire.hello_body(*DESCRIPTION)
TEXT = text.hello_text(*DESCRIPTION)
LAYOUT = wire.layout_hash(BODY)
TEXT_LAYOUT = text.layout_hash(TEXT)


def frames_in(data: bytes) -> list[Frame]:
    return Link().feed(data)


def test_sample_frame_consists_of_header_values_and_crc_in_cobs() -> None:
    payload = struct.pack("<BHII2h", 2, 0x1A2B, 7, 350_000, 120, -3400)
    by_hand = cobs.encode(payload + struct.pack("<I", crc32(payload))) + b"\0"
    assert wire.encode_sample(0x1A2B, 7, 350_000, struct.pack("<2h", 120, -3400)) == by_hand


def test_every_kind_of_frame_is_decoded_as_encoded() -> None:
    data = struct.pack("<6h", 1, -2, 3, -32768, 32767, 0)
    sent = [
        wire.encode_hello(0, BODY),
        wire.encode_sample(LAYOUT, 1, 5000, data),
        wire.encode_block(LAYOUT, 2, 10_000, 2, data + data),
        wire.encode_status(LAYOUT, 3, 15_000, 4, -3.5, 12.25),
        wire.encode_status(LAYOUT, 4, 15_000, 4),
        wire.encode_mark(LAYOUT, 5, 20_000, "trackside", 1.75e9, "km 12.3"),
    ]
    hello, *others = frames_in(b"\0" + b"".join(sent))
    assert isinstance(hello, Hello) and (hello.boot, hello.rate, hello.device) == (0xDEADBEEF, 200.0, "box")
    assert hello.channels == CHANNELS
    assert others == [
        Samples(LAYOUT, 1, 5000, 1, data),
        Samples(LAYOUT, 2, 10_000, 2, data + data),
        Status(LAYOUT, 3, 15_000, 4, -3.5, 12.25),
        Status(LAYOUT, 4, 15_000, 4, None, None),
        Mark(LAYOUT, 5, 20_000, "trackside", 1.75e9, "km 12.3"),
    ]
    assert hello.decode_samples(data)[0].tolist() == pytest.approx([0.001, -0.002, 0.003, -32.768, 32.767, 0.0])


def test_text_lines_are_decoded_as_encoded() -> None:
    sent = [
        text.encode_hello(0, TEXT),
        text.encode_sample(TEXT_LAYOUT, 1, 5000, [1, 2.5, math.nan, -4, 5, 6]),
        text.encode_status(TEXT_LAYOUT, 2, 6000, 1, None, 12.3),
        text.encode_mark(TEXT_LAYOUT, 3, 7000, "button", 0.0, "bridge, north end"),
    ]
    hello, sample, status, mark = frames_in(b"".join(sent).replace(b"\n", b"\r\n"))
    assert isinstance(hello, Hello) and hello.channels[0] == Channel("c0", "m/s^2", "f", 0.001, 0.0)
    assert isinstance(sample, Samples) and sample.data[1] == 2.5 and math.isnan(float(sample.data[2]))
    assert status == Status(TEXT_LAYOUT, 2, 6000, 1, None, 12.3)
    assert mark == Mark(TEXT_LAYOUT, 3, 7000, "button", 0.0, "bridge, north end")


def test_channels_of_different_types_are_decoded() -> None:
    channels = (Channel("a", "m", "i", 0.5), Channel("b", "V", "f"), Channel("c", "1", "B", 1.0, -10.0))
    hello = Hello(0, 0, 0, 100.0, "", "", channels)
    values = hello.decode_samples(struct.pack("<ifBifB", 7, 0.25, 3, -8, math.inf, 255))
    assert values[:, 0].tolist() == [3.5, -4.0] and values[0, 1] == 0.25 and math.isnan(values[1, 1])
    assert values[:, 2].tolist() == [-7.0, 245.0]


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (wire.encode_frame(wire.HEADER.pack(9, LAYOUT, 0) + b"x"), "kind"),
        (wire.encode_frame(wire.HEADER.pack(wire.HELLO, LAYOUT ^ 1, 0) + BODY), "low 16 bits"),
        (wire.encode_frame(wire.HEADER.pack(wire.STATUS, LAYOUT, 0) + b"12"), "missing or invalid fields"),
        (text.encode_line("S,zz,1,2,3"), "missing or invalid fields"),
        (text.encode_line(f"H,0000,0,1,200,box,1,1000000,{'a;m;1;0'}"), "1000000 channels"),
        (text.encode_line(f"S,{TEXT_LAYOUT:04x},-1,2,3"), "counter"),
    ],
)
def test_invalid_frame_with_correct_crc_is_refused_with_the_reason(frame: bytes, reason: str) -> None:
    link = Link()
    link.feed(wire.encode_sample(1, 0, 0, b"ab") if frame.endswith(b"\0") else text.encode_sample(1, 0, 0, [1.0]))
    assert link.feed(frame) == []
    assert link.statistics.refused == 1 and reason in link.statistics.reasons[0]


def test_hello_that_claims_65535_channels_is_refused() -> None:
    at = BODY.index(b"\x02c0") - wire.CHANNEL_HEADER.size - 2
    huge = BODY[:at] + b"\xff\xff" + BODY[at + 2 :]
    with pytest.raises(InvalidFrame, match="claims 65535 channels"):
        wire.decode(wire.encode_hello(0, huge)[:-1])


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
def test_hello_with_invalid_channels_is_refused(channels: tuple[Channel, ...]) -> None:
    body = wire.hello_body(1, 200.0, "x", "1", channels)
    with pytest.raises(InvalidFrame):
        wire.decode(wire.encode_hello(0, body)[:-1])


byte_parts = st.lists(
    st.one_of(
        st.binary(max_size=60),
        st.builds(lambda n: wire.encode_sample(LAYOUT, n, 5000 * n % 2**32, bytes(12)), st.integers(0, 2**32 - 1)),
        st.builds(lambda n: text.encode_sample(TEXT_LAYOUT, n, 0, [float(n)] * 6), st.integers(0, 999)),
        st.just(wire.encode_hello(0, BODY)),
        st.just(text.encode_hello(0, TEXT)),
    ),
    max_size=12,
)


@settings(max_examples=300, deadline=None)
@given(byte_parts, st.lists(st.integers(1, 50), max_size=30))
def test_division_of_bytes_into_reads_has_no_influence(parts: list[bytes], cuts: list[int]) -> None:
    data = b"".join(parts)
    whole, divided = Link(), Link()
    expected = whole.feed(data)
    frames: list[Frame] = []
    at = 0
    for cut in [*cuts, len(data) + 1]:
        frames += divided.feed(data[at : at + cut])
        at += cut
    assert frames == expected and divided.statistics == whole.statistics and divided.form == whole.form


@settings(max_examples=500, deadline=None)
@given(st.binary(max_size=400))
def test_decoders_raise_only_their_own_errors(data: bytes) -> None:
    for decode in (wire.decode, text.decode):
        for candidate in (data, wire.encode_frame(data)[:-1], text.encode_line(data.decode("latin-1"))[:-1]):
            with contextlib.suppress(CorruptFrame, InvalidFrame):
                decode(candidate)


def test_no_damaged_frame_is_accepted_as_valid() -> None:
    result = soak(20_000, seed=3)
    assert result.frames >= 20_000 and result.wrong == 0 and result.refused > 19_000


def test_endless_junk_uses_limited_memory() -> None:
    link = Link()
    junk = np.random.default_rng(0).integers(1, 10, 100_000, dtype=np.uint8).tobytes()
    for _ in range(50):
        link.feed(junk)
    assert link.pending_bytes <= wire.MAX_ENCODED_BYTES + text.MAX_LINE_BYTES and link.statistics.frames == 0
    assert [type(f) for f in link.feed(b"\0" + wire.encode_hello(0, BODY))] == [Hello]


def test_first_valid_frame_decides_the_form() -> None:
    link = Link()
    assert link.form is None
    link.feed(b"garbage\n\0garbage")
    assert link.form is None
    link.feed(b"\n" + text.encode_hello(0, TEXT))
    assert link.form == "text"
    assert link.feed(b"\0" + wire.encode_hello(0, BODY)) == []


@pytest.mark.parametrize("step", [1, 7, 1000, 10**6])
def test_bytes_without_an_intact_frame_are_counted_whatever_their_division(step: int) -> None:
    hello, sample = wire.encode_hello(0, BODY), wire.encode_sample(LAYOUT, 1, 5000, bytes(12))
    data = hello + b"\x81" * 20_000 + b"\0" + b"\x82" * 500 + b"\0" + sample + b"\x83" * 300
    link = Link()
    for start in range(0, len(data), step):
        link.feed(data[start : start + step])
    assert link.statistics.frames == 2
    assert (link.statistics.undecoded, link.statistics.longest_undecoded) == (300, 20_500)
    assert link.close().longest_undecoded == 20_500
