"""Longitudinal axis of a plan view: bogies to scale, the empty length between them shortened."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

REACH = 1.05  # m, drawn to scale to either side of a wheelset
SHORTENED = 1.3  # m, drawn for any longer empty length


@dataclass(frozen=True)
class LongitudinalAxis:
    """Monotonic map from x [m] to the drawn x [m]; `breaks` are the drawn middles of the shortened lengths."""

    places: Sequence[float]
    drawn: Sequence[float]
    breaks: Sequence[float]

    def __call__(self, x: float) -> float:
        """Return the drawn position of x."""
        if x < self.places[0]:
            return self.drawn[0] + max(x - self.places[0], -REACH)
        if x > self.places[-1]:
            return self.drawn[-1] + min(x - self.places[-1], REACH)
        return float(np.interp(x, self.places, self.drawn))


def longitudinal_axis(wheelsets: Iterable[float]) -> LongitudinalAxis:
    """Return the axis of a vehicle with wheelsets at these positions [m].

    >>> axis = longitudinal_axis([10.0, 8.0, -8.0, -10.0])
    >>> round(axis(10.0) - axis(8.0), 6), axis(8.0) - axis(-8.0) < 6.0
    (2.0, True)
    """
    centres = sorted(wheelsets)
    places, drawn = [centres[0] - REACH], [centres[0] - REACH]
    breaks = []
    for before, after in pairwise(centres):
        empty = after - before - 2 * REACH
        if empty <= SHORTENED:
            continue
        start = drawn[-1] + (before + REACH - places[-1])
        places += [before + REACH, after - REACH]
        drawn += [start, start + SHORTENED]
        breaks.append(start + SHORTENED / 2)
    places.append(centres[-1] + REACH)
    drawn.append(drawn[-1] + (places[-1] - places[-2]))
    return LongitudinalAxis(places, drawn, breaks)
