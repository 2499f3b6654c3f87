"""Examples of docs/wire.md: bytes and lines as railui encodes and decodes them."""

from __future__ import annotations

import re
import struct

from railui.capture.protocol import text, wire
from railui.capture.protocol.link import Link
from railui.capture.protocol.messages import Channel, Hello
from tests.capture.simulated_runs import HOME

PAGE = (HOME / "docs/wire.md").read_text()
CHANNELS = (Channel("ay1", "m/s^2", "h", 0.004), Channel("speed", "m/s", "H", 0.01))
BODY = wire.hello_body(7, 200.0, "box", "1.0", CHANNELS)


def test_binary_example_of_the_protocol_page_is_correct() -> None:
    lines = [bytes.fromhex(line) for line in re.findall(r"^(?:[0-9a-f]{2} ?)+$", PAGE, re.MULTILINE)]
    layout = wire.layout_hash(BODY)
    data = struct.pack("<hH", -250, 4000)
    payload = wire.SAMPLE_HEADER.pack(wire.SAMPLE, layout, 1, 5000) + data
    assert lines == [BODY, wire.encode_hello(0, BODY), payload, wire.encode_sample(layout, 1, 5000, data)]


def test_text_example_of_the_protocol_page_is_correct() -> None:
    lines = re.findall(r"^[HSIM],.*\*[0-9a-f]{8}$", PAGE, re.MULTILINE)
    frames = Link().feed(("\n".join(lines) + "\n").encode())
    hello = frames[0]
    assert isinstance(hello, Hello) and len(frames) == len(lines) == 4
    assert lines[0] + "\n" == text.encode_hello(0, text.hello_text(7, 200.0, "box", "1.0", CHANNELS)).decode()
