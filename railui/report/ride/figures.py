"""Figures of a ride: time histories, power spectral densities, guiding forces and Y/Q along the line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.dsp.spectra import welch
from railui.io.number_format import typeset_unit
from railui.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    STYLE,
    Drawing,
    Picture,
    axis_label,
    draw_picture,
    figure_file,
)
from railui.report.numbers import readable_scale
from railui.ride_quality.comfort import floor_points
from railui.ride_quality.running_safety import QUOTIENT_LIMIT, GuidingForces, guiding_force_channels
from railui.ride_quality.time_series import RideSeries
from railui.track.excitation import Excitation
from railui.vehicle.channels import channel_unit
from railui.vehicle.model import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: Final = (BLUE, ORANGE, GREEN, GREY)
MAX_LINE_BUCKETS: Final = 1500  # of a drawn line, each with its smallest and largest value
MIN_SEGMENT: Final = 256  # samples of Welch's segments
SEGMENTS: Final = 8  # into which a ride is divided for its spectra, which overlap by half
MAX_FREQUENCY: Final = 60.0  # Hz, of the drawn spectra
LABEL_LETTERS: Final = 24  # that fit along the axes; a longer label is smaller
SHOWN_RANGE: Final = 1e10  # of a spectrum, from its largest value down
PAGE_SIZE: Final = (9.4, 2.3)  # inch
PANEL_HEIGHT: Final = 1.7  # inch, in a file with all panels
LEGEND: Final[dict[str, Any]] = {
    **{"frameon": False, "fontsize": 8, "ncols": 5},
    **{"loc": "lower right", "bbox_to_anchor": (1.0, 0.98), "borderaxespad": 0.0},
}


def envelope(x: FloatArray, y: FloatArray, buckets: int = MAX_LINE_BUCKETS) -> tuple[FloatArray, FloatArray]:
    """Return a line with fewer points and the same look: the least and the largest value of each bucket.

    >>> envelope(np.arange(6.0), np.array([0.0, 5.0, 1.0, -2.0, 3.0, 0.0]), 2)
    (array([0., 0., 3., 3.]), array([ 0.,  5., -2.,  3.]))
    """
    if len(x) <= 2 * buckets:
        return x, y
    starts = np.linspace(0, len(x), buckets, endpoint=False).astype(int)
    ends = [np.minimum.reduceat(y, starts), np.maximum.reduceat(y, starts)]
    return np.repeat(x[starts], 2), np.stack(ends, axis=1).ravel()


class RidePanels:
    """Panels of a ride, each drawn into its own axes.

    Parameters
    ----------
    model : Model
    excitation : Excitation
    series : RideSeries
        With all channels.
    """

    def __init__(self, model: Model, excitation: Excitation, series: RideSeries) -> None:
        self.model, self.excitation, self.series = model, excitation, series
        self.wheelsets = len(model.wheelset_distances())
        self.comfort = tuple(f"floor.{name}" for name in floor_points(model)) or ("ayf",)

    def panels(self) -> list[Drawing]:
        """Return name, alternative text and drawing function of every panel."""
        numbers = range(1, self.wheelsets + 1)
        e, axle_boxes = [f"e{i}" for i in numbers], [f"ay{i}" for i in numbers]
        shown: list[Drawing] = [
            ("track", "Lateral deviation of the track against time", lambda ax: self._histories(ax, ["yw"])),
            ("displacement", "Displacement of the wheelsets against time", lambda ax: self._displacements(ax, e)),
            ("comfort", "Acceleration at the comfort point", lambda ax: self._histories(ax, self.comfort)),
            ("axle_boxes", "Accelerations of the axle boxes", lambda ax: self._histories(ax, axle_boxes)),
            ("psd_e", "Power spectral density of the displacements", lambda ax: self._spectra(ax, e)),
            ("psd_comfort", "Power spectral density at the comfort point", lambda ax: self._spectra(ax, self.comfort)),
        ]
        forces = self._forces()
        if forces is not None:
            shown.append(("sum_y", "Sums of guiding forces along the line", lambda ax: self._sums(ax, forces)))
        if forces is not None and forces.quotient is not None:
            shown.append(("y_q", "Derailment quotient along the line", lambda ax: self._quotients(ax, forces)))
        return shown

    def _forces(self) -> GuidingForces | None:
        """Return the guiding forces as `railui ride` evaluates them; None for a vehicle that diverged."""
        spacing = self.excitation.track.spacing
        if self.series.diverged_at is not None or self.excitation.track.length < 4.0:
            return None
        columns = np.stack([self.series.columns[name] for name in guiding_force_channels(self.model)])
        return GuidingForces.from_series(self.model, columns, 1.0 / self.excitation.dt, spacing)

    def _histories(self, ax: Axes, names: Sequence[str]) -> None:
        unit = channel_unit(names[0])
        values = [self.series.columns[name] for name in names]
        factor, shown = readable_scale(np.concatenate(values), unit)
        for i, (name, x) in enumerate(zip(names, values, strict=True)):
            line = envelope(self.series.columns["t"], factor * x)
            ax.plot(*line, lw=0.7, color=COLOURS[i % len(COLOURS)], label=name, alpha=0.85)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(axis_label(names[0] if len(names) == 1 else _common(names), typeset_unit(shown)))
        if len(names) > 1:
            ax.legend(**LEGEND)

    def _displacements(self, ax: Axes, names: Sequence[str]) -> None:
        self._histories(ax, names)
        values = np.concatenate([self.series.columns[name] for name in names])
        factor = readable_scale(values, "m")[0]
        clearance = factor * self.model.design.values["contact.flange_clearance"]
        for sign in (-1.0, 1.0):
            ax.axhline(sign * clearance, color="#444444", lw=0.7, ls=(0, (4, 2)))
        ax.set_title(f"dashed: flange clearance {clearance:.3g} {readable_scale(values, 'm')[1]}", fontsize=8)

    def _spectra(self, ax: Axes, names: Sequence[str]) -> None:
        rate = 1.0 / self.excitation.dt
        unit = channel_unit(names[0])
        for i, name in enumerate(names):
            x = self.series.columns[name][: self.series.diverged_at]
            if len(x) < MIN_SEGMENT:
                continue
            f, density = welch(x, rate, max(MIN_SEGMENT, len(x) // SEGMENTS))
            drawn = (f > 0) & (f <= MAX_FREQUENCY) & (density > 0)
            ax.loglog(f[drawn], density[drawn], lw=0.9, color=COLOURS[i % len(COLOURS)], label=name)
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylim(bottom=ax.get_ylim()[1] / SHOWN_RANGE)
        label = axis_label(f"PSD of {_common(names)}", density_unit(unit))
        ax.set_ylabel(label, fontsize=STYLE["font.size"] * min(1.0, LABEL_LETTERS / len(label)))
        if len(ax.lines) > 1:
            ax.legend(**LEGEND)

    def _sums(self, ax: Axes, forces: GuidingForces) -> None:
        s = self.excitation.track.s[: forces.total.shape[1]]
        for i, total in enumerate(forces.total):
            line = envelope(s, 1e-3 * total)
            ax.plot(*line, lw=0.7, color=COLOURS[i % len(COLOURS)], label=f"wheelset {i + 1}", alpha=0.85)
        limit = 1e-3 * float(forces.limit.min())
        for sign in (-1.0, 1.0):
            ax.axhline(sign * limit, color="#444444", lw=0.7, ls=(0, (4, 2)))
        ax.set_title(f"2 m means; dashed: limit {limit:.3g} kN", fontsize=8)
        ax.set_xlabel("s [m]")
        ax.set_ylabel("sum of Y [kN]")
        ax.legend(**LEGEND)

    def _quotients(self, ax: Axes, forces: GuidingForces) -> None:
        assert forces.quotient is not None
        s = self.excitation.track.s[: forces.total.shape[1]]
        for i, wheels in enumerate(forces.quotient):
            for wheel, dash, label in zip(wheels, ("-", ":"), (f"wheelset {i + 1}", None), strict=True):
                line: dict[str, Any] = {"color": COLOURS[i % len(COLOURS)], "ls": dash, "label": label}
                ax.plot(*envelope(s, wheel), lw=0.7, alpha=0.85, **line)
        ax.axhline(QUOTIENT_LIMIT, color="#444444", lw=0.7, ls=(0, (4, 2)))
        ax.set_title(f"2 m means, left wheels dotted; dashed: {QUOTIENT_LIMIT:g}", fontsize=8)
        ax.set_xlabel("s [m]")
        ax.set_ylabel("Y/Q")
        ax.legend(**LEGEND)


def draw_ride(panels: RidePanels, path: str | Path) -> None:
    """Write a figure with all panels of a ride below each other (svg, png, pdf)."""
    shown = panels.panels()
    with figure_file(path, 7.6, len(shown) * PANEL_HEIGHT + 0.4) as figure:
        axes = np.atleast_1d(figure.subplots(len(shown), 1))
        for ax, (_, _, draw) in zip(axes, shown, strict=True):
            draw(ax)
        figure.align_ylabels()


def ride_pictures(panels: RidePanels) -> list[Picture]:
    """Draw every panel of a ride for a page."""
    return [draw_picture(name, alt, PAGE_SIZE, draw, top=0.26) for name, alt, draw in panels.panels()]


def density_unit(unit: str) -> str:
    """Return the unit of a power spectral density per Hz, as it is printed.

    >>> density_unit("m"), density_unit("m/s^2")
    ('m²/Hz', '(m/s²)²/Hz')
    """
    return typeset_unit(f"{unit}^2/Hz" if unit.isalpha() else f"({unit})^2/Hz")


def _common(names: Sequence[str]) -> str:
    """Return the common part of names: the quantity of e1, e2.

    >>> _common(["e1", "e2"]), _common(["floor.middle"]), _common(["floor.a", "floor.b"])
    ('e', 'floor.middle', 'floor')
    """
    if len(names) == 1:
        return names[0]
    return names[0].partition(".")[0].rstrip("0123456789")
