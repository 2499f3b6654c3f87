"""The batch door: one command per question, each in a file of its own that is read when it is asked for."""

from __future__ import annotations

import errno
import importlib
import keyword
import os
import shlex
import sys
from typing import Any

import click

# what each command answers; its file is read when it runs, so that --help is quick
COMMANDS = {
    "desk": "The terminal desk; `railui` alone opens it.",
    "check": "Every problem of any of our files, with its place and remedy.",
    "effects": "The catalogue of effects that the linear model lacks.",
    "track": "A synthetic track, or what a track contains.",
    "ride": "The riding quality of a design on a track.",
    "stability": "Modes and critical speeds of a design: linear, fold, practical.",
    "curve": "Where a design stands in a curve, and what it wears.",
    "assess": "A track judged by the ride of a standard vehicle, worst stretches first.",
    "contact": "What measured wheel and rail profiles are to the model.",
    "adjust": "Adjust a model's parameters to a measured campaign.",
    "loop": "Adjust, trace what the model lacks, add it, adjust again, report.",
    "optimise": "Search for better suspensions.",
    "status": "Where a running or finished study stands.",
    "diff": "What differs between two designs, studies or campaigns.",
    "capture": "Field data from a serial logger.",
    "import": "Runs and tracks from the files of test benches and recording cars.",
    "schema": "JSON Schema of designs, campaigns and studies, for editors.",
    "doctor": "Published values and the machine against this installation.",
    "bench": "How quick the kernel is on this machine.",
}
FAILED, WRONG, LATER, VIOLATED, INTERRUPTED = 1, 2, 3, 4, 130  # exit codes, as --help tells them


class Door(click.Group):
    """A group whose commands are read when they are called, and whose errors end with their exit codes."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        module = f"{name}_" if keyword.iskeyword(name) else name
        found: click.Command = importlib.import_module(f"{__name__}.{module}").command
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from railui.io.problems import nearest

            ctx.fail(f"no command {args[0]!r}, {nearest(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta["railui.words"] = list(args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            try:
                return super().invoke(ctx)
            finally:
                sys.stdout.flush()  # here, where an error of it is told
        except KeyboardInterrupt:
            again = shlex.join(["railui", *ctx.meta["railui.words"]])
            click.echo(f"\ninterrupted; the same again: {again}", err=True)
            ctx.exit(INTERRUPTED)
        except (ValueError, RuntimeError, OSError) as error:
            # click's own errors and exits are RuntimeErrors of their kind
            if isinstance(error, click.exceptions.Exit | click.Abort | BrokenPipeError):
                raise
            if ctx.meta.get("railui.verbose", 0):
                import traceback

                traceback.print_exc(file=sys.stderr)
            ctx.exit(_told(error))


def _told(error: Exception) -> int:
    """Tells an error on stderr; returns the exit code that it has."""
    from railui.io.problems import FileProblems, LaterError
    from railui.io.units import UnitError

    if isinstance(error, FileProblems):
        for problem in error.problems:
            click.echo(str(problem), err=True)
        return WRONG
    told = str(error)
    if isinstance(error, OSError) and error.strerror:
        told = f"{error.filename}: {error.strerror}" if error.filename else _unnamed(error)
        if error.strerror == os.strerror(errno.EACCES):
            told += ", let yourself read and write there, or name another place"
    click.echo(f"railui: {told}", err=True)
    if isinstance(error, LaterError):
        return LATER
    return WRONG if isinstance(error, UnitError) else FAILED


def _unnamed(error: OSError) -> str:
    """An error of a stream that has no name, which is most often where stdout goes."""
    room = ", make room where the output goes" if error.errno == errno.ENOSPC else ""
    return f"cannot be written or read ({error.strerror}){room}"


@click.group(cls=Door, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="railui", prog_name="railui")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Railway bogies: models calibrated against measurements, unmodelled effects, suspension design.

    Research software. The bundled campaign is simulated; no measurement of a real vehicle has been analysed so far.
    Ride classes are not an acceptance or running-safety assessment.

    \b
    stdout is data, stderr is narration. Numbers are SI or carry a unit ("144 km/h").
    Exit codes: 0 done, 1 failed, 2 wrong use or a wrong file, 3 may work later,
    4 done but a limit is violated, 130 interrupted.
    """
    if ctx.invoked_subcommand is not None:
        return
    if sys.stdin.isatty() and sys.stdout.isatty():
        ctx.invoke(importlib.import_module(f"{__name__}.desk").command)
    else:
        click.echo(ctx.get_help())
