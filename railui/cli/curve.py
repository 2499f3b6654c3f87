"""railui curve: quasi-static curving behaviour of a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli.arguments import design_argument, figure_option, load_design_argument, quantity_option
from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.quantities import parse_cant, parse_radii, parse_radius
from railui.cli.tables import format_fixed, make_table

COLUMNS = (
    "radius [m]",
    "e [mm]",
    "angle of attack [mrad]",
    "force of the rails [kN]",
    "Y/Q",
    "wear number, largest wheel [N]",
    "flange",
)


@click.command("curve")
@design_argument
@quantity_option("--radius", parse_radius, metavar="RADIUS", help="Curve radius [m], such as 600; < 0 to the left.")
@quantity_option("--radii", parse_radii, metavar="RANGE", help="Several radii, such as 250:2000:50.")
@quantity_option(
    "--cant-deficiency", parse_cant, default="0", metavar="LENGTH", help='Cant deficiency, such as 0.1 or "100 mm".'
)
@figure_option("the results against the radius")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    radius: float | None,
    radii: list[float] | None,
    cant_deficiency: float,
    figure: str | None,
    call: Invocation,
) -> None:
    """Compute the equilibrium of DESIGN in a curve: displacement, angle of attack, lateral force, wear number.

    \b
    railui curve design.yaml --radius 600 --cant-deficiency "100 mm"
    railui curve design.yaml --radii 250:2000:50 --figure curve.svg

    Quasi-static: accelerations and rates are zero, the effects act with their full laws. For a positive radius
    (right-hand curve) the centre is at +y and e < 0 is outwards; for a negative radius the reverse. The force of the
    rails on each wheelset is positive to the right: minus the sum Y of its guiding forces. Wear numbers: the sum over
    all wheels, then the largest of a wheel. A suspension with a high critical speed on tangent track may cause high
    guiding forces and wear in curves.
    """
    from railui.api.curving import compute_curve

    if (radius is None) == (radii is None):
        raise usage_error("give either --radius or --radii")
    given = radius if radius is not None else list(radii or ())
    if figure is not None and (radius is not None or len(radii or ()) < 2):
        raise usage_error("--figure draws against the radius: give --radii")
    result = compute_curve(load_design_argument(call, design, overrides), given, cant_deficiency)
    rows = [(f"{case['radius']:g}", *_values(case)) for case in result.cases]
    call.show(make_table(COLUMNS, rows, caption="\n".join(result.notes)))
    call.write_json(call.document("curve", result.body(), [design]))
    if figure is not None:
        from railui.report.figures.stability import draw_curves

        draw_curves(result.cases, figure)
        call.info(f"wrote {figure}")


def _values(case: Mapping[str, Any]) -> list[str]:
    if case["displacement"] is None:
        return ["-"] * (len(COLUMNS) - 1)
    lists = (("displacement", 1e3, 3), ("angle_of_attack", 1e3, 3), ("guiding_force", 1e-3, 2))
    cells = [", ".join(format_fixed(factor * x, decimals) for x in case[key]) for key, factor, decimals in lists]
    touching = ", ".join(str(i) for i, is_touching in enumerate(case["flange_contact"], 1) if is_touching)
    quotient = case["derailment_quotient"]
    cells.append("-" if quotient is None else format_fixed(quotient, 3))
    largest = max(number for wheelset in case["wheelsets"] for number in wheelset["wear_number"])
    return [*cells, f"{case['wear_number']:.1f}, {largest:.1f}", f"wheelset {touching}" if touching else ""]
