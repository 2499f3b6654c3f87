"""Reading design files."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from railui.io.atomic import sha256, sha256_file
from railui.io.fields import check_group
from railui.io.problems import Findings, suggest_name
from railui.io.schema_line import check_schema
from railui.io.yaml_document import Document, parse_yaml, read_text
from railui.vehicle.contact_profiles import ContactProfiles
from railui.vehicle.contact_profiles_reader import DeclaredProfiles, apply_profiles, declare_profiles
from railui.vehicle.covariance import is_indefinite
from railui.vehicle.design import Adjustment, Design, RidingSettings
from railui.vehicle.design_schema import design_model
from railui.vehicle.effect_reader import read_effects
from railui.vehicle.effects import Catalogue, PlacedEffect, kernel_catalogue
from railui.vehicle.load_states import read_load_states
from railui.vehicle.mounted_elements import expand_elements
from railui.vehicle.multibody import Structure
from railui.vehicle.multibody_reader import check_no_lists, read_structure
from railui.vehicle.parameters import FORMS, setting_paths
from railui.vehicle.wheel_loads import check_bogie_wheel_loads, check_wheel_loads


def load_design(path_or_text: str | Path, catalogue: Catalogue | None = None) -> Design:
    """Read a design from a file, or from a text (recognised by a line end or ": ").

    Raises
    ------
    FileProblems
        With every problem of the file.

    Examples
    --------
    >>> load_design("name: bench\\nvehicle: {rig: {mass: 95 kg}}").name
    'bench'
    """
    if isinstance(path_or_text, str) and ("\n" in path_or_text or ": " in path_or_text):
        return parse_design(path_or_text, catalogue=catalogue)
    path = Path(path_or_text)
    return parse_design(read_text(path), str(path), path, catalogue)


def parse_design(
    text: str, file: str = "design", source: Path | None = None, catalogue: Catalogue | None = None
) -> Design:
    """Read a design from a text; `file` names it in problems."""
    document = parse_yaml(text, file)
    findings = document.findings()
    design = _read(document, findings, source, catalogue)
    findings.raise_errors()
    assert design is not None  # `_read` returns None only after it reported an error
    return design


def _read(document: Document, findings: Findings, source: Path | None, catalogue: Catalogue | None) -> Design | None:
    data = document.value
    if not isinstance(data, dict):
        findings.add("", "is not a design", "write `vehicle:` and `contact:` groups")
        return None
    check_schema(data, "design", findings)
    kind, data = _detect_kind(data, findings)
    form = "bench" if kind == "rig" and _prescribes_motion(data) else kind
    if form == "bench":
        data = _without_mass(data, findings)
    load_states = data.get("load")
    data = {key: value for key, value in data.items() if key != "load"}
    declared: DeclaredProfiles | None = None
    if kind != "rig":
        data, declared = declare_profiles(data, findings, form)
    structure: Structure | None = None
    structure_values: dict[str, float] = {}
    if form == "vehicle":
        structure, structure_values = read_structure(data, findings)
        if structure is not None and declared is not None:
            check_no_lists(structure, findings)
        data = _without_structure(data)
    known_paths = [*(p.path for p in FORMS.get(form, ())), *setting_paths(form)]
    model = check_group(design_model(form), data, findings, extra=known_paths)
    values = _read_numbers(data, model, form) | structure_values
    has_structure = form != "vehicle" or structure is not None
    entries = data.get("effects")
    profiles: ContactProfiles | None = None
    if declared is not None and has_structure:
        profiles, shapes = apply_profiles(declared, values, structure, source and source.parent, findings)
        entries = [*(entries or []), *shapes] if isinstance(entries or [], list) else entries
    effects: tuple[PlacedEffect, ...] = ()
    if isinstance(entries, list) and entries and has_structure:
        directory = source.parent if source is not None else None
        entries = expand_elements(entries, findings, "effects", catalogue, directory, kind, structure)
        records = kernel_catalogue() if catalogue is None else catalogue
        effects = read_effects(entries, findings, "effects", records, values, form=kind, structure=structure)
    if model is None or not has_structure:
        return None
    _check_cushion(model, kind, findings)
    if form == "bogie":
        check_bogie_wheel_loads(values, effects, findings)
    elif structure is not None:
        check_wheel_loads(structure, values, findings)
    design = Design(
        name=str(_get(model, "name")) or (source.stem if source else kind),
        kind=kind,
        values=values,
        effects=effects,
        settings={path: _get(model, path) for path in setting_paths(form) if _is_given(data, path)},
        source=source,
        sha256=sha256_file(source) if source and source.exists() else sha256(document.text),
        warnings=findings.warnings(),
        catalogue=catalogue,
        structure=structure,
        profiles=profiles,
    )
    return _add_adjustment(read_load_states(load_states, design, findings), model, findings)


def _without_structure(data: dict[str, Any]) -> dict[str, Any]:
    """Return the data without bodies, elements and contact groups."""
    contact = data.get("contact")
    other_data = {key: value for key, value in data.items() if key not in ("vehicle", "contact")}
    if isinstance(contact, dict) and "gauge_widens_clearance" in contact:
        other_data["contact"] = {"gauge_widens_clearance": contact["gauge_widens_clearance"]}
    return other_data


def _detect_kind(data: dict[str, Any], findings: Findings) -> tuple[str, dict[str, Any]]:
    """Return the kind of the vehicle, and the data without groups that this kind does not have."""
    vehicle = data.get("vehicle")
    if not isinstance(vehicle, dict):
        return "bogie", data
    if "bodies" in vehicle or "elements" in vehicle:
        return "vehicle", data
    if "rig" not in vehicle:
        return "bogie", data
    foreign = [f"vehicle.{key}" for key in vehicle if key != "rig"]
    foreign += [key for key in ("contact", "riding", "load") if key in data]
    for path in foreign:
        findings.add(path, "a rig is one mass, it has no such group", "leave it out, or leave `rig` out", key=True)
    rig_data = {key: value for key, value in data.items() if key not in foreign}
    return "rig", rig_data | {"vehicle": {"rig": vehicle["rig"]}}


def _prescribes_motion(data: dict[str, Any]) -> bool:
    rig = data["vehicle"]["rig"]
    return isinstance(rig, dict) and rig.get("input") == "motion"


def _without_mass(data: dict[str, Any], findings: Findings) -> dict[str, Any]:
    """Return the data of a component on a bench without mass and gain, which are reported."""
    rig = data["vehicle"]["rig"]
    for key in ("mass", "gain"):
        if key in rig:
            findings.add(
                f"vehicle.rig.{key}",
                f"a component whose motion is prescribed has no {key}",
                "leave it out, or write `input: force` for a mass that moves freely",
                key=True,
            )
    return data | {"vehicle": {"rig": {k: x for k, x in rig.items() if k not in ("mass", "gain")}}}


def _get(model: Any, path: str) -> Any:
    for step in path.split("."):
        model = getattr(model, step)
    return model


def _is_given(data: Any, path: str) -> bool:
    for step in path.split("."):
        if not isinstance(data, dict) or data.get(step) is None:
            return False
        data = data[step]
    return True


def _read_numbers(data: dict[str, Any], model: Any, form: str) -> dict[str, float]:
    """Return the numbers of a design; the readable ones of a faulty design, on which defaults of effects depend."""
    parameters = FORMS.get(form, ())
    if model is not None:
        return {p.path: float(_get(model, p.path)) for p in parameters}
    values: dict[str, float] = {}
    for p in parameters:
        value: Any = data
        for step in p.path.split("."):
            value = value.get(step) if isinstance(value, dict) else None
        with contextlib.suppress(ValueError):
            values[p.path] = p.read(p.default if value is None else value)
    return values


def _check_cushion(model: Any, form: str, findings: Findings) -> None:
    if form != "rig" and (model.riding.cushion_frequency is None) != (model.riding.cushion_damping is None):
        findings.add("riding", "a seat cushion needs cushion_frequency and cushion_damping", "give both, or none")


def _add_adjustment(design: Design, model: Any, findings: Findings) -> Design:
    """Add the adjustment; check that its names and covariance fit."""
    given = model.adjustment
    if given is None:
        return design
    known = set(design.paths())
    for i, name in enumerate(given.names):
        if name not in known:
            findings.add(f"adjustment.names.{i}", f"no such parameter {name!r}", suggest_name(name, sorted(known)))
    _check_covariance(given.covariance, len(given.names), findings)
    _check_samples(given.samples, len(given.names), findings)
    covariance, samples = tuple(map(tuple, given.covariance)), tuple(map(tuple, given.samples))
    estimates = tuple(design.value(name) if name in known else math.nan for name in given.names)
    adjustment = Adjustment(given.campaign, given.sha256, tuple(given.names), covariance, samples, estimates)
    return replace(design, adjustment=adjustment)


def _check_covariance(rows: Sequence[Sequence[float]], n: int, findings: Findings) -> None:
    path, remedy = "adjustment.covariance", "take the file that the adjustment wrote"
    if len(rows) != n or any(len(row) != n for row in rows):
        findings.add(path, f"is not {n} by {n}, as adjustment.names requires", "give one row and column for each name")
        return
    variances = [rows[i][i] for i in range(n)]
    if not all(math.isfinite(x) for row in rows for x in row) or any(variance < 0 for variance in variances):
        findings.add(path, "has a value that is not finite or a negative variance", remedy)
        return
    pairs = ((i, j) for i in range(n) for j in range(i))
    if any(abs(rows[i][j] - rows[j][i]) > 1e-6 * math.sqrt(variances[i] * variances[j]) for i, j in pairs):
        findings.add(path, "is not symmetric", remedy)
    elif is_indefinite(rows):
        what = "has a negative eigenvalue: the correlations contradict each other, no parameters can be drawn from it"
        findings.add(path, what, remedy)


def _check_samples(rows: Sequence[Sequence[float]], n: int, findings: Findings) -> None:
    for i, row in enumerate(rows):
        if len(row) != n or not all(map(math.isfinite, row)):
            text = f"has not {n} finite numbers, one for each of adjustment.names"
            findings.add(f"adjustment.samples.{i}", text, "take the file that the adjustment wrote")


__all__ = ["Adjustment", "Design", "PlacedEffect", "RidingSettings", "load_design", "parse_design"]
