"""Contact parameters from files of wheel and rail profiles."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from railui.contact.analysis import ContactAnalysis, result_dict
from railui.contact.analysis import analyse_contact as analyse_pair
from railui.contact.analysis import analyse_radius_table as analyse_table
from railui.contact.conicity import ConicityCurve, NoCentreError
from railui.contact.profile import Profile, ProfileError
from railui.contact.profile_reader import read_inclination, read_profile
from railui.contact.radius_table_reader import read_radius_table
from railui.contact.wheelset_on_track import WheelRailPair
from railui.io.problems import FileProblems, Problem, file_problem

if TYPE_CHECKING:
    from railui.ride_quality.closed_linearisation import ClosedLinearisation
    from railui.ride_quality.evaluation import TrackLike
    from railui.vehicle.design import Design

GAUGE, BACK_TO_BACK, ROLLING_RADIUS = 1.435, 1.360, 0.46  # m
DEVIATION, WHEEL_LOAD, SURFACE = 2e-3, 55e3, 0.6  # m, N, share of Kalker's coefficients
PROFILE_NAMES: Final = ("wheel", "rail", "left_wheel", "left_rail")


def analyse_contact(
    wheel: str | Path,
    rail: str | Path,
    *,
    gauge: float = GAUGE,
    back_to_back: float = BACK_TO_BACK,
    inclination: float | str = 0.0,
    radius: float = ROLLING_RADIUS,
    diameter_difference: float = 0.0,
    mirror_rail: bool = False,
    smooth: float = 0.0,
    sd: float = DEVIATION,
    load: float = WHEEL_LOAD,
    surface: float = SURFACE,
    left_wheel: str | Path | None = None,
    left_rail: str | Path | None = None,
) -> dict[str, Any]:
    """Compute contact parameters from the profiles of a wheel and a rail, as `railui contact WHEEL RAIL`.

    Parameters
    ----------
    wheel, rail : str or Path
        Files of the profiles.
    gauge, back_to_back, radius, diameter_difference : float
        Track gauge, distance of the wheels' inner faces, nominal rolling radius, right minus left diameter [m].
    inclination : float or str
        Inclination of the rails [rad], or such as "1:40"; 0 where the file has it.
    mirror_rail : bool
        Mirror the rail: its y points opposite to that of its file type.
    smooth : float
        Cut-off wavelength [m] of a Gaussian filter of the profiles; 0 for none.
    sd : float
        Standard deviation [m] of the displacement for the linearisation.
    load : float
        Wheel load [N].
    surface : float
        Factor on Kalker's coefficients for the rail surface.
    left_wheel, left_rail : str or Path, optional
        Profiles of the left side where they differ.

    Returns
    -------
    dict
        conicity, conicity_parameters, harmonic_parameters, creep (at the centre), creep_parameters (over the motion),
        flange_contact, two_point_contacts, notes and others.

    Raises
    ------
    FileProblems
        For faulty files, and for profiles without contact in the middle of the track.

    Examples
    --------
    >>> result = analyse_contact("designs/profiles/s1002.txt", "designs/profiles/60e1.txt", inclination="1:40")
    >>> round(result["conicity_3mm"], 3)
    0.177
    """
    given = zip(PROFILE_NAMES, (wheel, rail, left_wheel, left_rail), strict=True)
    files = {name: str(file) for name, file in given if file is not None}
    angle = read_inclination(inclination) if isinstance(inclination, str) else inclination
    geometry = (gauge, back_to_back, angle, radius, diameter_difference)
    analysis = contact_of_files(files, geometry, load, surface, mirror_rail=mirror_rail, smoothing=smooth)
    return result_dict(analysis, sd)


def contact_of_files(
    files: Mapping[str, str],
    geometry: tuple[float, float, float, float, float],
    load: float,
    surface: float,
    *,
    mirror_rail: bool = False,
    smoothing: float = 0.0,
) -> ContactAnalysis:
    """Analyse the contact of files of wheel, rail, left_wheel and left_rail; FileProblems with the faults of all.

    geometry: gauge, back-to-back distance [m], inclination, rolling radius, diameter difference [m].
    """
    from railui.documents.recognise import expect_kind

    profiles: dict[str, Profile] = {}
    problems: list[Problem] = []
    for name, file in files.items():
        kind = name.removeprefix("left_")
        is_mirrored = mirror_rail and kind == "rail"
        try:
            expect_kind(file, "profile")
            profiles[name] = read_profile(file, kind, mirror=is_mirrored, smoothing=smoothing)  # type: ignore[arg-type]
        except FileProblems as error:
            problems += error.problems
    if problems:
        raise FileProblems(list(dict.fromkeys(problems)))
    try:
        left = (profiles.get("left_wheel"), profiles.get("left_rail"))
        pair = WheelRailPair(profiles["wheel"], profiles["rail"], *geometry, left_wheel=left[0], left_rail=left[1])
        return analyse_pair(pair, load, surface)
    except ProfileError as fault:
        raise file_problem(f"{files['wheel']} on {files['rail']}", fault.message, fault.remedy) from None


def analyse_radius_table(file: str | Path, sd: float = DEVIATION) -> dict[str, Any]:
    """Compute the equivalent conicity of a table of rolling radii, as `railui contact --delta-r`.

    Parameters
    ----------
    file : str or Path
        Table `y [mm],delta_r [mm]`.
    sd : float
        Standard deviation [m] of the displacement for the linearisation.

    Returns
    -------
    dict
        conicity, conicity_parameters, notes.

    Raises
    ------
    FileProblems
        For a faulty file, and a table without a centre.
    """
    return conicity_of_table(str(file), sd)[1]


def conicity_of_table(file: str, sd: float) -> tuple[ConicityCurve, dict[str, Any]]:
    """Return the equivalent conicity of a table of rolling radii, and the result as data."""
    y, delta_r = read_radius_table(file)
    try:
        return analyse_table(y, delta_r, sd)
    except NoCentreError as fault:
        remedy = "check the sign: r_1 - r_2 is positive where the wheelset is displaced to the right"
        raise file_problem(file, str(fault), remedy, "delta_r") from None


def linearise_profiles(
    design: Design | str | Path, track: TrackLike, speed: float | str, *, once: bool = False, seed: int | None = None
) -> dict[str, Any]:
    """Linearise the profiles of a design over its own motion, as `railui contact DESIGN --track --speed`.

    Parameters
    ----------
    design : Design, str or Path
        With profiles from which its contact parameters follow.
    track : Track, TrackSource, spec or path
    speed : float or str
        Speed [m/s], or a quantity.
    once : bool
        Linearise once, over the standard deviations of the design.
    seed : int, optional
        Seed that replaces that of the spec.

    Returns
    -------
    dict
        groups, iterations, has_converged, table_sd, linearised_overrides.

    Raises
    ------
    FileProblems
        For faulty files, and a design without profiles.
    ValueError
        For a faulty spec or speed.
    """
    return close_linearisation_of(design, track, speed, once=once, seed=seed).document()


def close_linearisation_of(
    design: Design | str | Path, track: TrackLike, speed: float | str, *, once: bool = False, seed: int | None = None
) -> ClosedLinearisation:
    """Linearise the profiles of a design over its own motion, pass by pass; as `linearise_profiles`."""
    from railui.api.design import as_design
    from railui.ride_quality.closed_linearisation import close_linearisation
    from railui.ride_quality.evaluation import excitation_of

    return close_linearisation(as_design(design), excitation_of(track, speed, seed), once=once)
