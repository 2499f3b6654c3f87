"""railui capture --check: does the logger's data pass its line?"""

from __future__ import annotations

from typing import TYPE_CHECKING

from railui.cli import VIOLATED
from railui.cli.common import Invocation, refuse

if TYPE_CHECKING:
    from railui.capture.protocol.frames import Channel

LISTEN = 12.0  # s: two hellos
LETTERS = {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f"}


def check_line(
    call: Invocation, port: str | None, baud: int, channels: int | None, rate: float | None, letter: str, block: int,
    form: str,
) -> int:  # fmt: skip
    """Tells the load of a line, of numbers as given or of a logger that is heard on a port; returns the exit code."""
    from railui.capture.protocol.load import FULL, NARROW, link_load
    from railui.io.problems import nearest

    if letter not in LETTERS:
        raise refuse(f"--type {letter} is not known, {nearest(letter, LETTERS)}")
    if port is not None:
        listed, rate, block, form = _heard(port, baud)
    elif channels is None or rate is None:
        raise refuse("give --channels and --rate, or the PORT of a logger that sends")
    else:
        from railui.capture.protocol.load import channels_of

        listed = channels_of(channels, LETTERS[letter])
    load = link_load(listed, rate, baud, block, form)
    state = "refused" if load.share > FULL else "narrow" if load.share > NARROW else "fits"
    head = f"{len(listed)} channels at {rate:g} Hz need {load.needed:.0f} bytes/s, {baud} baud pass {load.passes:.0f}"
    call.show(f"{head}: {100 * load.share:.1f} %, {state}")
    bare = (
        "the bare values alone are more than the line passes, whatever the framing" if load.values > load.passes else ""
    )
    remedy = f"take {load.least_baud} baud" if load.least_baud else "no usual baud rate passes it"
    slower = f"or at most {rate * NARROW / load.share:.4g} Hz" + (
        "" if block > 1 or form == "text" else ", or --block 16"
    )
    if load.share > NARROW:
        call.say("; ".join(part for part in (bare, f"{remedy}, {slower}") if part))
    body = {
        "state": state,
        "share": load.share,
        "bytes_per_second": load.needed,
        "value_bytes_per_second": load.values,
        "passes": load.passes,
        "baud": baud,
        "least_baud": load.least_baud,
        "channels": len(listed),
        "rate": rate,
        "block": block,
        "form": form,
    }
    call.emit(call.document("capture_check", body))
    return VIOLATED if state == "refused" else 0


def _heard(port: str, baud: int) -> tuple[list[Channel], float, int, str]:
    """What a logger on a port says of itself: channels, rate, samples per frame, form."""
    import time

    import serial

    from railui.capture.recorder.assembly import Assembly

    heard = Assembly()
    with serial.Serial(port, baud, timeout=0.2, exclusive=True) as line:
        until = time.monotonic() + LISTEN
        while time.monotonic() < until:
            heard.feed(line.read(max(1, line.in_waiting)))
            if heard.segments and heard.segments[-1].samples > 100:
                break
    if not heard.segments:
        raise RuntimeError(f"{port}: no hello in {LISTEN:g} s at {baud} baud: is the rate right, does the logger send?")
    segment = heard.segments[-1]
    return list(segment.hello.channels), segment.hello.rate, max(segment.count, 1), heard.form or "binary"
