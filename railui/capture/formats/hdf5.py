"""HDF5: every series of one dimension, with unit and sampling rate from its attributes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import stated_clock
from railui.capture.formats.time_base import check_size
from railui.capture.formats.vectors import Vectors
from railui.capture.processing.recording import Recording

UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units")
FILL_ATTRIBUTES = ("_FillValue", "missing_value")  # of netCDF, in the numbers that are stored
SCALE_ATTRIBUTES = ("scale_factor", "add_offset")
RATE_ATTRIBUTES = ("rate", "fs", "sampling_rate", "sample_rate", "SampleRate")


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read the series, which may differ in length and rate; one within a group is called group/name."""
    import h5py

    columns: dict[str, FloatArray] = {}
    units: dict[str, str | None] = {}
    rates: dict[str, float] = {}
    notes: list[str] = []
    with h5py.File(path) as file:
        rate = rate or _attribute(file, RATE_ATTRIBUTES, float)

        def visit(name: str, item: Any) -> None:
            if not isinstance(item, h5py.Dataset):
                return
            if item.dtype.kind not in "fiu":
                notes.append(f"{name} holds no real numbers ({item.dtype}): left out")
                return
            check_size(path, name, item.size)
            values = np.squeeze(np.asarray(item[()], dtype=np.float64))
            values = _physical_values(name, item, values, notes)
            if values.ndim == 1 and values.size > 3:
                columns[name], units[name] = values, _attribute(item, UNIT_ATTRIBUTES, str)
                own = _attribute(item, RATE_ATTRIBUTES, float)
                rates.update({name: own} if own else {})
            elif values.ndim == 1 or item.ndim == 1:
                notes.append(f"{name} has {values.size} values: left out")
            elif values.ndim > 1:
                notes.append(f"{name} is an array of {' x '.join(map(str, values.shape))}: left out")

        file.visititems(visit)
    clock, stated = stated_clock(clock, columns, units)
    recording = Vectors(path, columns, stated, clock, rate, rates).recording()
    recording.notes.extend(notes)
    return [recording]


def _physical_values(name: str, item: Any, values: FloatArray, notes: list[str]) -> FloatArray:
    """Return stored values with the gaps, the scale and the offset that attributes state; add notes."""
    for attribute in FILL_ATTRIBUTES:
        fill = np.asarray(item.attrs.get(attribute, ())).ravel()
        rows = np.isin(values, fill.astype(item.dtype).astype(np.float64))
        if rows.any():
            values = np.where(rows, np.nan, values)
            notes.append(f"{name}: {np.count_nonzero(rows)} values of {fill[0]:g} are gaps: its {attribute}")
    scale, offset = (_attribute(item, (key,), float) for key in SCALE_ATTRIBUTES)
    if scale is not None or offset is not None:
        values = values * (1.0 if scale is None else scale) + (offset or 0.0)
        notes.append(f"{name}: its attributes scale_factor and add_offset are applied")
    return values


def _attribute(item: Any, names: tuple[str, ...], kind: type) -> Any:
    for name in names:
        if name in item.attrs:
            value = np.asarray(item.attrs[name]).ravel()[0]
            return kind(value.decode() if isinstance(value, bytes) else value)
    return None


def write(path: Path, recording: Recording) -> None:
    """Write a dataset per channel, and the time or distance."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, x in recording.columns().items():
            dataset = file.create_dataset(name, data=x)
            if (unit := recording.unit(name)) is not None:
                dataset.attrs["unit"] = unit
