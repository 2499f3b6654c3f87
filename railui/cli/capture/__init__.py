"""railui capture: field data from a serial logger."""

from __future__ import annotations

import errno
import importlib
import os
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli import LATER
from railui.cli.common import Invocation, options, refuse

if TYPE_CHECKING:
    from railui.capture.recorder.record import Recorder
    from railui.capture.recorder.replay import Replay

SILENT = 5.0  # s without a byte, after which the reader is asked
PARTS = {
    "campaign": "Recordings to a campaign: map, rail position, runs, campaign.yaml.",
    "decode": "Rebuild the runs of raw bytes.",
    "logger": "A logger in software, on a port of its own.",
    "speed": "What decoding costs, in processor time.",
}


class Parts(click.Group):
    """`capture PORT` records; `capture PART` does what else there is."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        asks = args[:1] in (["-h"], ["--help"])
        return super().parse_args(ctx, args if asks or (args[:1] and args[0] in PARTS) else ["record", *args])

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(PARTS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name == "record":
            return record
        found: click.Command = importlib.import_module(f"{__name__}.{name}").command
        return found

    def format_usage(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        formatter.write_usage(ctx.command_path, "[PORT] [OPTIONS] | PART ...")

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        record.format_options(ctx, formatter)
        with formatter.section("Parts"):
            formatter.write_dl(list(PARTS.items()))


@click.group("capture", cls=Parts, context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Record a serial logger into a directory; ctrl-c ends it.

    \b
    railui capture /dev/ttyUSB0 --baud 921600 -o monday
    railui capture --demo -o demo
    railui capture --check --channels 12 --rate 500 --baud 115200

    Raw bytes go to the disk first, the decoded runs beside them; a line typed meanwhile marks that instant.
    docs/wire.md tells what a logger sends, docs/capture.md a day in the field.
    """


@click.command("record")
@click.argument("port", required=False)
@click.option("-o", "--out", metavar="DIR", help="Where the recording goes; railui-capture/TIME by default.")
@click.option(
    "--baud", default=115200, show_default=True, type=click.IntRange(300, 20_000_000), help="Bits per second."
)
@click.option("--seconds", type=click.FloatRange(0, min_open=True), metavar="S", help="End by itself after so long.")
@click.option("--demo", is_flag=True, help="Record the demo logger: a simulated vehicle in a process of its own.")
@click.option("--check", is_flag=True, help="Compute the load of the line: refused above 100 %, a warning above 80 %.")
@click.option("--channels", type=click.IntRange(1, 256), help="Of --check without a PORT.")
@click.option("--rate", type=click.FloatRange(0, min_open=True), metavar="HZ", help="Of --check: samples per second.")
@click.option("--type", "letter", default="int16", show_default=True, help="Of --check: int8 to uint32, float32.")
@click.option(
    "--block", default=1, show_default=True, type=click.IntRange(1, 255), help="Of --check: samples per frame."
)
@click.option("--text", is_flag=True, help="Of --check: lines of text instead of binary frames.")
@options
@click.pass_context
def record(
    ctx: click.Context, port: str | None, out: str | None, baud: int, seconds: float | None, demo: bool, check: bool,
    channels: int | None, rate: float | None, letter: str, block: int, text: bool, call: Invocation,
) -> None:  # fmt: skip
    if check:
        from railui.cli.capture.check import check_line

        ctx.exit(check_line(call, port, baud, channels, rate, letter, block, "text" if text else "binary"))
    if bool(port) == demo:
        raise refuse("give the PORT of a logger (such as /dev/ttyUSB0), or --demo")
    directory = _directory(out)
    with ExitStack() as stack:
        from serial import SerialException

        from railui.capture.recorder.record import Recorder
        from railui.capture.simulator.demo_logger import DemoLogger

        if port is None:
            port = stack.enter_context(DemoLogger(call.seed or 0)).port
        try:
            recorder = Recorder(port, baud, directory, call.say)
        except (SerialException, OSError, ValueError) as error:
            call.say(_unopened(port, error))
            ctx.exit(LATER)
        call.say(f"recording {port} into {directory}: ctrl-c ends it, a line typed here marks an instant")
        _record(recorder, seconds, call)
    finish(call, recorder.replay, directory)
    if recorder.full is not None:
        raise OSError(f"{directory}: the disk is full, {recorder.replay.dropped} bytes were lost")


