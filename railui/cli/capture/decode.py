"""railui capture decode: runs of raw bytes."""

from __future__ import annotations

from pathlib import Path

import click

from railui.cli.capture import finish_recording
from railui.cli.invocation import Invocation, common_options, usage_error

MAX_LISTED_FILES = 4


@click.command("decode")
@click.argument("raw", type=click.Path(exists=True))
@click.option("-o", "--out", required=True, metavar="DIR", help="Directory of the runs.")
@common_options
def command(raw: str, out: str, call: Invocation) -> None:
    """Rebuild the runs of RAW: raw.bin of a recording, its directory, or bytes stored by another program.

    Reconnects, marks and times come from the journal in the same directory; without one, the bytes alone are decoded.
    """
    from railui.capture.recorder.replay import RAW_FILE, decode
    from railui.io.problems import TemporaryError

    path = Path(raw) / RAW_FILE if Path(raw).is_dir() else Path(raw)
    directory = Path(out)
    if not path.is_file():
        raise usage_error(f"{path} is no file: give the raw.bin of a recording")
    if directory.exists() and not directory.is_dir():
        raise usage_error(f"{directory} is a file: give a directory")
    files = sorted(p.name for p in directory.iterdir() if p.is_file()) if directory.exists() else []
    is_own_directory = directory.resolve() == path.parent.resolve()
    if files and not is_own_directory and "capture.json" not in files:
        raise usage_error(f"{directory} holds {', '.join(files[:MAX_LISTED_FILES])}: give another -o DIR")
    replay = decode(path, directory)
    finish_recording(call, replay, directory)
    if not replay.assembler.counts.samples:
        size = replay.position
        raise TemporaryError(f"{path}: no sample was decoded of {size} bytes: is it the raw.bin of a recording?")
