"""MATLAB files: vectors; version 7.3 is read as HDF5."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats import hdf5
from railui.capture.formats.clocks import stated_clock
from railui.capture.formats.time_base import check_size
from railui.capture.formats.vectors import Vectors
from railui.capture.processing.recording import Recording

RATE_VARIABLES = ("fs", "Fs", "rate", "sampling_rate")
MAX_NAME_LENGTH = 63  # of a variable


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read the vectors; fs or rate is the sampling rate, `units` a struct."""
    from scipy.io import loadmat, whosmat

    with path.open("rb") as file:
        if b"MATLAB 7.3" in file.read(128):
            return hdf5.read(path, clock, rate)
    for name, shape, _ in whosmat(path):
        check_size(path, name, math.prod(shape))
    variables = loadmat(path, squeeze_me=True, struct_as_record=False)
    columns: dict[str, FloatArray] = {}
    notes = []
    for name, x in variables.items():
        shape = getattr(x, "shape", ())
        if name.startswith("__") or not shape:
            continue
        if x.dtype.kind not in "fiu":
            notes.append(f"{name} holds no real numbers ({x.dtype}): left out")
        elif len(shape) == 1 and shape[0] > 3:
            columns[name] = np.asarray(x, dtype=np.float64)
        elif len(shape) == 1:
            notes.append(f"{name} has {shape[0]} values: left out")
        else:
            notes.append(f"{name} is an array of {' x '.join(map(str, shape))}: left out")
    unit_struct = variables.get("units")
    units = {name: str(getattr(unit_struct, name)) if hasattr(unit_struct, name) else None for name in columns}
    rate = rate or next((float(variables[name]) for name in RATE_VARIABLES if name in variables), None)
    clock, stated = stated_clock(clock, columns, units)
    recording = Vectors(path, columns, stated, clock, rate).recording()
    recording.notes.extend(notes)
    return [recording]


def write(path: Path, recording: Recording) -> None:
    """Write a vector per channel, the time or distance, and the units as a struct.

    Raises
    ------
    ValueError
        If the name of a channel is not one of a variable.
    """
    from scipy.io import savemat

    columns = recording.columns()
    for name in columns:
        if not (name.isascii() and name.isidentifier() and name[0] != "_" and len(name) <= MAX_NAME_LENGTH):
            remedy = "rename it, or write .h5 or .mf4"
            raise ValueError(f"MATLAB has no variables called {name!r}: {remedy}")
        if name in (*RATE_VARIABLES, "units"):
            raise ValueError(f"a channel called {name!r} would be read as something else: rename it, or write .h5")
    units = {name: unit for name in columns if (unit := recording.unit(name)) is not None}
    savemat(path, {**columns, "units": units}, long_field_names=True)
