"""Time series of a simulated ride, with their units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from railui.api.display import Summarised, SummaryRow, draw_on
from railui.arrays import FloatArray
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from railui.ride_quality.evaluation import TrackLike


@dataclass(frozen=True, eq=False)
class Series(Mapping[str, FloatArray], Summarised):
    """Time series of a ride: a mapping of arrays [sample] by name, in SI.

    Attributes
    ----------
    title : str
        Vehicle, track and speed.
    columns : mapping
        t, s, v, the track under the leading wheelset and the channels; NaN from the sample at which the vehicle
        diverged.
    units : mapping
        Unit of each column.
    diverged_at : float or None
        Distance s [m] at which the vehicle diverged.
    """

    title: str
    columns: Mapping[str, FloatArray] = field(repr=False)
    units: Mapping[str, str] = field(repr=False)
    diverged_at: float | None = None

    def __getitem__(self, name: str) -> FloatArray:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def rate(self) -> float:
        """Sampling rate [Hz]."""
        t = self.columns["t"]
        return float((t.size - 1) / (t[-1] - t[0]))

    def save(self, path: str | Path) -> Path:
        """Write the series as a run: .csv, .csv.gz or .parquet.

        Raises
        ------
        ValueError
            For another suffix.
        FileProblems
            For Parquet without pyarrow.
        """
        from railui.io.series_file import write_series

        columns = {f"{name} [{self.units[name]}]": values for name, values in self.columns.items()}
        return write_series(path, columns, [f"simulated by railui: {self.title}"])

    def to_frame(self) -> pandas.DataFrame:
        """Return the series as a pandas.DataFrame over t; ImportError without pandas."""
        from railui.api.frames import data_frame

        return data_frame(self.columns, "t", self.units)

    def to_xarray(self) -> xarray.Dataset:
        """Return the series as an xarray.Dataset over t, with units; ImportError without xarray."""
        from railui.api.frames import data_set

        return data_set(self.columns, "t", self.units, {"title": self.title})

    def plot(self, name: str, ax: Axes | None = None) -> Axes:
        """Draw a column against time on axes, a new figure by default; return the axes."""
        from railui.report.figures.drawing import BLUE, axis_label

        def draw(on: Axes) -> None:
            on.plot(self.columns["t"], self.columns[name], lw=0.8, color=BLUE)
            on.set_xlabel("time [s]")
            on.set_ylabel(axis_label(name, self.units[name]))

        return draw_on(ax, draw)

    def summary_title(self) -> str:
        """Return vehicle, track and speed."""
        return self.title

    def summary_rows(self) -> list[SummaryRow]:
        """Return the root mean square of every column but the clock."""
        import numpy as np

        names = [name for name in self.columns if name not in ("t", "s", "v")]
        rows = [SummaryRow(f"rms {n}", float(np.sqrt(np.nanmean(self.columns[n] ** 2))), self.units[n]) for n in names]
        return [*rows, SummaryRow("diverged at s", self.diverged_at, "m")]


def simulate_design(
    design: VehicleDesign,
    track: TrackLike,
    speed: float | str,
    channels: Sequence[str] | None = None,
    *,
    seed: int | None = None,
) -> Series:
    """Simulate a design on a track; parameters and exceptions as `Design.simulate`."""
    from railui.ride_quality.evaluation import excitation_of
    from railui.ride_quality.time_series import ride_series
    from railui.vehicle.resolve import resolve_model

    model, excitation = resolve_model(design), excitation_of(track, speed, seed)
    result = ride_series(model, excitation, channels)
    headers = (header.rpartition(" [") for header in result.by_header())
    units = {name: unit.removesuffix("]") for name, _, unit in headers}
    diverged_at = None if result.diverged_at is None else excitation.distance_at(result.diverged_at)
    title = f"{design.name} on {excitation.source.name} at {excitation.speed:.4g} m/s"
    return Series(title, result.columns, units, diverged_at)
