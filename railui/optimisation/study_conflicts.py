"""Entries of a study that repeat or contradict each other."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

from railui.io.problems import Findings
from railui.optimisation.study import Constraint, Objective


def check_repeated(entries: Mapping[str, Hashable], findings: Findings, remedy: str) -> None:
    """Add every entry that is equal to one before it to the findings; `entries` are by their key in the file."""
    first: dict[Hashable, str] = {}
    for key, entry in entries.items():
        if first.setdefault(entry, key) != key:
            findings.add(key, f"repeats {first[entry]}", remedy)


def check_seeds(raw: Any, findings: Findings) -> None:
    """Add seeds that occur twice: the same track would count twice."""
    seeds = raw if isinstance(raw, list) else []
    entries = {f"cases.seed.{i}": seed for i, seed in enumerate(seeds) if isinstance(seed, int | float)}
    check_repeated(entries, findings, "name each seed once: the same track would count twice")


def check_scenarios(scenarios: Mapping[str, Mapping[str, Any]], findings: Findings) -> None:
    """Add scenarios whose overrides, in SI, occur twice.

    The unchanged design, {}, may occur several times: the default gives it the weight of two scenarios.
    """
    entries = {key: _hashable(overrides) for key, overrides in scenarios.items() if overrides}
    check_repeated(entries, findings, "name each scenario once: it would count twice")


def _hashable(overrides: Mapping[str, Any]) -> Hashable:
    return frozenset((path, value if isinstance(value, Hashable) else repr(value)) for path, value in overrides.items())


def check_objectives_differ(objectives: Mapping[str, Objective], findings: Findings) -> None:
    """Add objectives of the same key over the same cases: one more says nothing, or the opposite."""
    entries = {key: (objective.key, objective.over) for key, objective in objectives.items()}
    check_repeated(entries, findings, "leave one of them out, or give it another `over`")


def check_constraints_agree(constraints: Mapping[str, Constraint], findings: Findings) -> None:
    """Add constraints that no design can satisfy together with one before: a lower bound above an upper one."""
    items = list(constraints.items())
    for i, (key, constraint) in enumerate(items):
        before = [(name, other) for name, other in items[:i] if _contradict(constraint, other)]
        if before:
            name, other = before[0]
            what = f"{constraint.text!r} contradicts {name}, {other.text!r}"
            findings.add(key, what, "leave a range between both bounds: no design can satisfy both")


def _contradict(one: Constraint, other: Constraint) -> bool:
    pair: Sequence[Constraint] = sorted((one, other), key=lambda constraint: constraint.relation)
    upper, lower = pair  # "<=" sorts before ">="
    return one.key == other.key and one.relation != other.relation and lower.bound > upper.bound
