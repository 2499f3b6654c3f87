"""railui capture: field data from a serial logger."""

from __future__ import annotations

import errno
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.invocation import Invocation, common_options, usage_error

if TYPE_CHECKING:
    from rich.table import Table

    from railui.capture.recorder.record import Recorder
    from railui.capture.recorder.replay import Replay

SUBCOMMANDS = {
    "campaign": "Build a campaign from recordings: sensor map, rail position, runs, campaign.yaml.",
    "decode": "Rebuild the runs of raw bytes.",
    "logger": "Simulate a logger on a port of its own.",
    "speed": "Measure the processor time of decoding.",
}


class CaptureGroup(click.Group):
    """Command group in which `capture PORT` records and `capture PART` runs a subcommand."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert the hidden command `record` before a port or an option."""
        is_help = args[:1] in (["-h"], ["--help"])
        is_subcommand = bool(args) and args[0] in SUBCOMMANDS
        return super().parse_args(ctx, args if is_help or is_subcommand else ["record", *args])

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the subcommands."""
        return list(SUBCOMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """Import a subcommand."""
        if name == "record":
            return record
        subcommand: click.Command = importlib.import_module(f"{__name__}.{name}").command
        return subcommand

    def format_usage(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the usage line."""
        formatter.write_usage(ctx.command_path, "[PORT] [OPTIONS] | PART ...")

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of recording and the subcommands."""
        record.format_options(ctx, formatter)
        with formatter.section("Parts"):
            formatter.write_dl(list(SUBCOMMANDS.items()))


@click.group("capture", cls=CaptureGroup, context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Record a serial logger into a directory; ctrl-c ends it.

    \b
    railui capture /dev/ttyUSB0 --baud 921600 -o monday
    railui capture --demo -o demo
    railui capture --check --channels 12 --rate 500 --baud 115200

    Raw bytes are written to the disk first, the decoded runs to the same directory. A line typed meanwhile marks that
    instant. The protocol of the logger: docs/wire.md; from a recording to a campaign: docs/capture.md.
    """


def _type_letter(ctx: click.Context, parameter: click.Parameter, name: str) -> str:
    """Return the letter of a type of channels."""
    from railui.cli.capture.check import type_letter

    return type_letter(name)


@click.command("record")
@click.argument("port", required=False)
@click.option("-o", "--out", metavar="DIR", help="Directory of the recording; railui-capture/TIME by default.")
@click.option(
    "--baud", default=115200, show_default=True, type=click.IntRange(300, 20_000_000), help="Bits per second."
)
@click.option("--seconds", type=click.FloatRange(0, min_open=True), metavar="S", help="Duration of the recording.")
@click.option("--demo", is_flag=True, help="Record the demo logger: a simulated vehicle in a process of its own.")
@click.option("--check", is_flag=True, help="Compute the load of the line: refused above 100 %, a warning above 80 %.")
@click.option("--channels", type=click.IntRange(1, 256), help="For --check without a PORT: number of channels.")
@click.option("--rate", type=click.FloatRange(0, min_open=True), metavar="HZ", help="For --check: samples per second.")
@click.option(
    "--type",
    "letter",
    default="int16",
    show_default=True,
    callback=_type_letter,
    help="For --check: int8 to uint32, float32.",
)
@click.option(
    "--block", default=1, show_default=True, type=click.IntRange(1, 255), help="For --check: samples per frame."
)
@click.option("--text", is_flag=True, help="For --check: lines of text instead of binary frames.")
@common_options
@click.pass_context
def record(
    ctx: click.Context,
    port: str | None,
    out: str | None,
    baud: int,
    seconds: float | None,
    demo: bool,
    check: bool,
    channels: int | None,
    rate: float | None,
    letter: str,
    block: int,
    text: bool,
    call: Invocation,
) -> None:
    """Record a port, or check the load of a line."""
    if check:
        from railui.cli.capture.check import check_line, line_of_options, line_on_port

        form = "text" if text else "binary"
        line = line_of_options(channels, rate, letter, block, form) if port is None else line_on_port(port, baud)
        ctx.exit(check_line(call, line, baud))
    if bool(port) == demo:
        raise usage_error("give the PORT of a logger (such as /dev/ttyUSB0), or --demo")
    directory = _new_directory(out)
    with ExitStack() as stack:
        from serial import SerialException

        from railui.capture.recorder.record import Recorder
        from railui.capture.recorder.run_files import DISK_FULL_ERRORS
        from railui.capture.simulator.demo_logger import DemoLogger
        from railui.io.problems import TemporaryError

        if port is None:
            port = stack.enter_context(DemoLogger(call.seed or 0)).port
        try:
            recorder = Recorder(port, baud, directory, call.info)
        except (SerialException, OSError, ValueError) as error:
            raise TemporaryError(port_error(port, error)) from None
        call.info(f"recording {port} into {directory}: ctrl-c ends it, a line typed here marks an instant")
        _run(recorder, seconds, call)
    try:
        finish_recording(call, recorder.replay, directory)
    except OSError:
        if recorder.disk_error is None:
            raise
    if recorder.disk_error is None and not recorder.replay.assembler.counts.samples:
        raise TemporaryError(
            f"{directory}: no sample was decoded of {recorder.replay.position} bytes: check the logger, the port and "
            "the baud rate, then record again"
        )
    if recorder.disk_error is not None:
        is_full = recorder.disk_error.errno in DISK_FULL_ERRORS
        fault = "the disk is full" if is_full else f"the disk fails ({recorder.disk_error.strerror})"
        lost = f"{recorder.replay.dropped_bytes} bytes were lost"
        remedy = f"{'make room' if is_full else 'use another disk'}, then `railui capture decode {directory}/raw.bin"
        raise OSError(f"{directory}: {fault}, {lost}: {remedy} -o DIR` gives the rest")


