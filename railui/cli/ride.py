"""railui ride: ride quality of a design on a track."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from railui.cli import EXIT_LIMIT_VIOLATED
from railui.cli.arguments import (
    GRADE_NOTE,
    REJECTED_CLASSES,
    design_argument,
    input_files,
    load_design_argument,
    quantity_option,
    resolve_track_argument,
    speed_option,
    strict_option,
)
from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.quantities import parse_plot_path, parse_seeds, parse_series_path, parse_speeds
from railui.cli.tables import format_cell, make_table

if TYPE_CHECKING:
    from railui.api.design import Design
    from railui.track.excitation import TrackSource

# rows of the table of a single ride, with their units
QUANTITIES = {
    "score": "",
    "class": "",
    "decided_by": "",
    "comfort_hours": "h",
    "comfort_point": "",
    "weighted_acceleration": "m/s^2",
    "weighted_acceleration_1974": "m/s^2",
    "flange_fraction": "",
    "flange_fraction_gaussian": "",
    "flange_margin": "",
    "n_mv": "",
    "wz": "",
}
# columns of the table of several rides
COMPARED = (
    "score",
    "class",
    "comfort_hours",
    "weighted_acceleration",
    "flange_fraction",
    "flange_margin",
    "safety_share",
)
SHARED_NOTES = ("comfort:", "cross-level:", "linear:")  # notes of the table of several rides
LABELS = {"class": "class, no acceptance"}
# rows of a line with curves
LINE_QUANTITIES = {
    "least_radius": ("least radius", "m"),
    "largest_cant_deficiency": ("largest cant deficiency", "m"),
    "largest_acceleration": ("its lateral acceleration", "m/s^2"),
}
# criteria of running safety: row, factor, unit
CRITERIA = {
    "sum_of_guiding_forces": ("sum of guiding forces, 2 m mean", 1e-3, "kN"),
    "rms_100m": ("its rms over 100 m near f_0", 1e-3, "kN"),
    "derailment_quotient": ("Y/Q of a wheel, 2 m mean", 1.0, ""),
    "weinstock": ("sum of abs(Y/Q) of a wheelset", 1.0, ""),
    "wheel_unloading": ("unloading of a wheel, 2 m mean", 1.0, ""),
}


@click.command("ride")
@design_argument
@click.option("--track", required=True, metavar="SPEC|FILE", help="Synthetic track, or a file: track, line or run.")
@speed_option()
@quantity_option("--speeds", parse_speeds, metavar="RANGE", help="Several speeds, such as 30:60:10, ends included.")
@quantity_option("--seeds", parse_seeds, metavar="LIST", help="Seeds of the track, such as 1,2,3 or 1:10.")
@quantity_option(
    "--series",
    parse_series_path,
    metavar="FILE",
    help="Write the time series of all channels: .csv, .csv.gz or .parquet.",
)
@quantity_option(
    "--plot",
    parse_plot_path,
    metavar="FILE",
    help="Draw time histories, spectra, guiding forces and Y/Q: .html, .svg, .png or .pdf.",
)
@strict_option("a ride")
@common_options
@click.pass_context
def command(
    ctx: click.Context,
    design: str,
    overrides: dict[str, str],
    track: str,
    speed: float | None,
    speeds: list[float] | None,
    seeds: list[int] | None,
    series: str | None,
    plot: str | None,
    strict: bool,
    call: Invocation,
) -> None:
    """Compute the ride quality of DESIGN on a track: comfort, guidance, score, class and the deciding criterion.

    \b
    railui ride design.yaml --track "erri_b176_low length=2000" --speed 40
    railui ride design.yaml --track line.csv --speed "144 km/h" vehicle.primary.lateral_stiffness=4e6
    railui ride design.yaml --track line.csv --speed 40 --series run.csv.gz --plot ride.html

    Several speeds or seeds are reported with their mean and standard deviation (n - 1) and the worst of them: one seed
    of a synthetic track is a random sample. The class is a grade of this program, not an acceptance.
    """
    if (speed is None) == (speeds is None):
        raise usage_error("give either --speed or --speeds")
    loaded = load_design_argument(call, design, overrides)
    given = speeds if speeds is not None else [speed] if speed is not None else []
    asked: list[int | None] = [call.seed] if seeds is None else [*seeds]
    sources = [resolve_track_argument(track, seed) for seed in asked]
    head = {"design": loaded.name, "overrides": overrides}
    is_single = len(given) * len(sources) == 1
    if not is_single and (series is not None or plot is not None):
        raise usage_error("--series and --plot are of one ride: give one --speed and one seed")
    if is_single:
        found = loaded.ride(sources[0], given[0], jobs=call.jobs)
        result = dict(found.data)
        body, cases = found.body(), [result]
        call.show(_single_table(result))
    else:
        from railui.api.ride_cases import summarise_cases

        cases = _simulate_cases(loaded, sources, given, call)
        body = head | summarise_cases(cases)
        call.show(_cases_table(body))
    document = call.document("ride", body, input_files(design, sources[0]), body.get("seed"))
    if series is not None or plot is not None:
        _write_time_series(loaded, sources[0], given[0], document, series, plot, call)
    call.write_json(document)
    is_rejected = any(case["class"] in REJECTED_CLASSES for case in cases)
    ctx.exit(EXIT_LIMIT_VIOLATED if strict and is_rejected else 0)


def _write_time_series(
    design: Design,
    source: TrackSource,
    speed: float,
    document: Mapping[str, Any],
    series: str | None,
    plot: str | None,
    call: Invocation,
) -> None:
    """Write the time series and the figures of a ride."""
    from railui.api.ride import ride_panels

    panels = ride_panels(design, source, speed, jobs=call.jobs)
    if series is not None:
        from railui.io.series_file import write_series

        title = f"simulated by railui {document['version']}: {design.name} on {source.name} at {speed:.4g} m/s"
        write_series(series, panels.series.by_header(), [title])
        call.info(f"wrote {series}")
    if plot is not None:
        from railui.report.ride.figures import draw_ride
        from railui.report.ride.page import write_ride_page

        if plot.lower().endswith(".html"):
            write_ride_page(panels, document, plot)
        else:
            draw_ride(panels, plot)
        call.info(f"wrote {plot}")


def _simulate_cases(
    design: Design, sources: list[TrackSource], speeds: list[float], call: Invocation
) -> list[dict[str, Any]]:
    from railui import ride_many
    from railui.api.ride import add_instability_notes

    cases: list[dict[str, Any]] = []
    for source in sources:
        for v in speeds:
            cases += ride_many([design], source, v, call.jobs)
            call.status(f"{len(cases)} of {len(sources) * len(speeds)} simulations")
    add_instability_notes(design, cases)
    return cases


def _single_table(result: dict[str, Any]) -> Any:
    rows = [(LABELS.get(key, key), format_cell(result[key]), unit) for key, unit in QUANTITIES.items()]
    for key, value in (result["reference"] or {}).items():
        rows.append((f"{key}, in the frequency domain", format_cell(value), "m/s^2"))
    forces = result["forces"] or {"criteria": [], "notes": []}
    rows += _criteria_rows(forces["criteria"])
    rows += _line_rows(result.get("line"))
    if result["diverged"]:
        rows.append(("simulation diverged at s", format_cell(result["diverged"]["at_s"]), "m"))
    title = f"{result['track']} at {result['speed']:.4g} m/s ({3.6 * result['speed']:.4g} km/h)"
    return make_table(
        ("ride quality", "", "unit"), rows, title=title, caption="\n".join([*result["notes"], *forces["notes"]])
    )


def _line_rows(line: Mapping[str, float | None] | None) -> list[tuple[str, str, str]]:
    """Return the rows of a line with curves."""
    if line is None:
        return []
    return [(caption, format_cell(line[key]), unit) for key, (caption, unit) in LINE_QUANTITIES.items()]


def _criteria_rows(criteria: list[dict[str, Any]]) -> list[tuple[str, str, str]]:
    """Return the rows of the largest values with their limits; criteria without a limit are in the JSON only."""
    rows = []
    for item in criteria:
        if item["criterion"] in CRITERIA and item["limit"] is not None:
            name, factor, unit = CRITERIA[item["criterion"]]
            value = f"{item['value'] * factor:.3g} of {item['limit'] * factor:.3g}"
            rows.append((name, value + (f", exceeded: {item['place']}" if item["exceeded"] else ""), unit))
    return rows


def _cases_table(body: dict[str, Any]) -> Any:
    cases = [
        (f"{case['speed']:.4g}", format_cell(case["seed"]), *(format_cell(case[key]) for key in COMPARED))
        for case in body["cases"]
    ]
    statistics = [
        (name, "", *("" if key == "class" else format_cell(body[name].get(key)) for key in COMPARED))
        for name in ("mean", "sd")
    ]
    columns = ("speed [m/s]", "seed", *(key.replace("_", " ") for key in COMPARED))
    worst = body["worst"]
    caption = [f"worst, at {worst['speed']:.4g} m/s: {worst['class']}, {worst['decided_by']}", GRADE_NOTE]
    caption += dict.fromkeys(note for case in body["cases"] for note in case["notes"] if note.startswith(SHARED_NOTES))
    return make_table(columns, cases, statistics, title=body["cases"][0]["track"], caption="\n".join(caption))
