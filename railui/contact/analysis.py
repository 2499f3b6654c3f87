"""What measured profiles say: contact geometry, equivalent conicity, linearised parameters, creep coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.contact.conicity import AMPLITUDES, ConicityCurve, NoCentreError, equivalent_conicity, klingel_wavelength
from railui.contact.contact_points import find_contacts
from railui.contact.creep import CreepCoefficients, creep_coefficients
from railui.contact.geometry import ContactGeometry
from railui.contact.linearisation import LinearContact, fit_forms, linearise_harmonically, linearise
from railui.contact.profile import MAX_ROUGHNESS
from railui.contact.profile_shape import conicity_per_gauge
from railui.contact.wheelset_on_track import WheelRailPair

COMPARISON_AMPLITUDE = 3e-3  # m, at which equivalent conicities are compared
DEFAULT_STANDARD_DEVIATION = 2e-3  # m, of a wheelset on ordinary track
DEFAULT_WHEEL_LOAD, DEFAULT_SURFACE_FACTOR = 55e3, 0.6  # N; share of Kalker's coefficients on rails as they are (Hobbs 1967)


@dataclass(frozen=True, eq=False)
class ContactAnalysis:
    """The contact of a pair: geometry, equivalent conicity, creep coefficients; None with a note where it has none."""

    contacts: ContactGeometry
    conicity: ConicityCurve | None
    creep: CreepCoefficients | None
    notes: tuple[str, ...]


def analyse_contact(pair: WheelRailPair, load: float = DEFAULT_WHEEL_LOAD, surface: float = DEFAULT_SURFACE_FACTOR) -> ContactAnalysis:
    """Rigid contact of a pair, its equivalent conicity and its creep coefficients under a wheel load [N].

    Raises ProfileFault where the pair has no contact in the middle of the track.
    """
    contacts = find_contacts(pair)
    notes = [*contacts.notes]
    for profile in (pair.wheel, pair.rail):
        notes += [f"{profile.kind}: {note}" for note in profile.notes]
        if profile.roughness() > MAX_ROUGHNESS:
            notes.append(
                f"{profile.kind}: noise of {profile.roughness() * 1e6:.2g} um from point to point makes contacts leap; "
                "smooth it, such as --smooth '4 mm'"
            )
    conicity = creep = None
    try:
        conicity = equivalent_conicity(contacts.displacement, contacts.delta_r)
        notes += _left_out(conicity)
    except NoCentreError as fault:
        notes.append(f"no equivalent conicity: {fault}")
    try:
        creep = creep_coefficients(contacts, load, conicity.centre if conicity else 0.0, surface)
    except ValueError as fault:
        notes.append(f"no creep coefficients: {fault}")
    return ContactAnalysis(contacts, conicity, creep, tuple(notes))


def _left_out(conicity: ConicityCurve) -> list[str]:
    notes = []
    if len(conicity.omitted_amplitudes):
        first, last = conicity.omitted_amplitudes[[0, -1]] * 1e3
        notes.append(f"the amplitudes {first:.1f} to {last:.1f} mm reach beyond the table: left out")
    if np.isnan(conicity.tan_gamma).any():
        none = conicity.amplitude[np.isnan(conicity.tan_gamma)] * 1e3
        notes.append(f"no motion round the centre at {none[0]:.1f} to {none[-1]:.1f} mm: null")
    return notes


def result_dict(found: ContactAnalysis, deviation: float = DEFAULT_STANDARD_DEVIATION) -> dict[str, Any]:
    """The answer as data, SI; `deviation` [m] of e is what the parameters are linearised over."""
    contacts, pair = found.contacts, found.contacts.pair
    centre = found.conicity.centre if found.conicity else 0.0
    linear = linearise(contacts, deviation, centre)
    at_3 = found.conicity.at(COMPARISON_AMPLITUDE) if found.conicity else float("nan")
    left, right = contacts.flange_displacements
    shapes = fit_forms(contacts, deviation)
    swung = linearise_harmonically(contacts, COMPARISON_AMPLITUDE, centre)
    return {
        "gauge": pair.gauge,
        "back_to_back": pair.back_to_back,
        "inclination": pair.inclination,
        "diameter_difference": pair.diameter_difference,
        "conicity": {
            "amplitude": found.conicity.amplitude if found.conicity else [],
            "tan_gamma": found.conicity.tan_gamma if found.conicity else [],
            "centre": found.conicity.centre if found.conicity else None,
        },
        "conicity_3mm": at_3,
        "klingel_wavelength": klingel_wavelength(pair.half_distance, pair.radius, at_3),
        "standard_deviation": deviation,
        "conicity_parameters": contact_parameters(linear),
        "harmonic_parameters": {"amplitude": COMPARISON_AMPLITUDE, **contact_parameters(swung)},
        "gauge_conicity": conicity_per_gauge(pair, deviation),
        "forms": vars(shapes),
        "flange_contact": {"left": left, "right": right},
        "two_point_contacts": [vars(jump) for jump in contacts.jumps],
        "creep": _creep(found.creep),
        "geometry": {
            "displacement": contacts.displacement,
            "delta_r": contacts.delta_r,
            "contact_angle_right": contacts.angle[0],
            "contact_angle_left": contacts.angle[1],
            "roll": contacts.roll,
            "rail_contact_right": contacts.rail[0],
            "rail_contact_left": contacts.rail[1],
        },
        "notes": [*found.notes, *_out_of_reach(contacts, linear, swung)],
    }


def _out_of_reach(contacts: ContactGeometry, linear: LinearContact, swung: LinearContact) -> list[str]:
    """Why parameters are null."""
    ends = " to ".join(f"{end * 1e3:.1f}" for end in contacts.tread_range)
    motions = (("standard deviation", linear), ("amplitude", swung))
    return [
        f"no parameters over the {word} of {one.motion * 1e3:g} mm: it reaches beyond the treads, {ends} mm"
        for word, one in motions
        if np.isnan(one.conicity)
    ]


def contact_parameters(linear: LinearContact) -> dict[str, float]:
    """lambda, epsilon, delta and sigma by their names in a design."""
    return {k: getattr(linear, k) for k in ("conicity", "gravitational_stiffness", "contact_angle", "roll")}


def _creep(creep: CreepCoefficients | None) -> dict[str, Any] | None:
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


def analyse_radius_table(
    y: FloatArray, delta_r: FloatArray, deviation: float = DEFAULT_STANDARD_DEVIATION
) -> tuple[ConicityCurve, dict[str, Any]]:
    """Equivalent conicity of a table of r_1 - r_2, and the answer as data. NoCentre where there is no centre."""
    found = equivalent_conicity(y, delta_r, AMPLITUDES)
    even = np.linspace(y[0], y[-1], 4 * len(y))
    half = 0.5 * np.interp(even, y, delta_r)
    weight = np.exp(-0.5 * ((even - found.centre) / deviation) ** 2)
    inside = weight.sum() * (even[1] - even[0]) / (deviation * np.sqrt(2.0 * np.pi))
    d = even - found.centre
    d = d - weight @ d / weight.sum()
    slope = weight @ (d * half) / (weight @ (d * d)) if inside > 0.98 else float("nan")
    notes = _left_out(found)
    if inside <= 0.98:
        notes.append(f"the table does not reach as far as a standard deviation of {deviation * 1e3:g} mm asks")
    return found, {
        "conicity": {"amplitude": found.amplitude, "tan_gamma": found.tan_gamma, "centre": found.centre},
        "conicity_3mm": found.at(COMPARISON_AMPLITUDE),
        "standard_deviation": deviation,
        "conicity_parameters": {
            "conicity": slope, "gravitational_stiffness": None, "contact_angle": None, "roll": None
        },
        "geometry": {"displacement": y, "delta_r": delta_r},
        "notes": [*notes, "a table of rolling radii holds no contact angles and no roll: null"],
    }  # fmt: skip
