"""modelDescription.xml of a functional mock-up unit (FMI 3.0)."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from typing import Final

from railui.io.unit_parser import BASE_LABELS, parse_unit
from railui.vehicle.fmu_vehicle import FmuVehicle, Variable

SAMPLE_SPACING: Final = 0.1  # m, of a synthetic track; the communication step that the file proposes
SPEED: Final = "running speed, constant"
START: Final = "distance s of the leading wheelset at the start"


def model_identifier(name: str) -> str:
    """Return a name as an identifier of C.

    >>> model_identifier("bogie of the check values"), model_identifier("2 axles")
    ('bogie_of_the_check_values', 'vehicle_2_axles')
    """
    word = re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_")
    return word if word[:1].isalpha() else f"vehicle_{word}".rstrip("_")


def fixed_parameters(vehicle: FmuVehicle) -> tuple[Variable, Variable]:
    """Return speed and start, the parameters that are no numbers of the vehicle."""
    return Variable("speed", "m/s", SPEED, vehicle.speed), Variable("start_distance", "m", START, 0.0)


def model_description(vehicle: FmuVehicle, token: str, tool: str) -> bytes:
    """Return modelDescription.xml; the value references are those that the kernel expects."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=vehicle.name,
        description="Lateral dynamics of a railway vehicle on straight track; outputs are one communication step late",
        instantiationToken=token,
        generationTool=tool,
        variableNamingConvention="flat",
    )
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model_identifier(vehicle.name),
        canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUState="true",
    )
    _add_units(root, [*vehicle.inputs, *fixed_parameters(vehicle), *vehicle.outputs, *vehicle.parameters])
    ElementTree.SubElement(ElementTree.SubElement(root, "LogCategories"), "Category", name="logStatusError")
    step = f"{SAMPLE_SPACING / vehicle.speed:.12g}"
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stepSize=step)
    _add_variables(root, vehicle)
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _add_units(root: ElementTree.Element, variables: Iterable[Variable]) -> None:
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for text in sorted({variable.unit for variable in variables} | {"s"}):
        powers = dict(zip(BASE_LABELS, parse_unit(text).dimension, strict=True))
        powers.pop("cycle")
        base = {label: str(power) for label, power in powers.items() if power}
        ElementTree.SubElement(ElementTree.SubElement(definitions, "Unit", name=text), "BaseUnit", base)


def _add_variables(root: ElementTree.Element, vehicle: FmuVehicle) -> None:
    variables = ElementTree.SubElement(root, "ModelVariables")
    structure = ElementTree.SubElement(root, "ModelStructure")
    time = {"name": "time", "valueReference": "0", "causality": "independent", "variability": "continuous", "unit": "s"}
    ElementTree.SubElement(variables, "Float64", time)
    groups = (
        (vehicle.inputs, {"causality": "input", "variability": "continuous"}),
        (fixed_parameters(vehicle), {"causality": "parameter", "variability": "fixed", "initial": "exact"}),
        (vehicle.outputs, {"causality": "output", "variability": "continuous", "initial": "calculated"}),
        (vehicle.parameters, {"causality": "parameter", "variability": "fixed", "initial": "exact"}),
    )
    reference = 0
    outputs = []
    for group, attributes in groups:
        for variable in group:
            reference += 1
            start = {} if variable.start is None else {"start": repr(variable.start)}
            name = {"name": variable.name, "valueReference": str(reference), "description": variable.description}
            ElementTree.SubElement(variables, "Float64", {**name, **attributes, "unit": variable.unit, **start})
            if attributes["causality"] == "output":
                outputs.append(str(reference))
    for kind in ("Output", "InitialUnknown"):
        for output in outputs:
            ElementTree.SubElement(structure, kind, valueReference=output)
