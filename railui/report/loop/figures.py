"""Figures of the loop report: errors, series and spectra, and the laws found, as SVG that needs nothing beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.dataset import COMPARED, RIG_RESPONSES, Segment, comparison_filter, cut_samples
from railui.dsp.spectra import periodogram, welch
from railui.identification.loop import LoopResult
from railui.report.figures.drawing import BLUE, ORANGE, Picture, Sketch, axis, drawn, drawn_alike, scale
from railui.runs.columns import columns_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# lines differ in dash and width too, bars in hatching
COLOURS = {"declared": "#b3b3b3", "before": ORANGE, "after": BLUE, "floor": "#ffffff", "measured": "#b0b0b0"}
LINES: dict[str, dict[str, Any]] = {
    "measured": {"color": COLOURS["measured"], "lw": 2.8, "solid_capstyle": "round"},
    "after": {"color": COLOURS["after"], "lw": 1.0},
    "before": {"color": COLOURS["before"], "lw": 1.1, "ls": (0, (2.2, 2.2))},
}
FIRST = ("e1", "ay1", "ayf", "d1")  # drawn first where they were measured
SHOWN = 5.0  # s of a series
PERIODS = 25  # of a rig's main frequency, which may be anything
POINTS = 2500  # of a line


def place(at: str, wheelset: int | None = None) -> str:
    """A place in words."""
    if at == "wheelset" and wheelset:
        return f"wheelset {wheelset}"
    return at.replace("_", " ") + (f", wheelset {wheelset}" if wheelset else "")


# errors


def error_bars(report: Mapping[str, Any]) -> Picture:
    """Error of every channel and of all: declared, before, after, floor."""
    channels = ["all", *report["declared"]["channels"]]
    which = ("declared", "before", "after", "floor")

    def value(w: str, c: str) -> float | None:
        found: float | None = report[w]["nrmse"] if c == "all" else report[w]["channels"].get(c)
        return found

    def draw(ax: Axes) -> None:
        for i, w in enumerate(which):
            heights = [value(w, c) for c in channels]
            x = np.arange(len(channels)) + 0.2 * (i - 1.5)
            hatch = "////" if w == "floor" else None
            ax.bar(x, [h or 0.0 for h in heights], 0.19, color=COLOURS[w], label=w, hatch=hatch,
                   edgecolor="#555555" if hatch else "none", linewidth=0.6)  # fmt: skip
            for at, h in zip(x, heights, strict=True):
                if h is None:
                    ax.text(at, 0.0, " diverged", rotation=90, ha="center", va="bottom", fontsize=7)
        ax.axvline(0.5, color="#999999", lw=0.7)
        ax.set_xticks(np.arange(len(channels)), channels)
        ax.set_xlim(-0.5, len(channels) - 0.5)
        ax.grid(axis="x", visible=False)
        ax.tick_params(axis="x", length=0)
        ax.set_ylabel("error (nrmse)")
        ax.legend(ncols=4, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)

    alt = "Bars of the error of every channel: declared, before, after, noise floor"
    return drawn("errors", alt, (7.2 if len(channels) > 4 else 5.0, 2.5), draw, bottom=0.25)


# series and spectra


@dataclass(frozen=True, eq=False)
class Window:
    """A telling piece of a validating stretch: rows [begin, end) of what is left after the cut."""

    index: int
    stretch: Segment
    begin: int
    end: int

    def rows(self, cut: int) -> slice:
        """The same rows of the whole stretch."""
        return slice(self.begin + cut, self.end + cut)


def compared_series(found: LoopResult, index: int) -> dict[str, FloatArray]:
    """measured, before, after of a validating stretch in the band of the comparison, each [channel, kept]."""
    stretch, campaign = found.measurement.validation[index], found.measurement.campaign
    return {w: comparison_filter(campaign, stretch, x) for w, x in raw_series(found, index).items()}


def raw_series(found: LoopResult, index: int) -> dict[str, FloatArray]:
    """measured, before, after as they are, each [channel, n], without what diverges, or before where it is after."""
    stretch = found.measurement.validation[index]
    series = {"measured": stretch.measured(stretch.channels)}
    series |= {w: found.validations[w].series[index] for w in ("before", "after")}
    if found.before is found.after:
        del series["before"]
    return {w: x for w, x in series.items() if np.all(np.isfinite(x))}


def telling(found: LoopResult) -> Window:
    """Where the vehicle as found does better than before by most; where nothing was added, where it moves most."""
    best: tuple[float, Window] | None = None
    for index, stretch in enumerate(found.measurement.validation):
        series = compared_series(found, index)
        x = series["measured"]
        power = np.maximum(x.var(axis=1, keepdims=True), 1e-300)
        gain = np.sum(x**2 / power, axis=0)
        if {"before", "after"} <= set(series):
            gain = np.sum(((x - series["before"]) ** 2 - (x - series["after"]) ** 2) / power, axis=0)
        width = max(2, min(x.shape[1], round(_seconds(stretch) / stretch.dt)))
        sums = np.cumsum(np.concatenate([[0.0], gain]))
        gains = sums[width:] - sums[:-width]
        at = int(np.argmax(gains))
        if best is None or gains[at] > best[0]:
            best = float(gains[at]), Window(index, stretch, at, at + width)
    assert best is not None  # a campaign without validating runs is refused when it is read
    return best[1]


def _seconds(stretch: Segment) -> float:
    if stretch.kind != "rig":
        return SHOWN
    f, power = periodogram(stretch.columns[stretch.channels[0]], 1.0 / stretch.dt)
    return float(min(SHOWN, PERIODS / f[1 + int(np.argmax(power[1:]))]))


def shown_channels(stretch: Segment) -> list[str]:
    """The compared channels of a stretch, those that tell most first."""
    judged = [c for c in stretch.channels if c in COMPARED or c in RIG_RESPONSES]
    return [*(c for c in FIRST if c in judged), *(c for c in judged if c not in FIRST)]


def units_of(found: LoopResult, stretch: Segment) -> Mapping[str, str]:
    """Unit of every channel: SI, or for a rig as its run calls it."""
    if stretch.kind != "rig":
        return {c.name: c.unit for c in columns_of(stretch.kind).values()}
    entries = zip(found.measurement.campaign.runs, found.measurement.runs, strict=True)
    return next(run.units for entry, run in entries if entry.name == stretch.file)


def channel_pictures(found: LoopResult, window: Window, channels: Sequence[str]) -> list[tuple[Picture, Picture]]:
    """A few seconds and the spectrum of each channel."""
    series = compared_series(found, window.index)
    few = drawn_alike((_series(found, window, series, c) for c in channels), (5.4, 1.9), 0.08)
    spectra = drawn_alike((_spectrum(found, window, series, c) for c in channels), (4.2, 1.9), 0.08)
    return list(zip(few, spectra, strict=True))


def _series(found: LoopResult, window: Window, series: Mapping[str, FloatArray], channel: str) -> Sketch:
    """A few seconds of one channel: measured, before, after."""
    stretch = window.stretch
    row = stretch.channels.index(channel)
    piece = slice(window.begin, window.end, max(1, (window.end - window.begin) // POINTS))
    t = stretch.columns["t"][cut_samples(found.measurement.campaign, stretch) :]
    factor, unit = scale(series["measured"][row, piece], units_of(found, stretch)[channel])

    def draw(ax: Axes) -> None:
        for which, line in LINES.items():
            if which in series:
                ax.plot(t[piece], factor * series[which][row, piece], **line)
        ax.margins(x=0)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(axis(channel, unit))

    return f"series-{channel}", f"{channel} over time: measured, before, after", draw


def _spectrum(found: LoopResult, window: Window, series: Mapping[str, FloatArray], channel: str) -> Sketch:
    """Power spectral density of one channel over the whole stretch, in the unit of its series."""
    stretch, band = window.stretch, found.measurement.campaign.band
    row = stretch.channels.index(channel)
    lines = {w: x[row] for w, x in raw_series(found, window.index).items()}
    factor, unit = scale(series["measured"][row, window.begin : window.end], units_of(found, stretch)[channel])
    segment = min(stretch.samples, max(256, stretch.samples // 5))
    low, high = (0.0, np.inf) if band is None else (0.5 * band[0], 1.5 * band[1])

    def draw(ax: Axes) -> None:
        ax.set(xscale="log", yscale="log")
        for which, line in LINES.items():
            if which in lines:
                f, power = welch(lines[which], 1.0 / stretch.dt, segment)
                kept = (f > 0) & (f >= low) & (f <= high)
                ax.plot(f[kept], factor**2 * power[kept], **line)
                if which == "measured":  # what a noiseless model has below the sensors' noise tells nothing
                    bottom = 0.1 * factor**2 * float(power[kept].min())
        ax.set_ylim(bottom=bottom)
        ax.margins(x=0)
        left, right = ax.get_xlim()
        for span in ((left, band[0]), (band[1], right)) if band else ():
            ax.axvspan(*span, color="#f1f1f1", lw=0, zorder=0)
        ax.set_xlim(left, right)
        _plain_decades(ax)
        ax.set_xlabel("frequency [Hz]")
        squared = f"({unit})²" if "/" in unit else f"{unit}²" if unit else "1"
        ax.set_ylabel(f"density [{squared}/Hz]")

    return f"spectrum-{channel}", f"Spectrum of {channel}: measured, before, after", draw


def _plain_decades(ax: Axes) -> None:
    """Frequencies as 1, 2, 5, 10; densities in few decades; no mathematics in the text."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    digits = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    left, right = ax.get_xlim()
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if right < 1e4 * left else (1.0,), numticks=16))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    ax.yaxis.set_major_locator(LogLocator(numticks=5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda x, _: "10" + f"{round(np.log10(x))}".translate(digits)))
    ax.xaxis.set_minor_locator(NullLocator())  # ticks are what takes time in a figure
    ax.yaxis.set_minor_locator(NullLocator())
