"""A study: which numbers of a vehicle may change, on which cases, and what is better."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from railui.io.atomic import sha256_file
from railui.io.fields import check_group
from railui.io.problems import FileProblems, Problem
from railui.io.schema_line import check_schema
from railui.io.yaml_document import load
from railui.optimisation.scenarios import read_scenarios, usual_scenarios
from railui.optimisation.study_parts import (
    Constraint,
    Objective,
    Variable,
    check_tracks,
    read_constraints,
    read_method,
    read_objectives,
    read_variables,
)
from railui.optimisation.study_schema import StudyModel
from railui.vehicle.design_reader import Design
from railui.vehicle.effect_records import Catalogue
from railui.vehicle.reference import vehicle_of


@dataclass(frozen=True)
class Cases:
    """What every design is judged on; speeds in m/s, scenarios as overrides in SI by path, curve in m."""

    track: tuple[str, ...]
    speed: tuple[float, ...]
    seed: tuple[int, ...]
    scenario: tuple[Mapping[str, Any], ...]
    draws: int
    radius: float
    cant_deficiency: float


@dataclass(frozen=True)
class Method:
    """How to search: kind, population, generations, seed."""

    kind: str
    population: int
    generations: int
    seed: int


@dataclass(frozen=True)
class Study:
    """A study, checked, in SI."""

    name: str
    design: Design
    variables: tuple[Variable, ...]
    cases: Cases
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    method: Method
    source: Path
    sha256: str
    warnings: tuple[Problem, ...] = field(default=(), compare=False)

    @property
    def directory(self) -> Path:
        """Where tracks that are files lie."""
        return self.source.parent


def load_study(
    path: str | Path, catalogue: Catalogue | None = None, check_track: Callable[[str], object] | None = None
) -> Study:
    """Reads a study and the vehicle it names; FileProblems with every fault.

    `check_track` reads the text of a synthetic track and raises ValueError where it cannot.
    """
    source = Path(path)
    document = load(source)
    findings = document.findings()
    data = document.value if isinstance(document.value, dict) else {}
    if not data:
        findings.add("", "is no study", "write `vehicle:`, `variables:`, `cases:` and `objectives:`")
        findings.stop()
    check_schema(data, "study", findings)
    model = check_group(StudyModel, data, findings)
    design = vehicle_of(source, data, findings, catalogue)
    variables = read_variables(data.get("variables"), design, findings)
    objectives = read_objectives(data.get("objectives"), findings)
    method = read_method(data.get("method"), objectives, variables, findings)
    constraints = read_constraints(data.get("constraints"), findings)
    told = data.get("cases")
    cases: dict[str, Any] = told if isinstance(told, dict) else {}
    check_tracks(cases.get("track"), source.parent, findings, check_track)
    varied = [variable.path for variable in variables]
    given = cases.get("scenario") if "scenario" in cases else usual_scenarios(design, varied)
    scenario = read_scenarios(given, design, findings)
    if design is not None and design.adjustment is None and isinstance(cases.get("draws"), int) and cases["draws"] > 0:
        findings.add(
            "cases.draws",
            "the vehicle has no adjustment to draw from",
            "name an adjusted.yaml, or set draws: 0",
        )
    if findings.errors() or design is None or model is None:
        raise FileProblems(findings.errors())
    c = model.cases
    return Study(
        name=model.name or source.stem,
        design=design,
        variables=variables,
        cases=Cases(tuple(c.track), tuple(c.speed), tuple(c.seed), scenario, c.draws, c.radius, c.cant_deficiency),
        objectives=objectives,
        constraints=constraints,
        method=Method(method, model.method.population, model.method.generations, model.method.seed),
        source=source,
        sha256=sha256_file(source),
        warnings=(*findings.warnings(), *design.warnings),
    )


__all__ = ["Cases", "Constraint", "Method", "Objective", "Study", "Variable", "load_study"]
