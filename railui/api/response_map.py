"""Map of a design: its results over two of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from railui.api.design import Design, as_design
from railui.api.display import SummaryRow, draw_on
from railui.api.result import DEFAULT_RADIUS, DesignResult, metres_per_second, source_files, sources_of
from railui.arrays import FloatArray
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from railui.optimisation.evaluation import Evaluator
    from railui.optimisation.response_map import Axis
    from railui.ride_quality.evaluation import TrackLike
    from railui.track.excitation import TrackSource

MAP_SIZE: Final = (5.6, 4.2)  # inch


@dataclass(frozen=True, eq=False)
class ResponseMap(DesignResult):
    """Results of a design over two of its parameters; `Design.map` computes them.

    Attributes
    ----------
    design : Design
    data : mapping
        The result of `railui.response_map`.
    """

    COMMAND: ClassVar[str] = "map"

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the results."""
        return tuple(self.data["of"])

    @property
    def units(self) -> dict[str, str]:
        """Unit of both parameters and of each result."""
        axes = {str(self.data[axis]["name"]): str(self.data[axis]["unit"]) for axis in "xy"}
        return {**axes, **{key: str(one["unit"]) for key, one in self.data["of"].items()}}

    @property
    def x(self) -> FloatArray:
        """Values of the first parameter, SI."""
        return np.asarray(self.data["x"]["values"], dtype=float)

    @property
    def y(self) -> FloatArray:
        """Values of the second parameter, SI."""
        return np.asarray(self.data["y"]["values"], dtype=float)

    def values(self, key: str) -> FloatArray:
        """Return the values [y, x] of a result, NaN where a vehicle has none."""
        rows = self.data["of"][key]["values"]
        return np.array([[np.nan if value is None else value for value in row] for row in rows], dtype=float)

    def to_frame(self) -> pandas.DataFrame:
        """Return a row for each vehicle: both parameters, then the results; ImportError without pandas."""
        from railui.api.frames import data_frame

        x, y = np.meshgrid(self.x, self.y)
        columns = {self.data["x"]["name"]: x.ravel(), self.data["y"]["name"]: y.ravel()}
        return data_frame({**columns, **{key: self.values(key).ravel() for key in self.keys}}, None, self.units)

    def to_xarray(self) -> xarray.Dataset:
        """Return each result [y, x] over both parameters, with units; ImportError without xarray."""
        from railui.api.frames import grid_data_set

        axes = {str(self.data["y"]["name"]): self.y, str(self.data["x"]["name"]): self.x}
        return grid_data_set({key: self.values(key) for key in self.keys}, axes, self.units, self.summary_title())

    def plot(self, key: str, ax: Axes | None = None) -> Axes:
        """Draw a result over both parameters, with contours; the design is a star."""
        from railui.report.figures.response_map import draw_map_panel

        return draw_on(ax, lambda on: draw_map_panel(on, self.data, key), MAP_SIZE)

    def summary_title(self) -> str:
        """Return vehicle and parameters."""
        return f"map of {self.design.name}: {self.data['y']['name']} against {self.data['x']['name']}"

    def summary_rows(self) -> list[SummaryRow]:
        """Return each result of the design, and its range over the map."""
        rows = []
        for key, one in self.data["of"].items():
            finite = self.values(key)[np.isfinite(self.values(key))]
            ends = [float(finite.min()), float(finite.max())] if finite.size else None
            name, unit = key.replace("_", " "), one["unit"]
            rows += [SummaryRow(name, one["baseline"], unit), SummaryRow(f"{name}, least and greatest", ends, unit)]
        return rows


def compute_map(
    design: Design,
    axes: tuple[Axis, Axis],
    of: Sequence[str],
    source: TrackSource | None,
    speed: float | None,
    evaluator: Evaluator,
    *,
    radius: float = DEFAULT_RADIUS,
    cant_deficiency: float = 0.0,
) -> ResponseMap:
    """Compute a map over axes that are read, with an evaluator that may store the results."""
    from railui.optimisation.response_map import case_of
    from railui.optimisation.response_map import response_map as evaluate_map

    case = case_of(design, [*axes[0].paths, *axes[1].paths], source, speed, radius, cant_deficiency)
    data = evaluate_map(design, *axes, of, case, evaluator)
    context = {
        "track": None if source is None else source.name,
        "speed": speed,
        "radius": radius,
        "cant_deficiency": cant_deficiency,
    }
    return ResponseMap(design, data, source_files(design, source), None if source is None else source.seed, context)


def map_of(
    design: Design,
    x: str,
    y: str,
    of: Sequence[str],
    *,
    track: TrackLike | None = None,
    speed: float | str | None = None,
    radius: float = DEFAULT_RADIUS,
    cant_deficiency: float = 0.0,
    jobs: int | None = None,
) -> ResponseMap:
    """Compute a map of a design; parameters and exceptions as `response_map`."""
    from railui.optimisation.evaluation import evaluate_in_process
    from railui.optimisation.response_map import check_keys, read_axis

    check_keys(of, has_track=track is not None, has_speed=speed is not None)
    axes = read_axis(design, x), read_axis(design, y)
    source, v = sources_of(track, None)[0], metres_per_second(speed)
    curve: dict[str, Any] = {"radius": radius, "cant_deficiency": cant_deficiency}
    return compute_map(design, axes, of, source, v, evaluate_in_process(jobs), **curve)


def response_map(
    design: VehicleDesign | str | Path,
    x: str,
    y: str,
    of: Sequence[str],
    *,
    track: TrackLike | None = None,
    speed: float | str | None = None,
    radius: float = DEFAULT_RADIUS,
    cant_deficiency: float = 0.0,
    jobs: int | None = None,
) -> dict[str, Any]:
    """Compute results of a design over two of its parameters, as `railui map`; nothing is stored.

    Parameters
    ----------
    design : Design, str or Path
    x, y : str
        Axes, PATH=FIRST:LAST or PATH=FIRST:LAST:STEP, such as "contact.conicity=0.05:0.4".
    of : sequence of str
        Keys of ride, stability or curve.
    track, speed, radius, cant_deficiency, jobs
        As for `sensitivity`.

    Returns
    -------
    dict
        As `railui.optimisation.response_map.response_map`: x, y, of (values [y, x] by key), failures, notes.

    Raises
    ------
    FileProblems
        For faulty files and unknown paths.
    ValueError
        For an unknown key, a faulty axis, and keys of a ride without a track and a speed.

    Examples
    --------
    >>> axes = ("contact.conicity=0.1:0.3:0.1", "vehicle.secondary.yaw_damping=10e3:50e3:20e3")
    >>> result = response_map("designs/check_bogie.yaml", *axes, ["linear_critical_speed"])
    >>> len(result["of"]["linear_critical_speed"]["values"])
    3
    """
    curve: dict[str, Any] = {"radius": radius, "cant_deficiency": cant_deficiency}
    return dict(map_of(as_design(design), x, y, of, track=track, speed=speed, **curve, jobs=jobs).data)
