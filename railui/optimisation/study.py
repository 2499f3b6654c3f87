"""Optimisation study: the variables of a vehicle, the cases on which designs are evaluated, objectives and method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from railui.io.problems import Problem
from railui.vehicle.design import Design


@dataclass(frozen=True)
class Variable:
    """Parameter of the vehicle that may vary between `lowest` and `highest` (SI)."""

    path: str
    lowest: float
    highest: float
    unit: str


@dataclass(frozen=True)
class Objective:
    """Objective: a key of the results, its sense ("minimise" or "maximise"), over mean, worst or p95 of the cases."""

    key: str
    sense: str
    over: str


@dataclass(frozen=True)
class Constraint:
    """Bound on a key of the results, in the key's own unit: relation ">=" or "<=", required of the worst case."""

    key: str
    relation: str
    bound: float
    text: str


@dataclass(frozen=True)
class Cases:
    """Cases on which every design is evaluated, with the field names of the study file.

    Speeds in m/s, scenarios as overrides in SI by path, radius and cant deficiency of the curve in m. The seed of a
    track's own spec is used if `has_default_seed`: the file leaves the seeds to the tracks.
    """

    track: tuple[str, ...]
    speed: tuple[float, ...]
    seed: tuple[int, ...]
    scenario: tuple[Mapping[str, Any], ...]
    draws: int
    radius: float
    cant_deficiency: float
    has_default_seed: bool = False


@dataclass(frozen=True)
class Method:
    """Search method, with the field names of the study file."""

    kind: str
    population: int
    generations: int
    seed: int


@dataclass(frozen=True)
class Study:
    """Checked study, all numbers in SI."""

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
        """Directory to which the paths of track files are relative."""
        return self.source.parent
