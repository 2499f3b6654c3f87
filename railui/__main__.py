"""Entry point of the command line: `railui`, or `python -m railui`."""

from __future__ import annotations

import gc
import os
import signal
import sys
from io import TextIOWrapper

EXIT_INTERRUPTED = 130
# the kernel uses all cores and the matrices are small: threads of BLAS cost time and change last digits
SINGLE_THREADED_BLAS = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# pydantic would search every installed package for plugins
NO_PYDANTIC_PLUGINS = {"PYDANTIC_DISABLE_PLUGINS": "__all__"}
GC_THRESHOLD = 50_000  # objects: importing modules makes no garbage, collections during it cost time


def _repair_streams() -> None:
    """Replace closed streams by the null device; escape characters that the terminal's encoding lacks."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115, open as long as the process runs
        elif mode == "w" and isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _flush_stdout() -> None:
    """Flush stdout; redirect it where that fails, since the error was reported and must not recur at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main() -> None:
    """Run the command that the command line names; end the process with its exit code."""
    _repair_streams()
    for name, value in (SINGLE_THREADED_BLAS | NO_PYDANTIC_PLUGINS).items():
        os.environ.setdefault(name, value)  # before numpy and pydantic are imported
    gc.set_threshold(GC_THRESHOLD)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as by ctrl-c: files and processes are tidied up
    try:
        from railui.cli import cli

        cli(prog_name="railui")
    except KeyboardInterrupt:  # outside of a command
        sys.exit(EXIT_INTERRUPTED)
    finally:
        gc.freeze()  # the process ends: a last collection would take a third of a second
        _flush_stdout()


if __name__ == "__main__":
    main()
