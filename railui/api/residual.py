"""Residual series of a model: measured and simulated channels as they are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from railui.api.display import Summarised, SummaryRow, draw_on
from railui.arrays import FloatArray
from railui.campaign.comparison import compare, cut_samples
from railui.campaign.segment import Segment
from railui.identification.result import LoopResult
from railui.io.problems import suggest_name
from railui.runs.columns import RIG_FORMS, columns_of

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

    from railui.identification.estimation.validation import Validation

SEGMENTS: Final = ("estimation", "validation", "test")


@dataclass(frozen=True, eq=False)
class Residual(Summarised):
    """Measured and simulated channels of a segment as compared: in the band of the campaign, both ends cut.

    Attributes
    ----------
    file : str
        Name of the run.
    role : str
        estimation, validation or test.
    channels : tuple of str
    units : mapping
        Unit of each channel.
    t : array [n]
        Time in s.
    measured, simulated : array [channel, n]
    """

    file: str
    role: str
    channels: tuple[str, ...]
    units: Mapping[str, str] = field(repr=False)
    t: FloatArray = field(repr=False)
    measured: FloatArray = field(repr=False)
    simulated: FloatArray = field(repr=False)

    @property
    def values(self) -> FloatArray:
        """Measured less simulated [channel, n]."""
        return self.measured - self.simulated

    @property
    def nrmse(self) -> dict[str, float]:
        """NRMSE of each channel on this segment; NaN where the vehicle diverged."""
        error, power = np.sum(self.values**2, axis=1), np.sum(self.measured**2, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return dict(zip(self.channels, np.sqrt(error / power).tolist(), strict=True))

    def __getitem__(self, channel: str) -> FloatArray:
        return np.asarray(self.values[self._row(channel)])

    def _row(self, channel: str) -> int:
        if channel not in self.channels:
            raise KeyError(f"{channel!r} is not compared: {suggest_name(channel, self.channels)}")
        return self.channels.index(channel)

    def to_frame(self) -> pandas.DataFrame:
        """Return `CHANNEL measured`, `CHANNEL simulated` and `CHANNEL residual` over t; ImportError without pandas."""
        from railui.api.frames import data_frame

        columns, units = self._columns()
        return data_frame(columns, "t", units)

    def to_xarray(self) -> xarray.Dataset:
        """Return the columns of `to_frame` as an xarray.Dataset over t, with units; ImportError without xarray."""
        from railui.api.frames import data_set

        columns, units = self._columns()
        return data_set(columns, "t", units, {"title": f"{self.file}, {self.role}"})

    def _columns(self) -> tuple[dict[str, FloatArray], dict[str, str]]:
        columns: dict[str, FloatArray] = {"t": self.t}
        units = {"t": "s"}
        for channel, measured, simulated in zip(self.channels, self.measured, self.simulated, strict=True):
            parts = {"measured": measured, "simulated": simulated, "residual": measured - simulated}
            columns |= {f"{channel} {part}": values for part, values in parts.items()}
            units |= {f"{channel} {part}": self.units[channel] for part in parts}
        return columns, units

    def summary_title(self) -> str:
        """Return run and role."""
        return f"residual of {self.file}, {self.role}, {self.t[-1] - self.t[0]:.1f} s"

    def summary_rows(self) -> list[SummaryRow]:
        """Return NRMSE and rms of the residual of each channel."""
        rms = np.sqrt(np.mean(self.values**2, axis=1)).tolist()
        sizes = [
            SummaryRow(f"rms {name}", value, self.units[name]) for name, value in zip(self.channels, rms, strict=True)
        ]
        return [*(SummaryRow(f"NRMSE {name}", value) for name, value in self.nrmse.items()), *sizes]

    def plot(self, channel: str, ax: Axes | None = None) -> Axes:
        """Draw a channel as measured, simulated and their difference against time; return the axes."""
        from railui.report.figures.drawing import BLUE, GREY, ORANGE, axis_label

        row = self._row(channel)

        def draw(on: Axes) -> None:
            lines = ((self.measured, "measured", GREY, 1.8), (self.simulated, "simulated", BLUE, 0.9))
            for values, label, colour, width in lines:
                on.plot(self.t, values[row], lw=width, color=colour, label=label)
            on.plot(self.t, self[channel], lw=0.7, color=ORANGE, label="residual")
            on.set_xlabel("time [s]")
            on.set_ylabel(axis_label(channel, self.units[channel]))
            on.legend(frameon=False, fontsize=8, ncols=3, loc="upper right")

        return draw_on(ax, draw)


def segments_of(result: LoopResult, role: str) -> list[Segment]:
    """Return the segments of a role: estimation, validation, or test (runs, or the reserved part of validation runs).

    Raises
    ------
    ValueError
        For another role.
    """
    if role not in SEGMENTS:
        raise ValueError(f"no role {role!r}: {suggest_name(role, SEGMENTS)}")
    return list(getattr(result.dataset, role))


def residuals_of(
    result: LoopResult, validation: Validation, segments: Sequence[Segment], role: str
) -> tuple[Residual, ...]:
    """Return the residual of every segment that a validation has simulated."""
    campaign, units = result.dataset.campaign, _units(result)
    residuals = []
    for segment, series in zip(segments, validation.series, strict=True):
        compared = compare(campaign, segment, series)
        cut = cut_samples(campaign, segment)
        t = segment.columns["t"][cut : segment.samples - cut]
        labels = {name: units[segment.run_index][name] for name in compared.channels}
        measured, simulated = compared.measured, compared.simulated
        residuals.append(Residual(segment.file, role, compared.channels, labels, t, measured, simulated))
    return tuple(residuals)


def _units(result: LoopResult) -> list[dict[str, str]]:
    """Return the units of the channels of each run: SI, of a rig those of its file."""
    return [
        {name: run.units.get(name, "") if run.kind in RIG_FORMS else columns_of(run.kind)[name].unit for name in names}
        for run in result.dataset.runs
        for names in [run.responses]
    ]
