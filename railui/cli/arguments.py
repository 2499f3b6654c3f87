"""Arguments and options that several commands share: designs with overrides, tracks, quantities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.invocation import Invocation, usage_errors
from railui.cli.quantities import option_callback, parse_figure_path, parse_speed

if TYPE_CHECKING:
    from railui.api.design import Design
    from railui.track.excitation import TrackSource

REJECTED_CLASSES = ("not admissible", "dangerous")  # ride classes that fail with --strict
GRADE_NOTE = "class: a grade of this program, no acceptance"

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def quantity_option(name: str, parse: Callable[[str], Any], **attributes: Any) -> Decorator:
    """Return an option whose text is parsed with its unit; a default is shown in the help."""
    return click.option(name, callback=option_callback(parse), show_default="default" in attributes, **attributes)


def speed_option(**attributes: Any) -> Decorator:
    """Return the option --speed [m/s]."""
    return quantity_option(
        "--speed", parse_speed, metavar="SPEED", help='Running speed, such as 40 or "144 km/h".', **attributes
    )


def figure_option(contents: str, name: str = "--figure") -> Decorator:
    """Return an option that names the file of a figure."""
    return quantity_option(name, parse_figure_path, metavar="FILE", help=f"Draw {contents}: .svg, .png or .pdf.")


def strict_option(what: str) -> Decorator:
    """Return the option --strict."""
    return click.option(
        "--strict", is_flag=True, help=f"Exit code 4 where {what} is classified {' or '.join(REJECTED_CLASSES)}."
    )


def overrides_argument(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the argument `overrides`: PATH=VALUE words."""
    return click.argument("overrides", nargs=-1, metavar="[PATH=VALUE]...", callback=parse_overrides)(command)


def design_argument(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the arguments `design` and `overrides`."""
    return click.argument("design", metavar="DESIGN")(overrides_argument(command))


def parse_overrides(ctx: click.Context, parameter: click.Parameter, words: tuple[str, ...]) -> dict[str, str]:
    """Parse PATH=VALUE words into a mapping, as the callback of an argument."""
    try:
        return split_overrides(words)
    except click.UsageError as error:
        raise click.BadParameter(error.message, ctx, parameter) from None


def split_overrides(words: tuple[str, ...]) -> dict[str, str]:
    """Return PATH=VALUE words as a mapping; raise a usage error for another word."""
    overrides: dict[str, str] = {}
    for word in words:
        path, equals, value = word.partition("=")
        if not equals or not path.strip() or not value.strip():
            message = f"{word!r} is not an override: write PATH=VALUE, such as vehicle.primary.lateral_stiffness=4e6"
            raise click.UsageError(message)
        overrides[path.strip()] = value.strip()
    return overrides


def load_design_argument(call: Invocation, path: str, overrides: Mapping[str, str]) -> Design:
    """Load a design with its overrides and print its warnings; FileProblems with every fault."""
    from railui.api.design import Design
    from railui.documents.recognise import expect_kind
    from railui.vehicle.superseded import superseded_warnings
    from railui.vehicle.wheel_loads import wheel_load_warnings

    expect_kind(path, "design")
    design = Design.load(Path(path))
    call.warn(design.warnings)
    if not overrides:
        return design
    changed = design.with_values(overrides)
    known = {problem.message for problem in design.warnings}
    call.warn([problem for problem in wheel_load_warnings(changed) if problem.message not in known])
    call.warn(superseded_warnings(changed, overrides))
    return changed


def resolve_track_argument(track: str, seed: int | None, option: str = "--track") -> TrackSource:
    """Return the track that an argument names: a file, or a synthetic track with this seed.

    Raises FileProblems for a faulty file, a usage error of `option` for a faulty spec and for a file with a seed.
    """
    from railui.track.excitation import resolve_track

    with usage_errors(option):
        return resolve_track(track, seed)


def input_files(design: str, source: TrackSource | None) -> list[str]:
    """Return the files that a command read: the design and, where it is a file, the track."""
    return [design, *([str(source.file)] if source is not None and source.file is not None else [])]
