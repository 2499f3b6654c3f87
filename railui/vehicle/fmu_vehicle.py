"""Vehicle of a functional mock-up unit: its numbers, variables and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from railui.core import MAX_STEPS_PER_SAMPLE
from railui.vehicle.channels import channel_unit
from railui.vehicle.dofs import is_lateral
from railui.vehicle.kernel_layout import kernel_layout
from railui.vehicle.kernel_rows import parameter_paths
from railui.vehicle.model import Model
from railui.vehicle.multibody import position_terms
from railui.vehicle.parameter import is_curve_point

# inputs: the track under the leading wheelset and its slopes along the track
TRACK_INPUTS: Final = (
    ("yw", "m", "lateral deviation of the track under the leading wheelset"),
    ("dyw_ds", "1", "slope of yw along the track"),
    ("phiw", "rad", "cross-level under the leading wheelset"),
    ("dphiw_ds", "rad/m", "slope of phiw along the track"),
    ("gauge", "m", "gauge deviation under the leading wheelset"),
    ("dgauge_ds", "1", "slope of gauge along the track"),
)


@dataclass(frozen=True)
class Variable:
    """Variable of an FMU; `start` is None for an output."""

    name: str
    unit: str
    description: str
    start: float | None = None


@dataclass(frozen=True, eq=False)
class FmuVehicle:
    """Vehicle on straight track as an FMU.

    Attributes
    ----------
    name : str
    speed : float
        Start value of the speed [m/s].
    inputs, parameters, outputs : tuple of Variable
        In the order of their value references.
    data : mapping
        Contents of `vehicle.json`, which the kernel reads.
    """

    name: str
    speed: float
    inputs: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    data: dict[str, Any]


def fmu_vehicle(model: Model, speed: float, channels: Sequence[str]) -> FmuVehicle:
    """Return a vehicle with its effects as an FMU.

    Parameters
    ----------
    model : Model
        A bogie or a vehicle of bodies.
    speed : float
        Start value of the speed [m/s].
    channels : sequence of str
        Outputs, which the vehicle must have.

    Raises
    ------
    ValueError
        For a wheelset without a vehicle.
    """
    if len(model.wheelset_distances()) == 1:
        raise ValueError(f"{model.design.name} is one wheelset: an FMU needs a bogie or a vehicle of bodies")
    vehicles, batch = model.vehicles(), model.single_batch()
    dofs = vehicles.degrees_of_freedom(batch)
    structure = model.design.structure
    parameters = _parameters(model)
    data = {
        "kind": model.design.kind,
        "layout": None if structure is None else asdict(kernel_layout(structure)),
        "placed": [
            {"kind": p.kind, "at": p.at, "wheelset": p.wheelset or 0, "count": p.parameter_count, "against": p.against}
            for p in vehicles.placements
        ],
        "row": model.row.tolist(),
        "numbers": len(parameter_paths(model.design)),
        "behind": _distances(model),
        "lateral": [i for i, dof in enumerate(dofs) if is_lateral(dof)],
        "channels": vehicles.kernel_names(channels),
        "parameters": [model.columns[p.name] for p in parameters],
        "speed": speed,
        "most_steps": MAX_STEPS_PER_SAMPLE,
    }
    inputs = tuple(Variable(name, unit, text, 0.0) for name, unit, text in TRACK_INPUTS)
    outputs = tuple(Variable(name, channel_unit(name), f"channel {name} of the vehicle") for name in channels)
    return FmuVehicle(model.design.name, speed, inputs, parameters, outputs, data)


def _parameters(model: Model) -> tuple[Variable, ...]:
    """Return the numbers of the vehicle and of its effects; the points of force curves keep theirs."""
    found = []
    for path, column in model.columns.items():
        if is_curve_point(path):
            continue
        record = model.design.parameter(path)
        found.append(Variable(path, record.unit, record.caption, float(model.row[column])))
    return tuple(found)


def _distances(model: Model) -> list[list[tuple[float, int]]]:
    """Return the distance of each wheelset behind the first as a sum of factor times number of the row."""
    structure, columns = model.design.structure, model.columns
    if structure is None:
        return [[], [(2.0, columns["vehicle.geometry.half_wheelbase"])]]
    terms = [[(f, columns[path]) for f, path in position_terms(structure, w)] for w in structure.wheelsets]
    return [[*terms[0], *((-f, column) for f, column in one)] for one in terms]
