"""railui response: transfer functions and stationary response of the linear vehicle."""

from __future__ import annotations

from collections.abc import Mapping
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
from railui.cli.invocation import Invocation, common_options, usage_errors
from railui.cli.quantities import parse_frequencies, parse_names
from railui.cli.tables import format_cell, make_table


@click.command("response")
@design_argument
@speed_option(required=True)
@click.option("--track", metavar="SPEC|CSV", help="Compute rms and spectral density of every channel on this track.")
@quantity_option("--channels", parse_names, metavar="LIST", help="Channels, such as e1,ayf; those of a run by default.")
@quantity_option(
    "--frequencies",
    parse_frequencies,
    metavar="RANGE",
    help="Frequencies, such as 0.1:20:0.1 [Hz]; 0.1 to 50 Hz and those of the modes by default.",
)
@figure_option("transfer functions and spectral densities")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    speed: float,
    track: str | None,
    channels: list[str] | None,
    frequencies: list[float] | None,
    figure: str | None,
    call: Invocation,
) -> None:
    """Compute transfer functions of the linear DESIGN and its stationary response to a track, without simulation.

    \b
    railui response design.yaml --speed 40 --track erri_b176_low
    railui response design.yaml --speed "144 km/h" --channels e1,ayf --frequencies 0.5:20:0.1 --figure h.svg

    Transfer functions from the lateral deviation yw and the cross-level phiw of the track under the leading wheelset
    to the channels; the other wheelsets meet the track later. rms and one-sided spectral densities follow from the
    spectrum of a synthetic track, of which a simulation is one sample, or from Welch's estimate of a measured one.
    Effects that are not linear are left out, as in railui stability.
    """
    from railui.api.response import compute_response
    from railui.vehicle.channels import check_channels
    from railui.vehicle.resolve import resolve_model

    loaded = load_design_argument(call, design, overrides)
    source = None if track is None else resolve_track_argument(track, call.seed)
    with usage_errors("--channels"):
        check_channels(resolve_model(loaded), channels or ())
    found = compute_response(loaded, speed, source, channels=channels, frequencies=frequencies)
    result = found.data
    if figure is not None:
        from railui.report.figures.response import draw_response

        draw_response(result, figure)
        call.info(f"wrote {figure}")
    call.show(_table(result))
    if result["ride"] is not None:
        call.show(_ride_table(result))
    call.write_json(call.document("response", found.body(), input_files(design, source), found.seed))


def _table(result: Mapping[str, Any]) -> Any:
    """Return rms and the largest magnitude of each transfer function with its frequency."""
    from railui.api.response import slowest_root

    rows = []
    for name, channel in result["channels"].items():
        rms = format_cell(result["stationary"][name]["rms"]) if result["stationary"] else "-"
        rows.append((name, channel["unit"], rms, *(_peak(result, name, key) for key in result["irregularities"])))
    columns = ("channel", "unit", "rms", *(f"largest from {key}" for key in result["irregularities"]))
    caption = [f"slowest root {slowest_root(result)}", *result["notes"]]
    return make_table(columns, rows, title=_title(result), caption="\n".join(caption))


def _title(result: Mapping[str, Any]) -> str:
    speed = f"linear response at {result['speed']:.4g} m/s"
    return speed if result["density"] is None else f"{speed}: {result['density']}"


def _peak(result: Mapping[str, Any], name: str, key: str) -> str:
    one = result["transfer"][name][key]
    k = int(np.argmax(one["magnitude"]))
    unit = "" if one["unit"] == "1" else f" {one['unit']}"
    return f"{one['magnitude'][k]:.4g}{unit} at {result['frequencies'][k]:.3g} Hz"


def _ride_table(result: Mapping[str, Any]) -> Any:
    units = {"comfort_hours": "h", "weighted_acceleration": "m/s^2", "weighted_acceleration_1974": "m/s^2"}
    rows = [(key, format_cell(value), units.get(key, "")) for key, value in result["ride"].items()]
    return make_table(("ride quality, linear", "", "unit"), rows)
