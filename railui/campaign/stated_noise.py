"""Noise of the columns as a campaign file states it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, suggest_name
from railui.io.table import read_header
from railui.io.units import UnitError, convert, quantity, split_quantity
from railui.runs.columns import RIG_FORMS, Form, columns_of
from railui.runs.units import (
    BENCH_UNITS,
    DERIVATIVE_ORDERS,
    bench_factor,
    rate_factor,
)


def read_stated_noise(raw: Any, kind: Form, files: Sequence[Path], findings: Findings) -> dict[str, float]:
    """Read the standard deviation [SI] of every column under `noise:`; files: the runs, for the units of a rig."""
    noise: dict[str, float] = {}
    columns = columns_of(kind)
    for name, value in (raw if isinstance(raw, dict) else {}).items():
        path = f"noise.{name}"
        known = [n for n, c in columns.items() if c.role != "clock"]
        if name in columns and name not in known:
            findings.add(path, f"{name} is the clock of the run and has no noise", "leave it out", key=True)
        elif name not in columns:
            findings.add(path, "unknown column", suggest_name(name, known), key=True)
        else:
            try:
                noise[name] = _standard_deviation(value, name, kind, files)
            except UnitError as error:
                findings.add(path, error.message, error.remedy)
    return noise


def _standard_deviation(value: Any, name: str, kind: Form, files: Sequence[Path]) -> float:
    if kind in RIG_FORMS:
        number = _rig_standard_deviation(value, name, kind, files)
    else:
        number = quantity(value, columns_of(kind)[name].unit)
    if number < 0:
        raise UnitError(f"{value!r} is not a standard deviation", "give 0 or more")
    return number


def _rig_standard_deviation(value: Any, name: str, kind: Form, files: Sequence[Path]) -> float:
    """Convert a standard deviation to the units in which the columns of a rig's run are read."""
    labels: Mapping[str, str | None] = {}
    number, unit = split_quantity(value) if isinstance(value, str) else (quantity(value, "1"), "")
    for file in files[:1]:
        try:
            header = read_header(file)
            labels = dict(zip(header.names, header.units, strict=True))
        except FileProblems:
            return number  # reading the run reports its problems
    label = labels.get(name) or ""
    if unit and not label:
        return _without_header_unit(value, number, unit, name, kind)
    if unit and unit != label:
        number = convert(number, unit, label)
    if kind == "bench" and name in BENCH_UNITS:
        return number * bench_factor(name, label)[0]
    if name not in DERIVATIVE_ORDERS:
        return number
    return number * rate_factor(labels.get("z") or "", label, DERIVATIVE_ORDERS[name])


def _without_header_unit(value: Any, number: float, unit: str, name: str, kind: Form) -> float:
    """Convert a standard deviation with a unit to the SI unit of a bench; UnitError for a column of unknown unit."""
    if kind == "bench" and name in BENCH_UNITS:
        factor, si_unit = bench_factor(name, unit)
        if si_unit in BENCH_UNITS[name]:
            return number * factor
    raise UnitError(
        f"{value!r} has a unit, but no header states that of {name}", "give the number alone, in the unit of the runs"
    )
