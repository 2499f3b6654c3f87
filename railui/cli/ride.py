"""railui ride: the riding quality of a design on a track."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from railui.cli import VIOLATED
from railui.cli.common import STRICT, Invocation, cell, design_argument, lay_track, load_vehicle, options, refuse
from railui.cli.quantities import reading, seeds, speed, speeds

if TYPE_CHECKING:
    from railui.track.excitation import TrackSource
    from railui.vehicle.design_reader import Design

SHOWN = (
    *(("score", ""), ("class", ""), ("decided_by", ""), ("comfort_hours", "h")),
    *(("weighted_acceleration", "m/s^2"), ("weighted_acceleration_1974", "m/s^2")),
    *(("flange_fraction", ""), ("flange_fraction_gaussian", ""), ("flange_margin", ""), ("n_mv", ""), ("wz", "")),
)


@click.command("ride")
@design_argument
@click.option("--track", required=True, metavar="SPEC|CSV", help="A synthetic track, or the file of one or of a run.")
@click.option("--speed", callback=reading(speed), metavar="SPEED", help='Such as 40, or "144 km/h".')
@click.option("--speeds", callback=reading(speeds), metavar="RANGE", help="Such as 30:60:10, ends included.")
@click.option("--seeds", callback=reading(seeds), metavar="LIST", help="Seeds of the track, such as 1,2,3 or 1:10.")
@click.option("--strict", is_flag=True, help="Exit code 4 where the class is not admissible or dangerous.")
@options
@click.pass_context
def command(
    ctx: click.Context, design: str, overrides: dict[str, str], track: str, speed: float | None,
    speeds: list[float] | None, seeds: list[int] | None, strict: bool, call: Invocation,
) -> None:  # fmt: skip
    """Tell the riding quality of DESIGN on a track: comfort, guidance, score, class and what decided it.

    \b
    railui ride design.yaml --track "erri_b176_low length=2000" --speed 40
    railui ride design.yaml --track line.csv --speed "144 km/h" vehicle.primary.lateral_stiffness=4e6

    Several speeds or seeds make cases, with the mean and the standard deviation (n - 1) over them: one seed
    of a synthetic track is a sample.
    """
    if (speed is None) == (speeds is None):
        raise refuse("give either --speed or --speeds")
    vehicle = load_vehicle(call, design, overrides)
    given = speeds if speeds is not None else [speed] if speed is not None else []
    asked: list[int | None] = [call.seed] if seeds is None else [*seeds]
    laid = [lay_track(track, seed, seeded=seeds is not None) for seed in asked]
    inputs = [design, *[str(line.file) for line in laid[:1] if line.file is not None]]
    head = {"design": vehicle.name, "overrides": overrides}
    if len(given) * len(laid) == 1:
        from railui.ride_quality.evaluation import ride

        found = ride(vehicle, laid[0], given[0], jobs=call.jobs)
        body, cases = head | found, [found]
        call.show(_single(found))
    else:
        cases = _cases(vehicle, laid, given, call)
        body = head | summary(cases)
        call.show(_several(body))
    call.emit(call.document("ride", body, inputs, body.get("seed")))
    ctx.exit(VIOLATED if strict and any(case["class"] in STRICT for case in cases) else 0)


def _cases(vehicle: Design, laid: list[TrackSource], speeds: list[float], call: Invocation) -> list[dict[str, Any]]:
    from railui.ride_quality.evaluation import ride_many

    found = []
    for line in laid:
        for v in speeds:
            found += ride_many([vehicle], line, v, call.jobs)
            call.progress(f"{len(found)} of {len(laid) * len(speeds)} rides")
    return found


def summary(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Cases with the mean and standard deviation (n - 1) of every number; None where a case has none."""
    import numpy as np

    own = ("steps", "speed", "seed", "comfort_clipped")
    many = ("flange_fractions",)
    keys = [key for key in cases[0] if key not in own and any(_number(case[key], key in many) for case in cases)]
    mean: dict[str, Any] = {}
    sd: dict[str, Any] = {}
    for key in keys:
        values = [case[key] for case in cases]
        whole = all(value is not None for value in values)
        mean[key] = np.mean(values, axis=0) if whole else None
        sd[key] = np.std(values, axis=0, ddof=1) if whole and len(values) > 1 else None
    lost = sum(case["diverged"] is not None for case in cases)
    notes = [f"mean and sd: null where a case has no value, {lost} of {len(cases)} diverged"] if lost else []
    return {"cases": cases, "mean": mean, "sd": sd, "notes": [*notes, "sd: of the sample, n - 1"]}


def _number(value: Any, many: bool) -> bool:
    return isinstance(value, list) if many else isinstance(value, int | float) and not isinstance(value, bool)


def _single(found: dict[str, Any]) -> Any:
    from rich.table import Table

    title = f"{found['track']} at {found['speed']:g} m/s ({3.6 * found['speed']:g} km/h)"
    table = Table("riding quality", "", "unit", title=title, title_justify="left")
    for key, unit in SHOWN:
        table.add_row(key, cell(found[key]), unit)
    if found["reference"]:
        for key, value in found["reference"].items():
            table.add_row(f"{key}, in the frequency domain", cell(value), "m/s^2")
    for i, one in enumerate((found.get("forces") or {}).get("wheelsets", ())):
        told = f"{one['sum_of_guiding_forces'] / 1e3:.3g} of {one['limit'] / 1e3:.3g}"
        table.add_row(f"sum of guiding forces, wheelset {i + 1} (2 m, 99.85 %)", told, "kN")
    if quotient := (found.get("forces") or {}).get("derailment_quotient"):
        table.add_row("Y/Q (2 m, 99.85 %), an indication", cell(quotient), "")
    if found["diverged"]:
        table.add_row("left the track at s", cell(found["diverged"]["at_s"]), "m")
    table.caption = "\n".join(found["notes"])
    return table


def _several(body: dict[str, Any]) -> Any:
    from rich.table import Table

    keys = ["score", "class", "comfort_hours", "weighted_acceleration", "flange_fraction", "flange_margin"]
    heads = [key.replace("_", " ") for key in keys]
    table = Table("speed [m/s]", "seed", *heads, title=body["cases"][0]["track"], title_justify="left")
    for case in body["cases"]:
        table.add_row(f"{case['speed']:g}", cell(case["seed"]), *(cell(case[key]) for key in keys))
    table.add_section()
    for name in ("mean", "sd"):
        table.add_row(name, "", *(cell(body[name].get(key)) if key != "class" else "" for key in keys))
    return table
