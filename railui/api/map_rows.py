"""Map of a design row by row: its results over a parameter, and over a second one or the speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.api.design import as_design
from railui.api.response_map import compute_map
from railui.arrays import FloatArray
from railui.vehicle.design import Design

if TYPE_CHECKING:
    from railui.optimisation.response_map import Axis
    from railui.track.excitation import TrackSource

SPEED: Final = "speed"  # name of an axis without a parameter: its values are speeds


def speed_axis(speeds: Sequence[float]) -> Axis:
    """Return an axis of speeds [m/s]."""
    from railui.optimisation.response_map import Axis

    return Axis(SPEED, (), "m/s", np.array(speeds, dtype=float))


def map_rows(
    design: Design,
    x: Axis,
    y: Axis,
    of: Sequence[str],
    source: TrackSource | None,
    speed: float | None,
    *,
    jobs: int | None = None,
) -> Iterator[dict[str, FloatArray]]:
    """Compute a map one value of y after the other, so that it can be shown and stopped meanwhile.

    Parameters
    ----------
    design : Design
    x : Axis
        Parameter.
    y : Axis
        Parameter, or `speed_axis`.
    of : sequence of str
        Keys of ride, stability or curve.
    source : TrackSource or None
        Track of the rides.
    speed : float or None
        Speed [m/s] of the rides, if it is not on an axis.
    jobs : int, optional
        Threads; by default all.

    Yields
    ------
    dict
        Values [x] of each key for one value of y, as `railui map` computes them.

    Raises
    ------
    ValueError
        For axes with a common path.
    """
    from railui.optimisation.evaluation import evaluate_in_process
    from railui.optimisation.response_map import Axis

    vehicle, evaluator = as_design(design), evaluate_in_process(jobs)
    for value in y.values.tolist():
        one = Axis(y.name, y.paths, y.unit, np.array([value]))
        at = speed if y.paths else value
        data: Mapping[str, Any] = compute_map(vehicle, (x, one), of, source, at, evaluator).data
        yield {key: np.array([np.nan if v is None else v for v in data["of"][key]["values"][0]]) for key in of}
