"""A track: what a vehicle's wheelsets meet at equally spaced places."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.core import Spline

UNEVEN = 0.01  # share of the spacing by which an interval may differ: as for the interval of a run


@dataclass(frozen=True, eq=False, init=False)
class Track:
    """s [m], yw [m], phiw [rad], gauge [m], one value each per place, and what its header says.

    Columns of one length, read-only copies; phiw and gauge left out are zero. Raises ValueError where
    columns differ in length, are not finite or not equally spaced.

    >>> flat = Track(s=[0.0, 0.1, 0.2, 0.3], yw=[0.0] * 4)
    >>> round(flat.spacing, 12), len(flat), flat.length
    (0.1, 4, 0.3)
    """

    s: FloatArray
    yw: FloatArray
    phiw: FloatArray
    gauge: FloatArray
    conventions: tuple[str, ...] = ()

    def __init__(
        self,
        s: ArrayLike,
        yw: ArrayLike,
        phiw: ArrayLike | None = None,
        gauge: ArrayLike | None = None,
        conventions: tuple[str, ...] = (),
    ) -> None:
        given = {"s": s, "yw": yw, "phiw": phiw, "gauge": gauge}
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
        if rows < 4:
            raise ValueError(f"a track needs 4 samples for its spline, here are {rows}")
        step = np.diff(self.s)
        if not self.spacing > 0 or np.max(np.abs(step - self.spacing)) > UNEVEN * self.spacing:
            i = int(np.argmax(np.abs(step - self.spacing)))
            raise ValueError(
                f"track samples must be equally spaced and increasing: {step[i]:g} m after "
                f"s = {self.s[i]:g} m, {self.spacing:g} m in the mean; `equally_spaced` lays them anew"
            )

    @property
    def spacing(self) -> float:
        """Distance of two samples [m]."""
        return float((self.s[-1] - self.s[0]) / (self.s.size - 1))

    @property
    def length(self) -> float:
        """Distance from the first to the last sample [m]."""
        return float(self.s[-1] - self.s[0])

    @property
    def sha256(self) -> str:
        """Hash of the columns' bytes (little-endian doubles, in the order s, yw, phiw, gauge)."""
        digest = hashlib.sha256()
        for column in (self.s, self.yw, self.phiw, self.gauge):
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
) -> Track:
    """The track that a run met, laid anew at equal spacing [m] by the cubic spline in s.

    Raises ValueError where s does not increase.

    >>> import numpy as np
    >>> s = np.array([0.0, 0.09, 0.21, 0.3, 0.41])
    >>> [round(float(y), 9) for y in equally_spaced(s, 2 * s, spacing=0.1).yw]
    [0.0, 0.2, 0.4, 0.6, 0.8]
    """
    place = np.asarray(s, dtype=np.float64)
    check_increasing(place)
    laid = place[0] + spacing * np.arange(int(np.floor((place[-1] - place[0]) / spacing + 1e-9)) + 1)

    def lay(column: ArrayLike | None) -> FloatArray | None:
        return None if column is None else Spline(place, np.asarray(column, dtype=np.float64))(laid)

    return Track(laid, Spline(place, np.asarray(yw))(laid), lay(phiw), lay(gauge), conventions)


def check_increasing(s: FloatArray) -> None:
    """Raises ValueError with the sample where distance stands still or runs back."""
    back = np.flatnonzero(np.diff(s) <= 0)
    if back.size:
        i = int(back[0])
        raise ValueError(
            f"distance must increase from sample to sample: s = {s[i]:g} m at sample {i}, "
            f"{s[i + 1]:g} m at the next; leave out where the vehicle stands"
        )
