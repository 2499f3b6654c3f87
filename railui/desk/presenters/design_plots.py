"""Plots of a design and its base: spectra, modal damping and frequencies, series, curving."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from railui.arrays import FloatArray
from railui.desk.presenters.design_results import CURVE_RADII, DesignResults
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import Difference, LimitLine, Line, PlotData

View = Callable[[DesignResults, DesignResults], PlotData]
MM_PER_M = 1e3
KN_PER_N = 1e-3
SERIES_MARGIN = 1.15  # range of the displacement axis over its largest value
INITIAL_WINDOW = (0.0, 0.2)  # fraction of a series shown before zooming


def displacement_spectrum(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the spectral density of the displacement of the leading wheelset relative to the track."""
    return _spectrum(current, base, "e1", MM_PER_M**2, Axis("e₁", "mm²/Hz", log=True))


def comfort_spectrum(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the spectral density of the acceleration at the comfort point."""
    return _spectrum(current, base, "comfort", 1.0, Axis("acceleration", "(m/s²)²/Hz", log=True))


def _spectrum(current: DesignResults, base: DesignResults, key: str, factor: float, y: Axis) -> PlotData:
    lines = [
        Line(results.f, factor * results.density[key], label, role) for results, label, role in _labelled(current, base)
    ]
    x = Axis("f", "Hz", log=True, low=0.1, high=40.0)
    return PlotData(x, y, lines, difference=_difference(lines, is_ratio=True))


def mode_damping(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the damping ratio of the modes against speed."""
    lines: list[Line] = []
    for results, label, role in _labelled(current, base):
        lines += _mode_points(results.speeds, results.damping, label, role)
    limits = (LimitLine(0.0), _speed_line(current))
    return PlotData(Axis("V", "m/s"), Axis("damping ratio", low=-0.1, high=0.6), lines, limits)


def mode_frequency(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the frequencies of the modes against speed."""
    lines: list[Line] = []
    for results, label, role in _labelled(current, base):
        lines += _mode_points(results.speeds, results.frequency, label, role)
    return PlotData(Axis("V", "m/s"), Axis("mode", "Hz", low=0.0, high=15.0), lines, (_speed_line(current),))


def _mode_points(speeds: FloatArray, values: FloatArray, label: str, role: str) -> list[Line]:
    labels = [label, *[""] * (values.shape[1] - 1)]
    return [Line(speeds, values[:, k], labels[k], role, is_points=True) for k in range(values.shape[1])]


def _speed_line(results: DesignResults) -> LimitLine:
    speed = results.conditions.speed
    return LimitLine(speed, f"{speed:.4g}", is_vertical=True)


def displacement_series(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the displacement of the leading wheelset along the track with the flange clearance."""
    lines = [
        Line(results.s, MM_PER_M * results.series["e1"], label, role)
        for results, label, role in _labelled(current, base)
    ]
    clearance = MM_PER_M * current.clearance
    largest = max(clearance, *(float(np.nanmax(np.abs(line.y), initial=0.0)) for line in lines))
    end = SERIES_MARGIN * largest
    limits = (LimitLine(clearance, "flange"), LimitLine(-clearance, "flange"))
    y = Axis("e₁", "mm", low=-end, high=end)
    return PlotData(Axis("s", "m"), y, lines, limits, difference=_difference(lines, "mm"))


def frame_acceleration(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the lateral acceleration of the bogie frame along the track."""
    lines = [Line(results.s, results.series["ayf"], label, role) for results, label, role in _labelled(current, base)]
    return PlotData(Axis("s", "m"), Axis("frame y''", "m/s²"), lines, difference=_difference(lines, "m/s²"))


def curving(current: DesignResults, base: DesignResults) -> PlotData:
    """Plot the lateral force of the rails on the leading wheelset in curves without cant deficiency."""
    lines = [
        Line(np.array(CURVE_RADII), KN_PER_N * results.guiding_force[:, 0], label, role)
        for results, label, role in _labelled(current, base)
        if results.guiding_force is not None
    ]
    y = Axis("rail force Qy₁", "kN")
    return PlotData(
        Axis("R", "m", log=True), y, lines, placeholder="computing curving ...", difference=_difference(lines, "kN")
    )


def _difference(lines: list[Line], unit: str = "", is_ratio: bool = False) -> Difference | None:
    """Return the difference of the current line from the base, of densities as a ratio in dB; None without a base."""
    if len(lines) != 2 or not np.array_equal(lines[0].x, lines[1].x):
        return None
    base, current = (line.y for line in lines)
    if not is_ratio:
        return Difference(lines[0].x, current - base, unit)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = 10.0 * np.log10(current / base)
    return Difference(lines[0].x, np.where(np.isfinite(ratio), ratio, np.nan), "dB")


def _labelled(current: DesignResults, base: DesignResults) -> list[tuple[DesignResults, str, str]]:
    """Return results, labels and roles, the base first so that it is drawn below."""
    first = [(base, "base", "base")] if base is not current else []
    return [*first, (current, "current", "current")]


VIEWS: dict[str, View] = {
    "displacement spectrum": displacement_spectrum,
    "comfort spectrum": comfort_spectrum,
    "modal damping": mode_damping,
    "displacement": displacement_series,
    "curving": curving,
    "modal frequencies": mode_frequency,
    "acceleration of the frame": frame_acceleration,
}
WINDOWS = {"displacement": INITIAL_WINDOW, "acceleration of the frame": INITIAL_WINDOW}
