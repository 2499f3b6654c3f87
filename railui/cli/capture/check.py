"""railui capture --check: load of a serial line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from railui.cli import EXIT_LIMIT_VIOLATED
from railui.cli.invocation import Invocation, usage_error

if TYPE_CHECKING:
    from railui.capture.protocol.load import LineLoad
    from railui.capture.protocol.messages import Channel

LISTEN_TIMEOUT = 12.0  # s: two hellos
READ_TIMEOUT = 0.2  # s
MIN_SAMPLES = 100  # after which the samples per frame are known
TYPE_LETTERS = {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f"}


@dataclass(frozen=True)
class Line:
    """Data on a line: channels, sampling rate [Hz], samples per frame, form of the frames."""

    channels: list[Channel]
    rate: float
    block: int
    form: str


def type_letter(name: str) -> str:
    """Return the letter of Python's struct for a type such as int16."""
    from railui.io.problems import suggest_name

    if name not in TYPE_LETTERS:
        raise usage_error(f"--type {name} is not known, {suggest_name(name, TYPE_LETTERS)}")
    return TYPE_LETTERS[name]


def line_of_options(channels: int | None, rate: float | None, letter: str, block: int, form: str) -> Line:
    """Return the line that the options describe."""
    from railui.capture.protocol.load import example_channels

    if channels is None or rate is None:
        raise usage_error("give --channels and --rate, or the PORT of a logger that sends")
    return Line(example_channels(channels, letter), rate, block, form)


def line_on_port(port: str, baud: int) -> Line:
    """Return the line of a logger that sends on a port; TemporaryError where the port or the logger is missing."""
    import time

    from railui.capture.recorder.port import open_port
    from railui.capture.recorder.session_assembler import SessionAssembler
    from railui.cli.capture import port_error
    from railui.io.problems import TemporaryError

    assembler = SessionAssembler()
    try:
        with open_port(port, baud, READ_TIMEOUT) as line:
            deadline = time.monotonic() + LISTEN_TIMEOUT
            while time.monotonic() < deadline:
                assembler.feed(line.read(max(1, line.in_waiting)))
                if assembler.sessions and assembler.sessions[-1].samples > MIN_SAMPLES:
                    break
    except (OSError, ValueError) as error:  # ValueError: a baud rate that the port does not have
        raise TemporaryError(port_error(port, error)) from None
    if not assembler.sessions:
        raise TemporaryError(
            f"{port}: no hello in {LISTEN_TIMEOUT:g} s at {baud} baud: is the rate right, does the logger send?"
        )
    session = assembler.sessions[-1]
    hello = session.hello
    return Line(list(hello.channels), hello.rate, max(session.frame_samples, 1), assembler.form or "binary")


def check_line(call: Invocation, line: Line, baud: int) -> int:
    """Print the load of a line and return the exit code."""
    from railui.capture.protocol.load import MAX_UTILISATION, WARNING_UTILISATION, link_load

    load = link_load(line.channels, line.rate, baud, line.block, line.form)
    if load.utilisation > MAX_UTILISATION:
        state = "refused"
    else:
        state = "narrow" if load.utilisation > WARNING_UTILISATION else "fits"
    need = f"{len(line.channels)} channels at {line.rate:g} Hz need {load.required:.0f} bytes/s"
    call.show(f"{need}, {baud} baud transmit {load.capacity:.0f}: {100 * load.utilisation:.1f} %, {state}")
    if load.utilisation > WARNING_UTILISATION:
        call.info(_remedy(line, load))
    body = {
        "state": state,
        "share": load.utilisation,
        "bytes_per_second": load.required,
        "value_bytes_per_second": load.values,
        "passes": load.capacity,
        "baud": baud,
        "least_baud": load.min_baud,
        "channels": len(line.channels),
        "rate": line.rate,
        "block": line.block,
        "form": line.form,
    }
    call.write_json(call.document("capture_check", body))
    return EXIT_LIMIT_VIOLATED if state == "refused" else 0


def _remedy(line: Line, load: LineLoad) -> str:
    """Return the remedies that reduce the load of a line."""
    from railui.capture.protocol.load import WARNING_UTILISATION

    parts = []
    if load.values > load.capacity:
        parts.append("the values alone exceed the capacity of the line, whatever the framing")
    baud = f"use {load.min_baud} baud" if load.min_baud else "no usual baud rate is sufficient"
    rate = f"or at most {line.rate * WARNING_UTILISATION / load.utilisation:.4g} Hz"
    block = "" if line.block > 1 or line.form == "text" else ", or --block 16"
    return "; ".join([*parts, f"{baud}, {rate}{block}"])
