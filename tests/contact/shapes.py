"""Profiles with contact geometry in closed form, and the directory of reference files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.contact.geometry import ContactGeometry
from railui.contact.profile import Profile
from railui.contact.wheelset_on_track import WheelRailPair

RAIL_RADIUS = 0.3  # m, of the head
REFERENCE = Path(__file__).parents[3] / "shared" / "reference"


def reference(name: str) -> Path:
    """A reference file, which is not part of the project: skips where it is absent."""
    path = REFERENCE / name
    if not path.exists():
        pytest.skip(f"{name} is absent")
    return path


def coned_wheel(conicity: float) -> Profile:
    """A straight cone with a flange of 70 degrees whose root, a sharp corner, lies 38 mm inside the tape line."""
    y = np.concatenate([np.linspace(-0.048, -0.0385, 60), np.linspace(-0.038, 0.06, 400)])
    flange = -0.038 * conicity + np.tan(np.radians(70.0)) * (y + 0.038)
    return Profile.from_points("wheel", np.concatenate([[-0.07, -0.06], y]),
                      np.concatenate([[-0.02, -0.0275], np.where(y < -0.038, flange, conicity * y)]))  # fmt: skip


def hollow_wheel(radius: float, conicity: float = 0.02) -> Profile:
    """A tread worn to an arc round the rail, with a flange; slope `conicity` at y 0."""
    y = np.linspace(-0.038, 0.06, 1500)
    highest = radius * conicity / np.sqrt(1.0 + conicity**2)
    arc = np.sqrt(radius**2 - (y - highest) ** 2) - radius
    flange_y = np.linspace(-0.048, -0.0385, 50)
    flange = np.interp(-0.038, y, arc) + np.tan(np.radians(70.0)) * (flange_y + 0.038)
    return Profile.from_points(
        "wheel", np.concatenate([[-0.07, -0.06], flange_y, y]), np.concatenate([[-0.03, -0.038], flange, arc])
    )


def worn_wheel() -> Profile:
    """A tread steepest in its slope where it runs: 0.11 inside, 0.01 outside, with a flange."""
    y = np.linspace(-0.038, 0.06, 1500)
    tread = 0.06 * y - 0.05 * 0.02 * np.log(np.cosh((y + 0.0205) / 0.02))
    flange_y = np.linspace(-0.048, -0.0385, 50)
    flange = tread[0] + np.tan(np.radians(70.0)) * (flange_y + 0.038)
    return Profile.from_points(
        "wheel", np.concatenate([[-0.07, -0.06], flange_y, y]), np.concatenate([[-0.03, -0.038], flange, tread])
    )


def round_rail(radius: float = RAIL_RADIUS, half_width: float = 0.03) -> Profile:
    """A head that is one arc, with upright sides 20 mm high."""
    y = np.linspace(-half_width, half_width, 1201)
    head = np.sqrt(radius**2 - y**2) - radius
    side = head[0] - np.linspace(0.02, 0.0005, 40)
    return Profile.from_points(
        "rail",
        np.concatenate([np.full(40, -half_width), y, np.full(40, half_width)]),
        np.concatenate([side, head, side[::-1]]),
    )


def cones(conicity: float = 0.05, **more: float) -> WheelRailPair:
    """Coned wheels on round rails."""
    return WheelRailPair(coned_wheel(conicity), round_rail(), **more)


def conicity_of_cones(slope: float, contacts: ContactGeometry) -> float:
    """lambda = gamma (b + R_r gamma)/(b - r gamma): feet and crowns move out as the axle rolls."""
    b = float(contacts.rail[0, contacts.index_at(0.0)])
    return slope * (b + RAIL_RADIUS * slope) / (b - contacts.pair.radius * slope)
