"""Scenarios of a study: operating conditions of wheels and rails, as overrides of the design."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import product
from typing import Any, Final

from railui.io.problems import FileProblems, Findings
from railui.io.units import UnitError, quantity
from railui.optimisation.study_conflicts import check_scenarios
from railui.vehicle.design import Design
from railui.vehicle.effects import PlacedEffect

# key that only scenarios know: it limits the creep forces also of designs that declare no friction
FRICTION_PATH: Final = "contact.friction"
SATURATION_KIND: Final = "creep_saturation"
CONICITIES: Final = (0.1, None, 0.4)  # new wheels, as in the design, worn wheels
FRICTIONS: Final = (0.2, 0.4)  # wet rails, dry rails
CONICITY_PATHS: Final = ("contact.leading.conicity", "contact.trailing.conicity")


def default_scenarios(design: Design | None, varied: Collection[str] = ()) -> list[dict[str, float]]:
    """Return the scenarios of a study that declares none: new and worn wheels on wet and dry rails, the design twice.

    A conicity or friction among the paths `varied` by the study keeps the value of the design, and so does the
    friction where the conicity is that of the design.
    """
    if design is None or design.kind == "rig":
        return [{}]
    varies_conicity = bool(set(CONICITY_PATHS) & set(varied))
    has_conicity = set(design.paths()).issuperset(CONICITY_PATHS)
    conicities = CONICITIES if has_conicity and not varies_conicity else (None,)
    frictions = FRICTIONS if not set(friction_paths(design)) & set(varied) else (None,)
    return [_scenario(conicity, friction) for conicity, friction in product(conicities, frictions)]


def _scenario(conicity: float | None, friction: float | None) -> dict[str, float]:
    if conicity is None:  # the design as it is, friction included
        return {}
    overrides = dict.fromkeys(CONICITY_PATHS, conicity)
    return overrides if friction is None else overrides | {FRICTION_PATH: friction}


def apply_scenario(design: Design, overrides: Mapping[str, Any]) -> Design:
    """Return the design with the values of a scenario.

    `contact.friction` sets the friction of the design's creep_saturation, which is added if the design has none.
    Raises FileProblems for a faulty value.
    """
    values = {path: value for path, value in overrides.items() if path != FRICTION_PATH}
    if FRICTION_PATH not in overrides:
        return design.with_values(values) if values else design
    friction = _read_friction(overrides[FRICTION_PATH])
    if not friction_paths(design):
        saturation = PlacedEffect(SATURATION_KIND, "contact", None, {"friction": friction})
        design = design.with_effects([*design.effects, saturation])
    return design.with_values(values | dict.fromkeys(friction_paths(design), friction))


def friction_paths(design: Design) -> list[str]:
    """Return the paths of the numbers that `contact.friction` of a scenario sets."""
    return [f"effects.{i}.friction" for i, effect in enumerate(design.effects) if effect.kind == SATURATION_KIND]


def _read_friction(value: Any) -> float:
    findings = Findings(FRICTION_PATH)
    try:
        friction = quantity(value, "1")
        if friction > 0:
            return friction
        findings.add(FRICTION_PATH, f"{value!r} is no friction", "give more than 0, such as 0.3")
    except UnitError as error:
        findings.add(FRICTION_PATH, error.message, error.remedy)
    raise FileProblems(findings.problems)


def read_scenarios(raw: Any, design: Design | None, findings: Findings) -> tuple[Mapping[str, Any], ...]:
    """Read scenarios as overrides in SI by path; add faults to the findings."""
    entries = [{}] if raw is None else raw if isinstance(raw, list) else [raw]
    scenarios: dict[str, Mapping[str, Any]] = {}
    for i, entry in enumerate(entries):
        overrides = {} if entry is None else entry
        if design is None or not isinstance(overrides, dict):
            continue
        key = f"cases.scenario.{i}" if isinstance(raw, list) else "cases.scenario"
        try:
            changed = apply_scenario(design, overrides)
            numeric = set(changed.paths())
            scenarios[key] = {path: _si_value(changed, path, value, numeric) for path, value in overrides.items()}
        except FileProblems as error:
            for problem in error.problems:
                findings.add(f"{key}.{problem.key}", problem.message, problem.remedy)
    check_scenarios(scenarios, findings)
    return tuple(scenarios.values())


def _si_value(changed: Design, path: str, value: Any, numeric: Collection[str]) -> Any:
    if path == FRICTION_PATH:
        return _read_friction(value)
    return changed.value(path) if path in numeric else value
