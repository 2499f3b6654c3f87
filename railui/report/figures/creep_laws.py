"""Comparison of the creep laws of the library, at the slopes of one contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from railui import core
from railui.contact.creep import CreepCoefficients
from railui.report.figures.drawing import BLUE, GREEN, ORANGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RIGHT_COLOUR, LEFT_COLOUR, THIRD_COLOUR = BLUE, ORANGE, GREEN
DASHED, DOTTED = (0, (3, 2)), (0, (1, 2))
FRICTION, SPEED = 0.35, 40.0  # m/s
MAX_CREEPAGE = 0.01  # of the axes
DRY = {"slip_reduction": 0.4, "friction_ratio": 0.4, "friction_decay": 0.6}  # Polach 2005, dry rail


def draw_laws(ax: Axes, creep: CreepCoefficients, *, across: bool = False) -> None:
    """Draw T/N of each law over creepage in %, along the rail, or across it with the spin of the contact angle.

    The slopes are Kalker's for clean surfaces; laws with a surface factor are drawn with and without it.
    """
    load, surface = creep.load, creep.surface
    slopes = (creep.longitudinal_creep / surface * load, creep.lateral_creep / surface * load)
    spin = creep.spin_creep / surface * load * creep.spin if across else 0.0
    creepage = np.linspace(-MAX_CREEPAGE if across else 0.0, MAX_CREEPAGE, 401)
    force = slopes[1] * creepage + spin if across else slopes[0] * creepage
    zero = np.zeros_like(creepage)
    linear = np.stack([zero, force, zero + spin] if across else [force, zero, zero], axis=1)
    ax.plot(100 * creepage, force / load, color="#999999", lw=0.8, ls=DOTTED, label="Kalker, linear")
    for name, kind, values, colour, dash in _laws(creep):
        forces = core.creep_forces(kind, {"friction": FRICTION, **values}, load, slopes, linear, SPEED)
        ax.plot(100 * creepage, forces[:, int(across)] / load, color=colour, ls=dash, lw=1.1, label=name)
    top = 1.15 * FRICTION
    ax.set(xlim=(100 * creepage[0], 100 * MAX_CREEPAGE), ylim=(-top if across else 0.0, top))
    conditions = f"friction {FRICTION:g}, {SPEED:g} m/s" + (f", spin {creep.spin:.2f} 1/m" if across else "")
    ax.annotate(conditions, (0.03, 0.94), xycoords="axes fraction", fontsize=7)
    if across:
        ax.set(xlabel="lateral creepage [%]", ylabel="$T_y/N$", title="creep laws, lateral, with spin")
    else:
        ax.set(xlabel="longitudinal creepage [%]", ylabel="$T_x/N$", title="creep laws, longitudinal")
    ax.legend(frameon=False, fontsize=7, loc="lower right")


def _laws(creep: CreepCoefficients) -> list[tuple[str, str, dict[str, float], str, Any]]:
    """Return name, kind, parameters, colour and dashes of each law."""
    x, y = creep.vermeulen_johnson
    return [
        ("Shen-Hedrick-Elkins", "shen_hedrick_elkins", {}, RIGHT_COLOUR, "-"),
        (
            f"the same, surface {creep.surface:g}",
            "shen_hedrick_elkins",
            {"surface": creep.surface},
            RIGHT_COLOUR,
            DASHED,
        ),
        ("Vermeulen-Johnson", "vermeulen_johnson", {"longitudinal_factor": x, "lateral_factor": y}, LEFT_COLOUR, "-"),
        ("Polach, clean", "polach", {}, THIRD_COLOUR, "-"),
        ("Polach, dry rail (2005)", "polach", DRY, THIRD_COLOUR, DASHED),
    ]
