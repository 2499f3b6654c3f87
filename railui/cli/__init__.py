"""Command line: one command per task, each in a module that is imported when the command runs."""

from __future__ import annotations

import errno
import importlib
import keyword
import os
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

# summaries are here and not in the modules, so that --help imports none of them
COMMANDS = {
    "desk": "Open the terminal user interface; the default without a command.",
    "check": "Validate input files; list all errors and warnings.",
    "effects": "List the effects of the model library, with their parameters.",
    "track": "Write a synthetic track, or analyse the spectrum of one.",
    "ride": "Compute the ride quality of a design on a track.",
    "response": "Compute transfer functions and the linear response to a track.",
    "stability": "Compute modes and critical speeds of a design.",
    "curve": "Compute the quasi-static curving behaviour of a design.",
    "map": "Compute results over two parameters of a design.",
    "sensitivity": "Compute changes of results with each parameter of a design.",
    "assess": "Rank the sections of a track by the ride of a reference vehicle.",
    "contact": "Compute contact parameters from wheel and rail profiles.",
    "plan": "Plan a campaign: sensors and runs that detect effects.",
    "adjust": "Estimate the parameters of a model from a campaign.",
    "loop": "Calibrate a model and identify an unmodelled effect.",
    "fleet": "Follow many vehicles over months of runs; find changes early.",
    "optimise": "Optimise a suspension: single- or multi-objective search.",
    "status": "Report the state of a running or finished optimisation.",
    "diff": "List the differences between two designs, studies or campaigns.",
    "capture": "Record data from a serial logger.",
    "import": "Convert recordings of test benches and track recording cars.",
    "export": "Write the vehicle for other programs: state space or FMU.",
    "schema": "Print the JSON Schema of the YAML files.",
    "doctor": "Run the installation self-test against reference values.",
    "bench": "Measure the speed of the kernel on this machine.",
}
EXIT_FAILED, EXIT_USAGE, EXIT_RETRY_LATER, EXIT_LIMIT_VIOLATED, EXIT_INTERRUPTED = 1, 2, 3, 4, 130


class LazyCommandGroup(click.Group):
    """Command group that imports a command when it is called and turns exceptions into exit codes."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        module = f"{name}_" if keyword.iskeyword(name) else name
        command: click.Command = importlib.import_module(f"{__name__}.{module}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from railui.io.problems import suggest_name

            ctx.fail(f"no command {args[0]!r}, {suggest_name(args[0], COMMANDS)}")
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
                with _warnings_in_words():
                    return super().invoke(ctx)
            finally:
                sys.stdout.flush()  # inside the try, so that a failing flush is reported
        except KeyboardInterrupt:
            command_line = shlex.join(["railui", *ctx.meta["railui.words"]])
            click.echo(f"\ninterrupted; to run the same again: {command_line}", err=True)
            ctx.exit(EXIT_INTERRUPTED)
        except (ValueError, RuntimeError, OSError, MemoryError) as error:
            # click's own errors and exits are RuntimeErrors, too
            if isinstance(error, click.exceptions.Exit | click.Abort | BrokenPipeError):
                raise
            if ctx.meta.get("railui.verbose", 0):
                import traceback

                traceback.print_exc(file=sys.stderr)
            ctx.exit(_print_error(error))


@contextmanager
def _warnings_in_words() -> Iterator[None]:
    """Replace the warnings of numerical libraries by one line."""
    import warnings

    original = warnings.showwarning
    shown: list[str] = []

    def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
        if not issubclass(category, RuntimeWarning):
            original(message, category, *more, **named)
        elif not shown:
            shown.append(str(message))
            click.echo(f"warning: numbers of the computation are not finite ({message}): check the input", err=True)

    warnings.showwarning = show
    try:
        yield
    finally:
        warnings.showwarning = original


def _print_error(error: Exception) -> int:
    """Print an error on stderr; return its exit code."""
    from railui.io.problems import FileProblems, TemporaryError
    from railui.io.units import UnitError

    if isinstance(error, FileProblems):
        for problem in error.problems:
            click.echo(str(problem), err=True)
        return EXIT_USAGE
    text = str(error)
    if isinstance(error, MemoryError):
        text = f"needs more memory than there is ({text or 'out of memory'}): give less, or coarser data"
    if isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else _stream_error(error)
        if error.strerror == os.strerror(errno.EACCES):
            text += ", change its permissions or name another path"
    click.echo(f"railui: {text}", err=True)
    if isinstance(error, TemporaryError):
        return EXIT_RETRY_LATER
    return EXIT_USAGE if isinstance(error, UnitError) else EXIT_FAILED


def _stream_error(error: OSError) -> str:
    """Return the message for a stream without a name, most often stdout."""
    remedy = ", make room where the output goes" if error.errno == errno.ENOSPC else ""
    return f"cannot be written or read ({error.strerror}){remedy}"


@click.group(
    cls=LazyCommandGroup, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(package_name="railui", prog_name="railui")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Railway bogies: models calibrated against measurements, unmodelled effects, suspension design.

    Research software. The bundled campaign is simulated; no measurement of a real vehicle has been analysed so far.
    Ride classes are not an acceptance or running-safety assessment.

    \b
    Results go to stdout, messages to stderr.
    Numbers are SI or carry a unit ("144 km/h").
    Exit codes: 0 done, 1 failed, 2 usage error or faulty file, 3 try again later,
    4 done but a limit is violated, 130 interrupted.
    """
    if ctx.invoked_subcommand is not None:
        return
    if sys.stdin.isatty() and sys.stdout.isatty():
        ctx.invoke(importlib.import_module(f"{__name__}.desk").command)
    else:
        click.echo(ctx.get_help())
