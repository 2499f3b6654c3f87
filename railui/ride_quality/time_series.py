"""Time series of a ride: every channel of the vehicle and the track under it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from railui.arrays import FloatArray
from railui.ride_quality.guiding_forces import wheel_load_paths
from railui.runs.columns import COLUMNS
from railui.track.excitation import Excitation
from railui.vehicle.channels import all_channels, channel_unit, check_channels
from railui.vehicle.model import Model
from railui.vehicle.simulate import simulate_series

CLOCK_AND_TRACK: Final = ("t", "s", "v", "yw", "phiw", "gauge")
LINE_UNITS: Final = {"curvature": "1/m", "cant": "m"}  # of a line with curves


@dataclass(frozen=True, eq=False)
class RideSeries:
    """Time series of a ride.

    Attributes
    ----------
    columns : dict of FloatArray
        Arrays [sample] in SI: t, s, v, the track under the leading wheelset (with curvature and cant on a line with
        curves), the channels, and wheel loads Qi.right, Qi.left where load transfer is among them; NaN from the sample
        at which the vehicle diverged.
    diverged_at : int or None
        Sample at which the vehicle diverged.
    """

    columns: dict[str, FloatArray]
    diverged_at: int | None

    def by_header(self) -> dict[str, FloatArray]:
        """Return the columns by the header of a run, `name [unit]`."""
        units = {name: COLUMNS[name].unit for name in CLOCK_AND_TRACK} | LINE_UNITS
        return {f"{name} [{units.get(name) or channel_unit(name)}]": x for name, x in self.columns.items()}


def ride_series(
    model: Model, excitation: Excitation, channels: Sequence[str] | None = None, jobs: int | None = 1
) -> RideSeries:
    """Simulate a vehicle and return its time series.

    Parameters
    ----------
    model : Model
    excitation : Excitation
    channels : sequence of str, optional
        Channels; all by default.
    jobs : int or None
        Threads; None for all.

    Raises
    ------
    ValueError
        For an unknown channel, and for a vehicle too stiff to integrate.

    Examples
    --------
    >>> from railui.track.excitation import resolve_track
    >>> from railui.vehicle.resolve import resolve_model
    >>> excitation = Excitation(resolve_track("erri_b176_low length=200"), 40.0)
    >>> series = ride_series(resolve_model("designs/test_bogie.yaml"), excitation, ["e1"])
    >>> list(series.by_header())
    ['t [s]', 's [m]', 'v [m/s]', 'yw [m]', 'phiw [rad]', 'gauge [m]', 'e1 [m]']
    """
    if channels is not None:
        check_channels(model, channels)
    names = all_channels(model) if channels is None else list(channels)
    values, diverged_at = simulate_series(model, excitation, names, jobs=jobs)
    if diverged_at is not None:
        values[:, diverged_at:] = np.nan
    track = excitation.track
    t, v = excitation.dt * np.arange(len(track)), np.full(len(track), excitation.speed)
    columns = dict(zip(CLOCK_AND_TRACK, (t, track.s, v, track.yw, track.phiw, track.gauge), strict=True))
    if track.has_curves:
        columns |= {"curvature": track.curvature, "cant": track.cant}
    series = dict(zip(names, values, strict=True))
    return RideSeries(columns | series | _wheel_loads(model, series), diverged_at)


def _wheel_loads(model: Model, series: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the wheel loads Qi.right, Qi.left [sample] in N of the wheelsets whose load transfer dQi is given."""
    loads: dict[str, FloatArray] = {}
    for i, path in enumerate(wheel_load_paths(model), 1):
        if (transfer := series.get(f"dQ{i}")) is not None:
            static = model.design.values[path]
            loads |= {f"Q{i}.right": static + transfer, f"Q{i}.left": static - transfer}
    return loads
