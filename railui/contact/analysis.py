"""Contact analysis of profiles: geometry, equivalent conicity, linearised parameters, creep coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.contact.conicity import AMPLITUDES, ConicityCurve, NoCentreError, equivalent_conicity, klingel_wavelength
from railui.contact.contact_points import find_contacts
from railui.contact.creep import CreepCoefficients, creep_coefficients, mean_creep_coefficients
from railui.contact.geometry import ContactGeometry, ContactJump
from railui.contact.linearisation import LinearContact, fit_forms, linearise, linearise_harmonically
from railui.contact.profile import MAX_ROUGHNESS
from railui.contact.profile_shape import conicity_per_gauge
from railui.contact.wheelset_on_track import WheelRailPair

COMPARISON_AMPLITUDE = 3e-3  # m, at which equivalent conicities are compared
DEFAULT_STANDARD_DEVIATION = 2e-3  # m, of a wheelset on ordinary track
DEFAULT_WHEEL_LOAD = 55e3  # N
DEFAULT_SURFACE_FACTOR = 0.6  # of Kalker's coefficients on contaminated rails (Hobbs 1967)
MIN_WEIGHT_INSIDE = 0.98  # of a normal distribution inside a table, for its linearisation


@dataclass(frozen=True, eq=False)
class ContactAnalysis:
    """Contact of a wheel-rail pair: geometry, conicity, creep coefficients (None with a note if undefined)."""

    contacts: ContactGeometry
    conicity: ConicityCurve | None
    creep: CreepCoefficients | None
    notes: tuple[str, ...]


def analyse_contact(
    pair: WheelRailPair, load: float = DEFAULT_WHEEL_LOAD, surface: float = DEFAULT_SURFACE_FACTOR
) -> ContactAnalysis:
    """Compute rigid contact of a wheel-rail pair, its equivalent conicity and its creep coefficients.

    Parameters
    ----------
    pair : WheelRailPair
        Profiles and their position.
    load : float
        Wheel load [N].
    surface : float
        Share of Kalker's coefficients on contaminated rails.

    Raises
    ------
    ProfileError
        If the pair has no contact in the middle of the track.
    """
    contacts = find_contacts(pair)
    notes = [*contacts.notes]
    for name, profile in pair.profiles:
        notes += [f"{name}: {note}" for note in profile.notes]
        if profile.roughness() > MAX_ROUGHNESS:
            notes.append(
                f"{name}: noise of {profile.roughness() * 1e6:.2g} um from point to point makes contacts jump; "
                "smooth it, such as --smooth '4 mm'"
            )
    conicity = creep = None
    try:
        conicity = equivalent_conicity(contacts.displacement, contacts.delta_r)
        notes += _omission_notes(conicity)
    except NoCentreError as fault:
        notes.append(f"no equivalent conicity: {fault}")
    try:
        creep = creep_coefficients(contacts, load, conicity.centre if conicity else 0.0, surface)
    except ValueError as fault:
        notes.append(f"no creep coefficients: {fault}")
    return ContactAnalysis(contacts, conicity, creep, tuple(notes))


def _omission_notes(conicity: ConicityCurve) -> list[str]:
    """Return notes on amplitudes without an equivalent conicity."""
    notes = []
    if len(conicity.omitted_amplitudes):
        first, last = conicity.omitted_amplitudes[[0, -1]] * 1e3
        notes.append(f"the amplitudes {first:.1f} to {last:.1f} mm reach beyond the table: left out")
    if np.isnan(conicity.tan_gamma).any():
        undefined = conicity.amplitude[np.isnan(conicity.tan_gamma)] * 1e3
        notes.append(f"no motion round the centre at {undefined[0]:.1f} to {undefined[-1]:.1f} mm: null")
    return notes


def result_dict(analysis: ContactAnalysis, deviation: float = DEFAULT_STANDARD_DEVIATION) -> dict[str, Any]:
    """Return the analysis as data, SI; parameters are linearised over the standard deviation `deviation` [m] of e."""
    contacts, pair, conicity = analysis.contacts, analysis.contacts.pair, analysis.conicity
    centre = conicity.centre if conicity else 0.0
    linear = linearise(contacts, deviation, centre)
    conicity_3mm = conicity.at(COMPARISON_AMPLITUDE) if conicity else float("nan")
    left, right = contacts.flange_displacements
    forms = fit_forms(contacts, deviation)
    harmonic = linearise_harmonically(contacts, COMPARISON_AMPLITUDE, centre)
    return {
        "gauge": pair.gauge,
        "back_to_back": pair.back_to_back,
        "inclination": pair.inclination,
        "diameter_difference": pair.diameter_difference,
        "conicity": {
            "amplitude": conicity.amplitude if conicity else [],
            "tan_gamma": conicity.tan_gamma if conicity else [],
            "centre": conicity.centre if conicity else None,
        },
        "conicity_3mm": conicity_3mm,
        "klingel_wavelength": klingel_wavelength(pair.half_distance, pair.radius, conicity_3mm),
        "standard_deviation": deviation,
        "conicity_parameters": contact_parameters(linear),
        "harmonic_parameters": {"amplitude": COMPARISON_AMPLITUDE, **contact_parameters(harmonic)},
        "gauge_conicity": conicity_per_gauge(pair, deviation),
        "forms": vars(forms),
        "flange_contact": {"left": left, "right": right},
        "two_point_contacts": [_jump_dict(jump) for jump in contacts.jumps],
        "creep": _creep_dict(analysis.creep),
        "creep_parameters": _mean_creep_dict(analysis, deviation, centre),
        "geometry": {
            "displacement": contacts.displacement,
            "delta_r": contacts.delta_r,
            "contact_angle_right": contacts.angle[0],
            "contact_angle_left": contacts.angle[1],
            "roll": contacts.roll,
            "rail_contact_right": contacts.rail[0],
            "rail_contact_left": contacts.rail[1],
        },
        "notes": [*analysis.notes, *_range_notes(contacts, linear, harmonic)],
    }


def _jump_dict(jump: ContactJump) -> dict[str, Any]:
    return vars(jump) | {"separation": jump.separation, "is_at_flange": jump.is_at_flange}


def _range_notes(contacts: ContactGeometry, linear: LinearContact, harmonic: LinearContact) -> list[str]:
    """Return notes on parameters that are null."""
    ends = " to ".join(f"{end * 1e3:.1f}" for end in contacts.tread_range)
    motions = (("standard deviation", linear), ("amplitude", harmonic))
    return [
        f"no parameters over the {word} of {each.motion * 1e3:g} mm: it reaches beyond the treads, {ends} mm"
        for word, each in motions
        if np.isnan(each.conicity)
    ]


def contact_parameters(linear: LinearContact) -> dict[str, float]:
    """Return lambda, epsilon, delta and sigma by their names in a design."""
    return {k: getattr(linear, k) for k in ("conicity", "gravitational_stiffness", "contact_angle", "roll")}


def _creep_dict(creep: CreepCoefficients | None) -> dict[str, Any] | None:
    if creep is None:
        return None
    c, f, ratio = creep.kalker, creep.factors, creep.ellipse.a / creep.ellipse.b
    return {
        "longitudinal_creep": creep.longitudinal_creep,
        "lateral_creep": creep.lateral_creep,
        "spin_creep": creep.spin_creep,
        "spin": creep.spin,
        "surface": creep.surface,
        "wheel_load": creep.load,
        "curvature": {"along": creep.along, "wheel": creep.wheel_across, "rail": creep.rail_across},
        "ellipse": {"a": creep.ellipse.a, "b": creep.ellipse.b, "ratio": ratio, "pressure": creep.ellipse.pressure},
        "kalker": {"c11": c.c11, "c22": c.c22, "c23": c.c23},
        "vermeulen_johnson": {
            "phi": f.phi,
            "psi": f.psi,
            "longitudinal_factor": creep.vermeulen_johnson[0],
            "lateral_factor": creep.vermeulen_johnson[1],
        },
    }


def _mean_creep_dict(analysis: ContactAnalysis, deviation: float, mean: float) -> dict[str, Any] | None:
    """Return the creep coefficients over the motion; None where those of the mean point are undefined."""
    at = analysis.creep
    if at is None:
        return None
    return vars(mean_creep_coefficients(analysis.contacts, at.load, deviation, mean, at.surface))


def analyse_radius_table(
    y: FloatArray, delta_r: FloatArray, deviation: float = DEFAULT_STANDARD_DEVIATION
) -> tuple[ConicityCurve, dict[str, Any]]:
    """Compute the equivalent conicity of a table of r_1 - r_2 [m] at displacements y [m], and the result as data.

    Parameters are linearised over the standard deviation `deviation` [m]. Raises NoCentreError for a table
    without zero.
    """
    conicity = equivalent_conicity(y, delta_r, AMPLITUDES)
    even = np.linspace(y[0], y[-1], 4 * len(y))
    half = 0.5 * np.interp(even, y, delta_r)
    weight = np.exp(-0.5 * ((even - conicity.centre) / deviation) ** 2)
    inside = weight.sum() * (even[1] - even[0]) / (deviation * np.sqrt(2.0 * np.pi))
    d = even - conicity.centre
    d = d - weight @ d / weight.sum()
    slope = weight @ (d * half) / (weight @ (d * d)) if inside > MIN_WEIGHT_INSIDE else float("nan")
    notes = _omission_notes(conicity)
    if inside <= MIN_WEIGHT_INSIDE:
        notes.append(f"the table does not reach as far as a standard deviation of {deviation * 1e3:g} mm requires")
    return conicity, {
        "conicity": {"amplitude": conicity.amplitude, "tan_gamma": conicity.tan_gamma, "centre": conicity.centre},
        "conicity_3mm": conicity.at(COMPARISON_AMPLITUDE),
        "standard_deviation": deviation,
        "conicity_parameters": {
            "conicity": slope,
            "gravitational_stiffness": None,
            "contact_angle": None,
            "roll": None,
        },
        "geometry": {"displacement": y, "delta_r": delta_r},
        "notes": [*notes, "a table of rolling radii contains no contact angles and no roll: null"],
    }
