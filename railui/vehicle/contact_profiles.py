"""Measured wheel and rail profiles of a design: contact parameters and the smooth table that follow from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from railui.contact.profile_reader import read_inclination, read_profile
from railui.io.atomic import relative_path, sha256_file
from railui.io.fields import (
    Group,
    Switch,
    Text,
    ValueReader,
    check_group,
    choice_reader,
    quantity_reader,
    quantity_schema,
)
from railui.io.problems import FileProblems, Findings
from railui.io.units import UnitError, quantity
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT

if TYPE_CHECKING:
    from railui.contact.geometry import ContactGeometry

USES = ("table", "linearised")
SHAPE_KIND = "profile_shape"
HALF_GAUGE_TOLERANCE = 0.02  # relative deviation of the model's half gauge from that of the profiles
SHARED_KEYS = ("spin_creep", "flange_clearance")
# stand-ins for the numbers of faulty profiles, so that the fault of the profile is the only one reported
PLACEHOLDERS = {p.key: 1.0 for p in WHEELSET_CONTACT}
Length = Annotated[float, quantity_reader("m", 0.0, above=True)]
Inclination = Annotated[float, ValueReader(read_inclination, quantity_schema("rad", description="1:40, or an angle"))]


class ProfilesModel(Group):
    """`contact.profiles` of a design: the pair of profiles, their position and their use."""

    wheel: Text
    rail: Text
    gauge: Length = 1.435
    back_to_back: Length = 1.360
    inclination: Inclination = 0.0
    diameter_difference: Annotated[float, quantity_reader("m", -0.1, maximum=0.1)] = 0.0
    mirror_rail: Switch = False
    smoothing: Annotated[float, quantity_reader("m", 0.0, maximum=0.03)] = 0.0
    sd: Annotated[float, quantity_reader("m", 2.5e-4, maximum=0.01)] = 2e-3
    surface: Annotated[float, quantity_reader("1", 0.05, maximum=1.5)] = 0.6
    use: Annotated[str, choice_reader(USES)] = USES[0]


@dataclass(frozen=True)
class ContactProfiles:
    """Wheel and rail profile of a design.

    Attributes
    ----------
    wheel, rail : Path
    settings : mapping
        Values of `ProfilesModel`, SI.
    radius : float
        Rolling radius of the vehicle [m].
    wheel_load : float
        Load of one wheel [N].
    sha256 : (str, str) or None
        Hashes of both files; None if a file is missing, so that only the numbers in the design are used.
    """

    wheel: Path
    rail: Path
    settings: Mapping[str, Any]
    radius: float
    wheel_load: float
    sha256: tuple[str, str] | None

    def geometry(self) -> ContactGeometry:
        """Return the rigid contact geometry of the pair.

        Raises
        ------
        FileProblems, ProfileFault
            If a file cannot be read or the profiles do not touch.
        """
        words = {k: v for k, v in self.settings.items() if k not in ("wheel", "rail", "sd", "surface", "use")}
        stamp = sha256_file(self.wheel), sha256_file(self.rail)
        return _cached_geometry(self.wheel, self.rail, stamp, self.radius, **words)

    def contact_parameters(self, deviation: float | None = None) -> tuple[dict[str, float], list[str]]:
        """Return the contact parameters of the pair by key, and warnings.

        Keys of quantities that the pair does not have are absent.

        Parameters
        ----------
        deviation : float, optional
            Standard deviation of e over which the geometry is linearised [m]; that of the design by default.
        """
        from railui.contact.creep import creep_coefficients
        from railui.contact.linearisation import linearise

        contacts = self.geometry()
        centre = contacts.centre
        warnings = (
            [f"has its centre at {centre * 1e3:.2f} mm"]
            if abs(centre) > 2e-4 and self.settings["use"] != "table"
            else []
        )
        linear = linearise(contacts, deviation or self.settings["sd"], centre)
        keys = ("conicity", "gravitational_stiffness", "contact_angle", "roll")
        parameters = {key: value for key in keys if (value := getattr(linear, key)) == value}
        ends = [abs(x) for x in contacts.flange_displacements if x is not None]
        if ends:
            parameters["flange_clearance"] = sum(ends) / len(ends)
        try:
            creep = creep_coefficients(contacts, self.wheel_load, centre, self.settings["surface"])
        except ValueError as fault:
            return parameters, [*warnings, f"gives no creep coefficients: {fault}"]
        return parameters | {
            k: getattr(creep, k) for k in ("longitudinal_creep", "lateral_creep", "spin_creep")
        }, warnings

    def shape_effect(self) -> dict[str, Any]:
        """Return the pair as the effect profile_shape; raise ValueError if its conicity is zero."""
        from railui.contact.linearisation import linearise
        from railui.contact.profile_shape import compute_profile_shape

        contacts = self.geometry()
        linear = linearise(contacts, self.settings["sd"], contacts.centre)
        return {"kind": SHAPE_KIND, "at": "contact", **compute_profile_shape(contacts, linear).parameters()}

    def entry(self, directory: Path | None, kinds: Iterable[str]) -> dict[str, Any]:
        """Return the keys of `contact.profiles` for a design file.

        Parameters
        ----------
        directory : Path or None
            Directory of the design file; None for absolute paths.
        kinds : iterable of str
            Kinds of the design's effects; `use` is table if they include profile_shape.
        """
        standard = ProfilesModel(wheel="", rail="")
        settings = {
            k: v for k, v in self.settings.items() if v != getattr(standard, k) or k in ("gauge", "back_to_back")
        }
        return settings | self.files(directory) | {"use": USES[0] if SHAPE_KIND in kinds else USES[1]}

    def files(self, directory: Path | None) -> dict[str, str]:
        """Return the paths of both files relative to a directory, or absolute for None."""
        paths = {"wheel": self.wheel, "rail": self.rail}
        return {
            key: path.as_posix() if directory is None else relative_path(path, directory) for key, path in paths.items()
        }


def fill_from_profiles(
    data: dict[str, Any], findings: Findings, directory: Path | None, form: str
) -> tuple[dict[str, Any], ContactProfiles | None]:
    """Fill absent contact parameters of a design from its profiles.

    Values in the file take precedence: a calibrated conicity scales the table.

    Returns
    -------
    dict
        The design file's data, completed.
    ContactProfiles or None
        None for a design without profiles.
    """
    contact = data.get("contact")
    if not isinstance(contact, dict) or contact.get("profiles") is None:
        return data, None
    own_contact = {key: value for key, value in contact.items() if key != "profiles"}
    groups = _groups_to_fill(own_contact, form)
    model = check_group(ProfilesModel, contact["profiles"], findings, "contact.profiles")
    vehicle = _radius_and_load(data, form)
    if model is None or vehicle is None:
        return _merge(data, own_contact, groups, PLACEHOLDERS), None
    base = (directory or Path()).resolve()
    wheel, rail = ((base / name).resolve() for name in (model.wheel, model.rail))
    profiles = ContactProfiles(wheel, rail, model.model_dump(), *vehicle, None)
    wanted = model.use == "table" and SHAPE_KIND not in _effect_kinds(data)
    try:
        profiles = replace(profiles, sha256=(sha256_file(wheel), sha256_file(rail)))
        numbers, warnings = profiles.contact_parameters()
        table = [profiles.shape_effect()] if wanted else []
    except (OSError, ValueError) as fault:
        whole = not wanted and all(p.key in group for group in groups.values() for p in WHEELSET_CONTACT)
        _report_fault(fault, findings, only_warn=whole and isinstance(fault, OSError))
        return _merge(data, own_contact, groups, {} if whole else PLACEHOLDERS), profiles
    for note in warnings:
        findings.warn("contact.profiles", note)
    _check_half_gauge(data, form, model, findings)
    return _merge(data, own_contact, groups, numbers, table), profiles


def _merge(
    data: Mapping[str, Any],
    contact: dict[str, Any],
    groups: Mapping[str, dict[str, Any]],
    numbers: Mapping[str, float],
    table: Sequence[dict[str, Any]] = (),
) -> dict[str, Any]:
    """Add contact numbers that the design lacks, and append the table to its effects."""
    group_numbers = {key: value for key, value in numbers.items() if key not in SHARED_KEYS}
    shared = {key: numbers[key] for key in SHARED_KEYS if key in numbers}
    filled = shared | contact | {name: group_numbers | group for name, group in groups.items()}
    given = data.get("effects") or []
    effects = {"effects": [*given, *table]} if table and isinstance(given, list) else {}
    return {**data, "contact": filled, **effects}


def _effect_kinds(data: Mapping[str, Any]) -> list[Any]:
    effects = data.get("effects")
    return [e.get("kind") for e in effects if isinstance(e, dict)] if isinstance(effects, list) else []


def _report_fault(fault: Exception, findings: Findings, *, only_warn: bool) -> None:
    from railui.contact.profile import ProfileError

    where = "contact.profiles"
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
    else:
        findings.add(where, str(fault), "write `use: linearised`, or another sd")


def _groups_to_fill(contact: Mapping[str, Any], form: str) -> dict[str, dict[str, Any]]:
    """Return the contact groups to fill by name: those in the file and those that are required."""
    common = {p.key for p in CONTACT if p.path.count(".") == 1} | {"gauge_widens_clearance"}
    given = {k: dict(v) for k, v in contact.items() if k not in common and isinstance(v, dict)}
    needed = ("leading", "trailing") if form == "bogie" else () if given else ("wheels",)
    return {name: {} for name in needed if contact.get(name) is None} | given


def _radius_and_load(data: Mapping[str, Any], form: str) -> tuple[float, float] | None:
    """Return rolling radius [m] and wheel load [N]; None if absent (the design's reader reports it)."""
    vehicle = data.get("vehicle")
    try:
        if form == "bogie":
            geometry, load = vehicle["geometry"], vehicle["wheel_load"]  # type: ignore[index]
        else:
            elements = vehicle["elements"].values()  # type: ignore[index]
            geometry = next(e for e in elements if e.get("kind") == "wheelset")
            load = geometry["wheel_load"]
        return quantity(geometry["rolling_radius"], "m"), quantity(load, "N")
    except (KeyError, TypeError, AttributeError, StopIteration, UnitError):
        return None


def _check_half_gauge(data: Mapping[str, Any], form: str, model: ProfilesModel, findings: Findings) -> None:
    """Warn if the rolling circles of the model differ from those of the profiles."""
    if form != "bogie":
        return
    half = 0.5 * model.back_to_back + 0.07
    try:
        given = quantity(data["vehicle"]["geometry"].get("half_gauge", 0.75), "m")
    except (KeyError, TypeError, AttributeError, UnitError):
        return
    if abs(given / half - 1.0) > HALF_GAUGE_TOLERANCE:
        message = f"is {given:.4g} m, the tape lines of the profiles lie {half:.4g} m from the middle"
        findings.warn("vehicle.geometry.half_gauge", message, "check it against back_to_back")


@lru_cache(maxsize=8)
def _cached_geometry(
    wheel: Path,
    rail: Path,
    stamp: tuple[str, str],
    radius: float,
    *,
    gauge: float,
    back_to_back: float,
    inclination: float,
    diameter_difference: float,
    mirror_rail: bool,
    smoothing: float,
) -> ContactGeometry:
    """Compute the contact geometry of two files with the hashes `stamp`; cached, since it takes about 0.1 s."""
    from railui.contact.contact_points import find_contacts
    from railui.contact.wheelset_on_track import WheelRailPair

    sides = (
        read_profile(wheel, "wheel", smoothing=smoothing),
        read_profile(rail, "rail", mirror=mirror_rail, smoothing=smoothing),
    )
    return find_contacts(WheelRailPair(*sides, gauge, back_to_back, inclination, radius, diameter_difference))
