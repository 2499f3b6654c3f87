"""Where a wheelset touches its track at every displacement: rolling radii, angles, roll, leaps, where flanges begin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railui.arrays import FloatArray
from railui.contact.conicity import NoCentreError, equivalent_conicity
from railui.contact.wheelset_on_track import WheelRailPair

JUMP = 1.5e-3  # m that a contact point must leap within a step of displacement beyond its usual way
FLANGE_ANGLE = np.pi / 4.0  # a contact at 45 degrees is on the flange


@dataclass(frozen=True)
class ContactJump:
    """Two contact points at once on a wheel (1 right, 2 left): at which displacement, from and to where on the rail.

    y on the rail from the track's middle [m], contact angles before and behind [rad].
    """

    wheel: int
    displacement: float
    rail: tuple[float, float]
    angle: tuple[float, float]


@dataclass(frozen=True, eq=False)
class ContactGeometry:
    """Contacts against lateral displacement e [n]; per wheel (1 right, 2 left) arrays [2, n].

    radius: rolling radius less the mean one at the tape line [m]; angle: contact angle [rad], positive where the wheel
    leans as on its tread; wheel, rail: where it touches, from the track's middle outwards [m] (the wheel's in its own
    co-ordinates); roll: phi of the wheelset [rad]; in track-fixed co-ordinates. `notes` say where the search ended.
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
        """Where the wheelset runs straight, r_1 = r_2 [m]; 0 where it has no such place."""
        try:
            return equivalent_conicity(self.displacement, self.delta_r, []).centre
        except NoCentreError:
            return 0.0

    @cached_property
    def jumps(self) -> tuple[ContactJump, ...]:
        """Where a contact point leaps: there the wheel touches at two points."""
        found = []
        for j in (0, 1):
            way = np.abs(np.diff(self.rail[j]))
            # far more than the contact moves in the steps around it
            around = np.array([np.median(way[max(i - 5, 0) : i + 6]) for i in range(len(way))])
            for i in np.flatnonzero(way > np.maximum(JUMP, 4.0 * around)):
                middle = 0.5 * (self.displacement[i] + self.displacement[i + 1])
                x, g = self.rail[j], self.angle[j]
                found.append(ContactJump(j + 1, float(middle), (float(x[i]), float(x[i + 1])), (float(g[i]), float(g[i + 1]))))
        return tuple(sorted(found, key=lambda jump: abs(jump.displacement)))

    @cached_property
    def flange_displacements(self) -> tuple[float | None, float | None]:
        """Displacements at which the left and the right flange begin to touch: at 45 degrees, or by a leap beyond."""

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
        """Displacements between which no flange touches [m]: the first and the last of the search that are inside."""
        left, right = self.flange_displacements
        e = self.displacement
        inside = e[(e > (-np.inf if left is None else left)) & (e < (np.inf if right is None else right))]
        return float(inside[0]), float(inside[-1])

    def index_at(self, displacement: float) -> int:
        """Index of the displacement nearest to one [m]."""
        return int(np.argmin(np.abs(self.displacement - displacement)))
