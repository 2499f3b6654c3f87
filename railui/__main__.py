"""The entry of the command line: `railui`, or `python -m railui`."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> None:
    """Runs the command that the words of the command line name; ends the process with its exit code."""
    try:
        from railui.cli import cli

        cli(prog_name="railui")
    except KeyboardInterrupt:  # before or after a command has the word
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
