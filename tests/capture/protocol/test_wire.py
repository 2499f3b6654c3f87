"""Binary frames byte by byte as docs/wire.md states them, and the reason for which each malformed one is refused."""

from __future__ import annotations

import struct
from zlib import crc32

import pytest
from cobs import cobs

from railui.capture.protocol import wire
from railui.capture.protocol.messages import Channel, CorruptFrame, Hello, InvalidFrame, Mark, Samples, Status

CHANNELS = (Channel("ay1", "m/s^2", "h", 0.004, 0.5), Channel("speed", "m/s", "H", 0.01, 0.0))
HEAD = struct.pack("<BIf", 1, 0xFFFF_FFF0, 200.0) + b"\x03box\x031.0"
FIRST = b"h" + struct.pack("<ff", 0.004, 0.5) + b"\x03ay1\x05m/s^2"
SECOND = b"H" + struct.pack("<ff", 0.01, 0.0) + b"\x05speed\x03m/s"
BODY = HEAD + b"\x02\0" + FIRST + SECOND
LAYOUT = crc32(BODY) & 0xFFFF
LATE = 2**32 + 7  # us: a time that has wrapped once


def payload_of(frame: bytes) -> bytes:
    """Return the payload of a frame, its CRC and delimiter checked."""
    assert frame.endswith(b"\0") and frame.count(b"\0") == 1
    decoded = cobs.decode(frame[:-1])
    assert struct.pack("<I", crc32(decoded[:-4])) == decoded[-4:]
    return decoded[:-4]


def frame_of(payload: bytes) -> bytes:
    """Return the bytes between two delimiters of a payload."""
    return cobs.encode(payload + struct.pack("<I", crc32(payload)))


def hello(body: bytes) -> bytes:
    return frame_of(struct.pack("<BHI", 1, crc32(body) & 0xFFFF, 3) + body)


def refusal(coded: bytes) -> str:
    with pytest.raises(InvalidFrame) as caught:
        wire.decode(coded)
    return str(caught.value)


def test_a_hello_is_encoded_as_documented() -> None:
    body = wire.hello_body(0xFFFF_FFF0, 200.0, "box", "1.0", CHANNELS)
    assert body == BODY and wire.layout_hash(body) == LAYOUT
    assert payload_of(wire.encode_hello(3, body)) == struct.pack("<BHI", 1, LAYOUT, 3) + BODY


def test_samples_and_blocks_are_encoded_as_documented_and_their_time_wraps() -> None:
    assert payload_of(wire.encode_sample(0x1A2B, 5, LATE, b"data")) == struct.pack("<BHII", 2, 0x1A2B, 5, 7) + b"data"
    block = struct.pack("<BHIIB", 3, 0x1A2B, 5, 7, 2) + b"databyte"
    assert payload_of(wire.encode_block(0x1A2B, 5, LATE, 2, b"databyte")) == block


def test_a_status_is_encoded_in_tenths_and_millivolts_and_wraps() -> None:
    known = wire.encode_status(0x1A2B, 5, LATE, 2**32 + 2, -3.46, 12.3456)
    assert payload_of(known) == struct.pack("<BHIIIhH", 4, 0x1A2B, 5, 7, 2, -35, 12346)
    unknown = wire.encode_status(0x1A2B, 5, LATE, 0)
    assert payload_of(unknown) == struct.pack("<BHIIIhH", 4, 0x1A2B, 5, 7, 0, -32768, 0)


def test_a_mark_is_encoded_in_seconds_and_microseconds() -> None:
    mark = wire.encode_mark(0x1A2B, 5, LATE, "trackside", 1_700_000_000.25, "km 3")
    assert payload_of(mark) == struct.pack("<BHIIBII", 5, 0x1A2B, 5, 7, 2, 1_700_000_000, 250_000) + b"\x04km 3"
    plain = wire.encode_mark(0x1A2B, 5, 7)
    assert payload_of(plain) == struct.pack("<BHIIBII", 5, 0x1A2B, 5, 7, 0, 0, 0) + b"\0"


def test_texts_are_measured_in_bytes_of_utf_8() -> None:
    mark = wire.encode_mark(0, 0, 0, label="Brücke")
    assert payload_of(mark)[-8:] == b"\x07Br\xc3\xbccke"
    assert wire.decode(mark[:-1]) == Mark(0, 0, 0, "button", 0.0, "Brücke")


