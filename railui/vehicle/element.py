"""Elements: components of a bench, identified or as a table, which a design mounts at a location of its suspension."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from railui.io.fields import OBJECT, Group, Objects, Text, ValueReader, check_group, choice_reader, quantity_reader
from railui.io.problems import Findings
from railui.io.yaml_file import load_fields
from railui.io.yaml_nodes import join_path
from railui.vehicle.effect_reader import read_effects
from railui.vehicle.effects import Catalogue, Number, PlacedEffect, record_of
from railui.vehicle.force_table import DAMPER, SPRING, read_force_table, read_tables, table_motion, table_schema

# location at which an element's numbers are read: one of displacement and one of rotation
REFERENCE_LOCATIONS = {"m": "primary_lateral", "rad": "primary_yaw"}
TABLE_SUFFIXES = (".csv", ".csv.gz")
PRELOAD_RANGE = 10.0  # m or rad, of the constant curve that holds a preload


class ElementModel(Group):
    """Schema of an element file."""

    schema_: Text = Field(default="railui.element/1", alias="schema")
    name: Text = ""
    motion: Annotated[str, choice_reader(tuple(REFERENCE_LOCATIONS))] = Field(
        default="m", title="unit of the motion: m of a displacement, rad of a rotation"
    )
    stiffness: Annotated[float, quantity_reader("", 0.0)] = Field(default=0.0, title="stiffness of the linear spring")
    damping: Annotated[float, quantity_reader("", 0.0)] = Field(default=0.0, title="damping of the linear damper")
    preload: Annotated[float, quantity_reader("")] = Field(default=0.0, title="steady force at z = 0")
    damper: Annotated[Any, ValueReader(lambda value: value, table_schema(DAMPER))] = Field(
        default=None, title="damper force over velocity: {velocity: [], force: []}, or {file: CSV}"
    )
    spring: Annotated[Any, ValueReader(lambda value: value, table_schema(SPRING))] = Field(
        default=None, title="spring force over displacement: {displacement: [], force: []}, or {file: CSV}"
    )
    effects: Objects = Field(default_factory=list, title="laws of the catalogue, without a location")
    source: Annotated[dict[str, Any], ValueReader(lambda value: value or {}, OBJECT)] = Field(
        default_factory=dict, title="campaign, its sha256, NRMSE and range of motion"
    )


@dataclass(frozen=True)
class Element:
    """A component as laws in parallel, at a reference location.

    Attributes
    ----------
    name : str
    motion : str
        Unit of its motion, m or rad.
    effects : tuple of PlacedEffect
        Spring, damper, preload and laws.
    catalogue : sequence of records
    """

    name: str
    motion: str
    effects: tuple[PlacedEffect, ...]
    catalogue: Catalogue

    def mount(self, at: str, wheelset: int | None, count: float) -> tuple[PlacedEffect, ...]:
        """Return the effects of so many parallel elements at a location: all forces times the count."""
        return tuple(
            replace(effect, at=at, wheelset=wheelset, parameters=self._scaled(effect, count)) for effect in self.effects
        )

    def _scaled(self, effect: PlacedEffect, count: float) -> dict[str, Number]:
        record = record_of(effect.kind, self.catalogue) or {"parameters": ()}
        forces = {str(p["key"]) for p in record["parameters"] if str(p["unit"]).startswith("F")}
        return {key: _times(value, count) if key in forces else value for key, value in effect.parameters.items()}


def _times(value: Number, count: float) -> Number:
    return tuple(count * x for x in value) if isinstance(value, tuple) else count * value


def load_element(path: str | Path, catalogue: Catalogue) -> Element:
    """Read an element: a YAML file, or a CSV with a force table (v or z, and F); FileProblems with every problem."""
    path = Path(path)
    if path.name.lower().endswith(TABLE_SUFFIXES):
        return _load_table(path, catalogue)
    remedy = "write `damping:` and `effects:`, or let railui loop export one"
    data, model, findings = load_fields(path, "element", ElementModel, remedy)
    element = _element(data, model, path.stem, findings, "", path.parent, catalogue)
    findings.raise_errors()
    assert element is not None  # else `findings` had an error
    return element


def read_element(
    data: Mapping[str, Any], name: str, findings: Findings, path: str, directory: Path | None, catalogue: Catalogue
) -> Element | None:
    """Read the keys of an element within another file; None where problems join `findings`.

    Parameters
    ----------
    data : mapping
    name : str
        Name by default.
    findings : Findings
    path : str
        Path of the element in its file.
    directory : Path, optional
        Directory to which the files of tables are relative.
    catalogue : sequence of records
    """
    model = check_group(ElementModel, data, findings, path)
    return _element(data, model, name, findings, path, directory, catalogue)


def _element(
    data: Mapping[str, Any],
    model: ElementModel | None,
    name: str,
    findings: Findings,
    path: str,
    directory: Path | None,
    catalogue: Catalogue,
) -> Element | None:
    before = len(findings.errors())
    entries = data.get("effects")
    motion = model.motion if model is not None else "m"
    at = REFERENCE_LOCATIONS[motion]
    laws = _read_laws(entries if isinstance(entries, list) else [], motion, findings, catalogue, path)
    tables = read_tables(data, motion, findings, path, directory, at)
    if model is None or len(findings.errors()) > before:
        return None
    linear = linear_effects(model.stiffness, model.damping, model.preload, at)
    return Element(model.name or name, motion, (*linear, *tables, *laws), catalogue)


def _load_table(path: Path, catalogue: Catalogue) -> Element:
    findings = Findings(str(path))
    found = table_motion(path, findings)
    findings.raise_errors()
    assert found is not None  # else `findings` had an error
    kind, motion = found
    at = REFERENCE_LOCATIONS[motion]
    table = read_force_table(path.name, kind, motion, findings, "", path.parent, at)
    findings.raise_errors()
    assert table is not None
    return Element(path.stem, motion, (table,), catalogue)


def _read_laws(
    entries: list[Any], motion: str, findings: Findings, catalogue: Catalogue, path: str
) -> tuple[PlacedEffect, ...]:
    for i, entry in enumerate(entries):
        for key in ("at", "wheelset", "element"):
            if isinstance(entry, Mapping) and key in entry:
                findings.add(
                    join_path(path, f"effects.{i}.{key}"),
                    "an element has no location of its own",
                    "leave it out: the design names the location",
                    key=True,
                )
    placed = [e | {"at": REFERENCE_LOCATIONS[motion]} if isinstance(e, dict) else e for e in entries]
    return read_effects(placed, findings, join_path(path, "effects"), catalogue, {})


def linear_effects(stiffness: float, damping: float, preload: float, at: str) -> tuple[PlacedEffect, ...]:
    """Return a spring, a damper and a preload as effects at a location; what is zero is left out."""
    constant = {"motion": (-PRELOAD_RANGE, PRELOAD_RANGE), "force": (-preload, -preload)}
    effects = (
        (stiffness, PlacedEffect("spring", at, None, {"stiffness": stiffness})),
        (damping, PlacedEffect("viscous_damper", at, None, {"damping": damping})),
        (preload, PlacedEffect("measured_force", at, None, constant, "z")),
    )
    return tuple(effect for number, effect in effects if number)
