"""docs/wire.md: its bytes are those that railui sends and reads."""

from __future__ import annotations

import re
import struct

from railui.capture.protocol import text, wire
from railui.capture.protocol.frames import Channel, Hello
from railui.capture.protocol.link import Link
from tests.capture.rides import HOME

PAGE = (HOME / "docs/wire.md").read_text()
CHANNELS = (Channel("ay1", "m/s^2", "h", 0.004), Channel("speed", "m/s", "H", 0.01))
BODY = wire.hello_body(7, 200.0, "box", "1.0", CHANNELS)


def test_the_bytes_of_the_example_are_right() -> None:
    lines = [bytes.fromhex(line) for line in re.findall(r"^(?:[0-9a-f]{2} ?)+$", PAGE, re.MULTILINE)]
    layout = wire.layout_of(BODY)
    data = struct.pack("<hH", -250, 4000)
    payload = wire.TIMED.pack(wire.SAMPLE, layout, 1, 5000) + data
    assert lines == [BODY, wire.hello(0, BODY), payload, wire.sample(layout, 1, 5000, data)]


def test_the_lines_of_the_example_are_right() -> None:
    lines = re.findall(r"^[HSIM],.*\*[0-9a-f]{8}$", PAGE, re.MULTILINE)
    frames = Link().feed(("\n".join(lines) + "\n").encode())
    hello = frames[0]
    assert isinstance(hello, Hello) and len(frames) == len(lines) == 4
    assert lines[0] + "\n" == text.hello(0, text.hello_text(7, 200.0, "box", "1.0", CHANNELS)).decode()
