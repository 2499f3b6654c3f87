"""railui map: responses over two parameters of a design."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from railui.cli.arguments import (
    design_argument,
    figure_option,
    input_files,
    load_design_argument,
    quantity_option,
    resolve_track_argument,
    speed_option,
)
from railui.cli.invocation import Invocation, StatusLine, common_options, usage_errors
from railui.cli.quantities import parse_cant, parse_names, parse_radius
from railui.cli.tables import format_cell, make_table


@click.command("map")
@design_argument
@click.option("--x", required=True, metavar="PATH=RANGE", help="First parameter, such as contact.conicity=0.05:0.4.")
@click.option(
    "--y", required=True, metavar="PATH=RANGE", help="Second parameter; RANGE is FIRST:LAST or FIRST:LAST:STEP."
)
@quantity_option(
    "--of", parse_names, required=True, metavar="KEYS", help="Results of ride, stability or curve, such as fold_speed."
)
@click.option("--track", metavar="SPEC|CSV", help="Track of the ride.")
@speed_option()
@quantity_option("--radius", parse_radius, default="600", metavar="RADIUS", help="Radius of the keys of curve [m].")
@quantity_option(
    "--cant-deficiency", parse_cant, default="0", metavar="LENGTH", help="Cant deficiency of the keys of curve."
)
@click.option("-o", "--output", metavar="DIR", help="Directory of the map; railui-map/NAME next to DESIGN by default.")
@figure_option("the map, besides map.svg")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    x: str,
    y: str,
    of: list[str],
    track: str | None,
    speed: float | None,
    radius: float,
    cant_deficiency: float,
    output: str | None,
    figure: str | None,
    call: Invocation,
) -> None:
    """Compute a map of results of DESIGN over two of its parameters.

    \b
    railui map design.yaml --x contact.conicity=0.05:0.4 --of fold_speed \\
      --y "vehicle.secondary.yaw_damping=10 kN*m*s/rad:200 kN*m*s/rad"
    railui map design.yaml --x vehicle.primary.lateral_stiffness=1e6:8e6 --of score,flange_margin \\
      --y vehicle.secondary.lateral_damping=1e4:6e4:1e4 --track erri_b176_low --speed 40

    A name GROUP.KEY such as contact.conicity sets the key of all members of the group. Without a step a range has
    21 values. Results are stored in DIR as they arrive: the same command resumes an interrupted map, with the same
    digits, and a wider map takes over the vehicles that it shares. DIR gets map.json, map.csv (SI) and map.svg.
    """
    from railui.api.response_map import compute_map
    from railui.execution.map_session import FIGURE_FILE, MapSession
    from railui.execution.threads import ThreadRunner
    from railui.optimisation.response_map import check_axes, check_keys, read_axis
    from railui.report.figures.response_map import draw_map

    loaded = load_design_argument(call, design, overrides)
    with usage_errors():
        check_keys(of, has_track=track is not None, has_speed=speed is not None)
        axes = _axis(read_axis, loaded, "--x", x), _axis(read_axis, loaded, "--y", y)
        check_axes(*axes)
    source = None if track is None else resolve_track_argument(track, call.seed)
    curve: dict[str, Any] = {"radius": radius, "cant_deficiency": cant_deficiency}
    directory = Path(output) if output is not None else Path(design).parent / "railui-map" / Path(design).stem
    with MapSession(directory, ThreadRunner(call.jobs), StatusLine(call)) as session:
        found = compute_map(loaded, axes, of, source, speed, session.evaluator, **curve)
        count = session.evaluator.count
        call.info(f"{count.computed} vehicles computed, {count.cached} were in {directory}")
        document = call.document("map", found.body(), input_files(design, source), found.seed)
        written = session.write(document)
        draw_map(document, directory / FIGURE_FILE)
    call.info(f"wrote {', '.join(str(path) for path in [*written, directory / FIGURE_FILE])}")
    if figure is not None:
        draw_map(document, figure)
        call.info(f"wrote {figure}")
    call.show(_table(document))
    call.write_json(document)


def _axis(read: Any, design: Any, option: str, text: str) -> Any:
    try:
        return read(design, text)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None


def _table(document: Mapping[str, Any]) -> Any:
    """Return the least and the greatest value of each key, where they are, and the value of the design."""
    rows = []
    for key, one in document["of"].items():
        values = np.array([[np.nan if v is None else v for v in row] for row in one["values"]], dtype=float)
        ends = (
            ("-", "-")
            if np.isnan(values).all()
            else tuple(_end(document, values, f) for f in (np.nanargmin, np.nanargmax))
        )
        rows.append((key, one["unit"], format_cell(one["baseline"]), *ends))
    caption = [f"{reason}: {count} vehicles" for reason, count in document["failures"].items()]
    title = " against ".join(f"{document[name]['name']} [{document[name]['unit']}]" for name in "yx")
    columns = ("result", "unit", "of the design", "least, at x, y", "greatest, at x, y")
    return make_table(columns, rows, title=title, caption="\n".join([*caption, *document["notes"]]))


def _end(document: Mapping[str, Any], values: Any, find: Any) -> str:
    i, j = np.unravel_index(int(find(values)), values.shape)
    return f"{values[i, j]:.4g} at {document['x']['values'][j]:.4g}, {document['y']['values'][i]:.4g}"