def _new_directory(out: str | None) -> Path:
    """Return the directory of the recording, which must be empty or missing."""
    from datetime import datetime

    from railui.io.atomic import check_directory_writable

    directory = Path(out) if out is not None else Path("railui-capture") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise usage_error(f"{directory} exists and is not overwritten: give another -o DIR")
    check_directory_writable(directory)
    return directory


def port_error(port: str, error: Exception) -> str:
    """Return why a port does not open, and the remedy."""
    from serial.tools.list_ports import comports

    ports = [p.device for p in comports()]
    number = getattr(error, "errno", None)
    problem = f"{port} does not open: {os.strerror(number) if number else error}"
    if number == errno.EACCES:
        return f"{problem}; add yourself to its group: sudo usermod -aG dialout $USER, then log in again"
    return f"{problem}; {'available: ' + ', '.join(ports) if ports else 'there is no serial port: plug the logger in'}"


def _run(recorder: Recorder, seconds: float | None, call: Invocation) -> None:
    """Record until ctrl-c, a termination signal, or the end of the time."""
    import threading

    if sys.stdin is not None and not sys.stdin.closed:
        threading.Thread(target=_read_markers, args=(recorder, call), name="markers", daemon=True).start()
    last_warning = None
    announced = 1
    clipped: set[tuple[int, str]] = set()
    with _stop_on_signals(recorder):
        for replay in recorder.run(seconds):
            call.status(_status_line(replay))
            for session in replay.assembler.sessions[announced:]:
                call.info(f"segment {session.number} begins: {session.reason}")
            announced = max(announced, len(replay.assembler.sessions))
            for channel, (_, level) in replay.clipped_channels().items():
                if channel not in clipped:
                    call.info(f"segment {channel[0]}: {channel[1]} is clipped at {level}")
                    clipped.add(channel)
            warning = recorder.link_fault()
            if warning is not None and warning != last_warning:
                call.warn([warning])
            last_warning = warning


@contextmanager
def _stop_on_signals(recorder: Recorder) -> Iterator[None]:
    """Stop the recorder on SIGINT and SIGTERM; restore the handlers afterwards."""
    import signal

    numbers = (signal.SIGINT, signal.SIGTERM)
    handlers = {number: signal.signal(number, lambda *_: recorder.stop()) for number in numbers}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _read_markers(recorder: Recorder, call: Invocation) -> None:
    """Mark an instant for every line on stdin."""
    try:
        for line in sys.stdin:
            if line.strip():
                recorder.add_marker(line.strip())
                call.info(f"marked: {line.strip()}")
    except (OSError, ValueError):
        pass


def _status_line(replay: Replay) -> str:
    counts = replay.assembler.counts
    statistics = replay.assembler.link_statistics()
    newest = replay.assembler.newest_sample
    return (
        f"{newest[1] if newest else 0.0:8.1f} s  {counts.samples} samples, {statistics.frames} frames, "
        f"{counts.lost_frames} lost, {statistics.crc_errors} damaged, {counts.gaps} gaps, "
        f"{counts.reconnects} reconnects, {counts.restarts} restarts"
    )


def finish_recording(call: Invocation, replay: Replay, directory: Path) -> None:
    """Write capture.json and print the counts of a recording."""
    from railui.api.recordings import write_capture_report

    document = write_capture_report(replay.report(), directory, call.seed)
    call.show(recording_table(document))
    for note in document["notes"]:
        call.info(note)
    call.write_json(document)
    call.info(f"in {directory}: {', '.join([*replay.files.file_names, 'capture.json'])}")


def recording_table(document: dict[str, Any]) -> Table:
    """Return the table of the segments, with the counts as caption."""
    from rich.table import Table

    names = ("segment", "begins with", "logger", "rate [Hz]", "seconds", "samples", "missing", "gaps", "drift [ppm]")
    counts = ", ".join(
        f"{document[key]} {key.replace('_', ' ')}"
        for key in ("frames", "lost", "crc_errors", "gaps", "reconnects", "restarts", "overruns", "undecoded_bytes")
    )
    if document["silent_seconds"]:
        counts += f", {document['silent_seconds']:.1f} s silent"
    table = Table(*names, title="recording", title_justify="left", caption=counts, caption_justify="left")
    for i, s in enumerate(document["segments"], 1):
        length = "" if s["first"] is None else f"{s['last'] - s['first']:.1f}"
        drift = "" if s["drift"] is None else f"{1e6 * s['drift']:.0f} ± {1e6 * s['drift_sd']:.0f}"
        cells = (s["why"], f"{s['device']} {s['firmware']}", f"{s['rate']:g}", length, s["samples"])
        table.add_row(str(i), *map(str, cells), str(s["missing_samples"]), str(s["gaps"]), drift)
    return table
