"""Plausibility of a run: values that no railway vehicle or track has, spikes, clipping, speed against distance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.dsp.robust import MAD_TO_SD
from railui.io.problems import Findings
from railui.io.table import Table
from railui.io.units import MAX_PLAUSIBLE_SPEED, MAX_SPEED
from railui.runs.clipping import clipped_samples
from railui.runs.columns import Column
from railui.runs.units import MAX_PLAUSIBLE_SD

CORRECT = "empty the cell, or correct the unit of the column"
ANGLE = "a cross-level as a height is no angle: divide it by the distance of the running circles, 1.5 m"
DEVIATION = "write the deviation from the nominal gauge: subtract 1.435 m"
# largest absolute value [SI] by column, several times what vehicles and tracks have
LIMITS: dict[str, tuple[float, str]] = {
    "s": (1e8, CORRECT),
    "v": (MAX_SPEED, "write `v [km/h]` where the numbers are km/h, or empty the cell"),
    "yw": (10.0, CORRECT),
    "phiw": (0.25, ANGLE),
    "gauge": (0.3, DEVIATION),
    **dict.fromkeys(("e1", "e2", "d1", "d2"), (1.0, CORRECT)),
    **dict.fromkeys(("ay1", "ay2", "ayf"), (1e5, CORRECT)),
    "rf": (100.0, CORRECT),
    **dict.fromkeys(("psi1", "psi2"), (1.0, CORRECT)),
    "Qy": (1e8, CORRECT),
    "Qpsi": (1e9, CORRECT),
}
LIMITS_BY_UNIT = {"m": 1.0, "m/s^2": 1e5, "rad/s": 100.0, "rad": 1.0}  # of a response of any other name
MAX_FAULTY_SHARE = 0.01  # of the rows with single wrong values
MAX_RMS = {"ay1": 100.0, "ay2": 100.0, "ayf": 30.0, "rf": 1.0, "psi1": 0.1, "psi2": 0.1}  # SI, of a whole run
MAX_RMS_BY_UNIT = {"m/s^2": 100.0, "rad/s": 1.0, "rad": 0.1}  # of a response of any other name
MIN_SPIKE_RATIO = 50.0  # of a sample off the line through its neighbours to the median of all
MIN_SPIKE_SHARE = 0.05  # of the robust standard deviation that counts as that median at least
MAX_NEIGHBOUR_SHARE = 0.2  # of a spike by which its neighbours differ
MAX_SPIKES_SHARE = 1e-3  # of the samples; more are shocks of the signal itself
MAX_DISTANCE_ERROR = 0.02  # of s against the integral of v
CLIPPED_COMMENT = "clipped: "  # a comment of a run, of channels that were clipped before they were processed


class Spikes(NamedTuple):
    """Spikes of a channel: their number, row and value of the largest."""

    number: int
    row: int
    value: float


def check_limits(
    table: Table, columns: Mapping[str, FloatArray], known: Mapping[str, Column], findings: Findings
) -> None:
    """Report the first value of each column [SI] beyond its limit as an error; known: the columns by name."""
    for name, x in columns.items():
        limit, remedy = LIMITS.get(name) or (LIMITS_BY_UNIT.get(known[name].unit, np.inf), CORRECT)
        beyond = np.flatnonzero(np.isfinite(x) & (np.abs(x) > limit))
        # a whole column in mm is reported by its standard deviation, with its unit
        is_in_mm = known[name].unit == "m" and name != "s" and _standard_deviation(x) > MAX_PLAUSIBLE_SD
        if beyond.size and not (is_in_mm and beyond.size > MAX_FAULTY_SHARE * x.size):
            row = int(beyond[0])
            more = f" (and {beyond.size - 1} more rows)" if beyond.size > 1 else ""
            unit = known[name].unit
            message = f"is {x[row]:.6g} {unit}, more than the {limit:g} {unit} that are possible{more}"
            findings.add(name, message, remedy, position=table.cell_position(row, name))


def _standard_deviation(x: FloatArray) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.std(x[np.isfinite(x)])) if np.isfinite(x).any() else 0.0


def warn_of_implausible(
    table: Table,
    columns: Mapping[str, FloatArray],
    rows: NDArray[np.intp],
    distance: FloatArray,
    known: Mapping[str, Column],
    findings: Findings,
) -> None:
    """Add warnings of a run: speed, distance against speed, size of accelerations, spikes, clipping.

    Parameters
    ----------
    table
        Table of the run.
    columns
        Columns in SI [n].
    rows
        Rows of the table of these values [n].
    distance
        Integral of the speed [m], [n].
    known
        Columns of the form of the run by name.
    findings
        Receives the warnings.
    """
    header = table.header_position
    speed = float(np.nanmedian(columns["v"]))
    if speed > MAX_PLAUSIBLE_SPEED:
        findings.warn("v", f"is {speed:.4g} m/s in the median", "write `v [km/h]` if it is in km/h", position=header)
    if "s" in table.names and "s" in columns:
        _warn_of_distance(columns["s"], distance, findings, table)
    for name, unit in ((c.name, c.unit) for c in known.values() if c.role == "response" and c.name in columns):
        limit = MAX_RMS.get(name, MAX_RMS_BY_UNIT.get(unit, np.inf))
        if (rms := float(np.sqrt(np.nanmean(columns[name] ** 2)))) > limit:
            message = f"has an rms of {rms:.4g} {unit}, vehicles have less than {limit:g} {unit}"
            findings.warn(name, message, "correct the unit in the header", position=header)
    for column in known.values():
        if column.role != "clock" and column.name in columns and column.name in table.names:
            _warn_of_samples(table, column, columns[column.name], rows, findings)
    for comment in table.comments:
        if comment.startswith(CLIPPED_COMMENT):
            remedy = "widen the range of the sensor, or leave the channel out"
            findings.warn("", f"was clipped in the recording: {comment.removeprefix(CLIPPED_COMMENT)}", remedy)


def _warn_of_distance(s: FloatArray, distance: FloatArray, findings: Findings, table: Table) -> None:
    ends = np.flatnonzero(np.isfinite(s))[[0, -1]]
    measured, driven = (float(np.diff(x[ends])[0]) for x in (s, distance))
    if driven > 0 and abs(measured / driven - 1) > MAX_DISTANCE_ERROR:
        message = f"covers {measured:.6g} m, the integral of v {driven:.6g} m"
        ratio = driven / measured if measured > 0 else np.inf
        is_kmh = abs(ratio / 3.6 - 1) < MAX_DISTANCE_ERROR
        remedy = "write `v [km/h]`, v is 3.6 times s" if is_kmh else "correct the unit of v or s, or leave s out"
        findings.warn("s", message, remedy, position=table.header_position)


def _warn_of_samples(table: Table, column: Column, x: FloatArray, rows: NDArray[np.intp], findings: Findings) -> None:
    name, unit = column.name, column.unit
    spikes = find_spikes(x)
    if spikes is not None:
        many = f"{spikes.number} spikes, the largest" if spikes.number > 1 else "a spike"
        message = f"has {many} of {spikes.value:.4g} {unit}, in a single row"
        place = table.cell_position(int(rows[spikes.row]), name)
        findings.warn(name, message, "empty the cell: the row becomes a gap", position=place)
    clipped = clipped_samples(x)
    if clipped is not None:
        count, level = clipped
        message = f"is clipped at {level:.4g} {unit}: {count} samples ({100 * count / x.size:.2g} %)"
        remedy = "widen the range of the sensor, or leave the column out"
        findings.warn(name, message, remedy, position=table.header_position)


def find_spikes(x: FloatArray) -> Spikes | None:
    """Return the single samples [n] far off their neighbours, None without any.

    >>> x = np.sin(np.arange(2000) / 9)
    >>> x[700] = 80.0
    >>> find_spikes(x)
    Spikes(number=1, row=700, value=80.0)
    """
    found, off = _spike_rows(x)
    if not found.size:
        return None
    largest = int(found[np.argmax(off)])
    return Spikes(int(found.size), largest, float(x[largest]))


def without_spikes(x: FloatArray) -> FloatArray:
    """Return a channel [n] with its spikes replaced by the mean of their neighbours."""
    found, _ = _spike_rows(x)
    if not found.size:
        return x
    smooth = x.copy()
    smooth[found] = 0.5 * (x[found - 1] + x[found + 1])
    return smooth


def _spike_rows(x: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Rows of the spikes of a channel [n], and how far they are off the line through their neighbours."""
    none = np.zeros(0, dtype=np.intp), np.zeros(0)
    if x.size < 8:
        return none
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(x[1:-1] - 0.5 * (x[:-2] + x[2:]))
        between = np.abs(x[2:] - x[:-2])
        spread = np.nanmedian(np.abs(x - np.nanmedian(x))) * MAD_TO_SD
        scale = max(float(np.nanmedian(off)) * MAD_TO_SD, MIN_SPIKE_SHARE * float(spread))
        found = np.flatnonzero((off > MIN_SPIKE_RATIO * scale) & (between < MAX_NEIGHBOUR_SHARE * off))
    if not scale or not found.size or found.size > max(MAX_SPIKES_SHARE * x.size, 1):
        return none
    return found + 1, off[found]
