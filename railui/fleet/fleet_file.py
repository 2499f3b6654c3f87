"""Fleet file: vehicle types as campaigns without runs, vehicles, limits and settings."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from railui import core
from railui.campaign.campaign import Campaign, check_band, comparison_options, with_declared_sensors
from railui.campaign.estimated import read_estimated
from railui.campaign.settings.fleet import FleetSettings
from railui.campaign.stated_noise import read_stated_noise
from railui.documents.recognise import expect_kind
from railui.fleet.schema import METADATA, EventModel, FleetModel, LimitModel, RunsModel, TriggersModel, TypeModel
from railui.io.atomic import canonical_json, sha256, sha256_file
from railui.io.problems import FileProblems, Findings, Problem, suggest_name
from railui.io.units import UnitError, quantity
from railui.io.yaml_file import load_fields
from railui.optimisation.response_keys import NUMERIC_KEYS, RESPONSE_KEYS, check_bound
from railui.optimisation.response_map import check_keys
from railui.runs.columns import RIG_FORMS
from railui.vehicle.reference import load_named_design

CALIBRATED: Final = "adjusted.yaml"  # of a loop
FIELD: Final = re.compile(r"\{(\w+)\}")  # of a pattern
REMEDY: Final = "write `types:`, `vehicles:` and `runs:`"


@dataclass(frozen=True)
class VehicleType:
    """Vehicle type: its campaign without runs, and the effects whose size is followed, KIND or "KIND at LOCATION".

    Attributes
    ----------
    content
        Hash of everything in the file that the results of its runs depend on.
    """

    name: str
    campaign: Campaign
    watch: tuple[str, ...]
    content: str


@dataclass(frozen=True)
class Vehicle:
    """Vehicle of a fleet; `prior`: directory of the loop whose calibrated vehicle is its reference."""

    name: str
    type: VehicleType
    prior: Path | None = None


@dataclass(frozen=True)
class Limit:
    """Limit of a parameter in SI, or of a criterion that is computed with the drifting parameter."""

    parameter: str
    value: float
    is_lower: bool
    criterion: str | None = None


@dataclass(frozen=True)
class Fleet:
    """A fleet: types, vehicles by name, runs, triggers, maintenance and limits."""

    name: str
    source: Path
    types: Mapping[str, VehicleType]
    vehicles: Mapping[str, Vehicle]
    runs: RunsModel
    triggers: TriggersModel
    events: tuple[EventModel, ...]
    limits: tuple[Limit, ...]
    settings: FleetSettings
    sha256: str
    warnings: tuple[Problem, ...] = field(default=(), compare=False)

    @property
    def directory(self) -> Path:
        """Directory that paths of the file are relative to."""
        return self.source.parent


def load_fleet(path: str | Path) -> Fleet:
    """Read a fleet file and the designs that it names.

    Raises
    ------
    FileProblems
        With every fault of these files.
    """
    source = Path(path)
    source = source / "fleet.yaml" if source.is_dir() else source
    expect_kind(source, "fleet")
    data, model, findings = load_fields(source, "fleet", FleetModel, REMEDY)
    if model is None:
        raise FileProblems(findings.errors())
    raw_types = data["types"]
    types = {
        name: one
        for name, fields in model.types.items()
        if (one := _read_type(name, fields, raw_types[name], source, findings)) is not None
    }
    vehicles = {}
    for name, v in model.vehicles.items():
        if v.type in types:
            prior = None if v.prior is None else source.parent / v.prior
            vehicles[name] = Vehicle(name, types[v.type], prior)
            if prior is not None and not (prior / CALIBRATED).is_file():
                remedy = "name the directory of the results of railui loop, or leave prior out"
                findings.add(f"vehicles.{name}.prior", f"{v.prior} has no {CALIBRATED}", remedy)
        elif v.type not in model.types:
            findings.add(f"vehicles.{name}", f"no type {v.type!r}", suggest_name(v.type, model.types))
    _check_runs(model, source, findings)
    for i, event in enumerate(model.events):
        if bool(event.vehicle) == bool(event.section):
            findings.add(f"events.{i}", "names neither or both of a vehicle and a section", "name one of them")
        elif event.vehicle and event.vehicle not in model.vehicles:
            remedy = suggest_name(event.vehicle, model.vehicles)
            findings.add(f"events.{i}.vehicle", f"no vehicle {event.vehicle!r}", remedy)
        elif event.section and model.triggers.sections and event.section not in model.triggers.sections:
            remedy = suggest_name(event.section, model.triggers.sections)
            findings.add(f"events.{i}.section", f"no section {event.section!r} in the triggers", remedy)
    # a type that cannot be read has parameters that are not known
    read = model.limits if len(types) == len(model.types) else []
    limits = [_read_limit(i, limit, types, findings) for i, limit in enumerate(read)]
    if findings.errors():
        raise FileProblems(findings.errors())
    return Fleet(
        name=model.name or source.resolve().parent.name,
        source=source,
        types=types,
        vehicles=vehicles,
        runs=model.runs,
        triggers=model.triggers,
        events=tuple(model.events),
        limits=tuple(limit for limit in limits if limit is not None),
        settings=FleetSettings(**model.model_dump()["settings"]),
        sha256=sha256_file(source),
        warnings=findings.warnings(),
    )


def _read_type(
    name: str, fields: TypeModel, raw: Mapping[str, Any], source: Path, findings: Findings
) -> VehicleType | None:
    """Return a vehicle type; problems join the findings below `types.NAME`."""
    inner = Findings(findings.file)
    design = with_declared_sensors(load_named_design(source, raw, inner, None), raw.get("channels"), inner)
    campaign = None
    if design is not None:
        kind = design.run_form
        noise = read_stated_noise(raw.get("noise"), kind, [], inner)
        design, paths = read_estimated(raw.get("adjust"), raw.get("free"), design, inner)
        check_band(raw.get("band"), inner)
        known = [str(record["kind"]) for record in core.effect_catalogue()]
        for i, watched in enumerate(fields.watch):
            effect = watched.partition(" at ")[0]
            if effect not in known:
                inner.add(f"watch.{i}", f"no effect {effect!r} in the catalogue", suggest_name(effect, known))
        campaign = Campaign(
            name=name,
            directory=source.parent,
            design=design,
            runs=(),
            noise=noise,
            estimated_parameters=paths,
            sensors=(),
            source=source,
            sha256="",
            channels=raw.get("channels") or {},
            **comparison_options(fields, is_rig=kind in RIG_FORMS),
        )
    for problem in inner.problems:
        if problem.file != findings.file:
            findings.problems.append(problem)
        elif problem.severity == "error":
            findings.add(f"types.{name}.{problem.key}", problem.message, problem.remedy)
        else:
            findings.warn(f"types.{name}.{problem.key}", problem.message, problem.remedy)
    if campaign is None:
        return None
    content = sha256(canonical_json([campaign.design.content(), fields.model_dump(mode="json")]))
    return VehicleType(name, campaign, tuple(fields.watch), content)


def _check_runs(model: FleetModel, source: Path, findings: Findings) -> None:
    """Report runs that are not named in exactly one way, an index that does not exist, and faulty patterns."""
    runs = model.runs
    index, pattern = runs.index, runs.pattern
    if sum(way is not None for way in (index, pattern, runs.glob)) != 1:
        remedy = "give `index: runs.csv`, `pattern: runs/{vehicle}/{time}.csv.gz`, or `glob: runs/*.csv`"
        findings.add("runs", "are not named by exactly one of index, pattern and glob", remedy)
    if runs.columns and index is None:
        findings.add("runs.columns", "name columns of an index, which is not given", "give `index: runs.csv`")
    _check_regex(model, findings)
    fields = set(FIELD.findall(pattern or ""))
    for name in sorted(fields - set(METADATA[1:])):
        remedy = f"write one of {', '.join(f'{{{x}}}' for x in METADATA[1:])}"
        findings.add("runs.pattern", f"has an unknown field {{{name}}}", remedy)
    if index is not None and "://" not in index and not (source.parent / index).is_file():
        findings.add("runs.index", f"no file {index!r}", f"give a path relative to {source.parent}")
    if pattern is not None and "{time}" not in pattern:
        findings.add("runs.pattern", "has no {time}", "write {time} where the names have the time of a run")
    if pattern is not None and "{vehicle}" not in pattern and len(model.vehicles) != 1:
        findings.add("runs.pattern", "has no {vehicle}", "write {vehicle} where the names have the vehicle")


def _check_regex(model: FleetModel, findings: Findings) -> None:
    """Report a regular expression that is none, or whose groups are not those of the metadata."""
    runs = model.runs
    if runs.regex is None:
        if runs.glob is not None and len(model.vehicles) != 1:
            findings.add("runs.glob", "does not state the vehicle", "add `regex: '(?P<vehicle>[^/]+)/'`")
        return
    if runs.glob is None:
        findings.add("runs.regex", "belongs to a glob, which is not given", "give `glob: runs/*.csv`")
    try:
        groups = re.compile(runs.regex).groupindex
    except re.error as error:
        findings.add("runs.regex", f"is no regular expression: {error}", "write it in single quotes, as Python does")
        return
    for name in sorted(set(groups) - set(METADATA[1:])):
        findings.add("runs.regex", f"has an unknown group {name!r}", suggest_name(name, METADATA[1:]))
    if "vehicle" not in groups and len(model.vehicles) != 1:
        findings.add("runs.regex", "has no group vehicle", "write (?P<vehicle>...) where the names have the vehicle")


def _read_limit(number: int, model: LimitModel, types: Mapping[str, VehicleType], findings: Findings) -> Limit | None:
    """Return a limit in SI; the unit is that of the criterion, or of the parameter."""
    path = f"limits.{number}"
    known = {p: t.campaign.design for t in types.values() for p in t.campaign.estimated_parameters}
    if model.parameter not in known:
        remedy = suggest_name(model.parameter, known)
        findings.add(f"{path}.parameter", f"{model.parameter!r} is not estimated", remedy)
        return None
    if model.criterion is not None and model.criterion not in NUMERIC_KEYS:
        findings.add(f"{path}.criterion", f"no result {model.criterion!r}", suggest_name(model.criterion, NUMERIC_KEYS))
        return None
    if model.criterion is not None:
        try:
            check_keys([model.criterion], has_track=False, has_speed=False)
        except ValueError:
            findings.add(f"{path}.criterion", f"{model.criterion} needs a track", "take a critical speed")
            return None
    if (model.below is None) == (model.above is None):
        findings.add(path, "has neither or both of below and above", "give one of them")
        return None
    unit = known[model.parameter].unit(model.parameter)
    if model.criterion is not None:
        unit = RESPONSE_KEYS[model.criterion].unit
    key = "above" if model.below is None else "below"
    try:
        value = quantity(getattr(model, key), unit)
        if model.criterion is not None:
            check_bound(model.criterion, value)
    except UnitError as error:
        findings.add(f"{path}.{key}", error.message, error.remedy)
        return None
    return Limit(model.parameter, value, key == "below", model.criterion)
