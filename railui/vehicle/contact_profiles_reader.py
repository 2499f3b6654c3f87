"""Reading `contact.profiles` of a design, and filling in the contact parameters that follow from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from railui.io.fields import check_group
from railui.io.problems import FileProblems, Findings
from railui.vehicle.contact_profiles import (
    GROUP,
    GROUP_KEYS,
    PARAMETERS_BY_KEY,
    SHAPE_KIND,
    SHARED_KEYS,
    ContactGroup,
    ContactProfiles,
    UndefinedContactError,
)
from railui.vehicle.multibody import Structure
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT
from railui.vehicle.profiles_schema import GroupProfilesModel, ProfilesModel

HALF_GAUGE_TOLERANCE = 0.02  # relative deviation of the model's half gauge from that of the profiles
# stand-ins for the numbers that follow from the profiles, until they are computed
PLACEHOLDERS = {p.key: 1.0 for p in WHEELSET_CONTACT}
WHEELS = "wheel"
BOGIE = (("leading", 1), ("trailing", 2))


@dataclass(frozen=True)
class DeclaredProfiles:
    """`contact.profiles` of a file as validated: words, files and numbers by path, and the parameters left to them."""

    words: Mapping[str, Any]
    group_wheels: Mapping[str, tuple[str, str]]
    numbers: Mapping[str, float]
    derived: frozenset[str]
    groups: tuple[str, ...]
    has_given_table: bool


def declare_profiles(
    data: dict[str, Any], findings: Findings, form: str
) -> tuple[dict[str, Any], DeclaredProfiles | None]:
    """Validate the profiles of a design, and fill in stand-ins for the contact parameters that it leaves to them.

    Returns
    -------
    dict
        The design file's data without its profiles.
    DeclaredProfiles or None
        None for a design without profiles, or with faulty ones.
    """
    contact = data.get("contact")
    if not isinstance(contact, dict) or contact.get("profiles") is None:
        return data, None
    own = {key: value for key, value in contact.items() if key != "profiles"}
    groups = _groups_to_fill(own, form)
    derived = {
        f"contact.{name}.{p.key}" for name, group in groups.items() for p in WHEELSET_CONTACT if p.key not in group
    }
    derived |= {f"contact.{key}" for key in SHARED_KEYS if key not in own}
    filled = {**data, "contact": own | {name: PLACEHOLDERS | group for name, group in groups.items()}}
    declared = _validate(contact["profiles"], [name for name, _ in BOGIE] if form == "bogie" else [*groups], findings)
    if declared is None:
        return filled, None
    kinds = (
        [e.get("kind") for e in data["effects"] if isinstance(e, dict)] if isinstance(data.get("effects"), list) else []
    )
    return filled, replace(declared, derived=frozenset(derived), has_given_table=SHAPE_KIND in kinds)


def _validate(raw: Any, groups: list[str], findings: Findings) -> DeclaredProfiles | None:
    """Validate the group `contact.profiles`, with its groups of wheelsets."""
    of_groups = {key: raw[key] for key in groups if key in raw} if isinstance(raw, dict) else {}
    common = {key: value for key, value in raw.items() if key not in of_groups} if isinstance(raw, dict) else raw
    model = check_group(ProfilesModel, common, findings, GROUP, extra=[f"{GROUP}.{group}" for group in groups])
    models = {
        key: check_group(GroupProfilesModel, value, findings, f"{GROUP}.{key}") for key, value in of_groups.items()
    }
    if model is None or None in models.values():
        return None
    words = model.model_dump()
    numbers = {f"{GROUP}.{key}": words[key] for key in PARAMETERS_BY_KEY}
    wheels: dict[str, tuple[str, str]] = {}
    for group, one in models.items():
        own = {key: x for key, x in one.model_dump().items() if x is not None} if one is not None else {}
        numbers |= {f"{GROUP}.{group}.{key}": own[key] for key in GROUP_KEYS if key in own}
        wheels |= {group: own[WHEELS]} if WHEELS in own else {}
    return DeclaredProfiles(words, wheels, numbers, frozenset(), tuple(groups), False)


def _groups_to_fill(contact: Mapping[str, Any], form: str) -> dict[str, dict[str, Any]]:
    """Return the contact groups to fill by name: those in the file and those that are required."""
    common = {p.key for p in CONTACT if p.path.count(".") == 1} | {"gauge_widens_clearance"}
    given = {k: dict(v) for k, v in contact.items() if k not in common and isinstance(v, dict)}
    if form == "bogie":
        return {name: given.get(name, {}) for name, _ in BOGIE if contact.get(name) is None or name in given}
    return given or {"wheels": {}}


def apply_profiles(
    declared: DeclaredProfiles,
    values: dict[str, float],
    structure: Structure | None,
    directory: Path | None,
    findings: Findings,
) -> tuple[ContactProfiles | None, tuple[dict[str, Any], ...]]:
    """Add the numbers of the profiles and the contact parameters that follow from them to the values of a design.

    Returns
    -------
    ContactProfiles or None
        None if the values lack what the profiles need, which the reader of the design reports.
    tuple of dict
        Entries of the effect profile_shape that follow from the profiles.
    """
    groups = _contact_groups(declared.groups, structure)
    if any(path not in values for site in groups.values() for path in (site.radius, site.wheel_load)) or not groups:
        return None, ()
    base = (directory or Path()).resolve()
    values |= declared.numbers
    wheels = {group: declared.group_wheels.get(group, declared.words["wheel"]) for group in groups}
    profiles = ContactProfiles(
        wheels={group: _paths(base, names) for group, names in wheels.items()},
        rails=_paths(base, declared.words["rail"]),
        mirror_rail=declared.words["mirror_rail"],
        use=declared.words["use"],
        groups=groups,
        derived=declared.derived,
        has_given_table=declared.has_given_table,
    )
    is_whole = not profiles.has_derived_table and all(path.count(".") == 1 for path in declared.derived)
    try:
        stamps = tuple(stamp for one in profiles.inputs(values).values() for stamp in one.pair.stamps())
        following = profiles.follow(values)
    except (OSError, ValueError) as fault:
        report_fault(fault, findings, only_warn=is_whole and isinstance(fault, OSError))
        return profiles, ()
    values |= following.values
    for note in following.warnings:
        findings.warn(GROUP, note)
    _check_half_gauge(profiles, values, findings)
    return replace(profiles, sha256=stamps), following.shapes


def _paths(base: Path, names: tuple[str, str]) -> tuple[Path, Path]:
    return (base / names[0]).resolve(), (base / names[1]).resolve()


def _contact_groups(names: tuple[str, ...], structure: Structure | None) -> dict[str, ContactGroup]:
    """Return the wheelsets of each contact group; a group without wheelsets has the numbers of the first wheelset."""
    if structure is None:
        return {name: ContactGroup("vehicle.geometry.rolling_radius", "vehicle.wheel_load", (i,)) for name, i in BOGIE}
    groups = {}
    for name in names:
        members = [w for w in structure.wheelsets if structure.contact_of(w) == name]
        part = (members or structure.wheelsets)[0].part if structure.wheelsets else None
        if part is not None:
            radius, load = (part.number_path(key) for key in ("rolling_radius", "wheel_load"))
            groups[name] = ContactGroup(radius, load, tuple(w.number for w in members))
    return groups


def report_fault(fault: Exception, findings: Findings, *, where: str = GROUP, only_warn: bool = False) -> None:
    """Add the fault of profiles to the findings."""
    from railui.contact.profile import ProfileError

    if isinstance(fault, FileProblems):
        findings.problems += fault.problems
    elif isinstance(fault, OSError):
        message = f"{fault.filename} cannot be read ({fault.strerror})"
        if only_warn:
            findings.warn(where, message, "the numbers of the file are used without it")
        else:
            findings.add(where, message, "give the path from the design's directory")
    elif isinstance(fault, ProfileError):
        findings.add(where, fault.message, fault.remedy)
    elif isinstance(fault, UndefinedContactError):
        findings.add(where, str(fault), "give it in the design, or write another sd")
    else:
        findings.add(where, str(fault), "write `use: linearised`, or another sd")


def _check_half_gauge(profiles: ContactProfiles, values: Mapping[str, float], findings: Findings) -> None:
    """Warn if the rolling circles of a bogie differ from those of the profiles."""
    path = "vehicle.geometry.half_gauge"
    half = profiles.geometry(values).pair.half_distance
    if path in values and abs(values[path] / half - 1.0) > HALF_GAUGE_TOLERANCE:
        message = f"is {values[path]:.4g} m, the tape lines of the profiles lie {half:.4g} m from the middle"
        findings.warn(path, message, "check it against back_to_back")
