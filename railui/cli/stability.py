"""railui stability: modes, decrements and critical speeds of a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from railui.cli.common import Invocation, design_argument, lay_track, load_vehicle, options
from railui.cli.quantities import figure, reading, speeds


@click.command("stability")
@design_argument
@click.option("--speeds", callback=reading(speeds), default="5:90:5", show_default=True, metavar="RANGE",
              help="Such as 5:90:5, ends included.")  # fmt: skip
@click.option("--fold", is_flag=True, help="Follow hunting with flange contact down to the speed where it dies.")
@click.option("--track", metavar="SPEC|CSV", help="Find the critical speed in practice on this track.")
@click.option(
    "--figure",
    callback=reading(figure),
    metavar="FILE",
    help="Draw damping, frequency and bifurcation: .svg, .png or .pdf.",
)
@options
def command(
    design: str, overrides: dict[str, str], speeds: list[float], fold: bool, track: str | None, figure: str | None,
    call: Invocation,
) -> None:  # fmt: skip
    """Tell modes and logarithmic decrements of DESIGN against speed, and its critical speeds.

    \b
    railui stability design.yaml
    railui stability design.yaml --speeds 20:80:2 --fold --track "erri_b176_low length=2000" --figure s.svg

    Linear: where the linear vehicle begins to hunt. Fold: below it hunting with flange contact, once begun,
    dies. Practical: up to it the class of the ride on the track stays just admissible. None of them follows
    from another.
    """
    from railui.hunting.summary import stability

    vehicle = load_vehicle(call, design, overrides)
    laid = None if track is None else lay_track(track, call.seed)
    found = stability(vehicle, speeds, fold=fold, track=laid, jobs=call.jobs, told=call.progress)
    body = {"design": vehicle.name, "overrides": overrides, **found}
    if figure is not None:
        from railui.report.figures.stability import draw_stability

        draw_stability(found, figure)
        call.say(f"wrote {figure}")
    call.show(_modes(found))
    call.show(_critical(found))
    inputs = [design, *([str(laid.file)] if laid is not None and laid.file is not None else [])]
    call.emit(call.document("stability", body, inputs, None if laid is None else laid.seed))


def _modes(found: Mapping[str, Any]) -> Any:
    """The least damped oscillation at every speed."""
    from rich.table import Table

    title = "least damped oscillation"
    table = Table("speed [m/s]", "Re [1/s]", "frequency [Hz]", "damping", "decrement", "shape", title=title,
                  title_justify="left")  # fmt: skip
    before = ""
    for v in found["speeds"]:
        some = [m for m in found["modes"] if m["speed"] == v and m["imag"] > 0]
        if some:
            m = max(some, key=lambda one: one["real"])
            numbers = (f"{v:g}", f"{m['real']:.4f}", f"{m['frequency']:.3f}", f"{m['damping']:.4f}")
            table.add_row(*numbers, f"{m['decrement']:.4f}", m["shape"] if m["shape"] != before else "")
            before = m["shape"]
    return table


def _critical(found: Mapping[str, Any]) -> Any:
    from rich.table import Table

    table = Table("critical speed", "m/s", "km/h", "", title_justify="left")
    frequency = found["linear_critical_frequency"]
    told = f"{frequency:.3f} Hz" if frequency is not None else ""
    table.add_row("linear", *_speed(found["linear_critical_speed"], 5), told)
    if found["rest_critical_speed"] != found["linear_critical_speed"]:
        table.add_row("of rest, with the effects' slopes", *_speed(found["rest_critical_speed"], 3), "")
    if fold := found["fold"]:
        told = "no hunting"
        if found["fold_speed"] is not None:
            told = f"{fold['loss']} loss, {1e3 * fold['amplitude']:.2f} mm at {fold['frequency']:.3f} Hz"
        if fold["bistable"]:
            told += f"; bistable up to {fold['bistable'][1]:.2f} m/s" if fold["bistable"][1] else "; bistable above"
        table.add_row("fold", *_speed(found["fold_speed"], 2), told)
    if practical := found["practical"]:
        told = practical["decided_by"] or "admissible at all speeds"
        table.add_row("practical", *_speed(found["practical_critical_speed"], 1), told)
    wavelength = found["klingel_wavelength"]
    klingel = f"Klingel's wavelength {wavelength:.3f} m; " if wavelength else ""
    caption = f"{klingel}least damping ratio over the speeds {found['linear_damping']:.4f}"
    table.caption = "\n".join([caption, *found["notes"]])
    return table


def _speed(value: float | None, digits: int) -> tuple[str, str]:
    return ("-", "-") if value is None else (f"{value:.{digits}f}", f"{3.6 * value:.1f}")
