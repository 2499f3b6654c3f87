"""Tables of profiles in the rows of the kernel: their values, and tables of one length for vehicles of one batch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.vehicle.contact_profiles import SHAPE_KIND
from railui.vehicle.design import Design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.kernel_rows import effect_row

CURVES = ("radius", "radius_per_gauge", "angle")


def with_tables(design: Design, row: FloatArray, first: int) -> Design:
    """Return a design with the tables of a row [row], in which its effects begin at `first`."""
    effects = list(design.effects)
    for i, effect in enumerate(effects):
        width = len(effect_row(effect))
        if effect.kind == SHAPE_KIND:
            effects[i] = replace(effect, parameters=_parameters(row[first : first + width]))
        first += width
    return replace(design, effects=tuple(effects))


def _parameters(numbers: FloatArray) -> dict[str, tuple[float, ...]]:
    """Return the parameters of profile_shape from its numbers in the kernel: n, start, step, curves."""
    n, start, step = int(numbers[0]), float(numbers[1]), float(numbers[2])
    curves = np.asarray(numbers[3:]).reshape(len(CURVES), n)
    grid = np.linspace(start, start + step * (n - 1), n)
    return {"displacement": tuple(grid.tolist())} | {k: tuple(x.tolist()) for k, x in zip(CURVES, curves, strict=True)}


def with_common_tables(design: Design) -> Design:
    """Return a design whose tables that follow from its profiles have one length, so that batches may differ in them.

    A natural spline ends straight: knots on its straight continuation leave the curve as it is.
    """
    if design.profiles is None or not design.profiles.has_derived_table:
        return design
    effects = tuple(_lengthened(e) if e.kind == SHAPE_KIND else e for e in design.effects)
    return replace(design, effects=effects)


def _common_length() -> int:
    """Return a number of knots than which no table is longer."""
    from railui.contact.profile_shape import KNOT_SPACING, MAX_DISPLACEMENT

    return int(2.0 * MAX_DISPLACEMENT / KNOT_SPACING) + 2


def _lengthened(effect: PlacedEffect) -> PlacedEffect:
    grid = np.array(effect.parameters["displacement"])
    missing = _common_length() - len(grid)
    if missing <= 0:
        return effect
    step = (grid[-1] - grid[0]) / (len(grid) - 1)
    beyond = step * np.arange(1, missing + 1)
    added: Mapping[str, Any] = {"displacement": grid[-1] + beyond} | {
        key: _end_value(grid, np.array(effect.parameters[key]), beyond) for key in CURVES
    }
    return replace(effect, parameters={k: (*_tuple(effect, k), *map(float, x)) for k, x in added.items()})


def _tuple(effect: PlacedEffect, key: str) -> tuple[float, ...]:
    values = effect.parameters[key]
    assert isinstance(values, tuple)
    return values


def _end_value(grid: FloatArray, curve: FloatArray, beyond: FloatArray) -> FloatArray:
    """Return the straight continuation of a natural spline at distances [n] beyond its end."""
    from scipy.interpolate import CubicSpline

    slope = float(CubicSpline(grid, curve, bc_type="natural")(grid[-1], 1))
    return np.asarray(curve[-1] + slope * beyond)
