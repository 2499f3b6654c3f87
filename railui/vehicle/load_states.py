"""Load states: values that change between tare and laden."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError

if TYPE_CHECKING:
    from railui.vehicle.design import Design

STATE_PATH = "load.state"


def read_load_states(raw: Any, design: Design, findings: Findings) -> Design:
    """Return the design with its load states, in the one that `load.state` names; problems join `findings`."""
    if raw is None:
        return design
    if not isinstance(raw, dict):
        findings.add("load", "must be a group of keys", "write `laden: {path: value}` lines below it")
        return design
    changes_by_state: dict[str, Mapping[str, float]] = {}
    for name, changes in raw.items():
        if name == "state":
            continue
        if not isinstance(changes, dict):
            findings.add(f"load.{name}", "is not a group of paths and values", "write {vehicle.bodies.body.mass: 40 t}")
            continue
        changes_by_state[name] = _read_changes(name, changes, design, findings)
    design = replace(design, load_states=changes_by_state, unloaded_values=design.values)
    state = raw.get("state")
    if state is None:
        return design
    if state not in changes_by_state:
        findings.add(STATE_PATH, f"no load state {state!r}", suggest_name(str(state), changes_by_state))
        return design
    return design if findings.errors() else design.with_values({STATE_PATH: state})


def _read_changes(name: str, changes: Mapping[str, Any], design: Design, findings: Findings) -> dict[str, float]:
    values = {}
    for path, value in changes.items():
        where = f"load.{name}.{path}"
        if path not in design.values:
            findings.add(where, f"no such parameter {path!r}", suggest_name(path, design.values), key=True)
            continue
        try:
            values[path] = design.parameter(path).read(value)
        except UnitError as error:
            findings.add(where, error.message, error.remedy)
    return values


def changed_paths(design: Design) -> set[str]:
    """Return the paths of the numbers that some load state changes."""
    return {path for changes in design.load_states.values() for path in changes}


def values_in_load_state(design: Design, state: str) -> dict[str, float]:
    """Return the values in a load state; UnitError if it is unknown.

    Values that only the previous state changed return to their unloaded values.
    """
    if state not in design.load_states:
        remedy = suggest_name(state, design.load_states) if design.load_states else "add a `load:` block to the design"
        raise UnitError(f"no load state {state!r}", remedy)
    unloaded = {path: design.unloaded_values.get(path, design.values[path]) for path in changed_paths(design)}
    return {**design.values, **unloaded, **design.load_states[state]}
