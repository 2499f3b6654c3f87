"""HDF5: every series of one dimension, with the unit and the rate that its attributes tell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import check_size, of_columns
from railui.capture.processing.recording import Recording

UNITS = ("unit", "units", "Unit", "Units")
RATES = ("rate", "fs", "sampling_rate", "sample_rate", "SampleRate")


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """The longest series and all of their length; a series within a group is called group/name."""
    import h5py

    columns: dict[str, FloatArray] = {}
    units: dict[str, str | None] = {}
    with h5py.File(path) as file:
        rate = rate or _attribute(file, RATES, float)

        def visit(name: str, item: Any) -> None:
            nonlocal rate
            if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiu":
                return
            check_size(path, name, item.size)
            values = np.squeeze(np.asarray(item[()], dtype=np.float64))
            if values.ndim == 1 and values.size > 3:
                columns[name], units[name] = values, _attribute(item, UNITS, str)
                rate = rate or _attribute(item, RATES, float)

        file.visititems(visit)
    size = max((x.size for x in columns.values()), default=0)
    kept = {name: x for name, x in columns.items() if x.size == size}
    return [of_columns(path, kept, units, clock, rate)]


def _attribute(item: Any, names: tuple[str, ...], kind: type) -> Any:
    for name in names:
        if name in item.attrs:
            value = np.asarray(item.attrs[name]).ravel()[0]
            return kind(value.decode() if isinstance(value, bytes) else value)
    return None


def write(path: Path, recording: Recording) -> None:
    """A dataset per channel, and t."""
    import h5py

    with h5py.File(path, "w") as file:
        file.create_dataset("t", data=recording.t).attrs["unit"] = "s"
        for name, x in recording.channels.items():
            file.create_dataset(name, data=x).attrs["unit"] = recording.units.get(name) or "1"