def test_the_size_of_a_sample_is_that_of_its_types() -> None:
    letters = {"b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4, "f": 4}
    for letter, size in letters.items():
        assert wire.sample_size([Channel("a", "m", letter)] * 3) == 3 * size


def test_the_longest_frame_is_that_of_the_longest_payload_in_cobs() -> None:
    assert len(cobs.encode(b"x" * 8192)) == wire.MAX_ENCODED_BYTES == 8225


def test_every_kind_is_decoded_into_its_fields() -> None:
    found = wire.decode(hello(BODY))
    assert found == Hello(LAYOUT, 3, 0xFFFF_FFF0, 200.0, "box", "1.0", CHANNELS)
    assert wire.decode(frame_of(struct.pack("<BHII", 2, 9, 5, 7) + b"x")) == Samples(9, 5, 7, 1, b"x")
    assert wire.decode(frame_of(struct.pack("<BHIIB", 3, 9, 5, 7, 3) + b"x")) == Samples(9, 5, 7, 3, b"x")
    status = struct.pack("<BHIIIhH", 4, 9, 5, 7, 2, -35, 12346)
    assert wire.decode(frame_of(status)) == Status(9, 5, 7, 2, -3.5, 12.346)
    status = struct.pack("<BHIIIhH", 4, 9, 5, 7, 2, 0, 1)
    assert wire.decode(frame_of(status)) == Status(9, 5, 7, 2, 0.0, 0.001)
    status = struct.pack("<BHIIIhH", 4, 9, 5, 7, 2, -32768, 0)
    assert wire.decode(frame_of(status)) == Status(9, 5, 7, 2, None, None)
    mark = struct.pack("<BHIIBII", 5, 9, 5, 7, 1, 1_700_000_000, 250_000) + b"\x04km 3"
    assert wire.decode(frame_of(mark)) == Mark(9, 5, 7, "clock", 1_700_000_000.25, "km 3")


def test_every_field_holds_its_largest_value() -> None:
    layout, largest = 0xFFFF, 0xFFFF_FFFF
    samples = wire.encode_sample(layout, largest, largest, b"x")
    assert wire.decode(samples[:-1]) == Samples(layout, largest, largest, 1, b"x")
    block = wire.encode_block(layout, largest, largest, 255, b"x")
    assert wire.decode(block[:-1]) == Samples(layout, largest, largest, 255, b"x")
    status = wire.encode_status(layout, largest, largest, largest, 3276.7, 65.535)
    assert wire.decode(status[:-1]) == Status(layout, largest, largest, largest, 3276.7, 65.535)
    mark = wire.encode_mark(layout, largest, largest, "trackside", 0xFFFF_FFFF + 0.75)
    assert wire.decode(mark[:-1]) == Mark(layout, largest, largest, "trackside", 0xFFFF_FFFF + 0.75, "")


def test_a_rate_and_a_scale_are_the_shortest_decimals_of_their_floats() -> None:
    body = BODY.replace(struct.pack("<f", 200.0), struct.pack("<f", 0.1))
    found = wire.decode(hello(body))
    assert isinstance(found, Hello) and found.rate == 0.1 and found.channels[0].scale == 0.004


@pytest.mark.parametrize("coded", [b"", b"\x05ab", frame_of(b"")[:3], frame_of(struct.pack("<BHI", 4, 0, 0)[:-1])])
def test_bytes_that_are_no_frame_are_corrupt(coded: bytes) -> None:
    with pytest.raises(CorruptFrame):
        wire.decode(coded)


def test_the_reason_for_a_corrupt_frame_is_the_crc_or_the_framing() -> None:
    good = struct.pack("<BHII", 2, 9, 5, 7) + b"data"
    wrong = good + struct.pack("<I", crc32(good) ^ 1)
    with pytest.raises(CorruptFrame, match=r"^the CRC is wrong$"):
        wire.decode(cobs.encode(wrong))
    with pytest.raises(CorruptFrame, match=r"^the CRC is wrong$"):
        wire.decode(frame_of(b"short."))
    with pytest.raises(CorruptFrame, match="not enough input bytes"):
        wire.decode(b"\x05ab")


def test_a_header_without_a_body_is_a_frame_with_missing_fields() -> None:
    assert refusal(frame_of(struct.pack("<BHI", 4, 0, 0))).startswith(
        "a frame of kind 4 has missing or invalid fields: "
    )


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (struct.pack("<BHII", 2, 9, 5, 7), "a frame of kind 2 and 4 bytes: kinds are 1 to 5"),
        (struct.pack("<BHIIB", 3, 9, 5, 7, 2), "a frame of kind 3 and 5 bytes: kinds are 1 to 5"),
        (struct.pack("<BHIIB", 3, 9, 5, 7, 0) + b"x", "a block of 0 samples"),
        (struct.pack("<BHI", 6, 9, 5) + b"xy", "a frame of kind 6 and 2 bytes: kinds are 1 to 5"),
        (struct.pack("<BHI", 0, 9, 5), "a frame of kind 0 and 0 bytes: kinds are 1 to 5"),
    ],
)
def test_frames_without_samples_or_of_another_kind_are_refused(payload: bytes, reason: str) -> None:
    assert refusal(frame_of(payload)) == reason


