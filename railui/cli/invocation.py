"""Invocation of a command: its common options, its messages on stderr and its data on stdout."""

from __future__ import annotations

import functools
import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.progress import Progress

if TYPE_CHECKING:
    from railui.io.problems import Problem

OUTPUTS = ("out", "output", "series", "plot", "figure", "draw")  # parameters that name a file to write
STATUS_INTERVAL = 10.0  # s between two status lines where stderr is not a terminal


@dataclass
class Invocation:
    """Options that every command has, and its output: messages on stderr, tables and JSON on stdout."""

    json: str | None = None
    quiet: bool = False
    verbose: int = 0
    seed: int | None = None
    jobs: int | None = None
    _last_status: float = field(default=0.0, repr=False)
    _status_line_open: bool = field(default=False, repr=False)

    def info(self, text: str) -> None:
        """Print a message on stderr, unless --quiet."""
        if not self.quiet:
            self.end_status_line()
            click.echo(text, err=True)

    def warn(self, problems: Sequence[Problem] | Sequence[str]) -> None:
        """Print one line per warning."""
        for problem in problems:
            self.info(f"warning: {problem}" if isinstance(problem, str) else str(problem))

    def status(self, text: str) -> None:
        """Print the state of a long computation: a rewritten line on a terminal, else a line every 10 s (-v: all)."""
        if self.quiet:
            return
        if sys.stderr.isatty() and not self.verbose:
            click.echo(f"\r\x1b[2K{text}", err=True, nl=False)
            self._status_line_open = True
        elif self.verbose or time.monotonic() - self._last_status >= STATUS_INTERVAL:
            self._last_status = time.monotonic()
            click.echo(text, err=True)

    def end_status_line(self) -> None:
        """Start a new line after a status line."""
        if self._status_line_open:
            click.echo("", err=True)
            self._status_line_open = False

    def show(self, data: Any) -> None:
        """Print a text or a rich table on stdout, or on stderr where the JSON goes to stdout."""
        self.end_status_line()
        if self.json == "-" and self.quiet:
            return
        if isinstance(data, str):
            click.echo(data, err=self.json == "-")
            return
        from railui.cli.tables import print_table

        print_table(data, sys.stderr if self.json == "-" else sys.stdout)

    def document(
        self, kind: str, body: Mapping[str, Any], inputs: Sequence[str | Path] = (), seed: int | None = None
    ) -> dict[str, Any]:
        """Return the JSON document of a command: the envelope, then the body; every number finite or None."""
        from railui.api.document import json_document

        return json_document(kind, body, inputs, self.seed if seed is None else seed)

    def write_json(self, document: Mapping[str, Any]) -> None:
        """Write a document to the destination of --json; nothing without that option."""
        if self.json is None:
            return
        text = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
        if self.json == "-":
            click.echo(text, nl=False)
        else:
            from railui.io.atomic import write_text

            write_text(self.json, text)
            self.info(f"wrote {self.json}")


class RunLog(Progress):
    """Messages of a computation, printed with the elapsed time and collected for a log file."""

    def __init__(self, call: Invocation) -> None:
        self.lines: list[str] = []
        self._call = call
        self._start = time.perf_counter()

    def message(self, text: str) -> None:
        """Print and collect a message."""
        line = f"{time.perf_counter() - self._start:6.1f} s  {text}"
        self.lines.append(line)
        self._call.info(line)


class InfoLines(Progress):
    """Messages of a computation, printed on stderr."""

    def __init__(self, call: Invocation) -> None:
        self._call = call

    def message(self, text: str) -> None:
        """Print a message."""
        self._call.info(text)


class StatusLine(Progress):
    """Messages of a computation, each printed in place of the one before."""

    def __init__(self, call: Invocation) -> None:
        self._call = call

    def message(self, text: str) -> None:
        """Print a message as the status."""
        self._call.status(text)


def common_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of every command, which the function receives as `call`, an Invocation."""

    @click.option("--json", "json_to", metavar="FILE", help="Write the result as JSON; - for stdout.")
    @click.option("-q", "--quiet", is_flag=True, help="Print no messages.")
    @click.option("-v", "--verbose", count=True, help="Print more messages, and the traceback of an error.")
    @click.option("--seed", type=click.IntRange(min=0), help="Seed of the random numbers.")
    @click.option("--jobs", type=click.IntRange(min=1), help="Number of threads; all processors by default.")
    @click.pass_context
    @functools.wraps(command)
    def wrapped(
        ctx: click.Context,
        /,
        json_to: str | None,
        quiet: bool,
        verbose: int,
        seed: int | None,
        jobs: int | None,
        **more: Any,
    ) -> Any:
        ctx.meta["railui.verbose"] = verbose
        call = Invocation(json_to, quiet, verbose, seed, jobs)
        _refuse_overwriting(json_to, more)
        if json_to not in (None, "-"):  # fail before the computation, not after it
            from railui.io.atomic import check_file_writable

            check_file_writable(str(json_to))
        try:
            return command(call=call, **more)
        finally:
            call.end_status_line()

    return wrapped


def _refuse_overwriting(json_to: str | None, arguments: Mapping[str, Any]) -> None:
    """Refuse a file to write that the command reads, or writes twice; raise FileProblems."""
    from railui.io.problems import refuse_overwriting

    texts: dict[str, list[str]] = {}
    for name, value in [("json_to", json_to), *arguments.items()]:
        values = value if isinstance(value, tuple | list) else [value]
        texts[name] = [text for text in values if isinstance(text, str)]
    for name in ("json_to", *OUTPUTS):
        for out in texts.get(name, []):
            refuse_overwriting(out, [text for other, found in texts.items() if other != name for text in found])


def usage_error(message: str) -> click.UsageError:
    """Return the error of wrong use of a command, exit code 2."""
    return click.UsageError(message, click.get_current_context(silent=True))


@contextmanager
def usage_errors(option: str = "") -> Iterator[None]:
    """Turn a ValueError into an error of wrong use of an option, or of the command; FileProblems stay as they are."""
    from railui.io.problems import FileProblems

    try:
        yield
    except FileProblems:
        raise
    except ValueError as error:
        raise usage_error(f"{option}: {error}" if option else str(error)) from None
