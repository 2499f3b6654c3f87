"""Catalogue of effects and parameters of the kernel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from railui import _core
from railui.arrays import FloatArray

Record = dict[str, Any]

MEASURED_FORCE = "measured_force"  # the only kind with a choice of abscissa: z, v or s
CURVE_KINDS = (MEASURED_FORCE, "profile_shape", "rolling_line")  # kinds whose parameters are lists
LINKAGE_NUMBER: int = _core.LINKAGE  # "wheelset" of the linkage between both wheelsets of a bogie


@cache
def effect_catalogue() -> tuple[Record, ...]:
    """Return the records of all effects, in the order of the kernel.

    >>> effect_catalogue()[0]["kind"]
    'spring'
    """
    return tuple(_core.catalogue())


@cache
def effect_record(kind: str) -> Record:
    """Return the record of an effect; raise KeyError for a kind that is not in the catalogue."""
    return {record["kind"]: record for record in effect_catalogue()}[kind]


@cache
def common_kinds() -> tuple[str, ...]:
    """Return the kinds of the common effects, to which a table with little room is limited.

    >>> common_kinds()[:2]
    ('free_play', 'dry_friction')
    """
    common = [record for record in effect_catalogue() if record["common"]]
    return tuple(record["kind"] for record in sorted(common, key=lambda record: record["common"]))


def adds_body(kind: str) -> bool:
    """Return True for an effect that adds a body, such as a lateral mode of the carbody.

    >>> adds_body("coach_mode"), adds_body("spring")
    (True, False)
    """
    return bool(effect_record(kind)["acts"] == "body")


@cache
def parameter_paths(kind: str, rig_input: str | None = None) -> tuple[str, ...]:
    """Return the paths of the numbers of a kind of vehicle ("bogie", "wheelset", "rig"), of a rig by its input.

    >>> parameter_paths("rig")[0]
    'vehicle.rig.mass'
    """
    return tuple(_core.parameters(kind, rig_input))


@dataclass(frozen=True)
class Placement:
    """Effect at a location of a vehicle.

    Attributes
    ----------
    kind, at : str
        Kind and location.
    wheelset : int or None
        None for both, or for a location without wheelsets.
    parameter_count : int
        Length of its numbers in the kernel; that of the catalogue by default.
    against : str or None
        Abscissa of a measured force: z (the default), v or s; "gauge" for a flange that the gauge moves.

    Examples
    --------
    >>> Placement("measured_force", "frame", None, 5) == Placement("measured_force", "frame", None, 5, "z")
    True
    """

    kind: str
    at: str
    wheelset: int | None = None
    parameter_count: int = 0
    against: str | None = None

    def __post_init__(self) -> None:
        if not self.parameter_count:
            object.__setattr__(self, "parameter_count", len(effect_record(self.kind)["parameters"]))
        if self.against is None and self.kind == MEASURED_FORCE:
            object.__setattr__(self, "against", "z")


def effect_numbers(kind: str, values: Mapping[str, Any]) -> list[float]:
    """Return the numbers of an effect in the kernel's order, with defaults for absent parameters.

    The abscissa of a curve is not a number: it belongs to the `Placement`.
    """
    if kind == "profile_shape":
        grid, *curves = (list(values[p["key"]]) for p in effect_record(kind)["parameters"])
        step = (grid[-1] - grid[0]) / (len(grid) - 1)
        return [float(len(grid)), grid[0], step, *(x for curve in curves for x in curve)]
    if kind == "rolling_line":
        return [float(len(values["place"])), *values["place"], *values["offset"]]
    if kind == MEASURED_FORCE:
        motion, force = list(values["motion"]), list(values["force"])
        return [float(len(motion)), *motion, *force]
    return [float(values.get(p["key"], p["default"])) for p in effect_record(kind)["parameters"]]


def creep_forces(
    kind: str,
    values: Mapping[str, Any],
    wheel_load: float,
    creep_slopes: tuple[float, float],
    linear: FloatArray,
    speed: float = 0.0,
) -> FloatArray:
    """Return the creep forces T_x, T_y [n, 2] of a wheel [N] by a creep law of the catalogue.

    Parameters
    ----------
    kind : str
        Kind of the law.
    values : mapping
        Parameters of the law.
    wheel_load : float
        Load of the wheel [N].
    creep_slopes : (float, float)
        kappa_x N and kappa_y N [N].
    linear : array [n, 3]
        t_x, t_y and the spin part of t_y by the linear law [N].
    speed : float
        Speed [m/s].

    Raises
    ------
    ValueError
        If the kind is not a creep law.

    Examples
    --------
    >>> t = creep_forces("creep_saturation", {"friction": 0.3}, 1e4, (1e6, 1e6), np.array([[9e3, 0.0, 0.0]]))
    >>> round(float(t[0, 0]), 9)
    3000.0
    """
    rows = np.ascontiguousarray(linear, dtype=float).tolist()
    return np.array(_core.creep_forces(kind, effect_numbers(kind, values), wheel_load, list(creep_slopes), rows, speed))
