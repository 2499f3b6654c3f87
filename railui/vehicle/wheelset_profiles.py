"""Profiles of one wheelset on its rails: contact parameters and smooth table, computed once for equal inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railui.contact.profile_reader import read_profile
from railui.io.atomic import sha256_file

if TYPE_CHECKING:
    from railui.contact.geometry import ContactGeometry

Sides = tuple[Path, Path]  # files of the right-hand and of the left-hand side
LINEARISED = ("conicity", "gravitational_stiffness", "contact_angle", "roll")
CREEP = ("longitudinal_creep", "lateral_creep", "spin_creep")
MAX_CENTRE = 2e-4  # m of the centre of a linearised pair, beyond which it is reported
MAX_FLANGE_DIFFERENCE = 5e-4  # m between the displacements at which both flanges touch, beyond which it is reported


@dataclass(frozen=True)
class PairFiles:
    """Files of wheels and rails, and the numbers [SI] of their geometry."""

    wheels: Sides
    rails: Sides
    mirror_rail: bool
    smoothing: float
    gauge: float
    back_to_back: float
    inclination: float
    diameter_difference: float
    radius: float

    @property
    def files(self) -> tuple[Path, ...]:
        """Distinct files: of the right-hand side, then others of the left-hand side."""
        right, left = zip(self.wheels, self.rails, strict=True)
        return tuple(dict.fromkeys((*right, *left)))

    def stamps(self) -> tuple[str, ...]:
        """Return the hashes of the files; OSError if one cannot be read."""
        return tuple(sha256_file(file) for file in self.files)


@dataclass(frozen=True)
class WheelsetProfiles:
    """Everything on which the contact of a wheelset depends.

    Attributes
    ----------
    pair : PairFiles
    wheel_load : float
        Load of one wheel [N].
    sd : float
        Standard deviation of e over which the geometry is linearised [m].
    surface : float
        Factor on Kalker's coefficients.
    """

    pair: PairFiles
    wheel_load: float
    sd: float
    surface: float

    def geometry(self) -> ContactGeometry:
        """Return the rigid contact geometry.

        Raises
        ------
        OSError, FileProblems, ProfileError
            If a file cannot be read or the profiles do not touch.
        """
        return _geometry(self.pair, self.pair.stamps())

    def contact_parameters(self, *, is_linearised: bool = False) -> tuple[dict[str, float], list[str]]:
        """Return the contact parameters by key, and warnings; keys of undefined quantities are absent.

        The creep coefficients are means over the motion, as the others; of both wheels where the sides differ.
        """
        from railui.contact.linearisation import linearise

        contacts = self.geometry()
        centre = contacts.centre
        warnings = [f"has its centre at {centre * 1e3:.2f} mm"] if is_linearised and abs(centre) > MAX_CENTRE else []
        linear = linearise(contacts, self.sd, centre)
        parameters = {key: value for key in LINEARISED if (value := getattr(linear, key)) == value}
        ends = [abs(x) for x in contacts.flange_displacements if x is not None]
        if ends:
            parameters["flange_clearance"] = sum(ends) / len(ends)
        if len(ends) == 2 and abs(ends[0] - ends[1]) > MAX_FLANGE_DIFFERENCE:
            touching = f"{-ends[0] * 1e3:.1f} and {ends[1] * 1e3:.1f} mm"
            warnings.append(f"flanges touch at {touching}: the flange clearance is the mean of both sides")
        creep, notes = _creep(self.pair, self.pair.stamps(), self.wheel_load, self.sd, self.surface)
        return parameters | dict(creep), [*warnings, *notes]

    def shape(self) -> dict[str, tuple[float, ...]]:
        """Return the parameters of the effect profile_shape; raise ValueError if the conicity is zero."""
        return _shape(self.pair, self.pair.stamps(), self.sd)


@lru_cache(maxsize=64)
def _creep(
    pair: PairFiles, stamps: tuple[str, ...], load: float, sd: float, surface: float
) -> tuple[Mapping[str, float], Sequence[str]]:
    """Return kappa_x, kappa_y and kappa_s over a motion; none, and a note, where Hertz's theory does not hold."""
    from railui.contact.creep import mean_creep_coefficients

    contacts = _geometry(pair, stamps)
    sides = (0,) if contacts.pair.has_equal_sides else (0, 1)
    try:
        each = [mean_creep_coefficients(contacts, load, sd, contacts.centre, surface, side) for side in sides]
    except ValueError as fault:
        return {}, [f"gives no creep coefficients: {fault}"]
    return {key: sum(getattr(one, key) for one in each) / len(each) for key in CREEP}, []


@lru_cache(maxsize=64)
def _geometry(pair: PairFiles, stamps: tuple[str, ...]) -> ContactGeometry:
    """Compute the contact geometry of files with the hashes `stamps`; cached, since it takes about 0.1 s."""
    from railui.contact.contact_points import find_contacts
    from railui.contact.wheelset_on_track import WheelRailPair

    words: dict[str, Any] = {"smoothing": pair.smoothing}
    wheel, left_wheel = (read_profile(file, "wheel", **words) for file in pair.wheels)
    rail, left_rail = (read_profile(file, "rail", mirror=pair.mirror_rail, **words) for file in pair.rails)
    position = pair.gauge, pair.back_to_back, pair.inclination, pair.radius, pair.diameter_difference
    return find_contacts(
        WheelRailPair(
            wheel,
            rail,
            *position,
            left_wheel=left_wheel if pair.wheels[0] != pair.wheels[1] else None,
            left_rail=left_rail if pair.rails[0] != pair.rails[1] else None,
        )
    )


@lru_cache(maxsize=64)
def _shape(pair: PairFiles, stamps: tuple[str, ...], sd: float) -> dict[str, tuple[float, ...]]:
    """Compute the smooth table of files with the hashes `stamps`; callers do not change it."""
    from railui.contact.linearisation import linearise
    from railui.contact.profile_shape import compute_profile_shape

    contacts = _geometry(pair, stamps)
    return compute_profile_shape(contacts, linearise(contacts, sd, contacts.centre)).parameters()
