"""railui sensitivity: derivatives of the results of a design with respect to its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli.arguments import (
    design_argument,
    figure_option,
    input_files,
    load_design_argument,
    quantity_option,
    resolve_track_argument,
    speed_option,
)
from railui.cli.invocation import Invocation, common_options, usage_error, usage_errors
from railui.cli.quantities import parse_cant, parse_names, parse_radius, parse_seeds
from railui.cli.tables import format_cell, make_table

MAX_ROWS = 20
MAX_SKIPPED = 4  # paths named in the table


@click.command("sensitivity")
@design_argument
@quantity_option(
    "--of",
    parse_names,
    metavar="KEYS",
    help="Results of ride, stability or curve; ride quality and damping by default.",
)
@click.option("--track", metavar="SPEC|CSV", help="Track of the ride.")
@speed_option()
@quantity_option("--seeds", parse_seeds, metavar="LIST", help="Seeds of the track, over which changes are averaged.")
@quantity_option("--radius", parse_radius, default="600", metavar="RADIUS", help="Radius of the keys of curve [m].")
@quantity_option(
    "--cant-deficiency", parse_cant, default="0", metavar="LENGTH", help="Cant deficiency of the keys of curve."
)
@figure_option("the largest changes of each result")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    of: list[str] | None,
    track: str | None,
    speed: float | None,
    seeds: list[int] | None,
    radius: float,
    cant_deficiency: float,
    figure: str | None,
    call: Invocation,
) -> None:
    """Compute how the results of DESIGN change with each of its parameters, all others fixed.

    \b
    railui sensitivity design.yaml --track "erri_b176_low length=2000" --speed 40 --seeds 1:4
    railui sensitivity design.yaml --of wear_number,guiding_force --radius 400

    Each parameter goes from 5 % below to 5 % above its value, on the same tracks. The table has the change of each
    result and, for several seeds, its standard deviation; the JSON also the derivatives in SI and relative ones.
    """
    from railui.api.sensitivity import compute_sensitivity, default_keys
    from railui.optimisation.response_map import check_keys

    has_ride = track is not None and speed is not None
    keys = default_keys(of, has_ride=has_ride)
    with usage_errors("--of"):
        check_keys(keys, has_track=track is not None, has_speed=speed is not None)
    if seeds is not None and track is None:
        raise usage_error("--seeds needs a track: give --track")
    loaded = load_design_argument(call, design, overrides)
    asked: list[int | None] = [call.seed] if seeds is None else [*seeds]
    sources = [None if track is None else resolve_track_argument(track, s) for s in asked]
    curve: dict[str, Any] = {"radius": radius, "cant_deficiency": cant_deficiency}
    found = compute_sensitivity(loaded, keys, sources, speed, seeds=seeds, **curve, jobs=call.jobs)
    result = found.data
    if figure is not None:
        from railui.report.figures.sensitivity import draw_sensitivity

        draw_sensitivity(result, figure)
        call.info(f"wrote {figure}")
    call.show(_table(result, keys))
    call.write_json(call.document("sensitivity", found.body(), input_files(design, sources[0]), found.seed))


def _table(result: Mapping[str, Any], keys: list[str]) -> Any:
    """Return the parameters with the largest relative changes of any result."""

    def largest(parameter: Mapping[str, Any]) -> float:
        values = [abs(parameter["relative"][key]) for key in keys]
        return max((x for x in values if x == x), default=0.0)

    ranked = sorted(result["parameters"], key=largest, reverse=True)
    rows = [
        (one["path"], format_cell(one["value"]), one["unit"], *(_change(one, key) for key in keys))
        for one in ranked[:MAX_ROWS]
    ]
    base = ("value of the design", "", "", *(_value(result["responses"][key]) for key in keys))
    units = [result["responses"][key]["unit"] for key in keys]
    heads = [key if unit == "1" else f"{key} [{unit}]" for key, unit in zip(keys, units, strict=True)]
    notes = [f"{len(ranked) - MAX_ROWS} more in the JSON"] if len(ranked) > MAX_ROWS else []
    if skipped := result["skipped"]:
        notes.append(f"{len(skipped)} left out, zero or at the end of their range: {_some(skipped)}")
    title = f"change of each result as a parameter rises by {200 * result['step']:g} %, largest relative change first"
    columns = ("parameter", "value", "unit", *heads)
    return make_table(columns, [base], rows, title=title, caption="\n".join([*notes, *result["notes"]]))


def _value(response: Mapping[str, Any]) -> str:
    spread = f" +/- {response['sd']:.2g}" if response["sd"] else ""
    return ("-" if response["value"] != response["value"] else f"{response['value']:.4g}") + spread


def _change(parameter: Mapping[str, Any], key: str) -> str:
    change, sd = parameter["change"][key], parameter["change_sd"][key]
    if change != change:
        return "-"
    return f"{change:+.3g}" + (f" +/- {sd:.1g}" if sd else "")


def _some(paths: list[str]) -> str:
    return ", ".join(paths[:MAX_SKIPPED]) + (", ..." if len(paths) > MAX_SKIPPED else "")
