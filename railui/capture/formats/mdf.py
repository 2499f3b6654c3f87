"""ASAM MDF, the format of test benches and most vehicle recorders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from railui.capture.formats.time_base import Series, check_size, merge_series
from railui.capture.processing.recording import Recording


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read every numeric channel against its master channel; `clock` and `rate` are not used."""
    from asammdf import MDF

    series = []
    with MDF(path) as file:
        for number, group in enumerate(file.groups):
            check_size(path, f"group {number}", group.channel_group.cycles_nr)
        for signal in file.iter_channels(skip_master=True):
            values = np.asarray(signal.samples)
            if values.ndim == 1 and values.size > 3 and values.dtype.kind in "fiub":
                stamps = np.asarray(signal.timestamps, float)
                series.append(Series(signal.name, signal.unit or None, stamps, values.astype(float)))
    return [merge_series(path, series)]


def write(path: Path, recording: Recording) -> None:
    """Write one group with every channel."""
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append(
            [
                Signal(samples=x, timestamps=recording.t, name=name, unit=recording.units.get(name) or "")
                for name, x in recording.channels.items()
            ]
        )
        file.save(path, overwrite=True)
