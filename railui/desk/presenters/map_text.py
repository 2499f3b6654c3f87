"""Maps of the ride quality: their axes, their values and their texts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from railui.api.map_rows import SPEED, speed_axis
from railui.arrays import FloatArray
from railui.desk.presenters.design_results import DesignResults
from railui.desk.widgets.heat_map import MapData
from railui.io.number_format import format_quantity, typeset
from railui.optimisation.response_map import Axis
from railui.vehicle.design_reader import Design
from railui.vehicle.parameter import split_path

QUANTITIES: Final = {  # name, unit, factor from SI
    "weighted_acceleration": ("weighted acceleration", "m/s²", 1.0),
    "score": ("score", "", 1.0),
    "flange_margin": ("flange margin", "sd", 1.0),
    "safety_share": ("share of the safety limit", "%", 100.0),
    "linear_damping": ("least damping", "", 1.0),
    "linear_critical_speed": ("linear critical speed", "m/s", 1.0),
}
MAP_COLUMNS: Final = 11  # values of a parameter
MAP_SPEEDS: Final = np.arange(20.0, 85.0, 7.5)  # m/s
RATIO: Final = 4.0  # ends of a parameter's values over its value, and the inverse


@dataclass(frozen=True, eq=False)
class MapAxis:
    """Axis of a map with its name in words."""

    axis: Axis
    name: str

    @property
    def path(self) -> str:
        """Path of the parameter, or `speed`."""
        return self.axis.paths[0] if self.axis.paths else SPEED

    def labels(self) -> tuple[str, ...]:
        """Return the values with their units."""
        return tuple(typeset(format_quantity(value, self.axis.unit, 3)) for value in self.axis.values.tolist())


def parameter_axis(design: Design, path: str) -> MapAxis | None:
    """Return an axis over a parameter between a quarter and four times its value, None for one of 0 or below."""
    value = design.value(path)
    if path == SPEED or not value > 0:
        return None
    values = np.geomspace(value / RATIO, value * RATIO, MAP_COLUMNS)
    rounded = np.array([float(f"{one:.3g}") for one in values])
    group, key = split_path(path)
    name = f"{group.rpartition('.')[2]} {key}".replace("_", " ")
    return MapAxis(Axis(path, (path,), design.unit(path), rounded), name)


def speeds_axis() -> MapAxis:
    """Return the axis of speeds."""
    return MapAxis(speed_axis(MAP_SPEEDS.tolist()), "V")


def first_parameter(design: Design) -> str | None:
    """Return the parameter of a first map: the damping of the secondary suspension, or any spring or damper."""
    paths = [path for path in design.paths() if path.endswith(("damping", "stiffness")) and design.value(path) > 0]
    paths.sort(key=lambda path: ("secondary" not in path, "lateral_damping" not in path))
    return paths[0] if paths else None


def map_key(results: DesignResults, x: MapAxis, y: MapAxis) -> str:
    """Return what the values of a map depend on: the design without its own values on the axes, track and speed."""
    conditions = results.conditions
    fixed = {axis.path: float(axis.axis.values[0]) for axis in (x, y) if axis.path != SPEED}
    content = results.design.with_values(fixed).content()
    speed = "" if SPEED in (x.path, y.path) else f"{conditions.speed:.9g}"
    axes = [(axis.path, *axis.axis.values.tolist()) for axis in (x, y)]
    return repr((content, conditions.track, speed, axes))


@dataclass
class DesignMap:
    """Values of a map that arrive row by row."""

    x: MapAxis
    y: MapAxis
    rows: list[Mapping[str, FloatArray]] = field(default_factory=list)

    @property
    def is_complete(self) -> bool:
        """True if all rows are there."""
        return len(self.rows) == len(self.y.axis.values)

    def values(self, key: str) -> FloatArray:
        """Return the values [y, x] of a quantity in the unit in which it is shown, NaN where they are not known yet."""
        z = np.full((len(self.y.axis.values), len(self.x.axis.values)), np.nan)
        for j, row in enumerate(self.rows):
            z[j] = QUANTITIES[key][2] * row[key]
        return z


def map_data(known: DesignMap, key: str, results: DesignResults) -> MapData:
    """Return the picture of a map with the present design."""
    title, unit, _ = QUANTITIES[key]

    def own(axis: MapAxis) -> float:
        return results.conditions.speed if axis.path == SPEED else results.design.value(axis.path)

    x, y = known.x, known.y
    return MapData(
        title,
        unit,
        x.name,
        y.name,
        x.axis.values,
        y.axis.values,
        known.values(key),
        x.labels(),
        y.labels(),
        (own(x), own(y)),
        "computing the first rows",
    )


def axis_choices(design: Design) -> list[tuple[str, str]]:
    """List the parameters that an axis can have: path, text."""
    found: list[tuple[str, str]] = []
    for path in design.paths():
        parameter: Any = design.parameter(path)
        if design.value(path) > 0:
            found.append((path, f"{path:44} {parameter.caption}"))
    return found
