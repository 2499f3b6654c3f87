"""Measured profiles in a design: what they give to its contact, as numbers and as a smooth table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from railui.contact.profile_reader import read_inclination, read_profile
from railui.io.atomic import relative_path, sha256_file
from railui.io.fields import Group, Reader, Switch, Text, check_group, measure, quantity_schema, word
from railui.io.problems import FileProblems, Findings
from railui.io.units import UnitError, quantity
from railui.vehicle.parameters import CONTACT, WHEELSET_CONTACT

if TYPE_CHECKING:
    from railui.contact.geometry import Contacts

USES = ("table", "linearised")
SHAPE = "profile_shape"
WIDER = 0.02  # share by which the half gauge of the model may differ from that of the profiles
SHARED = ("spin_creep", "flange_clearance")
# where the profiles are at fault: that is told, not that numbers are missing
UNKNOWN = {p.key: 1.0 for p in WHEELSET_CONTACT}
Length = Annotated[float, measure("m", 0.0, above=True)]
Inclination = Annotated[float, Reader(read_inclination, quantity_schema("rad", description="1:40, or an angle"))]


class ProfilesModel(Group):
    """`contact.profiles` of a design: the pair, how it stands, and how it is used."""

    wheel: Text
    rail: Text
    gauge: Length = 1.435
    back_to_back: Length = 1.360
    inclination: Inclination = 0.0
    diameter_difference: Annotated[float, measure("m", -0.1, maximum=0.1)] = 0.0
    mirror_rail: Switch = False
    smoothing: Annotated[float, measure("m", 0.0, maximum=0.03)] = 0.0
    sd: Annotated[float, measure("m", 2.5e-4, maximum=0.01)] = 2e-3
    surface: Annotated[float, measure("1", 0.05, maximum=1.5)] = 0.6
    use: Annotated[str, word(USES)] = USES[0]


@dataclass(frozen=True)
class ContactProfiles:
    """The profiles of a design: files, what was given (SI), rolling radius [m] and wheel load [N] of the vehicle.

    `sha256` of wheel and rail; None where a file is gone, and the numbers of the design stand alone.
    """

    wheel: Path
    rail: Path
    given: Mapping[str, Any]
    radius: float
    wheel_load: float
    sha256: tuple[str, str] | None

    def contacts(self) -> Contacts:
        """The rigid contact of the pair. FileProblems or ProfileFault where it has none."""
        words = {k: v for k, v in self.given.items() if k not in ("wheel", "rail", "sd", "surface", "use")}
        stamp = sha256_file(self.wheel), sha256_file(self.rail)
        return _contacts(self.wheel, self.rail, stamp, self.radius, **words)

    def numbers(self, deviation: float | None = None) -> tuple[dict[str, float], list[str]]:
        """What the pair is to the model, by the keys of a contact group and of what all share, and what is odd.

        Linearised over a standard deviation [m] of e; that of the file where none is given. Keys of what the pair
        does not have are absent.
        """
        from railui.contact.creep import creep_coefficients
        from railui.contact.linearisation import linearise

        contacts = self.contacts()
        centre = contacts.centre
        odd = (
            [f"has its centre at {centre * 1e3:.2f} mm"] if abs(centre) > 2e-4 and self.given["use"] != "table" else []
        )
        linear = linearise(contacts, deviation or self.given["sd"], centre)
        keys = ("conicity", "gravitational_stiffness", "contact_angle", "roll")
        found = {key: value for key in keys if (value := getattr(linear, key)) == value}
        ends = [abs(x) for x in contacts.flange if x is not None]
        if ends:
            found["flange_clearance"] = sum(ends) / len(ends)
        try:
            creep = creep_coefficients(contacts, self.wheel_load, centre, self.given["surface"])
        except ValueError as fault:
            return found, [*odd, f"gives no creep coefficients: {fault}"]
        return found | {k: getattr(creep, k) for k in ("longitudinal_creep", "lateral_creep", "spin_creep")}, odd

    def table(self) -> dict[str, Any]:
        """The pair as the effect profile_shape. ValueError where it has no conicity to be a multiple of."""
        from railui.contact.linearisation import linearise
        from railui.contact.profile_shape import shape

        contacts = self.contacts()
        linear = linearise(contacts, self.given["sd"], contacts.centre)
        return {"kind": SHAPE, "at": "contact", **shape(contacts, linear).parameters()}

    def entry(self, home: Path | None, kinds: Iterable[str]) -> dict[str, Any]:
        """The keys as they stand in a design in the directory `home` with these kinds of effects.

        The files have their whole paths where there is no directory; they are a table where the effects hold it.
        """
        standard = ProfilesModel(wheel="", rail="")
        kept = {k: v for k, v in self.given.items() if v != getattr(standard, k) or k in ("gauge", "back_to_back")}
        return kept | self.files(home) | {"use": USES[0] if SHAPE in kinds else USES[1]}

    def files(self, home: Path | None) -> dict[str, str]:
        """Wheel and rail as a file in a directory names them; their whole paths where there is none."""
        both = {"wheel": self.wheel, "rail": self.rail}
        return {key: path.as_posix() if home is None else relative_path(path, home) for key, path in both.items()}


def filled(
    data: dict[str, Any], findings: Findings, home: Path | None, form: str
) -> tuple[dict[str, Any], ContactProfiles | None]:
    """The design with what its profiles give in the place of what it leaves out, and the profiles.

    What the file gives itself stands: an adjusted conicity scales the table.
    """
    contact = data.get("contact")
    if not isinstance(contact, dict) or contact.get("profiles") is None:
        return data, None
    bare = {key: value for key, value in contact.items() if key != "profiles"}
    groups = _groups(bare, form)
    model = check_group(ProfilesModel, contact["profiles"], findings, "contact.profiles")
    vehicle = _vehicle(data, form)
    if model is None or vehicle is None:
        return _joined(data, bare, groups, UNKNOWN), None
    here = (home or Path()).resolve()
    wheel, rail = ((here / name).resolve() for name in (model.wheel, model.rail))
    profiles = ContactProfiles(wheel, rail, model.model_dump(), *vehicle, None)
    wanted = model.use == "table" and SHAPE not in _kinds(data)
    try:
        profiles = replace(profiles, sha256=(sha256_file(wheel), sha256_file(rail)))
        numbers, odd = profiles.numbers()
        table = [profiles.table()] if wanted else []
    except (OSError, ValueError) as fault:
        whole = not wanted and all(p.key in group for group in groups.values() for p in WHEELSET_CONTACT)
        _tell(fault, findings, only_warn=whole and isinstance(fault, OSError))
        return _joined(data, bare, groups, {} if whole else UNKNOWN), profiles
    for note in odd:
        findings.warn("contact.profiles", note)
    _wide(data, form, model, findings)
    return _joined(data, bare, groups, numbers, table), profiles


def _joined(
    data: Mapping[str, Any], contact: dict[str, Any], groups: Mapping[str, dict[str, Any]],
    numbers: Mapping[str, float], table: Sequence[dict[str, Any]] = (),
) -> dict[str, Any]:  # fmt: skip
    """The design with numbers where its contact has none, and a table behind its effects."""
    own = {key: value for key, value in numbers.items() if key not in SHARED}
    shared = {key: numbers[key] for key in SHARED if key in numbers}
    filled = shared | contact | {name: own | group for name, group in groups.items()}
    given = data.get("effects") or []
    effects = {"effects": [*given, *table]} if table and isinstance(given, list) else {}
    return {**data, "contact": filled, **effects}


def _kinds(data: Mapping[str, Any]) -> list[Any]:
    effects = data.get("effects")
    return [e.get("kind") for e in effects if isinstance(e, dict)] if isinstance(effects, list) else []


def _tell(fault: Exception, findings: Findings, *, only_warn: bool) -> None:
    from railui.contact.profile import ProfileFault

    where = "contact.profiles"
    if isinstance(fault, FileProblems):
        findings.problems += fault.problems
    elif isinstance(fault, OSError):
        told = f"{fault.filename} cannot be read ({fault.strerror})"
        if only_warn:
            findings.warn(where, told, "the numbers of the file stand without it")
        else:
            findings.add(where, told, "give the path from the design's directory")
    elif isinstance(fault, ProfileFault):
        findings.add(where, fault.message, fault.remedy)
    else:
        findings.add(where, str(fault), "write `use: linearised`, or another sd")


def _groups(contact: Mapping[str, Any], form: str) -> dict[str, dict[str, Any]]:
    """The contact groups by name that the profiles fill: those that are there, or those that must be."""
    common = {p.key for p in CONTACT if p.path.count(".") == 1} | {"gauge_widens_clearance"}
    given = {k: dict(v) for k, v in contact.items() if k not in common and isinstance(v, dict)}
    needed = ("leading", "trailing") if form == "bogie" else () if given else ("wheels",)
    return {name: {} for name in needed if contact.get(name) is None} | given


def _vehicle(data: Mapping[str, Any], form: str) -> tuple[float, float] | None:
    """Rolling radius [m] and wheel load [N]; None where the file does not say them: its own reader tells that."""
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


def _wide(data: Mapping[str, Any], form: str, model: ProfilesModel, findings: Findings) -> None:
    """Warns where the rolling circles of the model lie elsewhere than those of the profiles."""
    if form != "bogie":
        return
    half = 0.5 * model.back_to_back + 0.07
    try:
        given = quantity(data["vehicle"]["geometry"].get("half_gauge", 0.75), "m")
    except (KeyError, TypeError, AttributeError, UnitError):
        return
    if abs(given / half - 1.0) > WIDER:
        told = f"is {given:.4g} m, the tape lines of the profiles lie {half:.4g} m from the middle"
        findings.warn("vehicle.geometry.half_gauge", told, "check it against back_to_back")


@lru_cache(maxsize=8)
def _contacts(
    wheel: Path, rail: Path, stamp: tuple[str, str], radius: float, *, gauge: float, back_to_back: float,
    inclination: float, diameter_difference: float, mirror_rail: bool, smoothing: float,
) -> Contacts:  # fmt: skip
    """The contact of two files as they are (`stamp`): a search of a tenth of a second, once."""
    from railui.contact.contact_points import search
    from railui.contact.wheelset_on_track import Pair

    sides = (
        read_profile(wheel, "wheel", smoothing=smoothing),
        read_profile(rail, "rail", mirror=mirror_rail, smoothing=smoothing),
    )
    return search(Pair(*sides, gauge, back_to_back, inclination, radius, diameter_difference))


__all__ = ["ContactProfiles", "ProfilesModel", "filled"]
