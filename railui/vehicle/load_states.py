"""States of loading: what changes of a vehicle between tare and laden."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from railui.io.problems import Findings, nearest
from railui.io.units import UnitError

if TYPE_CHECKING:
    from railui.vehicle.design import Design

STATE = "load.state"


def read_loads(raw: Any, design: Design, findings: Findings) -> Design:
    """The design with its states of loading, in the one that `load.state` names; faults go to `findings`."""
    if raw is None:
        return design
    if not isinstance(raw, dict):
        findings.add("load", "stands where a group of keys belongs", "write `laden: {path: value}` lines below it")
        return design
    loads: dict[str, Mapping[str, float]] = {}
    for name, changes in raw.items():
        if name == "state":
            continue
        if not isinstance(changes, dict):
            findings.add(f"load.{name}", "is no group of paths and values", "write {vehicle.bodies.body.mass: 40 t}")
            continue
        loads[name] = _changes(name, changes, design, findings)
    design = replace(design, loads=loads, declared=design.values)
    state = raw.get("state")
    if state is None:
        return design
    if state not in loads:
        findings.add(STATE, f"no state of loading {state!r}", nearest(str(state), loads))
        return design
    return design if findings.errors() else design.with_values({STATE: state})


def _changes(name: str, changes: Mapping[str, Any], design: Design, findings: Findings) -> dict[str, float]:
    found = {}
    for path, value in changes.items():
        where = f"load.{name}.{path}"
        if path not in design.values:
            findings.add(where, f"no such parameter {path!r}", nearest(path, design.values), key=True)
            continue
        try:
            found[path] = design.parameter(path).read(value)
        except UnitError as error:
            findings.add(where, error.message, error.remedy)
    return found


def loaded(design: Design, state: str) -> dict[str, float]:
    """The values in another state: what the one before changed is as declared again; UnitError for an unknown one."""
    if state not in design.loads:
        known = nearest(state, design.loads) if design.loads else "add a `load:` block to the design"
        raise UnitError(f"no state of loading {state!r}", known)
    touched = {path for changes in design.loads.values() for path in changes}
    declared = {path: design.declared.get(path, design.values[path]) for path in touched}
    return {**design.values, **declared, **design.loads[state]}
