"""railui contact: from profiles, or a table of rolling radii, to the parameters of the model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, options, refuse
from railui.cli.quantities import figure as drawing
from railui.cli.quantities import force, length, reading

if TYPE_CHECKING:
    from railui.contact.analysis import Found


def _inclination(text: str) -> float:
    from railui.contact.profile_reader import read_inclination

    return read_inclination(text)


@click.command("contact")
@click.argument("wheel", required=False, metavar="[WHEEL]")
@click.argument("rail", required=False, metavar="[RAIL]")
@click.option("--gauge", callback=reading(length), default="1435 mm", metavar="LENGTH", show_default=True,
              help="Of the rails, 14 mm below their top.")  # fmt: skip
@click.option("--back-to-back", callback=reading(length), default="1360 mm", metavar="LENGTH", show_default=True,
              help="Of the wheels' inner faces.")  # fmt: skip
@click.option("--inclination", callback=reading(_inclination), default="0", metavar="1:N", show_default=True,
              help="Of the rails; 0 where the file is of a rail as it lies.")  # fmt: skip
@click.option("--radius", callback=reading(length), default="0.46 m", metavar="LENGTH", show_default=True,
              help="Of the wheels.")  # fmt: skip
@click.option("--diameter-difference", callback=reading(length), default="0", metavar="LENGTH", show_default=True,
              help="Right wheel less left wheel.")  # fmt: skip
@click.option("--mirror-rail", is_flag=True, help="The rail's y points to the other side than its file type says.")
@click.option("--smooth", callback=reading(length), metavar="LENGTH", help="Smooth measured profiles: half is left.")
@click.option("--sd", callback=reading(length), default="2 mm", metavar="LENGTH", show_default=True,
              help="Standard deviation of e that is linearised over.")  # fmt: skip
@click.option("--load", callback=reading(force), default="55 kN", metavar="FORCE", show_default=True, help="Per wheel.")
@click.option("--surface", type=click.FloatRange(0.05, 1.5), default=0.6, show_default=True,
              help="Share of Kalker's coefficients on rails as they are: 0.5 to 0.7, 1 clean.")  # fmt: skip
@click.option("--delta-r", metavar="TABLE", help="A table `y [mm],delta_r [mm]` in place of profiles.")
@click.option("--figure", callback=reading(drawing), metavar="FILE", help="Draw it: .png, .svg or .pdf.")
@click.option(
    "--laws",
    callback=reading(drawing),
    metavar="FILE",
    help="Draw the laws of creep at this contact against each other.",
)
@options
def command(
    wheel: str | None, rail: str | None, gauge: float, back_to_back: float, inclination: float, radius: float,
    diameter_difference: float, mirror_rail: bool, smooth: float | None, sd: float, load: float, surface: float,
    delta_r: str | None, figure: str | None, laws: str | None, call: Invocation,
) -> None:  # fmt: skip
    """Tell what the profiles of WHEEL and RAIL are to the model: conicity, contact angles, creep.

    \b
    railui contact S1002.prw UIC60.prr --gauge "1435 mm" --back-to-back "1360 mm" --inclination 0
    railui contact worn.txt rail.txt --inclination 1:40 --smooth "4 mm" --figure worn.png
    railui contact --delta-r table.csv

    WHEEL and RAIL are SIMPACK's .prw and .prr, or text of two columns y and z (header `y [mm], z [mm]`).
    The equivalent conicity is that of EN 15302; conicity_parameters are linearised over --sd.
    """
    if not 2.5e-4 <= sd <= 0.01:
        raise refuse(f"--sd: {sd * 1e3:g} mm is no displacement of a wheelset: write 0.5 to 5 mm")
    if delta_r is not None:
        if wheel is not None:
            raise refuse("give either two profiles or --delta-r TABLE")
        if laws is not None:
            raise refuse("--laws: a table of rolling radii has no contact ellipse, give two profiles")
        _table(delta_r, sd, figure, call)
        return
    if wheel is None or rail is None:
        raise refuse("give a wheel and a rail profile, or --delta-r TABLE")
    stands = (gauge, back_to_back, inclination, radius, diameter_difference)
    found = _contact(wheel, rail, mirror_rail, smooth or 0.0, stands, load, surface)
    _profiles(found, (wheel, rail), sd, figure, laws, call)


def _table(file: str, sd: float, figure: str | None, call: Invocation) -> None:
    from railui.contact.analysis import described_table
    from railui.contact.conicity import NoCentre
    from railui.contact.radius_table_reader import read_delta_r
    from railui.io.problems import one_problem

    y, delta_r = read_delta_r(file)
    try:
        found, body = described_table(y, delta_r, sd)
    except NoCentre as fault:
        told = "check the sign: r_1 - r_2 is positive where the wheelset stands to the right"
        raise one_problem(file, str(fault), told, "delta_r") from None
    call.warn([note for note in body["notes"] if "left out" in note or "does not reach" in note])
    if figure is not None:
        from railui.report.figures.contact import table_figure

        table_figure(y, delta_r, found.amplitude, found.tan_gamma, figure)
        call.say(f"drew {figure}")
    call.show(_amplitudes(found.amplitude, found.tan_gamma, found.centre))
    call.emit(call.document("contact", body, [file]))


def _contact(
    wheel: str, rail: str, mirror: bool, smoothing: float, stands: tuple[float, ...], load: float, surface: float
) -> Found:
    """The contact of two files; what is wrong with either is told at once."""
    from railui.contact.analysis import contact
    from railui.contact.profile import Profile, ProfileFault
    from railui.contact.profile_reader import read_profile
    from railui.contact.wheelset_on_track import Pair
    from railui.documents.recognise import expect
    from railui.io.problems import FileProblems, Problem, one_problem

    read: list[Profile] = []
    problems: list[Problem] = []
    for file, kind, mirrored in ((wheel, "wheel", False), (rail, "rail", mirror)):
        try:
            expect(file, "profile")
            read.append(read_profile(file, kind, mirror=mirrored, smoothing=smoothing))  # type: ignore[arg-type]
        except FileProblems as error:
            problems += error.problems
    if problems:
        raise FileProblems(list(dict.fromkeys(problems)))
    try:
        return contact(Pair(read[0], read[1], *stands), load, surface)
    except ProfileFault as fault:
        raise one_problem(f"{wheel} on {rail}", fault.message, fault.remedy) from None


def _profiles(
    found: Found, files: tuple[str, str], sd: float, figure: str | None, laws: str | None, call: Invocation
) -> None:
    from railui.contact.analysis import described

    body = described(found, sd)
    call.warn([note for note in body["notes"] if "noise" in note or note.startswith(("no ", "beyond"))])
    if figure is not None:
        from railui.report.figures.contact import contact_figure

        contact_figure(found, figure, sd)
        call.say(f"drew {figure}")
    if laws is not None and found.creep is not None:
        from railui.report.figures.contact import laws_figure

        laws_figure(found.creep, laws)
        call.say(f"drew {laws}")
    call.show(_told(body))
    call.emit(call.document("contact", body, list(files)))


def _amplitudes(amplitude: Any, tan_gamma: Any, centre: float) -> Any:
    import numpy as np
    from rich.table import Table

    table = Table("amplitude", "tan gamma_e", title=f"equivalent conicity, centre at {centre * 1e3:.2f} mm")
    for a, value in zip(amplitude, tan_gamma, strict=True):
        if abs(a * 1e3 - round(a * 1e3)) < 1e-6:
            table.add_row(f"{a * 1e3:.0f} mm", f"{value:.3f}" if np.isfinite(value) else "no such motion")
    return table


def _told(body: dict[str, Any]) -> Any:
    import math

    from rich.table import Table

    sd, harmonic = body["standard_deviation"], body["harmonic_parameters"]
    table = Table("", f"sd {sd * 1e3:g} mm", "harmonic, 3 mm", "EN 15302, 3 mm")

    def number(x: float | None, digits: int = 3) -> str:
        return "" if x is None else f"{x:.{digits}f}" if math.isfinite(x) else "out of reach"

    names = {
        "conicity": "conicity lambda",
        "gravitational_stiffness": "gravitational stiffness epsilon",
        "contact_angle": "contact angle delta [rad]",
        "roll": "roll sigma",
    }
    for key, name in names.items():
        en = number(body["conicity_3mm"]) if key == "conicity" else ""
        table.add_row(name, number(body["conicity_parameters"][key]), number(harmonic[key]), en)
    table.add_row("change of conicity with gauge [1/m]", number(body["gauge_conicity"], 1))
    ends = [body["flange_contact"][side] for side in ("left", "right")]
    table.add_row("flange contact at [mm]", ", ".join("none" if x is None else f"{x * 1e3:.1f}" for x in ends))
    jumps = sorted({round(abs(j["displacement"]) * 1e3, 1) for j in body["two_point_contacts"]})
    table.add_row("two points of contact at [mm]", ", ".join(f"{x:g}" for x in jumps) or "none")
    if (creep := body["creep"]) is not None:
        ellipse, c = creep["ellipse"], creep["kalker"]
        table.add_section()
        table.add_row("ellipse a x b [mm]", f"{ellipse['a'] * 1e3:.2f} x {ellipse['b'] * 1e3:.2f}")
        table.add_row("Kalker C11, C22, C23", ", ".join(f"{c[k]:.2f}" for k in ("c11", "c22", "c23")))
        table.add_row(f"kappa_x, kappa_y (surface {creep['surface']:g})",
                      f"{creep['longitudinal_creep']:.0f}, {creep['lateral_creep']:.0f}")  # fmt: skip
        table.add_row("kappa_s [m]", number(creep["spin_creep"]))
    return table