def _directory(out: str | None) -> Path:
    from datetime import datetime

    from railui.io.atomic import check_writable

    directory = Path(out) if out is not None else Path("railui-capture") / datetime.now().strftime("%Y-%m-%d_%H%M%S")
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise refuse(f"{directory} is there already and stays as it is: give another -o DIR")
    check_writable(directory)
    return directory


def _unopened(port: str, error: Exception) -> str:
    """Why a port does not open, and what to do."""
    from serial.tools.list_ports import comports

    there = [p.device for p in comports()]
    number = getattr(error, "errno", None)
    told = f"railui: {port} does not open: {os.strerror(number) if number else error}"
    if number == errno.EACCES:
        return f"{told}; add yourself to its group: sudo usermod -aG dialout $USER, then log in again"
    return f"{told}; {'there are ' + ', '.join(there) if there else 'no serial port is there: plug the logger in'}"


def _record(recorder: Recorder, seconds: float | None, call: Invocation) -> None:
    """Records until ctrl-c, a signal to end, or the time is up."""
    import signal
    import threading
    import time

    def typed() -> None:
        try:
            for line in sys.stdin:
                if line.strip():
                    recorder.marker(line.strip())
                    call.say(f"marked: {line.strip()}")
        except (OSError, ValueError):
            pass

    before = {number: signal.signal(number, lambda *_: recorder.stop()) for number in (signal.SIGINT, signal.SIGTERM)}
    if sys.stdin is not None and not sys.stdin.closed:
        threading.Thread(target=typed, name="markers", daemon=True).start()
    try:
        told, begun = None, time.monotonic()
        for replay in recorder.run(seconds):
            call.progress(_state(replay))
            doubt = _doubt(replay, recorder, time.monotonic() - begun)
            if doubt is not None and doubt != told:
                call.say(doubt)
                told = doubt
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _doubt(replay: Replay, recorder: Recorder, waited: float) -> str | None:
    """What may be wrong where a logger is not heard for some seconds; None where it is, or may still be."""
    if not replay.at:
        asked = f"is the logger on, and is {recorder.name} its port?"
        return f"no byte has come in {SILENT:g} s: {asked}" if waited > SILENT else None
    if replay.at > 3 * recorder.baud / 10 and not replay.assembly.total().frames:
        return f"bytes come and no frame is whole: is the logger set to {recorder.baud} baud?"
    return None


def _state(replay: Replay) -> str:
    counts, heard = replay.assembly.counts, replay.assembly.total()
    newest = replay.assembly.newest
    return (
        f"{newest[1] if newest else 0.0:8.1f} s  {counts.samples} samples, {heard.frames} frames, {counts.lost} lost, "
        f"{heard.crc_errors} damaged, {counts.gaps} gaps, {counts.reconnects} reconnects"
    )


def finish(call: Invocation, replay: Replay, directory: Path) -> None:
    """Writes and shows what a recording is told by."""
    import json

    from railui.capture.recorder.replay import RAW
    from railui.io.atomic import write_text

    raw = directory / RAW
    document = call.document("capture", replay.report(), [raw] if raw.exists() else [])
    write_text(directory / "capture.json", json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
    call.show(table(document))
    for note in document["notes"]:
        call.say(note)
    call.emit(document)
    call.say(f"in {directory}: {', '.join([*replay.files.names, 'capture.json'])}")


def table(document: dict[str, Any]) -> Any:
    """The segments and the counts."""
    from rich.table import Table

    names = ("segment", "begins with", "logger", "rate [Hz]", "seconds", "samples", "missing", "gaps", "drift [ppm]")
    counts = ", ".join(
        f"{document[key]} {key.replace('_', ' ')}"
        for key in ("frames", "lost", "crc_errors", "gaps", "reconnects", "restarts", "overruns")
    )
    shown = Table(*names, title="recording", title_justify="left", caption=counts, caption_justify="left")
    for i, s in enumerate(document["segments"], 1):
        length = "" if s["first"] is None else f"{s['last'] - s['first']:.1f}"
        drift = "" if s["drift"] is None else f"{1e6 * s['drift']:.0f} ± {1e6 * s['drift_sd']:.0f}"
        cells = (s["why"], f"{s['device']} {s['firmware']}", f"{s['rate']:g}", length, s["samples"])
        shown.add_row(str(i), *map(str, cells), str(s["missing_samples"]), str(s["gaps"]), drift)
    return shown
