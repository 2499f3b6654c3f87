"""TDMS of LabVIEW: waveforms with their own start and interval, and channels with a time channel in their group."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import stated_clock
from railui.capture.formats.time_base import Series, check_size, is_discrete, merge_series
from railui.capture.formats.vectors import Vectors
from railui.capture.processing.recording import Recording

UNIT_PROPERTIES = ("unit_string", "Unit", "unit", "NI_UnitDescription")
MICROSECONDS = 1e6


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read every numeric channel; one of several groups is called group/name."""
    from nptdms import TdmsFile

    waveforms: list[tuple[Any, str, np.ndarray]] = []
    columns: dict[str, FloatArray] = {}
    units: dict[str, str | None] = {}
    notes: list[str] = []
    with TdmsFile.open(path) as file:
        groups = [group for group in file.groups() if group.channels()]
        for channel in (channel for group in groups for channel in group.channels()):
            name = channel.name if len(groups) == 1 else f"{channel.group_name}/{channel.name}"
            check_size(path, name, len(channel))
            if len(channel) < 4:
                notes.append(f"{name} has {len(channel)} values: left out")
                continue
            if channel.dtype.kind not in "fiubM":
                notes.append(f"{name} holds no real numbers ({channel.dtype}): left out")
                continue
            values = np.asarray(channel[:])
            units[name] = _unit(channel) if values.dtype.kind != "M" else "s"
            if values.dtype.kind != "M" and float(channel.properties.get("wf_increment", 0.0)) > 0:
                waveforms.append((channel.properties, name, values))
            else:
                columns[name] = _as_numbers(values)
    clock, stated = stated_clock(clock, columns, units)
    vectors = Vectors(path, columns, stated, clock, rate)
    if not waveforms:
        recording = vectors.recording()
        recording.notes.extend(notes)
        return [recording]
    others, remarks = vectors.series()
    return [merge_series(path, [*_series_of(waveforms, units), *others], [*notes, *remarks])]


def _unit(channel: Any) -> str | None:
    texts = (str(channel.properties.get(name, "")).strip() for name in UNIT_PROPERTIES)
    return next((text for text in texts if text), None)


def _as_numbers(values: np.ndarray) -> FloatArray:
    """Return values as floats; time stamps as seconds since 1970, NaN where one is missing."""
    if values.dtype.kind != "M":
        return values.astype(np.float64)
    whole = values.astype("datetime64[us]")
    return np.where(np.isnat(whole), np.nan, whole.astype(np.int64) / MICROSECONDS)


def _series_of(waveforms: list[tuple[Any, str, np.ndarray]], units: dict[str, str | None]) -> list[Series]:
    """Return waveforms as series, whose time counts from the earliest start."""
    starts = [_start(properties) for properties, _, _ in waveforms]
    earliest = min((start for start in starts if start is not None), default=0)
    series = []
    for (properties, name, values), start in zip(waveforms, starts, strict=True):
        begin = float(properties.get("wf_start_offset", 0.0))
        begin += 0.0 if start is None else (start - earliest) / MICROSECONDS
        t: FloatArray = begin + float(properties["wf_increment"]) * np.arange(values.size, dtype=np.float64)
        series.append(Series(name, units[name], t, values.astype(np.float64), is_discrete(values)))
    return series


def _start(properties: Any) -> int | None:
    """Return the start of a waveform in microseconds since 1970, None if it is not stated."""
    start = properties.get("wf_start_time")
    return None if start is None else int(np.datetime64(start, "us").astype(np.int64))
