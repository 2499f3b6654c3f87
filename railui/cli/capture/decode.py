"""railui capture decode: the runs of raw bytes."""

from __future__ import annotations

from pathlib import Path

import click

from railui.cli.capture import finish
from railui.cli.common import Invocation, options, refuse


@click.command("decode")
@click.argument("raw", type=click.Path(exists=True))
@click.option("-o", "--out", required=True, metavar="DIR", help="Where the runs go.")
@options
def command(raw: str, out: str, call: Invocation) -> None:
    """Rebuild the runs of RAW: raw.bin of a recording, its directory, or bytes that something else has stored.

    The journal beside RAW tells of reconnects, marks and times; without one the bytes alone are read.
    """
    from railui.capture.recorder.replay import RAW, decode

    path, directory = Path(raw), Path(out)
    path = path / RAW if path.is_dir() else path
    if not path.is_file():
        raise refuse(f"{path} is no file: give the raw.bin of a recording")
    if directory.exists() and not directory.is_dir():
        raise refuse(f"{directory} is a file: give a directory")
    others = [p.name for p in directory.iterdir() if p.is_file()] if directory.exists() else []
    own = directory.resolve() == path.parent.resolve()
    if others and not own and not {"capture.json"} & set(others):
        raise refuse(f"{directory} holds {', '.join(sorted(others)[:4])}: give another -o DIR")
    finish(call, decode(path, directory), directory)
