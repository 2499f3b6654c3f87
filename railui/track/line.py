"""Track irregularities at equally spaced locations."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.core import Spline

SPACING_TOLERANCE = 0.01  # relative deviation of an interval from the spacing, as for the samples of a run
MIN_SAMPLES = 4  # for a cubic spline


@dataclass(frozen=True, eq=False, init=False)
class Track:
    """Track irregularities under the leading wheelset, one value per location.

    The columns are read-only copies.

    Parameters
    ----------
    s : array_like
        Distance along the track [m], equally spaced.
    yw : array_like
        Lateral deviation of the track centre line [m].
    phiw : array_like, optional
        Cross-level as an angle [rad]; by default 0.
    gauge : array_like, optional
        Gauge deviation [m]; by default 0.
    curvature : array_like, optional
        Curvature of the designed line [1/m], positive with the centre at +y (right-hand curves); by default 0.
    cant : array_like, optional
        Designed cant [m], positive where the left rail is higher; by default 0. `phiw` counts from it.
    conventions : tuple of str
        Lines of the header of its file.
    is_synthetic : bool
        True for the irregularities of a spectrum, which have no mean line.

    Raises
    ------
    ValueError
        For columns that differ in length, are not finite or not equally spaced.

    Examples
    --------
    >>> flat = Track(s=[0.0, 0.1, 0.2, 0.3], yw=[0.0] * 4)
    >>> round(flat.spacing, 12), len(flat), flat.length
    (0.1, 4, 0.3)
    """

    s: FloatArray
    yw: FloatArray
    phiw: FloatArray
    gauge: FloatArray
    conventions: tuple[str, ...] = ()
    is_synthetic: bool = False
    curvature: FloatArray = field(init=False)
    cant: FloatArray = field(init=False)

    def __init__(
        self,
        s: ArrayLike,
        yw: ArrayLike,
        phiw: ArrayLike | None = None,
        gauge: ArrayLike | None = None,
        conventions: tuple[str, ...] = (),
        is_synthetic: bool = False,
        curvature: ArrayLike | None = None,
        cant: ArrayLike | None = None,
    ) -> None:
        given = {"s": s, "yw": yw, "phiw": phiw, "gauge": gauge, "curvature": curvature, "cant": cant}
        rows = np.size(np.asarray(s))
        for name, values in given.items():
            column = np.zeros(rows) if values is None else np.array(values, dtype=np.float64)
            if column.shape != (rows,):
                raise ValueError(f"track column {name} has shape {column.shape}, s has {rows} values")
            bad = np.flatnonzero(~np.isfinite(column))
            if bad.size:
                raise ValueError(f"track column {name} is not finite at sample {bad[0]}, {bad.size} in all")
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        object.__setattr__(self, "conventions", tuple(conventions))
        object.__setattr__(self, "is_synthetic", is_synthetic)
        if rows < MIN_SAMPLES:
            raise ValueError(f"a track needs {MIN_SAMPLES} samples for its spline, here are {rows}")
        step = np.diff(self.s)
        if not self.spacing > 0 or np.max(np.abs(step - self.spacing)) > SPACING_TOLERANCE * self.spacing:
            i = int(np.argmax(np.abs(step - self.spacing)))
            raise ValueError(
                f"track samples must be equally spaced and increasing: {step[i]:g} m after "
                f"s = {self.s[i]:g} m, {self.spacing:g} m in the mean; `equally_spaced` resamples them"
            )

    @property
    def spacing(self) -> float:
        """Distance between two samples [m]."""
        return float((self.s[-1] - self.s[0]) / (self.s.size - 1))

    @property
    def length(self) -> float:
        """Distance from the first to the last sample [m]."""
        return float(self.s[-1] - self.s[0])

    def with_deviation(self, yw: ArrayLike) -> Track:
        """Return the track with another lateral deviation [m]."""
        columns = (self.s, yw, self.phiw, self.gauge, self.conventions)
        return Track(*columns, curvature=self.curvature, cant=self.cant)

    @property
    def has_curves(self) -> bool:
        """True if the line is not straight and level: it has curvature or cant."""
        return bool(np.any(self.curvature) or np.any(self.cant))

    @property
    def sha256(self) -> str:
        """Hash of the columns' bytes (little-endian doubles: s, yw, phiw, gauge; with curves curvature, cant)."""
        digest = hashlib.sha256()
        line = (self.curvature, self.cant) if self.has_curves else ()
        for column in (self.s, self.yw, self.phiw, self.gauge, *line):
            digest.update(column.astype("<f8").tobytes())
        return digest.hexdigest()

    def __len__(self) -> int:
        return int(self.s.size)


def equally_spaced(
    s: ArrayLike,
    yw: ArrayLike,
    phiw: ArrayLike | None = None,
    gauge: ArrayLike | None = None,
    *,
    spacing: float,
    conventions: tuple[str, ...] = (),
    curvature: ArrayLike | None = None,
    cant: ArrayLike | None = None,
) -> Track:
    """Resample track irregularities at equal spacing [m] by their cubic spline in s; curvature and cant linearly.

    Raises ValueError if s does not increase.

    >>> import numpy as np
    >>> s = np.array([0.0, 0.09, 0.21, 0.3, 0.41])
    >>> [round(float(y), 9) for y in equally_spaced(s, 2 * s, spacing=0.1).yw]
    [0.0, 0.2, 0.4, 0.6, 0.8]
    """
    given = np.asarray(s, dtype=np.float64)
    check_increasing(given)
    even = given[0] + spacing * np.arange(int(np.floor((given[-1] - given[0]) / spacing + 1e-9)) + 1)

    def resample(column: ArrayLike | None) -> FloatArray | None:
        return None if column is None else Spline(given, np.asarray(column, dtype=np.float64))(even)

    def linear(column: ArrayLike | None) -> FloatArray | None:
        return None if column is None else np.interp(even, given, np.asarray(column, dtype=np.float64))

    irregularities = (Spline(given, np.asarray(yw))(even), resample(phiw), resample(gauge))
    return Track(even, *irregularities, conventions, curvature=linear(curvature), cant=linear(cant))


def check_increasing(s: FloatArray) -> None:
    """Raise ValueError with the sample at which the distance does not increase."""
    back = np.flatnonzero(np.diff(s) <= 0)
    if back.size:
        i = int(back[0])
        raise ValueError(
            f"distance must increase from sample to sample: s = {s[i]:g} m at sample {i}, "
            f"{s[i + 1]:g} m at the next; leave out samples at standstill"
        )
