"""railui stability: modes, logarithmic decrements and critical speeds of a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from railui.cli.arguments import (
    design_argument,
    figure_option,
    input_files,
    load_design_argument,
    quantity_option,
    resolve_track_argument,
)
from railui.cli.invocation import Invocation, StatusLine, common_options
from railui.cli.quantities import parse_speeds
from railui.cli.tables import format_fixed, make_table

if TYPE_CHECKING:
    from railui.api.stability import Stability

BIFURCATION = {"hard": "subcritical", "soft": "amplitude falls gradually"}


@click.command("stability")
@design_argument
@quantity_option(
    "--speeds", parse_speeds, default="5:90:5", metavar="RANGE", help="Speeds, such as 5:90:5, ends included."
)
@click.option("--fold", is_flag=True, help="Compute the nonlinear critical speed, with flange contact.")
@click.option("--track", metavar="SPEC|CSV", help="Compute the speed limit by ride criteria on this track.")
@figure_option("damping, frequency and bifurcation diagram")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    speeds: list[float],
    fold: bool,
    track: str | None,
    figure: str | None,
    call: Invocation,
) -> None:
    """Compute modes and logarithmic decrements of DESIGN against speed, and the limits of its speed.

    \b
    railui stability design.yaml
    railui stability design.yaml --speeds 20:80:2 --fold --track "erri_b176_low length=2000" --figure s.svg

    linear critical speed: a mode of the linear vehicle becomes unstable. nonlinear critical speed (--fold): the
    lowest speed at which hunting with flange contact persists (the saddle-node of limit cycles or, where the
    amplitude falls gradually, the speed at which it no longer reaches the flanges). Speed limit by ride criteria
    (--track): the highest speed up to which the ride class on this track stays just admissible. None of them
    follows from another.
    """
    from railui.api.stability import compute_stability

    loaded = load_design_argument(call, design, overrides)
    source = None if track is None else resolve_track_argument(track, call.seed)
    found = compute_stability(loaded, speeds, fold=fold, track=source, jobs=call.jobs, progress=StatusLine(call))
    result = found.data
    if figure is not None:
        from railui.report.figures.stability import draw_stability

        draw_stability(result, figure)
        call.info(f"wrote {figure}")
    call.show(_modes_table(found))
    call.show(_critical_speeds_table(result))
    call.write_json(call.document("stability", found.body(), input_files(design, source), found.seed))


def _modes_table(found: Stability) -> Any:
    """Return the oscillation with the smallest damping ratio at every speed."""
    rows = []
    last_shape = ""
    for mode in found.least_damped_oscillations:
        shape = mode["shape"] if mode["shape"] != last_shape else ""
        numbers = (f"{mode['real']:.4f}", f"{mode['frequency']:.3f}", f"{mode['damping']:.4f}")
        rows.append((f"{mode['speed']:.4g}", *numbers, f"{mode['decrement']:.4f}", shape))
        last_shape = mode["shape"]
    columns = ("speed [m/s]", "Re [1/s]", "frequency [Hz]", "damping ratio", "log. decrement", "mode shape")
    return make_table(columns, rows, title="least damped oscillation")


def _critical_speeds_table(result: Mapping[str, Any]) -> Any:
    frequency = result["linear_critical_frequency"]
    sd = result["linear_critical_speed_sd"]
    spread = "" if sd is None else f", standard deviation {sd:.2g} m/s"
    text = "" if frequency is None else f"{frequency:.3f} Hz{spread}"
    rows = [("linear critical speed", *_speed(result["linear_critical_speed"], 5), text)]
    if result["rest_critical_speed"] != result["linear_critical_speed"]:
        rows.append(("the same, effects linearised", *_speed(result["rest_critical_speed"], 3), ""))
    if result["fold"]:
        rows.append(("nonlinear critical speed", *_speed(result["fold_speed"], 2), _limit_cycle_text(result)))
    if practical := result["practical"]:
        reason = practical["decided_by"] or "admissible at all speeds"
        rows.append(("speed limit by ride criteria", *_speed(result["practical_critical_speed"], 1), reason))
    wavelength = result["klingel_wavelength"]
    klingel = [f"Klingel wavelength {wavelength:.3f} m"] if wavelength else []
    columns = ("limit", "m/s", "km/h", "")
    return make_table(columns, rows, caption="\n".join([*klingel, _damping_note(result), *result["notes"]]))


def _damping_note(result: Mapping[str, Any]) -> str:
    """Return the smallest damping ratio over the speeds, with its speed, frequency and mode."""
    text = f"smallest damping ratio over the speeds {result['linear_damping']:.4f}"
    mode = result["linear_damping_mode"]
    if mode is None:
        return text
    motion = f"{mode['frequency']:.3f} Hz" if mode["imag"] else "without oscillation"
    return f"{text}, at {mode['speed']:.4g} m/s: {motion}, {mode['shape']}"


def _limit_cycle_text(result: Mapping[str, Any]) -> str:
    fold = result["fold"]
    if result["fold_speed"] is None:
        return "no limit cycle"
    text = f"{BIFURCATION[fold['loss']]}, {1e3 * fold['amplitude']:.2f} mm at {fold['frequency']:.3f} Hz"
    if fold["bistable"]:
        upper = fold["bistable"][1]
        text += f"; bistable up to {upper:.2f} m/s" if upper else "; bistable above"
    return text


def _speed(value: float | None, decimals: int) -> tuple[str, str]:
    return format_fixed(value, decimals), format_fixed(None if value is None else 3.6 * value, 1)
