"""railui assess: ranking of track sections by the simulated ride of a reference vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli import EXIT_LIMIT_VIOLATED
from railui.cli.arguments import (
    GRADE_NOTE,
    REJECTED_CLASSES,
    figure_option,
    input_files,
    load_design_argument,
    overrides_argument,
    quantity_option,
    resolve_track_argument,
    speed_option,
    strict_option,
)
from railui.cli.invocation import Invocation, common_options, usage_error, usage_errors
from railui.cli.quantities import parse_cant, parse_length
from railui.cli.tables import format_cell, make_table

METHODS = ("response", "en14363")
MAX_ROWS = 20
COLUMNS = (
    *("from [m]", "to [m]", "score", "class", "flange", "margin [sd]", "W_d [m/s^2]", "max e [mm]"),
    *("sum Y [kN]", "Y/Q", "sd yw [mm]", "rank yw"),
)


@click.command("assess")
@click.argument("track", metavar="TRACK")
@click.argument("design", metavar="DESIGN")
@overrides_argument
@speed_option()
@quantity_option("--stretch", parse_length, default="200", metavar="LENGTH", help="Length of a track section [m].")
@click.option("--method", type=click.Choice(METHODS), default=METHODS[0], show_default=True, help="Kind of assessment.")
@click.option("--measured", is_flag=True, help="en14363: evaluate the measured columns of the run TRACK.")
@quantity_option(
    "--cant-deficiency",
    parse_cant,
    metavar="LENGTH",
    help="en14363: target of the two-dimensional method; one-dimensional without it.",
)
@figure_option("geometry and ride quality along the track")
@strict_option("a section")
@common_options
@click.pass_context
def command(
    ctx: click.Context,
    track: str,
    design: str,
    overrides: dict[str, str],
    speed: float | None,
    stretch: float,
    method: str,
    measured: bool,
    cant_deficiency: float | None,
    figure: str | None,
    strict: bool,
    call: Invocation,
) -> None:
    """Simulate DESIGN, a reference vehicle, on TRACK and rank the track sections by ride quality, worst first.

    \b
    railui assess line.csv design.yaml --speed 40
    railui assess "erri_b176_low length=5000" design.yaml --speed "160 km/h" --figure line.svg

    TRACK is a track, a measured run or the spec of a synthetic track. The table also gives the rank of each section
    by track geometry alone, so that maintenance can be prioritised by vehicle response.

    \b
    railui assess line.csv design.yaml --speed 40 --method en14363
    railui assess run.csv design.yaml --method en14363 --measured

    With `--method en14363` the forces and accelerations of the simulation, or those measured in a run, are evaluated by
    the rules of EN 14363: test zones, track sections, percentiles, estimated maxima, limits. It is not an acceptance.
    """
    from railui.api.assessed_track import check_section_length, compute_assessment

    if method != METHODS[1] and (measured or cant_deficiency is not None):
        raise usage_error("--measured and --cant-deficiency belong to --method en14363")
    if speed is None and not measured:
        raise usage_error("give --speed")
    loaded = load_design_argument(call, design, overrides)
    if method == METHODS[1]:
        from railui.cli.assess_en14363 import evaluate_command

        if figure is not None:
            raise usage_error("--figure: --method en14363 draws none")
        is_exceeded = evaluate_command(call, track, design, loaded, overrides, speed, cant_deficiency, measured)
        ctx.exit(EXIT_LIMIT_VIOLATED if strict and is_exceeded else 0)
    assert speed is not None
    source = resolve_track_argument(track, call.seed, "TRACK")
    with usage_errors("--stretch"):
        check_section_length(source.track, stretch)
    found = compute_assessment(loaded, source, speed, section_length=stretch, jobs=call.jobs)
    result = found.data
    if figure is not None:
        from railui.report.figures.assess import draw_assessment

        draw_assessment(result, source.track, figure)
        call.info(f"wrote {figure}")
    call.show(_table(result))
    call.write_json(call.document("assess", found.body(), input_files(design, source), source.seed))
    is_rejected = any(section["class"] in REJECTED_CLASSES for section in result["stretches"])
    ctx.exit(EXIT_LIMIT_VIOLATED if strict and is_rejected else 0)


def _table(result: Mapping[str, Any]) -> Any:
    sections = result["stretches"]
    notes = [GRADE_NOTE, *([f"{len(sections) - MAX_ROWS} more in the JSON"] if len(sections) > MAX_ROWS else [])]
    if result["agreement"] is not None:
        notes.append(f"rank correlation of ride quality and geometry (sd of 3 to 25 m): {result['agreement']:.2f}")
    title = f"{result['track']} at {result['speed']:.4g} m/s, worst first"
    return make_table(
        COLUMNS, map(_row, sections[:MAX_ROWS]), title=title, caption="\n".join([*notes, *result["notes"]])
    )


def _row(section: Mapping[str, Any]) -> list[str]:
    keys = {
        "flange_fraction": 1.0,
        "flange_margin": 1.0,
        "weighted_acceleration": 1.0,
        "largest_e": 1e3,
        "sum_of_guiding_forces": 1e-3,
        "derailment_quotient": 1.0,
    }
    return [
        f"{section['from']:.0f}",
        f"{section['to']:.0f}",
        f"{section['score']:.1f}",
        section["class"],
        *(format_cell(section[key], 3, factor) for key, factor in keys.items()),
        f"{1e3 * section['sd_yw']:.3f}",
        str(section["rank_geometry"]),
    ]
