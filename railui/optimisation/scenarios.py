"""The scenarios of a study: wheels and rails as they may be, beside the vehicle as it is."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import product
from typing import Any

from railui.io.problems import FileProblems, Findings
from railui.io.units import UnitError, quantity
from railui.vehicle.design_reader import Design
from railui.vehicle.effects import PlacedEffect

FRICTION = "contact.friction"  # a word of scenarios: limits the creep forces of vehicles that leave friction open too
SATURATION = "creep_saturation"
CONICITIES = (0.1, None, 0.4)  # new wheels, as is, worn ones
FRICTIONS = (0.2, 0.4)  # wet rails, dry ones
CONICITY = ("contact.leading.conicity", "contact.trailing.conicity")


def usual_scenarios(design: Design | None, varied: Collection[str] = ()) -> list[dict[str, float]]:
    """What is on where a study says nothing: low, own and high conicity, each on wet and on dry rails.

    What the study varies itself is left as it is.
    """
    if design is None or design.kind == "rig":
        return [{}]
    paths = set(design.paths())
    conicities = CONICITIES if paths.issuperset(CONICITY) and not set(CONICITY) & set(varied) else (None,)
    frictions = FRICTIONS if not set(_frictions(design)) & set(varied) else (None,)
    return [
        {} if conicity is None else dict.fromkeys(CONICITY, conicity)
        | ({} if friction is None else {FRICTION: friction})
        for conicity, friction in product(conicities, frictions)
    ]  # fmt: skip


def in_scenario(design: Design, changes: Mapping[str, Any]) -> Design:
    """A design with the values of a scenario; FileProblems where one of them is no value.

    contact.friction stands for the friction of the design's creep_saturation, which is added where it has none.
    """
    given = {path: value for path, value in changes.items() if path != FRICTION}
    if FRICTION not in changes:
        return design.with_values(given) if given else design
    friction = _friction(changes[FRICTION])
    if not _frictions(design):
        design = design.with_effects(
            [*design.effects, PlacedEffect(SATURATION, "contact", None, {"friction": friction})]
        )
    return design.with_values(given | dict.fromkeys(_frictions(design), friction))


def _frictions(design: Design) -> list[str]:
    """Paths of the friction in the design's own creep_saturation."""
    return [f"effects.{i}.friction" for i, effect in enumerate(design.effects) if effect.kind == SATURATION]


def _friction(value: Any) -> float:
    findings = Findings(FRICTION)
    try:
        friction = quantity(value, "1")
        if friction > 0:
            return friction
        findings.add(FRICTION, f"{value!r} is no friction", "give more than 0, such as 0.3")
    except UnitError as error:
        findings.add(FRICTION, error.message, error.remedy)
    raise FileProblems(findings.problems)


def read_scenarios(raw: Any, design: Design | None, findings: Findings) -> tuple[Mapping[str, Any], ...]:
    """Scenarios as overrides in SI by path."""
    entries = [{}] if raw is None else raw if isinstance(raw, list) else [raw]
    scenarios: list[Mapping[str, Any]] = []
    for i, entry in enumerate(entries):
        changes = {} if entry is None else entry
        if design is None or not isinstance(changes, dict):
            continue
        where = f"cases.scenario.{i}" if isinstance(raw, list) else "cases.scenario"
        try:
            changed = in_scenario(design, changes)
            numbers = set(changed.paths())
            scenarios.append({path: _told(changed, path, value, numbers) for path, value in changes.items()})
        except FileProblems as error:
            for told in error.problems:
                findings.add(f"{where}.{told.key}", told.message, told.remedy)
    return tuple(scenarios)


def _told(changed: Design, path: str, value: Any, numbers: Collection[str]) -> Any:
    if path == FRICTION:
        return _friction(value)
    return changed.value(path) if path in numbers else value
