"""Contact geometry over lateral displacement: rolling radii, angles, roll, jumps, flange contact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railui.arrays import FloatArray
from railui.contact.conicity import NoCentreError, equivalent_conicity
from railui.contact.wheelset_on_track import WheelRailPair

MIN_JUMP = 1.5e-3  # m of a contact point within one step of displacement
MIN_JUMP_RATIO = 4.0  # over the median movement in the neighbouring steps
JUMP_NEIGHBOURS = 5  # steps to either side
FLANGE_ANGLE = np.pi / 4.0  # a contact at 45 degrees is on the flange


@dataclass(frozen=True)
class ContactJump:
    """Two-point contact of a wheel (1 right, 2 left) at a displacement [m], where the contact point jumps.

    `rail`: y on the rail from the track centre line before and after the jump [m]; `angle`: contact angles [rad].
    """

    wheel: int
    displacement: float
    rail: tuple[float, float]
    angle: tuple[float, float]

    @property
    def separation(self) -> float:
        """Distance of both contact points across the rail [m]."""
        return abs(self.rail[1] - self.rail[0])

    @property
    def is_at_flange(self) -> bool:
        """True if the tread and the flange touch at once."""
        return min(self.angle) < FLANGE_ANGLE <= max(self.angle)


@dataclass(frozen=True, eq=False)
class ContactGeometry:
    """Contact geometry over lateral displacement e, in track-fixed co-ordinates.

    Attributes
    ----------
    pair : WheelRailPair
        Profiles and their position.
    displacement : FloatArray
        e [n] in m.
    radius : FloatArray
        Rolling radii less the mean radius at the tape line [wheel, n] in m; wheel 1 right, 2 left.
    angle : FloatArray
        Contact angles [wheel, n] in rad, positive as on a tread.
    wheel, rail : FloatArray
        Contact points on wheel (in its own co-ordinates) and rail, outward from the track centre line [wheel, n] in m.
    roll : FloatArray
        phi of the wheelset [n] in rad.
    notes : tuple of str
        Ends of the search.
    """

    pair: WheelRailPair
    displacement: FloatArray
    radius: FloatArray
    angle: FloatArray
    wheel: FloatArray
    rail: FloatArray
    roll: FloatArray
    notes: tuple[str, ...] = ()

    @property
    def delta_r(self) -> FloatArray:
        """r_1 - r_2 [m]."""
        return np.asarray(self.radius[0] - self.radius[1])

    @cached_property
    def centre(self) -> float:
        """Displacement at which r_1 = r_2 [m]; 0 if there is none."""
        try:
            return equivalent_conicity(self.displacement, self.delta_r, []).centre
        except NoCentreError:
            return 0.0

    @cached_property
    def jumps(self) -> tuple[ContactJump, ...]:
        """Jumps of contact points, at which a wheel has two-point contact."""
        jumps = []
        for j in (0, 1):
            movement = np.abs(np.diff(self.rail[j]))
            windows = (movement[max(i - JUMP_NEIGHBOURS, 0) : i + JUMP_NEIGHBOURS + 1] for i in range(len(movement)))
            usual = np.array([np.median(window) for window in windows])
            for i in np.flatnonzero(movement > np.maximum(MIN_JUMP, MIN_JUMP_RATIO * usual)):
                middle = 0.5 * (self.displacement[i] + self.displacement[i + 1])
                x, g = self.rail[j], self.angle[j]
                rail, angle = (float(x[i]), float(x[i + 1])), (float(g[i]), float(g[i + 1]))
                jumps.append(ContactJump(j + 1, float(middle), rail, angle))
        return tuple(sorted(jumps, key=lambda jump: abs(jump.displacement)))

    @cached_property
    def flange_displacements(self) -> tuple[float | None, float | None]:
        """Displacements [m] at which the left and the right flange begin to touch, by 45 degrees or a jump."""

        def first(side: int) -> float | None:
            j = 0 if side > 0 else 1
            steep = np.flatnonzero((self.angle[j] >= FLANGE_ANGLE) & (side * self.displacement > 0.0))
            if not len(steep):
                return None
            i = int(steep[np.argmin(np.abs(self.displacement[steep]))])
            k = i - side
            if not 0 <= k < len(self.displacement):
                return float(self.displacement[i])
            a, b = self.angle[j, k], self.angle[j, i]
            share = (FLANGE_ANGLE - a) / (b - a) if b > a else 1.0
            return float(self.displacement[k] + share * (self.displacement[i] - self.displacement[k]))

        return first(-1), first(1)

    @property
    def tread_range(self) -> tuple[float, float]:
        """First and last displacement of the search without flange contact [m]."""
        left, right = self.flange_displacements
        e = self.displacement
        inside = e[(e > (-np.inf if left is None else left)) & (e < (np.inf if right is None else right))]
        return float(inside[0]), float(inside[-1])

    def index_at(self, displacement: float) -> int:
        """Return the index of the displacement nearest to `displacement` [m]."""
        return int(np.argmin(np.abs(self.displacement - displacement)))
