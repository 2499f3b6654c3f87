"""The parts of a study: variables, objectives, constraints, tracks, the kind of search."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, nearest
from railui.io.units import UnitError, convert, split
from railui.optimisation.response_keys import NUMBERS, RESULTS
from railui.vehicle.design_reader import Design

CONSTRAINT = re.compile(r"\s*(\w+)\s*(>=|<=|>|<|==|=)?\s*(.*?)\s*\Z")
SPEC = re.compile(r"[\w-]+=\S+\Z")
ONE_AIM, MANY_AIMS = ("cmaes", "de"), ("nsga2", "nsga3")
MANY = 4  # aims from which on crowding tells little and reference directions serve better


@dataclass(frozen=True)
class Variable:
    """A number that may change, between lowest and highest (SI)."""

    path: str
    lowest: float
    highest: float
    unit: str


@dataclass(frozen=True)
class Objective:
    """An aim: the key, its sense ("minimise" or "maximise"), over mean, worst or p95 of the cases."""

    key: str
    sense: str
    over: str


@dataclass(frozen=True)
class Constraint:
    """A limit in the key's own unit: relation ">=" or "<=", held by the worst case."""

    key: str
    relation: str
    bound: float
    text: str


def read_variables(raw: Any, design: Design | None, findings: Findings) -> tuple[Variable, ...]:
    """The variables of a study, their ends in SI; what is no parameter of the design or no range goes to `findings`."""
    variables: list[Variable] = []
    if isinstance(raw, dict) and not raw:
        findings.add("variables", "is empty", "name a parameter and its range")
    for path, pair in (raw if isinstance(raw, dict) and design else {}).items():
        assert design is not None
        where = f"variables.{path}"
        if not isinstance(pair, list) or len(pair) != 2:
            continue
        try:
            unit = design.unit(path)
        except FileProblems as error:
            findings.add(where, error.problems[0].message, error.problems[0].remedy, key=True)
            continue
        ends = [_end(value, path, f"{where}.{i}", design, findings) for i, value in enumerate(pair)]
        if ends[0] is None or ends[1] is None:
            continue
        if ends[0] >= ends[1]:
            findings.add(where, "the range does not rise", "give [lowest, highest]")
        variables.append(Variable(path, ends[0], ends[1], unit))
    return tuple(variables)


def _end(value: Any, path: str, where: str, design: Design, findings: Findings) -> float | None:
    try:
        return design.with_values({path: value}).value(path)
    except FileProblems as error:
        findings.add(where, error.problems[0].message, error.problems[0].remedy)
        return None


def _key(name: str, where: str, findings: Findings) -> bool:
    if name in NUMBERS:
        return True
    if name in RESULTS:
        findings.add(where, f"{name} is a word, not a number", "aim at score, weighted_acceleration or flange_margin")
    else:
        findings.add(where, f"{name!r} is no result of ride, stability or curve", nearest(name, NUMBERS))
    return False


def read_objectives(raw: Any, findings: Findings) -> tuple[Objective, ...]:
    """The aims of a study; what is no single aim at a number of the results goes to `findings`."""
    objectives: list[Objective] = []
    if isinstance(raw, list) and not raw:
        findings.add("objectives", "is empty", "add {minimise: weighted_acceleration, over: mean}")
    for i, entry in enumerate(raw if isinstance(raw, list) else []):
        if not isinstance(entry, dict):
            continue
        senses = [sense for sense in ("minimise", "maximise") if entry.get(sense) is not None]
        if len(senses) != 1:
            findings.add(f"objectives.{i}", f"has {len(senses)} aims", "give one of minimise and maximise")
        elif _key(str(entry[senses[0]]), f"objectives.{i}.{senses[0]}", findings):
            objectives.append(Objective(str(entry[senses[0]]), senses[0], str(entry.get("over", "mean"))))
    return tuple(objectives)


def read_constraints(raw: Any, findings: Findings) -> tuple[Constraint, ...]:
    """The limits of a study, "linear_damping >= 0.05", bounds in the key's own unit; faults go to `findings`."""
    constraints: list[Constraint] = []
    for i, text in enumerate(raw if isinstance(raw, list) else []):
        where = f"constraints.{i}"
        match = CONSTRAINT.match(text) if isinstance(text, str) else None
        if match is None or match[2] not in (">=", "<=") or not match[3]:
            findings.add(where, f"{text!r} is no constraint", 'write "linear_damping >= 0.05" or "wear_number <= 200"')
        elif _key(match[1], where, findings):
            try:
                number, unit = split(match[3])
                bound = convert(number, unit, RESULTS[match[1]].unit) if unit else number
                constraints.append(Constraint(match[1], match[2], bound, text))
            except UnitError as error:
                findings.add(where, error.message, error.remedy)
    return tuple(constraints)


def check_tracks(raw: Any, home: Path, findings: Findings, check: Callable[[str], object] | None) -> None:
    """Tells tracks that are no file beside the study in `home` and no spec; `check` reads a spec, ValueError if not."""
    tracks = raw if isinstance(raw, list) else [] if raw is None else [raw]
    for i, text in enumerate(tracks):
        where = f"cases.track.{i}" if isinstance(raw, list) else "cases.track"
        if not isinstance(text, str):
            continue
        if re.search(r"\.csv(\.gz)?\Z", text):
            if not (home / text).is_file():
                findings.add(where, f"no file {text!r}", f"give a path relative to {home}")
            continue
        faulty = [part for part in text.split()[1:] if not SPEC.match(part)]
        if not text.split() or faulty:
            findings.add(where, f"{text!r} is no track", "write a name and key=value pairs: erri_b176_low length=2000")
        elif check is not None:
            try:
                check(text)
            except ValueError as error:
                findings.add(where, str(error), "")


def read_method(raw: Any, objectives: Sequence[Objective], variables: Sequence[Variable], findings: Findings) -> str:
    """The kind of search, by the number of aims where none is given; a kind that cannot serve them is a problem."""
    one = len(objectives) == 1
    fitting = ONE_AIM if one else MANY_AIMS
    kind = raw.get("kind") if isinstance(raw, dict) else None
    if kind is None:
        usual = fitting[0] if len(objectives) < MANY else "nsga3"
        return "de" if usual == "cmaes" and len(variables) == 1 else usual
    if (kind == "nsga3" and one) or (kind in ONE_AIM and not one):
        findings.add("method.kind", f"{kind} cannot search {len(objectives)} aims", f"write {' or '.join(fitting)}")
    elif kind == "cmaes" and len(variables) == 1:
        findings.add("method.kind", "cmaes needs two variables or more", "write de")
    return str(kind)
