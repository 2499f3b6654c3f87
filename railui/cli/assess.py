"""railui assess: a track judged by what a standard vehicle does on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli import VIOLATED
from railui.cli.common import STRICT, Invocation, lay_track, load_vehicle, options, overrides_of, refuse
from railui.cli.quantities import figure, length, reading, speed

SHOWN = 20  # stretches of the table


@click.command("assess")
@click.argument("track", metavar="TRACK")
@click.argument("design", metavar="DESIGN")
@click.argument("overrides", nargs=-1, metavar="[PATH=VALUE]...", callback=overrides_of)
@click.option("--speed", callback=reading(speed), required=True, metavar="SPEED", help='Such as 40, or "144 km/h".')
@click.option("--stretch", callback=reading(length), default="200", show_default=True, metavar="LENGTH",
              help="Length of a stretch [m].")  # fmt: skip
@click.option(
    "--figure",
    callback=reading(figure),
    metavar="FILE",
    help="Draw geometry and ride along the track: .svg, .png or .pdf.",
)
@click.option("--strict", is_flag=True, help="Exit code 4 where a stretch is not admissible or dangerous.")
@options
@click.pass_context
def command(
    ctx: click.Context, track: str, design: str, overrides: dict[str, str], speed: float, stretch: float,
    figure: str | None, strict: bool, call: Invocation,
) -> None:  # fmt: skip
    """Judge TRACK by the ride of DESIGN, a standard vehicle, in stretches, worst first.

    \b
    railui assess line.csv design.yaml --speed 40
    railui assess "erri_b176_high length=5000" design.yaml --speed "160 km/h" --figure line.svg

    TRACK is a track, a measured run or the spec of a synthetic track. Maintenance should better the ride, not
    the straightness: beside the score of a stretch stands its place in the order by geometry.
    """
    from railui.ride_quality.track_assessment import assess, check_stretch

    vehicle = load_vehicle(call, design, overrides)
    laid = lay_track(track, call.seed, "TRACK")
    try:
        check_stretch(laid.track, stretch)
    except ValueError as error:
        raise refuse(f"--stretch: {error}") from None
    found = assess(laid, vehicle, speed, stretch=stretch, jobs=call.jobs)
    if figure is not None:
        from railui.report.figures.assess import draw_assessment

        draw_assessment(found, laid.track, figure)
        call.say(f"wrote {figure}")
    call.show(_table(found))
    inputs = [design, *([str(laid.file)] if laid.file is not None else [])]
    body = {"design": vehicle.name, "overrides": overrides, **found}
    call.emit(call.document("assess", body, inputs, laid.seed))
    ctx.exit(VIOLATED if strict and any(one["class"] in STRICT for one in found["stretches"]) else 0)


def _table(found: Mapping[str, Any]) -> Any:
    from rich.table import Table

    title = f"{found['track']} at {found['speed']:g} m/s, worst first"
    columns = ("from [m]", "to [m]", "score", "class", "flange share", "margin [sd]", "W_d [m/s^2]",
               "max e [mm]", "sum Y [kN]", "Y/Q", "sd yw [mm]", "by yw")  # fmt: skip
    table = Table(*columns, title=title, title_justify="left")
    for one in found["stretches"][:SHOWN]:
        table.add_row(
            f"{one['from']:.0f}", f"{one['to']:.0f}", f"{one['score']:.1f}", one["class"],
            _number(one["flange_fraction"], 1.0), _number(one["flange_margin"], 1.0),
            _number(one["weighted_acceleration"], 1.0), _number(one["largest_e"], 1e3),
            _number(one["sum_of_guiding_forces"], 1e-3), _number(one["derailment_quotient"], 1.0),
            f"{1e3 * one['sd_yw']:.3f}", str(one["rank_geometry"]),
        )  # fmt: skip
    more = len(found["stretches"]) - SHOWN
    notes = [f"{more} more in the JSON"] if more > 0 else []
    if found["agreement"] is not None:
        notes.append(f"rank correlation of ride and geometry (sd of 3 to 25 m): {found['agreement']:.2f}")
    table.caption = "\n".join([*notes, *found["notes"]])
    return table


def _number(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{factor * value:.3g}"
