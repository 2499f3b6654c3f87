"""The entry of the command line: `railui`, or `python -m railui`."""

from __future__ import annotations

import gc
import os
import sys
from io import TextIOWrapper

INTERRUPTED = 130
# the kernel has the cores, and the matrices are small: threads of BLAS stand in its way and change last digits
ALONE = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# pydantic would ask every package that is installed whether it is a plugin: we use none
NO_PLUGINS = {"PYDANTIC_DISABLE_PLUGINS": "__all__"}
UNCOLLECTED = 50_000  # objects before garbage is looked for: what modules make while they are read is none


def _open_streams() -> None:
    """Streams that are closed swallow what they get; what a terminal's encoding lacks is written by its number."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115, open as long as the process lives
        elif mode == "w" and isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _leave_stdout() -> None:
    """What could not be written, and was told, does not fail once more when the process ends."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main() -> None:
    """Runs the command that the words of the command line name; ends the process with its exit code."""
    _open_streams()
    for name, value in (ALONE | NO_PLUGINS).items():
        os.environ.setdefault(name, value)  # before numpy and pydantic are there
    gc.set_threshold(UNCOLLECTED)
    try:
        from railui.cli import cli

        cli(prog_name="railui")
    except KeyboardInterrupt:  # before or after a command has the word
        sys.exit(INTERRUPTED)
    finally:
        gc.freeze()  # the process ends and frees all: to look through the modules for garbage takes a third of a second
        _leave_stdout()


if __name__ == "__main__":
    main()
