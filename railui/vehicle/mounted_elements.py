"""Entries of a design's effects that mount an element of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, suggest_name
from railui.io.units import UnitError, quantity
from railui.vehicle.effects import (
    ROTATION_SUFFIXES,
    WHEELSET_LOCATIONS,
    Catalogue,
    PlacedEffect,
    kernel_catalogue,
    record_of,
)
from railui.vehicle.element import Element, load_element, read_element
from railui.vehicle.multibody import Structure

KEYS = ("element", "at", "wheelset", "count")
LAW = "dry_friction"  # stands for all laws that act at every suspension


def expand_elements(
    entries: Sequence[Any],
    findings: Findings,
    path: str,
    catalogue: Catalogue | None,
    directory: Path | None,
    form: str,
    structure: Structure | None,
) -> list[Any]:
    """Replace every entry `{element: FILE, at: LOCATION, count: N}` by the effects of the element there.

    Instead of FILE the keys of an element may stand in the design.

    Parameters
    ----------
    entries : sequence
        Entries of the file.
    findings : Findings
        Receives the problems of these entries and of the element files.
    path : str
        Path of the list in the file.
    catalogue : sequence of records, optional
    directory : Path, optional
        Directory of the design, to which file names are relative.
    form : str
        Kind of the vehicle.
    structure : Structure, optional
        Bodies and elements of a multibody vehicle.

    Returns
    -------
    list
        Entries without elements, in the order of the file.
    """
    records = kernel_catalogue() if catalogue is None else catalogue
    expanded: list[Any] = []
    for i, entry in enumerate(entries):
        if isinstance(entry, Mapping) and "element" in entry:
            here = f"{path}.{i}"
            effects = _mount(entry, findings, here, records, directory, _locations(records, form, structure))
            expanded += [effect.entry() for effect in effects]
        else:
            expanded.append(entry)
    return expanded


def _locations(records: Catalogue, form: str, structure: Structure | None) -> list[str]:
    """Return the locations of a vehicle where an element can be mounted."""
    record = record_of(LAW, records) or {"at": ()}
    if structure is not None:
        return [at for at, found in structure.effect_locations.items() if found.catalogue_name in record["at"]]
    return [str(at) for at in record["at"] if (at == "rig") == (form == "rig")]


def _mount(
    entry: Mapping[str, Any],
    findings: Findings,
    path: str,
    records: Catalogue,
    directory: Path | None,
    locations: Sequence[str],
) -> tuple[PlacedEffect, ...]:
    before = len(findings.problems)
    for key in entry:
        if key not in KEYS:
            findings.add(f"{path}.{key}", "unknown key of an element", suggest_name(key, KEYS), key=True)
    element = _load(entry["element"], findings, path, records, directory)
    at = str(entry.get("at"))
    if "at" not in entry:
        findings.add(path, "the element has no location", f"add `at:`, one of {', '.join(locations)}")
    elif at not in locations:
        findings.add(f"{path}.at", f"an element is not possible at {at!r}", suggest_name(at, locations))
    elif element is not None and (element.motion == "rad") != at.endswith(ROTATION_SUFFIXES) and at != "rig":
        needed = "a rotation" if at.endswith(ROTATION_SUFFIXES) else "a displacement"
        message = f"moves in {element.motion}, but the motion at {at} is {needed}"
        findings.add(f"{path}.at", message, "mount it at a location with a motion of its kind")
    count, wheelset = _count(entry, findings, path), entry.get("wheelset")
    if wheelset is not None and locations and at in WHEELSET_LOCATIONS and wheelset not in (1, 2):
        findings.add(f"{path}.wheelset", f"{wheelset!r} is not a wheelset", "write 1 or 2, or leave the key out")
    if element is None or len(findings.problems) > before:
        return ()
    return element.mount(at, wheelset, count)


def _count(entry: Mapping[str, Any], findings: Findings, path: str) -> float:
    try:
        count = quantity(entry.get("count", 1.0), "1")
    except UnitError as error:
        findings.add(f"{path}.count", error.message, error.remedy)
        return 1.0
    if count <= 0:
        findings.add(f"{path}.count", f"{count:g} elements carry no force", "give a number above 0")
    return count


def _load(given: Any, findings: Findings, path: str, records: Catalogue, directory: Path | None) -> Element | None:
    """Return the element of a file, or of the keys in the design itself."""
    if isinstance(given, Mapping):
        return read_element(given, "element", findings, f"{path}.element", directory, records)
    name = str(given)
    file = (directory or Path()) / name
    if not file.is_file():
        patterns = ("*.yaml", "*.csv")
        near = sorted(p.name for x in patterns for p in file.parent.glob(x)) if file.parent.is_dir() else []
        remedy = suggest_name(file.name, near) if near else "railui loop CAMPAIGN --export-element FILE writes one"
        findings.add(f"{path}.element", f"no file {name!r}", remedy)
        return None
    try:
        return load_element(file, records)
    except FileProblems as error:
        findings.problems += error.problems
        return None
