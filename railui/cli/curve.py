"""railui curve: where a design stands in a curve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli.common import Invocation, design_argument, load_vehicle, options, refuse
from railui.cli.quantities import cant, figure, inclusive, length, reading


def _radii(text: str) -> list[float]:
    """Radii [m]: single ones and ranges, divided by commas."""
    found: list[float] = []
    for part in text.split(","):
        ends = [length(end) for end in part.split(":")]
        if len(ends) > 3:
            raise ValueError(f"{part.strip()!r} is no range: write FIRST:LAST or FIRST:LAST:STEP")
        found += [ends[0]] if len(ends) == 1 else inclusive(*ends)
    return found


@click.command("curve")
@design_argument
@click.option("--radius", callback=reading(length), metavar="RADIUS", help="Radius [m], such as 600; < 0 curves left.")
@click.option("--radii", callback=reading(_radii), metavar="RANGE", help="Several, such as 250:2000:50.")
@click.option("--cant-deficiency", callback=reading(cant), default="0", show_default=True, metavar="LENGTH",
              help='Such as 0.1, or "100 mm".')  # fmt: skip
@click.option(
    "--figure", callback=reading(figure), metavar="FILE", help="Draw them against the radius: .svg, .png or .pdf."
)
@options
def command(
    design: str, overrides: dict[str, str], radius: float | None, radii: list[float] | None, cant_deficiency: float,
    figure: str | None, call: Invocation,
) -> None:  # fmt: skip
    """Tell where DESIGN stands in a curve: displacement, angle of attack, guiding force, wear.

    \b
    railui curve design.yaml --radius 600 --cant-deficiency "100 mm"
    railui curve design.yaml --radii 250:2000:50 --figure curve.svg

    Quasi-static: accelerations and rates are zero, the effects act with their full laws. The centre of the
    curve lies at +y, so e < 0 is outwards. A suspension that rides well on straight track may eat rails here.
    """
    from railui.curving import curves

    if (radius is None) == (radii is None):
        raise refuse("give either --radius or --radii")
    given = [radius] if radius is not None else list(radii or ())
    if any(r == 0 for r in given):
        raise refuse("a curve has a radius other than 0")
    if figure is not None and len(given) < 2:
        raise refuse("--figure draws against the radius: give --radii")
    vehicle = load_vehicle(call, design, overrides)
    cases = curves(vehicle, given, cant_deficiency)
    head = {"design": vehicle.name, "overrides": overrides, "cant_deficiency": cant_deficiency}
    if figure is not None:
        from railui.report.figures.stability import draw_curves

        draw_curves(cases, figure)
        call.say(f"wrote {figure}")
    call.show(_table(cases))
    notes = list(dict.fromkeys(note for case in cases for note in case["notes"]))
    body = head | (cases[0] if radius is not None else {"cases": cases, "notes": notes})
    call.emit(call.document("curve", body, [design]))


def _table(cases: list[dict[str, Any]]) -> Any:
    from rich.table import Table

    columns = ("radius [m]", "e [mm]", "angle of attack [mrad]", "guiding force [kN]", "wear number [N]", "flange")
    table = Table(*columns)
    for case in cases:
        table.add_row(f"{case['radius']:g}", *_values(case))
    table.caption = "\n".join(dict.fromkeys(note for case in cases for note in case["notes"]))
    return table


def _values(case: Mapping[str, Any]) -> list[str]:
    if case["displacement"] is None:
        return ["-"] * 5
    lists = (("displacement", 1e3, 3), ("angle_of_attack", 1e3, 3), ("guiding_force", 1e-3, 2))
    found = [", ".join(f"{factor * x:.{digits}f}" for x in case[key]) for key, factor, digits in lists]
    touching = ", ".join(str(i + 1) for i, yes in enumerate(case["flange_contact"]) if yes)
    return [*found, f"{case['wear_number']:.1f}", f"wheelset {touching}" if touching else ""]
