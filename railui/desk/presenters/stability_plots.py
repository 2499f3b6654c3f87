"""Plots and rows of the Stability page: damping of named modes, root locus, limit cycles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rich.style import Style
from rich.text import Text

from railui.desk.presenters.critical_speeds import critical_lines
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import LimitLine, Line, Mark, PlotData, series_role

if TYPE_CHECKING:
    from railui.running_stability.mode_tracking import TrackedMode

MM_PER_M: Final = 1e3
MAX_DAMPING: Final = 0.6  # of the damping plot; modes that are always damped more are no concern
MIN_DAMPING: Final = -0.1
LOCUS_DAMPING: Final = 0.5  # up to which points set the scale of the root locus
MIN_WIDE_COLUMNS: Final = 60  # of the rows of the modes with base and loss of stability
MODE_NUMBERS: Final = "123456789abcdefghijklmnopqrstuvwxyz"
Known = Mapping[str, Mapping[str, Any]]


def shown_modes(modes: Sequence[TrackedMode]) -> list[TrackedMode]:
    """Return the modes that are damped less than MAX_DAMPING at any speed."""
    return [mode for mode in modes if np.nanmin(mode.damping, initial=np.inf) < MAX_DAMPING]


def damping_plot(modes: Sequence[TrackedMode], base: Sequence[TrackedMode], known: Known, speed: float) -> PlotData:
    """Plot the damping ratio of every mode against speed, with the critical speeds."""
    lines = [Line(mode.speeds, mode.damping, "base", "base") for mode in shown_modes(base)]
    shown = shown_modes(modes)
    lines += [Line(m.speeds, m.damping, f"{MODE_NUMBERS[k]} {m.name}", series_role(k)) for k, m in enumerate(shown)]
    limits = [LimitLine(0.0, "unstable below"), *critical_lines(known), LimitLine(speed, f"V {speed:.4g}", True)]
    marks = [mark for k, mode in enumerate(shown) if (mark := _number_on_line(mode, k, len(shown))) is not None]
    y = Axis("damping ratio", low=MIN_DAMPING, high=MAX_DAMPING)
    return PlotData(Axis("V", "m/s"), y, lines, limits, marks)


def _number_on_line(mode: TrackedMode, k: int, count: int) -> Mark | None:
    """Return the number of mode k of `count` on its line, each at a speed of its own, so that none hides another."""
    visible = np.flatnonzero((mode.damping < MAX_DAMPING) & (mode.damping > MIN_DAMPING))
    if not len(visible):
        return None
    wanted = (k + 0.5) / count * (len(mode.speeds) - 1)
    i = int(visible[np.argmin(np.abs(visible - wanted))])
    return Mark(float(mode.speeds[i]), float(mode.damping[i]), MODE_NUMBERS[k], "", series_role(k))


def locus_plot(modes: Sequence[TrackedMode], base: Sequence[TrackedMode], speed: float) -> PlotData:
    """Plot the root locus: frequency against growth rate over all speeds, with a number at the present speed."""
    lines = [Line(m.roots.real, m.frequency, "base", "base") for m in shown_modes(base)]
    lines += [Line(m.roots.real, m.frequency, "", series_role(k)) for k, m in enumerate(shown_modes(modes))]
    marks, low, high, top = [], -1.0, 1.0, 1.0
    for k, mode in enumerate(shown_modes(modes)):
        near = mode.damping < LOCUS_DAMPING
        if np.any(near):
            low, high = min(low, float(mode.roots.real[near].min())), max(high, float(mode.roots.real[near].max()))
            top = max(top, float(mode.frequency[near].max()))
        i = int(np.argmin(np.abs(mode.speeds - speed)))
        if mode.oscillates[i]:
            mark = MODE_NUMBERS[k]
            marks.append(Mark(float(mode.roots.real[i]), float(mode.frequency[i]), mark, "", series_role(k)))
    span = high - low
    x = Axis("growth rate", "1/s", low=low - 0.05 * span, high=high + 0.05 * span)
    y = Axis("frequency", "Hz", low=0.0, high=1.08 * top)
    return PlotData(x, y, lines, [LimitLine(0.0, "unstable", True)], marks)


def cycles_plot(known: Known, base: Known | None) -> PlotData:
    """Plot the amplitude of limit cycles against speed with the nonlinear critical speed (the fold)."""
    current = known.get("nonlinear")
    x, y = Axis("V", "m/s"), Axis("amplitude", "mm", low=0.0)
    if current is None:
        return PlotData(x, y, placeholder="computing the nonlinear critical speed")
    if current.get("failure"):
        return PlotData(x, y, placeholder=str(current["failure"]))
    lines = _cycle_lines(base["nonlinear"], "base") if base is not None and "nonlinear" in base else []
    lines += _cycle_lines(current, "current")
    limits = [LimitLine(MM_PER_M * current["clearance"], "flange"), *critical_lines(known)]
    return PlotData(x, y, lines, limits, placeholder="no limit cycle up to 90 m/s")


def _cycle_lines(result: Mapping[str, Any], role: str) -> list[Line]:
    if result.get("failure"):
        return []
    lines = []
    for key, label, is_points in (("from_above", "hunting", False), ("from_below", "small offset", True)):
        points = np.array([(r["speed"], r[key]) for r in result["diagram"] if r.get(key) is not None]).reshape(-1, 2)
        if len(points):
            shown = "base" if role == "base" else label
            series = role if role == "base" else "current" if key == "from_above" else "other"
            lines.append(Line(points[:, 0], MM_PER_M * points[:, 1], shown, series, is_points))
    unstable = [(c["speed"], c["amplitude"]) for c in result["branch"] if c["multiplier"] > 1]
    if len(unstable) > 1:
        points = np.array(unstable)
        label, series = ("base", "base") if role == "base" else ("unstable", "series4")
        lines.append(Line(points[:, 0], MM_PER_M * points[:, 1], label, series))
    return lines


def modes_text(
    modes: Sequence[TrackedMode],
    base: Sequence[TrackedMode],
    speed: float,
    style: Callable[[str], Style],
    width: int,
    rows: int,
) -> Text:
    """Return a row per mode: number and name in the colour of its line, frequency, damping, loss of stability."""
    text = Text(no_wrap=True, overflow="ellipsis")
    is_wide = width >= MIN_WIDE_COLUMNS
    names = max(12, min(34, width - (46 if is_wide else 20)))  # less the columns after it
    header = f"{'':2}{'mode':{names}}{'f [Hz]':>8}{'damping':>9}"
    text.append(header + (f"{'base' if base else '':>8}  {'unstable':17}" if is_wide else ""), "dim")
    before = {mode.name: mode for mode in base}
    for k, mode in enumerate(shown_modes(modes)[: max(0, rows - 2)]):
        text.append(f"\n{MODE_NUMBERS[k]} {mode.name[: names - 1]:{names}}", style(series_role(k)))
        frequency, damping = (float(np.interp(speed, mode.speeds, x)) for x in (mode.frequency, mode.damping))
        text.append(f"{_number(frequency, 2):>8}{_number(damping, 3):>9}", "bold")
        if is_wide:
            same = before.get(mode.name)
            value = float("nan") if same is None else float(np.interp(speed, same.speeds, same.damping))
            text.append(f"{_number(value, 3) if base else '':>8}", "dim")
            text.append(f"  {_unstable_text(mode):17}")
    shown = shown_modes(modes)
    at_speed = [(float(np.interp(speed, m.speeds, m.damping)), m) for m in shown]
    least = min((pair for pair in at_speed if np.isfinite(pair[0])), key=lambda pair: pair[0], default=None)
    if least is not None:
        text.append(f"\n{least[1].name} at {speed:.4g} m/s: {least[1].shape_at(speed)}", "dim")
    return text


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if np.isfinite(value) else "-"


def _unstable_text(mode: TrackedMode) -> str:
    if not np.any(mode.is_unstable):
        return f"not up to {mode.speeds[-1]:.4g} m/s"
    first = int(np.argmax(mode.is_unstable))
    if not first or mode.oscillates[first] != mode.oscillates[first - 1]:
        return f"from {mode.speeds[first]:.4g} m/s"
    growth = mode.roots.real[first - 1 : first + 1]
    return f"from {float(np.interp(0.0, growth, mode.speeds[first - 1 : first + 1])):.1f} m/s"
