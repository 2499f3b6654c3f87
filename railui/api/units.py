"""Units of arrays: their conversion to the SI unit of a quantity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray
from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError, convert


def in_si(
    columns: Mapping[str, ArrayLike], si: Mapping[str, str], units: Mapping[str, str] | None, name: str
) -> dict[str, FloatArray]:
    """Return arrays in SI.

    Parameters
    ----------
    columns : mapping
        Arrays [n] by name.
    si : mapping
        SI unit of each name that is known.
    units : mapping, optional
        Units of the arrays by name; SI by default.
    name : str
        Name of the arrays in problems.

    Raises
    ------
    FileProblems
        For an unknown name, and a unit of another dimension.

    Examples
    --------
    >>> in_si({"yw": [1.0, 2.0]}, {"yw": "m"}, {"yw": "mm"}, "arrays")["yw"].tolist()
    [0.001, 0.002]
    """
    findings = Findings(name)
    given = check_unit_names(columns, units, findings)
    converted: dict[str, FloatArray] = {}
    for key, values in columns.items():
        if key not in si:
            findings.add(key, "no such column", suggest_name(key, si))
            continue
        try:
            factor = convert(1.0, given.get(key, si[key]), si[key])
        except UnitError as error:
            findings.add(key, error.message, error.remedy)
            continue
        array = np.asarray(values, dtype=np.float64)
        converted[key] = array if factor == 1.0 else array * factor
    findings.raise_errors()
    return converted


def check_unit_names(
    columns: Mapping[str, ArrayLike], units: Mapping[str, str] | None, findings: Findings
) -> Mapping[str, str]:
    """Return the units; a unit of a column that is not there joins the findings."""
    for key in units or {}:
        if key not in columns:
            findings.add(f"units.{key}", "no such column", suggest_name(key, columns))
    return units or {}
