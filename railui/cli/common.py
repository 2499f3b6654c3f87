"""What all commands share: options, overrides, the envelope of their JSON, narration."""

from __future__ import annotations

import functools
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console

    from railui.io.problems import Problem
    from railui.track.excitation import TrackSource
    from railui.vehicle.design_reader import Design

PAUSE = 10.0  # s between two lines of progress where there is no terminal
WIDE = 160  # columns of a table where there is no terminal
SHORT = 16  # letters of a cell that is not to be broken
STRICT = ("not admissible", "dangerous")  # classes that --strict does not let pass


@dataclass
class Invocation:
    """One call of a command: its common options, its narration (stderr) and its data (stdout, JSON)."""

    json: str | None = None
    quiet: bool = False
    verbose: int = 0
    seed: int | None = None
    jobs: int | None = None
    _told: float = field(default=0.0, repr=False)
    _open: bool = field(default=False, repr=False)

    def say(self, text: str) -> None:
        """A line of narration."""
        if not self.quiet:
            self.close()
            click.echo(text, err=True)

    def warn(self, problems: Sequence[Problem] | Sequence[str]) -> None:
        """Warnings, a line each."""
        for problem in problems:
            self.say(f"warning: {problem}" if isinstance(problem, str) else str(problem))

    def progress(self, text: str) -> None:
        """How far long work is: one line rewritten on a terminal, elsewhere a line now and then (-v: all)."""
        if self.quiet:
            return
        if sys.stderr.isatty() and not self.verbose:
            click.echo(f"\r\x1b[2K{text}", err=True, nl=False)
            self._open = True
        elif self.verbose or time.monotonic() - self._told >= PAUSE:
            self._told = time.monotonic()
            click.echo(text, err=True)

    def close(self) -> None:
        """Ends the line of progress."""
        if self._open:
            click.echo("", err=True)
            self._open = False

    def show(self, data: Any) -> None:
        """A text or a rich table for the reader: on stdout, or on stderr where JSON has stdout."""
        self.close()
        if self.json == "-" and self.quiet:
            return
        if isinstance(data, str):
            click.echo(data, err=self.json == "-")
            return
        from rich.console import Console

        stream = sys.stderr if self.json == "-" else sys.stdout
        # names come from files: what stands in square brackets there is text, never markup
        console = Console(file=stream, width=None if stream.isatty() else WIDE, markup=False, emoji=False)
        console.print(fitted(data, console))

    def document(
        self, kind: str, body: Mapping[str, Any], inputs: Sequence[str | Path] = (), seed: int | None = None
    ) -> dict[str, Any]:
        """The JSON document of a command: the envelope first, then its keys; every number finite or None."""
        import railui
        from railui.core import simd
        from railui.io.atomic import finite

        head = {
            "schema": f"railui.{kind}/1",
            "version": railui.__version__,
            "inputs": [{"file": str(path), "sha256": sha256_of(path)} for path in inputs],
            "seed": self.seed if seed is None else seed,
            "simd": simd(),
        }
        return {**head, **finite(dict(body))}

    def emit(self, document: Mapping[str, Any]) -> None:
        """Writes a document where --json asks for it."""
        if self.json is None:
            return
        text = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
        if self.json == "-":
            click.echo(text, nl=False)
        else:
            from railui.io.atomic import write_text

            write_text(self.json, text)
            self.say(f"wrote {self.json}")


def cell(value: Any, digits: int = 4) -> str:
    """A value for the reader: a number of so many digits, several divided by commas, a dash for none.

    >>> cell(2.51349), cell(None), cell("good"), cell([1.0, 0.25])
    ('2.513', '-', 'good', '1, 0.25')
    """
    if isinstance(value, list | tuple):
        return ", ".join(cell(one, digits) for one in value)
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def fitted(data: Any, console: Console) -> Any:
    """A table without rules between its columns where they would not fit; what is still too long goes on below.

    Nothing of a name or a number is left out.
    """
    from rich import box
    from rich.measure import Measurement
    from rich.table import Table

    if not isinstance(data, Table):
        return data
    data.title_justify = data.caption_justify = "left"
    for column in data.columns:
        column.overflow = "fold"
    natural = Measurement.get(console, console.options.update(max_width=10 * WIDE), data).maximum
    if console.width < min(natural, WIDE):
        data.box, data.padding, data.pad_edge = box.SIMPLE_HEAD, (0, 0), False
        for column in data.columns:
            head, *cells = (str(cell) for cell in (column.header, *column.cells))
            longest = max(map(len, cells), default=0)
            if longest <= SHORT:  # numbers and single words stay whole, heads go on below
                column.width = max(longest, *map(len, head.split()), 1)
    return data


