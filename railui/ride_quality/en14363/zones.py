"""Test zones and track sections: tangent track, large, small and very small radii."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray

MAX_TANGENT_CANT_DEFICIENCY: Final = 0.040  # m, of tangent track and curves of very large radius
TANGENT_RADIUS: Final = 10e3  # m above which a track is tangent at any cant deficiency
CURVATURE_TOLERANCE: Final = 0.10  # of the median of a curve, beyond which a location is in its transition
NOISE_LENGTH: Final = 20.0  # m of the running median of curvature and cant deficiency: shorter than a transition
SPEED_STEPS: Final = ((160.0 / 3.6, 100.0), (220.0 / 3.6, 250.0), (np.inf, 500.0))  # up to a speed [m/s]: length [m]
ROUNDING: Final = 1e-9  # of a speed in km/h that is converted to m/s


@dataclass(frozen=True)
class Zone:
    """Test zone: radii [m] from `radius_from` to below `radius_to`, number of sections that a test needs.

    `mean_radius`: least and largest mean radius [m] of its sections.
    """

    number: int
    caption: str
    radius_from: float
    radius_to: float
    required: int
    length: float | None = None
    mean_radius: tuple[float, float] = (0.0, np.inf)

    def section_length(self, speed: float) -> float:
        """Return the length [m] of a section; on tangent track and in large radii it grows with the speed [m/s]."""
        return self.length or next(length for limit, length in SPEED_STEPS if speed <= limit * (1.0 + ROUNDING))


ZONES: Final = (
    Zone(1, "tangent track and very large radii", TANGENT_RADIUS, np.inf, 25),
    Zone(2, "large radii, above 600 m", 600.0, TANGENT_RADIUS, 25),
    Zone(3, "small radii, 400 to 600 m", 400.0, 600.0, 50, 100.0, (450.0, 550.0)),
    Zone(4, "very small radii, 250 to 400 m", 250.0, 400.0, 25, 70.0, (280.0, 350.0)),
)


@dataclass(frozen=True)
class Section:
    """Track section: zone, ends [m], mean curvature [1/m] (right-hand curves positive), mean cant deficiency [m]."""

    zone: Zone
    start: float
    end: float
    curvature: float
    cant_deficiency: float


def zone_numbers(curvature: FloatArray, cant_deficiency: FloatArray) -> NDArray[np.int64]:
    """Return the number of the zone at each location, 0 outside all zones.

    >>> zone_numbers(np.array([0.0, 1 / 2000, 1 / 2000, -1 / 500, 1 / 300, 1 / 200]),
    ...              np.array([0.0, 0.03, 0.10, 0.10, 0.10, 0.10])).tolist()
    [1, 1, 2, 3, 4, 0]
    """
    radius = 1.0 / np.maximum(np.abs(curvature), 1e-12)
    numbers = np.zeros(radius.shape, dtype=np.int64)
    for zone in ZONES[1:]:
        numbers[(radius >= zone.radius_from) & (radius < zone.radius_to)] = zone.number
    numbers[np.isclose(radius, 600.0, rtol=1e-9)] = 3
    is_flat = np.abs(cant_deficiency) <= MAX_TANGENT_CANT_DEFICIENCY
    numbers[(radius >= TANGENT_RADIUS) | ((numbers == 2) & is_flat)] = 1
    return numbers


def cut_sections(s: FloatArray, curvature: FloatArray, cant_deficiency: FloatArray, speed: float) -> list[Section]:
    """Cut a line s [n] m into sections of the length of their zone at a speed [m/s].

    A section lies in one zone, on tangent track or in a curve between its transitions, in zone 1 as in the others,
    and does not cross a transition; what is shorter than a section is left out. Running medians of curvature and cant
    deficiency over 20 m decide, which keep jumps and pass over the noise of a recording.
    """
    spacing = float(np.median(np.diff(s)))
    bend, excess = (_running_median(x, spacing) for x in (curvature, cant_deficiency))
    numbers = zone_numbers(bend, excess)
    hand = np.where(np.abs(bend) <= 1.0 / TANGENT_RADIUS, 0.0, np.sign(bend))
    edges = np.flatnonzero((np.diff(numbers) != 0) | (np.diff(hand) != 0)) + 1
    bounds = [0, *edges.tolist(), len(s)]
    sections = []
    for first, stop in pairwise(bounds):
        zone = next((z for z in ZONES if z.number == numbers[first]), None)
        if zone is None or stop - first < 2:
            continue
        inside = np.arange(first, stop)
        if hand[first]:
            middle = np.median(bend[inside])
            inside = inside[np.abs(bend[inside] - middle) <= CURVATURE_TOLERANCE * abs(middle)]
        length = zone.section_length(speed)
        for part in np.split(inside, np.flatnonzero(np.diff(s[inside]) > NOISE_LENGTH) + 1):
            begin, end = s[part[0]], s[part[-1]] + spacing
            for k in range(int((end - begin) / length + 1e-6)):
                a = begin + k * length
                here = (s >= a) & (s < a + length)
                means = float(curvature[here].mean()), float(cant_deficiency[here].mean())
                sections.append(Section(zone, float(a), float(a + length), *means))
    return sections


def _running_median(x: FloatArray, spacing: float) -> FloatArray:
    """Return the median of x [n], sampled every so many m, over 20 m around each location."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(x, size=2 * round(0.5 * NOISE_LENGTH / spacing) + 1, mode="nearest"))
