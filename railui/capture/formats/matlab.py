"""MATLAB files: vectors of one length; version 7.3 is read as HDF5."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats import hdf5
from railui.capture.formats.time_base import check_size, recording_from_columns
from railui.capture.processing.recording import Recording

RATE_VARIABLES = ("fs", "Fs", "rate", "sampling_rate")


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read the longest vectors and all of the same length; fs or rate is the sampling rate, `units` a struct."""
    from scipy.io import loadmat, whosmat

    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            return hdf5.read(path, clock, rate)
    for name, shape, _ in whosmat(path):
        check_size(path, name, math.prod(shape))
    variables = loadmat(path, squeeze_me=True, struct_as_record=False)
    columns: dict[str, FloatArray] = {
        name: np.asarray(x, dtype=np.float64)
        for name, x in variables.items()
        if not name.startswith("__") and getattr(x, "ndim", 0) == 1 and x.dtype.kind in "fiu" and x.size > 3
    }
    unit_struct = variables.get("units")
    units = {name: str(getattr(unit_struct, name)) if hasattr(unit_struct, name) else None for name in columns}
    rate = rate or next((float(variables[name]) for name in RATE_VARIABLES if name in variables), None)
    size = max((x.size for x in columns.values()), default=0)
    return [
        recording_from_columns(path, {name: x for name, x in columns.items() if x.size == size}, units, clock, rate)
    ]


def write(path: Path, recording: Recording) -> None:
    """Write a vector per channel, t, and the units as a struct."""
    from scipy.io import savemat

    units = {name: recording.units.get(name) or "1" for name in recording.channels}
    savemat(path, {"t": recording.t, **recording.channels, "units": units})
