"""railui export: the linear vehicle for other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from railui.cli.arguments import design_argument, load_design_argument, quantity_option, speed_option
from railui.cli.invocation import Invocation, common_options, usage_error
from railui.cli.quantities import parse_names
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.vehicle.state_space import StateSpace


@click.command("export")
@design_argument
@click.option("--state-space", "file", required=True, metavar="FILE", help="Write the state space: .npz or .mat.")
@speed_option(required=True)
@quantity_option("--channels", parse_names, metavar="LIST", help="Outputs, such as e1,ayf; those of a run by default.")
@common_options
def command(
    design: str, overrides: dict[str, str], file: str, speed: float, channels: list[str] | None, call: Invocation
) -> None:
    """Write the linear DESIGN at a speed as state space, for NumPy, scipy, python-control or MATLAB.

    \b
    railui export design.yaml --state-space bogie.mat --speed 40
    railui export adjusted.yaml --state-space bogie.npz --speed "144 km/h" --channels e1,e2,ayf

    x' = A x + B u, y = C x + D u. The inputs are yw, its slope along the track, phiw, its slope and gauge under every
    wheelset; wheelset i meets the track a time delays(i) after the leading one. SI units. Effects that are not linear
    are left out and named.
    """
    from railui.api.response import state_space_of
    from railui.documents.state_space_file import check_state_space_file, write_state_space
    from railui.io.atomic import check_file_writable

    try:
        check_state_space_file(file)
    except ValueError as error:
        raise usage_error(f"--state-space: {error}") from None
    check_file_writable(file)
    loaded = load_design_argument(call, design, overrides)
    try:
        space = state_space_of(loaded, speed, channels)
    except ValueError as error:
        if channels is None:
            raise
        raise usage_error(f"--channels: {error}") from None
    write_state_space(file, space)
    call.show(_table(space))
    head = {"design": loaded.name, "overrides": overrides, "file": file, "speed": space.speed}
    body = head | _names(space) | {"delays": space.delays, "notes": list(space.notes)}
    call.write_json(call.document("export", body, [design]))
    call.info(f"wrote {file}")


def _names(space: StateSpace) -> dict[str, list[dict[str, str]]]:
    """Return names and units of states, inputs and outputs."""
    return {
        key: [{"name": n, "unit": u} for n, u in zip(names, units, strict=True)]
        for key, names, units in (
            ("state", space.states, space.state_units),
            ("input", space.inputs, space.input_units),
            ("output", space.outputs, space.output_units),
        )
    }


def _table(space: StateSpace) -> Any:
    rows = [
        (f"{key}s", len(group), ", ".join(one["name"] + (f" [{one['unit']}]" if one["unit"] else "") for one in group))
        for key, group in _names(space).items()
    ]
    caption = [f"delays of the wheelsets [s]: {', '.join(f'{tau:.6g}' for tau in space.delays)}", *space.notes]
    title = f"state space of {space.name} at {space.speed:g} m/s"
    return make_table(("", "number", "names"), rows, title=title, caption="\n".join(caption))
