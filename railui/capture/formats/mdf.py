"""ASAM MDF, the format of test benches and most vehicle recorders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import axis_factor
from railui.capture.formats.time_base import Series, check_size, is_discrete, merge_series
from railui.capture.processing.recording import Recording

TIME_MASTERS = (0, 1)  # sync types of a master channel: none stated, time


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read every numeric channel against its master channel; `clock` and `rate` are not used.

    Samples that the recorder marked invalid are gaps.
    """
    from asammdf import MDF

    series, notes = [], []
    with MDF(path) as file:
        for number, group in enumerate(file.groups):
            check_size(path, f"group {number}", group.channel_group.cycles_nr)
        for signal in file.iter_channels(skip_master=True):
            values = np.asarray(signal.samples)
            if values.ndim == 1 and values.size > 3 and values.dtype.kind in "fiub":
                unit, sync = _master(file, signal.group_index)
                if sync not in TIME_MASTERS:
                    notes.append(f"{signal.name} is not recorded against time: left out")
                    continue
                stamps = np.asarray(signal.timestamps, float) * axis_factor(path, "master channel", unit, "s")
                valid, invalid_count = _valid_values(signal)
                if invalid_count:
                    notes.append(f"{signal.name}: {invalid_count} samples marked invalid by the recorder are gaps")
                series.append(Series(signal.name, signal.unit or None, stamps, valid, is_discrete(values)))
            elif values.ndim == 1 and values.dtype.kind in "fiub":
                notes.append(f"{signal.name} has {values.size} values: left out")
            else:
                notes.append(f"{signal.name} holds no real numbers ({values.dtype}): left out")
    return [merge_series(path, series, notes)]


def _master(file: Any, group: int) -> tuple[str | None, int]:
    """Return unit and sync type of the master channel of a group."""
    index = file.masters_db.get(group)
    if index is None:
        return None, 1
    channel = file.groups[group].channels[index]
    return getattr(channel, "unit", None) or None, int(getattr(channel, "sync_type", 1) or 0)


def _valid_values(signal: Any) -> tuple[FloatArray, int]:
    """Return the values, NaN where the recorder marked them invalid, and the number of these."""
    values = np.asarray(signal.samples).astype(float)
    bits = signal.invalidation_bits
    if bits is None:
        return values, 0
    invalid = np.asarray(bits, dtype=bool)
    values[invalid] = np.nan
    return values, int(np.count_nonzero(invalid))


def write(path: Path, recording: Recording) -> None:
    """Write one group with every channel.

    Raises
    ------
    ValueError
        If the recording is one against distance.
    """
    from asammdf import MDF, Signal

    if recording.abscissa != "t":
        raise ValueError("MDF would hold the distance as a time: write .h5, .mat or .csv")
    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(samples=x, timestamps=recording.t, name=name, unit=recording.unit(name) or "")
                for name, x in recording.columns().items()
                if name != recording.abscissa
            ]
        )
        file.save(path, overwrite=True)
