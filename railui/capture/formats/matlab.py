"""MATLAB files: vectors of one length, of version 7.3 as the HDF5 that it is."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats import hdf5
from railui.capture.formats.clocks import check_size, of_columns
from railui.capture.processing.recording import Recording

RATES = ("fs", "Fs", "rate", "sampling_rate")


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """The longest vectors and all of their length; fs or rate is the sampling rate, `units` a struct of theirs."""
    from scipy.io import loadmat, whosmat

    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            return hdf5.read(path, clock, rate)
    for name, shape, _ in whosmat(path):
        check_size(path, name, math.prod(shape))
    found = loadmat(path, squeeze_me=True, struct_as_record=False)
    columns: dict[str, FloatArray] = {
        name: np.asarray(x, dtype=np.float64)
        for name, x in found.items()
        if not name.startswith("__") and getattr(x, "ndim", 0) == 1 and x.dtype.kind in "fiu" and x.size > 3
    }
    told = found.get("units")
    units = {name: str(getattr(told, name)) if hasattr(told, name) else None for name in columns}
    rate = rate or next((float(found[name]) for name in RATES if name in found), None)
    size = max((x.size for x in columns.values()), default=0)
    return [of_columns(path, {name: x for name, x in columns.items() if x.size == size}, units, clock, rate)]


def write(path: Path, recording: Recording) -> None:
    """A vector per channel, t, and the units as a struct."""
    from scipy.io import savemat

    units = {name: recording.units.get(name) or "1" for name in recording.channels}
    savemat(path, {"t": recording.t, **recording.channels, "units": units})