@pytest.mark.parametrize(
    ("tail", "reason"),
    [
        (b"", "index out of range"),
        (b"\x05km 3", ": a text is longer than its frame"),
        (b"\x04km 3!", ": bytes after the last text"),
        (b"\x01\xff", ": invalid start byte"),
    ],
)
def test_a_mark_with_a_malformed_label_is_refused(tail: bytes, reason: str) -> None:
    found = refusal(frame_of(struct.pack("<BHIIBII", 5, 9, 5, 7, 1, 0, 0) + tail))
    assert found.startswith("a frame of kind 5 has missing or invalid fields: ") and found.endswith(reason)


def test_a_mark_of_an_unknown_source_is_refused() -> None:
    found = refusal(frame_of(struct.pack("<BHIIBII", 5, 9, 5, 7, 3, 0, 0) + b"\0"))
    assert found.startswith("a frame of kind 5 has missing or invalid fields: ")


def test_a_status_with_more_bytes_than_its_fields_is_refused() -> None:
    assert "kind 4" in refusal(frame_of(struct.pack("<BHIIIhH", 4, 9, 5, 7, 2, 0, 0) + b"x"))


def test_a_hello_of_another_layout_is_refused_with_both() -> None:
    body = BODY.replace(b"box", b"fox")
    found = refusal(frame_of(struct.pack("<BHI", 1, 0x00AB, 0) + body))
    hashed = f"{crc32(body) & 0xFFFF:04x}"
    assert found == f"a hello of layout 00ab whose body has {hashed}: the low 16 bits of its CRC"


def test_a_hello_of_another_version_is_refused() -> None:
    assert refusal(hello(b"\x02" + BODY[1:])) == "a hello of version 2: supported is version 1"


@pytest.mark.parametrize("count", [4, 257, 65535])
def test_a_hello_that_claims_more_channels_than_it_has_is_refused(count: int) -> None:
    body = HEAD + struct.pack("<H", count) + FIRST + SECOND
    assert refusal(hello(body)) == f"a hello that claims {count} channels in {len(body)} bytes: the maximum is 256"


def test_a_hello_of_256_short_channels_is_read_and_of_257_refused() -> None:
    def body(count: int) -> bytes:
        names = [b"%c%c" % (65 + i // 26, 65 + i % 26) for i in range(count)]
        parts = [b"b" + struct.pack("<ff", 1.0, 0.0) + b"\x02" + name + b"\0" for name in names]
        return HEAD + struct.pack("<H", count) + b"".join(parts)

    found = wire.decode(hello(body(256)))
    assert isinstance(found, Hello) and len(found.channels) == 256 and found.channels[255].name == "JV"
    assert "claims 257 channels" in refusal(hello(body(257)))


def test_a_hello_with_the_shortest_channel_is_not_taken_for_too_short() -> None:
    body = HEAD + b"\x01\0" + b"b" + struct.pack("<ff", 1.0, 0.0) + b"\0\0"
    assert "must be unique, not empty" in refusal(hello(body))


def test_a_hello_with_bytes_after_its_last_channel_is_refused() -> None:
    assert refusal(hello(BODY + b"xyz")) == "a hello with 3 bytes after its last channel"


def test_a_hello_that_ends_in_a_field_is_refused() -> None:
    for size in range(1, len(BODY)):
        assert refusal(hello(BODY[:size])).startswith("a ")


def test_a_type_that_is_no_letter_is_named() -> None:
    assert "has the type 'é'" in refusal(hello(HEAD + b"\x01\0" + b"\xe9" + FIRST[1:]))
