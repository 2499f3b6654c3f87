"""Contact parameters and tables that follow the profiles when numbers of a design change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError
from railui.vehicle.contact_profiles import GROUP, SHAPE_KIND, USE_PATH, USES, ContactProfiles
from railui.vehicle.contact_profiles_reader import report_fault

if TYPE_CHECKING:
    from railui.vehicle.design import Design

Entries = list[dict[str, Any]]


def parse_use(value: Any) -> str:
    """Return the use of profiles; UnitError if it is none."""
    if value not in USES:
        raise UnitError(f"{value!r} is not known here", suggest_name(str(value), USES))
    return str(value)


def follow_profiles(
    before: Design, changed: Design, changes: Mapping[str, Any], entries: Entries, findings: Findings
) -> tuple[Design, Entries]:
    """Compute what follows from the profiles of a design with changed values.

    Parameters
    ----------
    before, changed : Design
        The design, and the same with changed values.
    changes : mapping
        Changes by path. A contact parameter among them is given from now on, as in a file.
    entries : list of dict
        Entries of the effects of the changed design.
    findings : Findings
        Faults of the profiles join these.

    Returns
    -------
    Design
        With all contact parameters.
    list of dict
        Entries of its effects.
    """
    given = before.profiles
    assert given is not None
    use = str(changes[USE_PATH]) if changes.get(USE_PATH) in USES else _present_use(given, entries)
    profiles = replace(given, derived=given.derived - set(changes), use=use)
    changed = replace(changed, profiles=profiles)
    if not given.is_followed and not profiles.is_followed:
        _refuse(changes, findings)
    is_unchanged = use == given.use and _inputs(profiles, changed) == _inputs(profiles, before)
    if findings.errors() or (is_unchanged and changed.load_state == before.load_state):
        return changed, entries
    of_state = changed.load_states.get(changed.load_state or "", {})
    try:
        following = replace(profiles, derived=profiles.derived - set(of_state)).follow(changed.values)
    except (OSError, ValueError) as fault:
        report_fault(fault, findings, where=_first_input(profiles, changes))
        return changed, entries
    if not profiles.has_given_table:
        entries = [entry for entry in entries if entry["kind"] != SHAPE_KIND] + list(following.shapes)
    return replace(changed, values={**changed.values, **following.values}), entries


def _inputs(profiles: ContactProfiles, design: Design) -> tuple[Any, ...]:
    """Return everything that contact parameters and tables follow, with the paths that have a value of their own."""
    return profiles.inputs(design.values), profiles.input_paths() & set(design.values)


def _present_use(profiles: ContactProfiles, entries: Entries) -> str:
    """Return the use of profiles; linearised if their table was removed from the effects."""
    is_removed = profiles.has_derived_table and all(entry["kind"] != SHAPE_KIND for entry in entries)
    return USES[1] if is_removed else profiles.use


def _refuse(changes: Iterable[str], findings: Findings) -> None:
    """Refuse changes of the profiles of a design that gives all contact parameters itself."""
    for path in changes:
        if path.startswith(f"{GROUP}."):
            findings.add(
                path,
                "changes nothing: the design gives all contact parameters itself",
                "leave those out that the profiles shall give",
            )


def _first_input(profiles: ContactProfiles, changes: Iterable[str]) -> str:
    inputs = profiles.input_paths()
    return next((path for path in changes if path in inputs), GROUP)
