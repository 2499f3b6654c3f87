"""Units of a run's columns: converted to SI for a vehicle, retained as labels for a rig."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import Findings
from railui.io.table import Table
from railui.io.unit_parser import Unit
from railui.io.units import UnitError, parse_unit, parse_unit_like
from railui.runs.columns import Column

DIMENSIONLESS = ("", "-", "1")
DERIVATIVE_ORDERS = {"vz": 1, "az": 2}
# SI units of a bench, by column: translation, rotation
BENCH_UNITS = {"z": ("m", "rad"), "vz": ("m/s", "rad/s"), "F": ("N", "N*m")}
MAX_PLAUSIBLE_SD = 0.2  # m
CROSS_LEVEL_HEIGHT = (
    "divide the height by the distance of the running circles, 1.5 m, or give the channel to `cross_level` in a map of "
    "`railui import`, which does so"
)


def columns_in_si(
    table: Table, known: Mapping[str, Column], findings: Findings
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    """Return the known columns in SI and the unit of each in the file; report problems at the header."""
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    for i, name in enumerate(table.names):
        if name not in known:
            continue
        factor = _factor_to_si(
            table.units[i], known[name], findings, (table.header_position[0], table.column_positions[i])
        )
        if factor is not None:
            column = table.column(name)
            columns[name] = column if factor == 1 else column * factor
            units[name] = table.units[i] or known[name].unit
    return columns, units


def _factor_to_si(unit: str | None, column: Column, findings: Findings, place: tuple[int, int]) -> float | None:
    wanted = parse_unit(column.unit)
    try:
        if unit is None:
            raise UnitError("has no unit", f"write that of its numbers, such as `{column.name} [{column.unit}]`")
        given = parse_unit_like("1" if unit in DIMENSIONLESS else unit, column.unit)
        if not given.is_compatible(wanted):
            raise UnitError(
                f"the unit {unit} does not fit the {column.caption}, expected in {column.unit}",
                _remedy_of_other_dimension(given, column),
            )
    except UnitError as error:
        findings.add(column.name, error.message, error.remedy, position=place)
        return None
    return given.factor / wanted.factor


def _remedy_of_other_dimension(given: Unit, column: Column) -> str:
    """Return how to convert a column, or to correct its header, where the unit has another dimension."""
    if column.name == "phiw" and given.dimension == parse_unit("m").dimension:
        return CROSS_LEVEL_HEIGHT
    if column.role not in ("response", "coach"):
        return "convert the numbers, or correct the header if it is wrong"
    key = f"`sensors: {{{column.name}: {{unit: UNIT}}}}`"
    return f"convert the numbers; where the header is wrong, correct it, or give the unit by {key} in the campaign"


def rig_columns(
    table: Table, known: Mapping[str, Column], findings: Findings, notes: list[str]
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    """Return the columns of a rig: time in s, vz and az in units consistent with z, others as they are."""
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    for i, name in enumerate(table.names):
        if name not in known:
            continue
        columns[name], units[name] = table.column(name), table.units[i] or ""
        if name == "t":
            factor = _factor_to_si(
                table.units[i], known["t"], findings, (table.header_position[0], table.column_positions[i])
            )
            columns[name], units[name] = columns[name] * (factor or 1.0), "s"
    for name, order in DERIVATIVE_ORDERS.items():
        if name in columns and "z" in columns:
            factor = rate_factor(units["z"], units[name], order)
            if factor != 1.0:
                unit = f"{units['z']}/s" + ("^2" if order == 2 else "")
                notes.append(f"{name} converted from {units[name]} to {unit}, to go with z")
                columns[name], units[name] = columns[name] * factor, unit
    return columns, units


def bench_columns(
    table: Table, known: Mapping[str, Column], findings: Findings, notes: list[str]
) -> tuple[dict[str, FloatArray], dict[str, str]]:
    """Return the columns of a component bench: z, vz and F in SI where their units are known, others as they are.

    A design gives stiffness and damping in SI, and the runs of a campaign may have different units.
    """
    columns, units = rig_columns(table, known, findings, notes)
    for name in set(BENCH_UNITS) & set(columns):
        factor, units[name] = bench_factor(name, units[name])
        columns[name] = columns[name] if factor == 1 else columns[name] * factor
    return columns, units


def bench_factor(name: str, label: str) -> tuple[float, str]:
    """Return the factor from a label to the SI unit of a bench column, and that unit; 1 and the label if unknown.

    >>> bench_factor("z", "mm"), bench_factor("F", "V")
    ((0.001, 'm'), (1.0, 'V'))
    """
    with contextlib.suppress(UnitError):
        given = parse_unit(label or "1")
        for unit in BENCH_UNITS[name]:
            wanted = parse_unit(unit)
            if given.dimension == wanted.dimension:
                return given.factor / wanted.factor, unit
    return 1.0, label


def rate_factor(z: str, rate: str, order: int) -> float:
    """Return the factor from a rate's unit to that of z per s (per s^2); 1 if the labels are not such units.

    `g` is the acceleration of gravity here, not the gram.

    >>> round(rate_factor("mm", "m/s^2", 2), 9), rate_factor("m", "g", 2), rate_factor("V", "V", 2)
    (1000.0, 9.80665, 1.0)
    """
    try:
        wanted = parse_unit(f"({z})/s" if order == 1 else f"({z})/s^2")
        given = parse_unit_like(rate, wanted.text)
    except UnitError:
        return 1.0
    return given.factor / wanted.factor if given.dimension == wanted.dimension else 1.0


def check_magnitudes(
    table: Table, columns: Mapping[str, FloatArray], known: Mapping[str, Column], findings: Findings
) -> None:
    """Report motions and deviations with a standard deviation above 0.2 m, which are probably in mm."""
    reported = {problem.key for problem in findings.problems}
    for name, column in columns.items():
        values = column[np.isfinite(column)]
        if name == "s" or name in reported or known[name].unit != "m" or not values.size:
            continue
        with np.errstate(over="ignore"):  # infinite of numbers near the largest
            sd = float(np.std(values))
        if not sd > MAX_PLAUSIBLE_SD:
            continue
        message = f"its standard deviation is {sd:.3g} m, more than a vehicle or a track moves"
        findings.add(name, message, f"write `{name} [mm]` where the numbers are mm", position=table.header_position)
