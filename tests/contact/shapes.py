"""Profiles whose contact geometry is known in closed form, and where the reference files lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.contact import Pair, Profile

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
    return Profile.of("wheel", np.concatenate([[-0.07, -0.06], y]),
                      np.concatenate([[-0.02, -0.0275], np.where(y < -0.038, flange, conicity * y)]))  # fmt: skip


def hollow_wheel(radius: float, centre: float = 0.02, conicity: float = 0.05) -> Profile:
    """A tread that is an arc hollow upwards, with a flange; slope `conicity` at y 0."""
    y = np.linspace(-0.03, 0.06, 1500)
    lowest = -radius * conicity / np.sqrt(1.0 + conicity**2)
    arc = radius - np.sqrt(radius**2 - (y - lowest) ** 2)
    flange_y = np.linspace(-0.045, -0.0305, 50)
    flange = np.interp(-0.03, y, arc) + np.tan(np.radians(70.0)) * (flange_y + 0.03)
    return Profile.of(
        "wheel", np.concatenate([[-0.07, -0.06], flange_y, y]), np.concatenate([[-0.03, -0.038], flange, arc])
    )


def round_rail(radius: float = 0.3, half_width: float = 0.03) -> Profile:
    """A head that is one arc, with upright sides 20 mm high."""
    y = np.linspace(-half_width, half_width, 1201)
    head = np.sqrt(radius**2 - y**2) - radius
    side = head[0] - np.linspace(0.02, 0.0005, 40)
    return Profile.of(
        "rail",
        np.concatenate([np.full(40, -half_width), y, np.full(40, half_width)]),
        np.concatenate([side, head, side[::-1]]),
    )


def cones(conicity: float = 0.05, **more: float) -> Pair:
    """Coned wheels on round rails."""
    return Pair(coned_wheel(conicity), round_rail(), **more)
