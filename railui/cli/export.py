"""railui export: the vehicle for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railui.cli.arguments import design_argument, load_design_argument, quantity_option, speed_option
from railui.cli.invocation import Invocation, common_options, usage_error, usage_errors
from railui.cli.quantities import parse_names
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.vehicle.design_reader import Design
    from railui.vehicle.fmu_vehicle import Variable

Names = dict[str, list[dict[str, Any]]]


@click.command("export")
@design_argument
@click.option("--state-space", "state_space", metavar="FILE", help="Write the state space: .npz or .mat.")
@click.option("--fmu", is_flag=True, help="Write a functional mock-up unit: FMI 3.0, co-simulation.")
@click.option("-o", "--out", metavar="FILE.fmu", help="File of --fmu; the name of DESIGN with .fmu here by default.")
@speed_option()
@quantity_option("--channels", parse_names, metavar="LIST", help="Outputs, such as e1,ayf; those of a run by default.")
@common_options
def command(
    design: str,
    overrides: dict[str, str],
    state_space: str | None,
    fmu: bool,
    out: str | None,
    speed: float | None,
    channels: list[str] | None,
    call: Invocation,
) -> None:
    """Write DESIGN for other programs: the linear vehicle as state space, or the vehicle with its effects as an FMU.

    \b
    railui export design.yaml --state-space bogie.mat --speed 40
    railui export --fmu adjusted.yaml --speed "144 km/h"

    State space: x' = A x + B u, y = C x + D u at one --speed, for NumPy, scipy, python-control or MATLAB. The inputs
    are yw, its slope along the track, phiw, its slope and gauge under every wheelset; wheelset i meets the track a time
    delays(i) after the leading one. SI units. Effects that are not linear are left out and named.

    FMU: FMI 3.0 co-simulation on Linux, tested with FMPy. The inputs are the track under the leading wheelset and its
    slopes at the communication points; the outputs are one communication step late. --speed is the start value of the
    parameter `speed`, 40 m/s by default.
    """
    if fmu == (state_space is not None):
        raise usage_error("give --state-space FILE or --fmu")
    if state_space is not None:
        if out is not None:
            raise usage_error("-o: the file of the state space is that of --state-space")
        _export_state_space(call, design, overrides, state_space, speed, channels)
    else:
        _export_fmu(call, design, overrides, out or f"{Path(design).stem}.fmu", speed, channels)


def _export_state_space(
    call: Invocation,
    design: str,
    overrides: dict[str, str],
    file: str,
    speed: float | None,
    channels: list[str] | None,
) -> None:
    from railui.api.response import state_space_of
    from railui.documents.state_space_file import check_state_space_file, write_state_space

    if speed is None:
        raise usage_error("--state-space needs --speed: the matrices are those of one speed")
    loaded = _prepare(call, design, overrides, file, "--state-space", check_state_space_file)
    space = _checked(channels, lambda: state_space_of(loaded, speed, channels))
    write_state_space(file, space)
    names: Names = {
        key: [{"name": n, "unit": u} for n, u in zip(names, units, strict=True)]
        for key, names, units in (
            ("state", space.states, space.state_units),
            ("input", space.inputs, space.input_units),
            ("output", space.outputs, space.output_units),
        )
    }
    caption = [f"delays of the wheelsets [s]: {', '.join(f'{tau:.6g}' for tau in space.delays)}", *space.notes]
    _report(call, names, f"state space of {space.name} at {space.speed:.4g} m/s", caption)
    head = {"design": loaded.name, "overrides": overrides, "file": file, "speed": space.speed}
    body = head | names | {"delays": space.delays, "notes": list(space.notes)}
    call.write_json(call.document("export", body, [design]))
    call.info(f"wrote {file}")


def _export_fmu(
    call: Invocation,
    design: str,
    overrides: dict[str, str],
    file: str,
    speed: float | None,
    channels: list[str] | None,
) -> None:
    from railui.api.fmu import DEFAULT_SPEED, fmu_vehicle_of
    from railui.documents.fmu_file import check_fmu_file, write_fmu

    loaded = _prepare(call, design, overrides, file, "-o", check_fmu_file)
    vehicle = _checked(channels, lambda: fmu_vehicle_of(loaded, DEFAULT_SPEED if speed is None else speed, channels))
    with usage_errors("--fmu"):
        write_fmu(file, vehicle)
    names = {"input": _variables(vehicle.inputs), "output": _variables(vehicle.outputs)}
    caption = [f"parameters: speed {vehicle.speed:.4g} m/s, start_distance, {len(vehicle.parameters)} of the vehicle"]
    _report(call, names, f"FMU of {vehicle.name}", caption)
    head = {"design": loaded.name, "overrides": overrides, "file": file, "speed": vehicle.speed}
    body = head | names | {"parameter": _variables(vehicle.parameters), "notes": []}
    call.write_json(call.document("export", body, [design]))
    call.info(f"wrote {file}")


def _prepare(call: Invocation, design: str, overrides: dict[str, str], file: str, option: str, check: Any) -> Design:
    """Check the file to be written, then read the design."""
    from railui.io.atomic import check_file_writable

    with usage_errors(option):
        check(file)
    check_file_writable(file)
    return load_design_argument(call, design, overrides)


def _checked(channels: list[str] | None, build: Any) -> Any:
    """Return what is built, with an error of its channels as one of the option."""
    try:
        return build()
    except ValueError as error:
        if channels is None:
            raise
        raise usage_error(f"--channels: {error}") from None


def _variables(variables: Sequence[Variable]) -> list[dict[str, Any]]:
    return [{"name": v.name, "unit": v.unit} | ({} if v.start is None else {"start": v.start}) for v in variables]


def _report(call: Invocation, names: Names, title: str, caption: Sequence[str]) -> None:
    rows = [
        (f"{key}s", len(group), ", ".join(one["name"] + (f" [{one['unit']}]" if one["unit"] else "") for one in group))
        for key, group in names.items()
    ]
    call.show(make_table(("", "number", "names"), rows, title=title, caption="\n".join(caption)))
