"""Figures of the contact: profiles, rolling radii, contact angles, roll, conicity against amplitude."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from railui.arrays import FloatArray
from railui.contact.analysis import ContactAnalysis
from railui.contact.creep import CreepCoefficients
from railui.contact.profile import Profile
from railui.report.figures.creep_laws import LEFT_COLOUR, RIGHT_COLOUR, draw_laws
from railui.report.figures.drawing import figure_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_CONTACT_ANGLE = 75.0  # degrees of the angle axis


def draw_contact(result: ContactAnalysis, file: str | Path, deviation: float) -> None:
    """Write a figure of the contact of a pair of profiles in six diagrams; the file name determines the format."""
    with figure_file(file, 11.0, 6.6) as figure:
        axes = figure.subplots(2, 3)
        _profiles(axes[0, 0], result)
        _rolling(axes[0, 1], result)
        _angles(axes[0, 2], result)
        _roll(axes[1, 0], result)
        _conicity(
            axes[1, 1],
            result.conicity.amplitude if result.conicity else np.zeros(0),
            result.conicity.tan_gamma if result.conicity else np.zeros(0),
            deviation,
        )
        if result.creep is None:
            axes[1, 2].text(
                0.5, 0.5, "no ellipse: see the notes", transform=axes[1, 2].transAxes, ha="center", fontsize=8
            )
        else:
            draw_laws(axes[1, 2], result.creep)


def draw_radius_table(
    y: FloatArray, delta_r: FloatArray, amplitude: FloatArray, tan_gamma: FloatArray, file: str | Path
) -> None:
    """Write a figure of a table of rolling radii and its equivalent conicity."""
    with figure_file(file, 7.6, 3.3) as figure:
        first, second = figure.subplots(1, 2)
        first.plot(1e3 * y, 1e3 * delta_r, color=RIGHT_COLOUR)
        first.set(xlabel="lateral displacement [mm]", ylabel="$r_1 - r_2$ [mm]", title="rolling radius difference")
        _conicity(second, amplitude, tan_gamma, None)


def draw_creep_laws(creep: CreepCoefficients, file: str | Path) -> None:
    """Write a figure of the creep laws: along the rail, and across it with the spin of the contact angle."""
    with figure_file(file, 9.4, 4.0) as figure:
        first, second = figure.subplots(1, 2)
        draw_laws(first, creep)
        draw_laws(second, creep, across=True)


def _profiles(ax: Axes, result: ContactAnalysis) -> None:
    contacts, pair = result.contacts, result.contacts.pair
    i = contacts.index_at(0.0)
    rail, wheel = pair.rail_curve, pair.wheel_curve
    level = float(np.interp(contacts.rail[0, i], rail.y, rail.h) - np.interp(contacts.wheel[0, i], wheel.y, wheel.h))
    ax.plot(1e3 * rail.y, 1e3 * rail.h, color="#555555", label=_label(pair.rail))
    ax.plot(1e3 * wheel.y, 1e3 * (wheel.h + level), color=RIGHT_COLOUR, label=_label(pair.wheel))
    shown = np.abs(contacts.displacement) < 8.05e-3
    marks = 1e3 * np.interp(contacts.rail[0, shown], rail.y, rail.h)
    ax.plot(1e3 * contacts.rail[0, shown], marks, ".", ms=3.5, color=LEFT_COLOUR, label="contacts, -8 to 8 mm")
    ax.set(xlabel="from the track centre [mm]", ylabel="height [mm]", title="right wheel on its rail, e = 0")
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend(frameon=False, fontsize=7, loc="lower right")


def _label(profile: Profile) -> str:
    """Return the kind and the file of a profile, with dollar signs escaped for matplotlib."""
    return f"{profile.kind} {profile.name}".replace("$", r"\$")


def _mark_flanges(ax: Axes, result: ContactAnalysis) -> None:
    """Mark where flanges begin to touch, and where a wheel has two points of contact."""
    for side, at in zip("lr", result.contacts.flange_displacements, strict=True):
        if at is not None:
            ax.axvline(1e3 * at, color="#888888", lw=0.8, ls=(0, (1, 2)))
            ax.annotate(
                "flange",
                (1e3 * at, 1.0),
                xycoords=("data", "axes fraction"),
                rotation=90,
                fontsize=7,
                color="#666666",
                xytext=(2 if side == "r" else -8, -28),
                textcoords="offset points",
            )
    for jump in result.contacts.jumps:
        ax.axvline(1e3 * jump.displacement, color=RIGHT_COLOUR if jump.wheel == 1 else LEFT_COLOUR, lw=0.5, alpha=0.5)
    ax.set_xlabel("lateral displacement e [mm]")


def _displacement_range(result: ContactAnalysis) -> float:
    ends = [abs(x) for x in result.contacts.flange_displacements if x is not None]
    return 1.18 * max(ends) if ends else float(np.abs(result.contacts.displacement).max())


def _rolling(ax: Axes, result: ContactAnalysis) -> None:
    contacts = result.contacts
    e, curve = 1e3 * contacts.displacement, 1e3 * contacts.delta_r
    ax.plot(e, curve, color=RIGHT_COLOUR)
    reach = _displacement_range(result)
    inside = np.abs(contacts.displacement) < 0.97 * min(reach / 1.18, reach)
    top = 1.6 * float(np.abs(curve[inside]).max()) if inside.any() else 1.0
    ax.set(xlim=(-1e3 * reach, 1e3 * reach), ylim=(-top, top), ylabel="$r_1 - r_2$ [mm]")
    ax.set_title("rolling radius difference")
    _mark_flanges(ax, result)


def _angles(ax: Axes, result: ContactAnalysis) -> None:
    contacts = result.contacts
    for j, (colour, name) in enumerate(((RIGHT_COLOUR, "right wheel"), (LEFT_COLOUR, "left wheel"))):
        ax.plot(1e3 * contacts.displacement, np.degrees(contacts.angle[j]), color=colour, label=name)
    reach = 1e3 * _displacement_range(result)
    ax.set(xlim=(-reach, reach), ylim=(-5, MAX_CONTACT_ANGLE), ylabel="contact angle [degrees]", title="contact angles")
    _mark_flanges(ax, result)
    ax.legend(frameon=False, fontsize=7, loc="upper center")


def _roll(ax: Axes, result: ContactAnalysis) -> None:
    contacts, reach = result.contacts, _displacement_range(result)
    ax.plot(1e3 * contacts.displacement, 1e3 * contacts.roll, color=RIGHT_COLOUR)
    inside = np.abs(contacts.displacement) < reach / 1.18
    top = 1.6e3 * float(np.abs(contacts.roll[inside]).max()) if inside.any() else 1.0
    ax.set(xlim=(-1e3 * reach, 1e3 * reach), ylim=(-top, top), ylabel="roll [mrad]", title="roll of the wheelset")
    _mark_flanges(ax, result)


def _conicity(ax: Axes, amplitude: FloatArray, tan_gamma: FloatArray, deviation: float | None) -> None:
    ax.plot(1e3 * amplitude, tan_gamma, color=RIGHT_COLOUR)
    at = np.flatnonzero(np.abs(amplitude - 3e-3) < 1e-9)
    if len(at) and np.isfinite(tan_gamma[at[0]]):
        ax.plot(3.0, tan_gamma[at[0]], "o", ms=4, color=LEFT_COLOUR)
        ax.annotate(
            f"{tan_gamma[at[0]]:.3f} at 3 mm",
            (3.0, float(tan_gamma[at[0]])),
            fontsize=7.5,
            color=LEFT_COLOUR,
            xytext=(4, -11),
            textcoords="offset points",
        )
    ax.set(xlabel="amplitude [mm]", ylabel=r"tan $\gamma_e$", title="equivalent conicity (EN 15302)", xlim=(0, 10))
    finite = tan_gamma[np.isfinite(tan_gamma)]
    ax.set_ylim(0.0, min(1.1 * float(finite.max()), 1.0) if len(finite) else 1.0)
    if deviation is None:
        ax.set_xlim(0, 1e3 * float(amplitude.max()) + 0.5 if len(amplitude) else 10)