def sha256_of(path: str | Path) -> str | None:
    """The hash of a file, None where it cannot be read."""
    from railui.io.atomic import sha256_file

    try:
        return sha256_file(path)
    except OSError:
        return None


def options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of every command; the function gets them as `call`, an Invocation."""

    @click.option("--json", "json_to", metavar="FILE", help="Write the result as JSON; - for stdout.")
    @click.option("-q", "--quiet", is_flag=True, help="No narration.")
    @click.option("-v", "--verbose", count=True, help="More narration; the whole trace of an error.")
    @click.option("--seed", type=click.IntRange(min=0), help="Seed of all random numbers.")
    @click.option("--jobs", type=click.IntRange(min=1), help="Threads; all that the machine has by default.")
    @click.pass_context
    @functools.wraps(command)
    def wrapped(
        ctx: click.Context, /, json_to: str | None, quiet: bool, verbose: int, seed: int | None, jobs: int | None,
        **more: Any,
    ) -> Any:  # fmt: skip
        ctx.meta["railui.verbose"] = verbose
        call = Invocation(json_to, quiet, verbose, seed, jobs)
        if json_to not in (None, "-"):  # before the work, not after it
            from railui.io.atomic import check_file

            check_file(str(json_to))
        try:
            return command(call=call, **more)
        finally:
            call.close()

    return wrapped


def design_argument(command: Callable[..., Any]) -> Callable[..., Any]:
    """A design and its overrides, as arguments `design` and `overrides`."""
    command = click.argument("overrides", nargs=-1, metavar="[PATH=VALUE]...", callback=overrides_of)(command)
    return click.argument("design", metavar="DESIGN")(command)


def overrides_of(ctx: click.Context, parameter: click.Parameter, words: tuple[str, ...]) -> dict[str, str]:
    """The callback of an argument of overrides: PATH=VALUE words as a mapping."""
    found: dict[str, str] = {}
    for word in words:
        path, equals, value = word.partition("=")
        if not equals or not path.strip() or not value.strip():
            raise click.BadParameter(
                f"{word!r} is no override: write PATH=VALUE, such as vehicle.primary.lateral_stiffness=4e6",
                ctx, parameter,
            )  # fmt: skip
        found[path.strip()] = value.strip()
    return found


def load_vehicle(call: Invocation, path: str, overrides: Mapping[str, str]) -> Design:
    """The design of a file with its overrides; its warnings are told. FileProblems with every fault."""
    from railui.documents.recognise import expect
    from railui.vehicle.design_reader import load_design

    expect(path, "design")
    design = load_design(Path(path))
    call.warn(design.warnings)
    return design.with_values(overrides) if overrides else design


def narrator(call: Invocation, log: list[str]) -> Any:
    """Tells every line with the seconds since the start, and keeps it for the log."""
    began = time.perf_counter()

    def report(text: str) -> None:
        line = f"{time.perf_counter() - began:6.1f} s  {text}"
        log.append(line)
        call.say(line)

    return report


def lay_track(track: str, seed: int | None, said: str = "--track", *, seeded: bool = False) -> TrackSource:
    """The track that an argument names, its `seed` where it is random: a file has none, unless one is asked of it.

    FileProblems for a faulty file, wrong use of what was `said` for a faulty spec.
    """
    from railui.io.problems import FileProblems
    from railui.track.excitation import is_track_file, resolve_track

    try:
        return resolve_track(track, seed if seeded or not is_track_file(track) else None)
    except FileProblems:
        raise
    except ValueError as error:
        raise refuse(f"{said}: {error}") from None


def refuse(message: str) -> click.UsageError:
    """Wrong use of a command, exit code 2."""
    return click.UsageError(message, click.get_current_context(silent=True))
