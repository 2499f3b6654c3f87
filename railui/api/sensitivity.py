"""Sensitivity of a design: changes of its results with each of its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.design import Design, as_design
from railui.api.display import SummaryRow, draw_on
from railui.api.result import DEFAULT_RADIUS, DesignResult, metres_per_second, source_files, sources_of
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from railui.ride_quality.evaluation import TrackLike
    from railui.track.excitation import TrackSource

RIDE_KEYS: Final = ["score", "weighted_acceleration", "flange_margin", "linear_damping", "linear_critical_speed"]
LINEAR_KEYS: Final = ["linear_critical_speed"]


@dataclass(frozen=True, eq=False)
class Sensitivity(DesignResult):
    """Changes of the results of a design with each of its parameters; `Design.sensitivity` computes them.

    Attributes
    ----------
    design : Design
    data : mapping
        The result of `railui.sensitivity`.

    Examples
    --------
    >>> sensitivity = Design.load("designs/check_bogie.yaml").sensitivity(["linear_critical_speed"])
    >>> sensitivity.keys, sensitivity.largest("linear_critical_speed", 1)[0]["path"]
    (('linear_critical_speed',), 'vehicle.geometry.half_wheelbase')
    """

    COMMAND: ClassVar[str] = "sensitivity"

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the results."""
        return tuple(self.data["responses"])

    @property
    def parameters(self) -> tuple[Mapping[str, Any], ...]:
        """Parameters: path, unit, value, and by key change, change_sd, derivative, relative."""
        return tuple(self.data["parameters"])

    @property
    def units(self) -> dict[str, str]:
        """Unit of each result."""
        return {key: str(one["unit"]) for key, one in self.data["responses"].items()}

    def largest(self, key: str, count: int | None = None) -> tuple[Mapping[str, Any], ...]:
        """Return the parameters with the largest changes of a result, all by default; those without a value last."""

        def size(one: Mapping[str, Any]) -> tuple[bool, float]:
            change = one["change"][key]
            is_missing = change != change
            return is_missing, 0.0 if is_missing else -abs(change)

        return tuple(sorted(self.parameters, key=size)[:count])

    def to_frame(self) -> pandas.DataFrame:
        """Return a row for each parameter: value, unit, then change and relative change of each result.

        Raises
        ------
        ImportError
            Without pandas.
        """
        from railui.api.frames import frame_of_rows

        rows = []
        for one in self.parameters:
            columns = {f"{key} {of}": one[of][key] for key in self.keys for of in ("change", "relative")}
            rows.append({"path": one["path"], "value": one["value"], "unit": one["unit"], **columns})
        units = {f"{key} change": unit for key, unit in self.units.items()}
        return frame_of_rows(rows, units).set_index("path")

    def plot_changes(self, key: str, ax: Axes | None = None) -> Axes:
        """Draw the largest changes of a result as a parameter rises by 10 %."""
        from railui.report.figures.sensitivity import draw_changes_of, panel_height

        size = (7.0, panel_height(self.data, key))
        return draw_on(ax, lambda on: draw_changes_of(on, self.data, key), size)

    def summary_title(self) -> str:
        """Return the vehicle."""
        return f"sensitivity of {self.design.name}"

    def summary_rows(self) -> list[SummaryRow]:
        """Return each result with the parameter that changes it most."""
        rows = []
        for key, one in self.data["responses"].items():
            first = self.largest(key, 1)
            most = f"; most by {first[0]['path']}" if first else ""
            rows.append(SummaryRow(key.replace("_", " "), SummaryRow("", one["value"], one["unit"]).text + most))
        return rows


def default_keys(of: Sequence[str] | None, *, has_ride: bool) -> list[str]:
    """Return the keys of a sensitivity: those given, of a ride, or those that need no track."""
    return list(of) if of is not None else RIDE_KEYS if has_ride else LINEAR_KEYS


def compute_sensitivity(
    design: Design,
    keys: Sequence[str],
    sources: Sequence[TrackSource | None],
    speed: float | None,
    *,
    seeds: Sequence[int] | None = None,
    radius: float = DEFAULT_RADIUS,
    cant_deficiency: float = 0.0,
    jobs: int | None = None,
) -> Sensitivity:
    """Compute the sensitivity of a design on tracks that are read, one for each seed."""
    from railui.optimisation.design_sensitivity import design_sensitivity
    from railui.optimisation.evaluation import evaluate_in_process
    from railui.optimisation.response_map import case_of

    first = sources[0]
    cases = [case_of(design, (), source, speed, radius, cant_deficiency) for source in sources]
    data = design_sensitivity(cases, keys, evaluate_in_process(jobs))
    context = {
        "track": None if first is None else first.name,
        "speed": speed,
        "radius": radius,
        "cant_deficiency": cant_deficiency,
        "seeds": seeds,
    }
    seed = None if first is None or seeds is not None else first.seed
    return Sensitivity(design, data, source_files(design, first), seed, context)


def sensitivity_of(
    design: Design,
    of: Sequence[str] | None = None,
    *,
    track: TrackLike | None = None,
    speed: float | str | None = None,
    seeds: Sequence[int] | None = None,
    radius: float = DEFAULT_RADIUS,
    cant_deficiency: float = 0.0,
    jobs: int | None = None,
) -> Sensitivity:
    """Compute the sensitivity of a design; parameters and exceptions as `sensitivity`."""
    from railui.optimisation.response_map import check_keys

    keys = default_keys(of, has_ride=track is not None and speed is not None)
    check_keys(keys, has_track=track is not None, has_speed=speed is not None)
    curve: dict[str, Any] = {"radius": radius, "cant_deficiency": cant_deficiency}
    return compute_sensitivity(
        design, keys, sources_of(track, seeds), metres_per_second(speed), seeds=seeds, **curve, jobs=jobs
    )


def sensitivity(
    design: VehicleDesign | str | Path,
    of: Sequence[str] | None = None,
    *,
    track: TrackLike | None = None,
    speed: float | str | None = None,
    seeds: Sequence[int] | None = None,
    radius: float = DEFAULT_RADIUS,
    cant_deficiency: float = 0.0,
    jobs: int | None = None,
) -> dict[str, Any]:
    """Compute the change of results with each parameter of a design, all others fixed, as `railui sensitivity`.

    Parameters
    ----------
    design : Design, str or Path
    of : sequence of str, optional
        Keys of ride, stability or curve; ride quality and damping by default.
    track : Track, TrackSource, spec or path, optional
        Track of the ride.
    speed : float or str, optional
        Speed [m/s], or a quantity.
    seeds : sequence of int, optional
        Seeds of the track, over which changes are averaged.
    radius, cant_deficiency : float
        Curve of the keys of curve [m].
    jobs : int, optional
        Threads; by default all.

    Returns
    -------
    dict
        As `railui.optimisation.design_sensitivity.design_sensitivity`: responses, parameters, skipped, notes.

    Raises
    ------
    FileProblems
        For faulty files.
    ValueError
        For an unknown key, and keys of a ride without a track and a speed.

    Examples
    --------
    >>> result = sensitivity("designs/check_bogie.yaml", ["linear_critical_speed"])
    >>> round(result["responses"]["linear_critical_speed"]["value"], 2)
    61.64
    """
    curve: dict[str, Any] = {"radius": radius, "cant_deficiency": cant_deficiency}
    result = sensitivity_of(as_design(design), of, track=track, speed=speed, seeds=seeds, **curve, jobs=jobs)
    return dict(result.data)
