"""Results of a design over its parameters: sensitivities, and maps over two of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from railui.api.design import as_design
from railui.vehicle.design import Design

if TYPE_CHECKING:
    from railui.ride_quality.evaluation import TrackLike
    from railui.track.excitation import TrackSource

DEFAULT_RADIUS: Final = 600.0  # m, of the keys of curve
RIDE_KEYS: Final = ["score", "weighted_acceleration", "flange_margin", "linear_damping", "linear_critical_speed"]
LINEAR_KEYS: Final = ["linear_critical_speed"]


def sensitivity(
    design: Design | str | Path,
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
    from railui.io.units import read_speed
    from railui.optimisation.design_sensitivity import design_sensitivity
    from railui.optimisation.evaluation import evaluate_in_process
    from railui.optimisation.response_map import case_of, check_keys

    keys = default_keys(of, has_ride=track is not None and speed is not None)
    check_keys(keys, has_track=track is not None, has_speed=speed is not None)
    v = read_speed(speed) if isinstance(speed, str) else speed
    loaded = as_design(design)
    cases = [case_of(loaded, (), source, v, radius, cant_deficiency) for source in _sources(track, seeds)]
    return design_sensitivity(cases, keys, evaluate_in_process(jobs))


def default_keys(of: Sequence[str] | None, *, has_ride: bool) -> list[str]:
    """Return the keys of a sensitivity: those given, of a ride, or those that need no track."""
    return list(of) if of is not None else RIDE_KEYS if has_ride else LINEAR_KEYS


def _sources(track: TrackLike | None, seeds: Sequence[int] | None) -> list[TrackSource | None]:
    from railui.track.excitation import resolve_track

    if track is None:
        if seeds is not None:
            raise ValueError("seeds need a track")
        return [None]
    return [resolve_track(track, seed) for seed in ([None] if seeds is None else seeds)]


def response_map(
    design: Design | str | Path,
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
    from railui.io.units import read_speed
    from railui.optimisation.evaluation import evaluate_in_process
    from railui.optimisation.response_map import case_of, check_keys, read_axis
    from railui.optimisation.response_map import response_map as evaluate_map

    check_keys(of, has_track=track is not None, has_speed=speed is not None)
    v = read_speed(speed) if isinstance(speed, str) else speed
    loaded = as_design(design)
    first, second = read_axis(loaded, x), read_axis(loaded, y)
    case = case_of(loaded, [*first.paths, *second.paths], _sources(track, None)[0], v, radius, cant_deficiency)
    return evaluate_map(loaded, first, second, of, case, evaluate_in_process(jobs))
