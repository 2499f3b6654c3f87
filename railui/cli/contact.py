"""railui contact: contact parameters from wheel and rail profiles, or from a table of rolling radii."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from railui.cli.arguments import (
    Decorator,
    figure_option,
    overrides_argument,
    quantity_option,
    speed_option,
    split_overrides,
)
from railui.cli.contact_of_design import close_design
from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.quantities import bounded, parse_force, parse_length
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.contact.analysis import ContactAnalysis

MIN_DEVIATION, MAX_DEVIATION = 2.5e-4, 0.01  # m, of --sd
PARAMETERS = {
    "conicity": "conicity lambda",
    "gravitational_stiffness": "gravitational stiffness epsilon",
    "contact_angle": "contact angle delta [rad]",
    "roll": "roll sigma",
}


def _parse_inclination(text: str) -> float:
    from railui.contact.profile_reader import read_inclination

    return read_inclination(text)


def _length_option(name: str, lowest: float, highest: float, default: str, text: str) -> Decorator:
    """Return an option of a length between bounds [m]."""
    parse = bounded(parse_length, lowest, highest, "m")
    return quantity_option(name, parse, default=default, metavar="LENGTH", help=text)


@click.command("contact")
@click.argument("wheel", required=False, metavar="[WHEEL | DESIGN]")
@click.argument("rail", required=False, metavar="[RAIL]")
@overrides_argument
@_length_option("--gauge", 0.3, 2.0, "1435 mm", "Track gauge, 14 mm below the top of the rails.")
@_length_option("--back-to-back", 0.2, 2.0, "1360 mm", "Distance of the wheels' inner faces.")
@quantity_option(
    "--inclination", _parse_inclination, default="0", metavar="1:N", help="Rail inclination; 0 where the file has it."
)
@_length_option("--radius", 0.05, 1.5, "0.46 m", "Nominal rolling radius.")
@_length_option("--diameter-difference", -0.05, 0.05, "0", "Right minus left wheel diameter.")
@click.option("--mirror-rail", is_flag=True, help="Mirror the rail: its y points opposite to that of its file type.")
@quantity_option(
    "--smooth",
    parse_length,
    metavar="LENGTH",
    help="Cut-off wavelength (50 % transmission) of a Gaussian filter of the profiles.",
)
@quantity_option(
    "--sd", parse_length, default="2 mm", metavar="LENGTH", help="Standard deviation of e for the linearisation."
)
@quantity_option("--load", bounded(parse_force, 1e3, 1e6, "N"), default="55 kN", metavar="FORCE", help="Wheel load.")
@click.option(
    "--surface",
    type=click.FloatRange(0.05, 1.5),
    default=0.6,
    show_default=True,
    help="Factor on Kalker's coefficients for the rail surface: 0.5 to 0.7 in service, 1 clean.",
)
@click.option("--left-wheel", metavar="FILE", help="Profile of the left wheel where it differs; y points outward.")
@click.option("--left-rail", metavar="FILE", help="Profile of the left rail where it differs.")
@click.option("--delta-r", metavar="TABLE", help="Table `y [mm],delta_r [mm]` instead of profiles.")
@click.option("--track", metavar="SPEC|CSV", help="With DESIGN: track over whose motion its profiles are linearised.")
@speed_option()
@click.option("--once", is_flag=True, help="With DESIGN: linearise once, over the sd of the design.")
@figure_option("the contact")
@figure_option("the creep laws of the library at this contact", "--laws")
@common_options
def command(
    wheel: str | None,
    rail: str | None,
    overrides: dict[str, str],
    gauge: float,
    back_to_back: float,
    inclination: float,
    radius: float,
    diameter_difference: float,
    mirror_rail: bool,
    smooth: float | None,
    sd: float,
    load: float,
    surface: float,
    left_wheel: str | None,
    left_rail: str | None,
    delta_r: str | None,
    track: str | None,
    speed: float | None,
    once: bool,
    figure: str | None,
    laws: str | None,
    call: Invocation,
) -> None:
    """Compute contact parameters (conicity, contact angles, creep coefficients) from profiles of WHEEL and RAIL.

    \b
    railui contact S1002.prw UIC60.prr --gauge "1435 mm" --back-to-back "1360 mm" --inclination 0
    railui contact worn.txt rail.txt --inclination 1:40 --smooth "4 mm" --figure worn.png
    railui contact --delta-r table.csv
    railui contact design.yaml --track "erri_b176_low length=2000 seed=1" --speed 40

    WHEEL and RAIL are SIMPACK's .prw and .prr, or text of two columns y and z (header `y [mm], z [mm]`).
    The equivalent conicity is that of EN 15302; conicity_parameters are linearised over --sd. With a DESIGN, a track
    and a speed its profiles are linearised over the standard deviation of e of each wheelset, until the ride
    reproduces it.
    """
    if track is not None or speed is not None or once:
        # the second argument is the first override of a design
        first = {} if rail is None else split_overrides((rail,))
        close_design(wheel, first | overrides, track, speed, once, call)
        return
    if overrides:
        raise usage_error("overrides belong to a design: give --track and --speed with it")
    if not MIN_DEVIATION <= sd <= MAX_DEVIATION:
        raise usage_error(f"--sd: {sd * 1e3:g} mm is not plausible for a wheelset displacement: write 0.5 to 5 mm")
    if delta_r is not None:
        if wheel is not None:
            raise usage_error("give either two profiles or --delta-r TABLE")
        if laws is not None:
            raise usage_error("--laws: a table of rolling radii has no contact ellipse, give two profiles")
        _analyse_table(delta_r, sd, figure, call)
        return
    if wheel is None or rail is None:
        raise usage_error("give a wheel and a rail profile, --delta-r TABLE, or a design with --track and --speed")
    from railui.api.contact import contact_of_files

    geometry = (gauge, back_to_back, inclination, radius, diameter_difference)
    files = {"wheel": wheel, "rail": rail, "left_wheel": left_wheel, "left_rail": left_rail}
    given = {name: file for name, file in files.items() if file is not None}
    result = contact_of_files(given, geometry, load, surface, mirror_rail=mirror_rail, smoothing=smooth or 0.0)
    _report_pair(result, list(given.values()), sd, figure, laws, call)


def _analyse_table(file: str, sd: float, figure: str | None, call: Invocation) -> None:
    from railui.api.contact import conicity_of_table

    conicity, body = conicity_of_table(file, sd)
    call.warn([note for note in body["notes"] if "left out" in note or "does not reach" in note])
    if figure is not None:
        from railui.report.figures.contact import draw_radius_table

        geometry = body["geometry"]
        draw_radius_table(geometry["displacement"], geometry["delta_r"], conicity.amplitude, conicity.tan_gamma, figure)
        call.info(f"wrote {figure}")
    call.show(_conicity_table(conicity.amplitude, conicity.tan_gamma, conicity.centre))
    call.write_json(call.document("contact", body, [file]))


def _report_pair(
    result: ContactAnalysis, files: list[str], sd: float, figure: str | None, laws: str | None, call: Invocation
) -> None:
    from railui.contact.analysis import result_dict

    body = result_dict(result, sd)
    call.warn([note for note in body["notes"] if "noise" in note or note.startswith(("no ", "beyond"))])
    if figure is not None:
        from railui.report.figures.contact import draw_contact

        draw_contact(result, figure, sd)
        call.info(f"wrote {figure}")
    if laws is not None and result.creep is not None:
        from railui.report.figures.contact import draw_creep_laws

        draw_creep_laws(result.creep, laws)
        call.info(f"wrote {laws}")
    call.show(_parameters_table(body))
    call.write_json(call.document("contact", body, files))


def _conicity_table(amplitude: Any, tan_gamma: Any, centre: float) -> Any:
    rows = [
        (f"{a * 1e3:.0f} mm", f"{value:.3f}" if math.isfinite(value) else "no such motion")
        for a, value in zip(amplitude, tan_gamma, strict=True)
        if abs(a * 1e3 - round(a * 1e3)) < 1e-6
    ]
    title = f"equivalent conicity, centre at {centre * 1e3:.2f} mm"
    return make_table(("amplitude", "tan gamma_e"), rows, title=title)


def _parameters_table(body: dict[str, Any]) -> Any:
    sd, linearised, harmonic = body["standard_deviation"], body["conicity_parameters"], body["harmonic_parameters"]
    rows = []
    for key, name in PARAMETERS.items():
        en15302 = _number(body["conicity_3mm"]) if key == "conicity" else ""
        rows.append((name, _number(linearised[key]), _number(harmonic[key]), en15302))
    flanges = [body["flange_contact"][side] for side in ("left", "right")]
    jumps = _jumps(body["two_point_contacts"])
    flange_jumps = _jumps([jump for jump in body["two_point_contacts"] if jump["is_at_flange"]])
    rows += [
        ("change of conicity with gauge [1/m]", _number(body["gauge_conicity"], 1), "", ""),
        (
            "flange contact at [mm]",
            ", ".join("none" if x is None else f"{x * 1e3:.1f}" for x in flanges),
            "",
            "",
        ),
        ("two-point contact at [mm]", jumps, "", ""),
        ("of tread and flange at [mm]", flange_jumps, "", ""),
    ]
    columns = ("", f"sd {sd * 1e3:g} mm", "harmonic, 3 mm", "EN 15302, 3 mm")
    return make_table(columns, rows, _creep_rows(body["creep"], body["creep_parameters"]))


def _jumps(found: list[dict[str, Any]]) -> str:
    """Return the displacements of two-point contact [mm]."""
    displacements = sorted({round(abs(jump["displacement"]) * 1e3, 1) for jump in found})
    return ", ".join(f"{x:g}" for x in displacements) or "none"


def _creep_rows(creep: dict[str, Any] | None, mean: dict[str, float] | None) -> list[tuple[str, ...]]:
    """Return the rows of the ellipse at the centre, and of the creep coefficients over the motion."""
    if creep is None or mean is None:
        return []
    ellipse, c = creep["ellipse"], creep["kalker"]
    kappa = f"{mean['longitudinal_creep']:.0f}, {mean['lateral_creep']:.0f}"
    return [
        (f"kappa_x, kappa_y (surface {creep['surface']:g})", kappa, "", ""),
        ("kappa_s [m]", _number(mean["spin_creep"]), "", ""),
        ("centre: semi-axes a, b [mm]", f"{ellipse['a'] * 1e3:.2f}, {ellipse['b'] * 1e3:.2f}", "", ""),
        ("centre: Kalker C11, C22, C23", ", ".join(f"{c[key]:.2f}" for key in ("c11", "c22", "c23")), "", ""),
    ]


def _number(x: float | None, decimals: int = 3) -> str:
    if x is None:
        return ""
    return f"{x:.{decimals}f}" if math.isfinite(x) else "out of range"
