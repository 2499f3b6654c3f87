"""Figures of the loop report: errors, time series and spectra, as self-contained SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import compared_channels, comparison_filter, cut_samples
from railui.campaign.segment import Segment
from railui.dsp.spectra import periodogram, welch
from railui.identification.result import LoopResult
from railui.report.figures.drawing import BLUE, ORANGE, Drawing, Picture, axis_label, draw_picture, draw_pictures
from railui.report.loop.wording import shown_models
from railui.report.numbers import display_scale
from railui.runs.columns import columns_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# lines differ in dash and width and bars in hatching, not in colour alone
COLOURS = {"declared": "#b3b3b3", "before": ORANGE, "after": BLUE, "floor": "#ffffff", "measured": "#b0b0b0"}
LINES: dict[str, dict[str, Any]] = {
    "measured": {"color": COLOURS["measured"], "lw": 2.8, "solid_capstyle": "round"},
    "after": {"color": COLOURS["after"], "lw": 1.0},
    "before": {"color": COLOURS["before"], "lw": 1.1, "ls": (0, (2.2, 2.2))},
}
LINES_TEXT = "measured, calibrated, calibrated + effect"
LEADING_CHANNELS = ("e1", "ay1", "ayf", "d1")  # shown first where they are present
WINDOW_SECONDS = 5.0  # of a time series
MAX_RIG_PERIODS = 25  # of the main frequency of a rig, in a time series
MAX_LEVEL_CHARACTERS = 80  # under the bars of the errors, beyond which the names of channels are slanted
MAX_LINE_POINTS = 2500
SPECTRUM_SEGMENTS = 5
MIN_SEGMENT_SAMPLES = 256


def error_bars(report: Mapping[str, Any]) -> Picture:
    """Draw the error of all channels and of each, for every model and the noise floor."""
    channels = _error_channels(report)
    longest = max(map(len, channels))
    is_slanted = _is_slanted(channels)
    alt = f"Bars of the error of every channel: {', '.join(shown_models(report).values())}"
    below = 0.25 + (0.045 * longest if is_slanted else 0.0)
    size = (7.2 if len(channels) > 4 else 6.2, 2.25 + below)
    return draw_picture("errors", alt, size, lambda ax: draw_error_bars(ax, report), bottom=below)


def _error_channels(report: Mapping[str, Any]) -> list[str]:
    return ["all", *report["declared"]["channels"]]


def _is_slanted(channels: Sequence[str]) -> bool:
    """True where the names of the channels do not fit below their bars."""
    return max(map(len, channels)) * len(channels) > MAX_LEVEL_CHARACTERS


def draw_error_bars(ax: Axes, report: Mapping[str, Any]) -> None:
    """Draw the error of all channels and of each as bars, for every model and the noise floor."""
    channels = _error_channels(report)

    def error(model: str, channel: str) -> float | None:
        value: float | None = report[model]["nrmse"] if channel == "all" else report[model]["channels"].get(channel)
        return value

    models = shown_models(report)
    for i, (model, label) in enumerate(models.items()):
        heights = [error(model, channel) for channel in channels]
        x = np.arange(len(channels)) + 0.2 * (i - 0.5 * (len(models) - 1))
        style: dict[str, Any] = {"color": COLOURS[model], "edgecolor": "none", "linewidth": 0.6}
        if model == "floor":
            style |= {"hatch": "////", "edgecolor": "#555555"}
        ax.bar(x, [height or 0.0 for height in heights], 0.19, label=label, **style)
        for position, height in zip(x, heights, strict=True):
            if height is None:
                ax.text(position, 0.0, " diverged", rotation=90, ha="center", va="bottom", fontsize=7)
    ax.axvline(0.5, color="#999999", lw=0.7)
    slant: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if _is_slanted(channels) else {}
    ax.set_xticks(np.arange(len(channels)), channels, **slant)
    ax.set_xlim(-0.5, len(channels) - 0.5)
    ax.grid(axis="x", visible=False)
    ax.tick_params(axis="x", length=0)
    ax.set_ylabel("NRMSE")
    ax.legend(ncols=4, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)


@dataclass(frozen=True, eq=False)
class Window:
    """Excerpt of a validation segment: rows [begin, end) of the samples that are compared."""

    index: int
    segment: Segment
    begin: int
    end: int

    def rows(self, cut: int) -> slice:
        """Return the same rows in the whole segment."""
        return slice(self.begin + cut, self.end + cut)


def compared_series(result: LoopResult, index: int) -> dict[str, FloatArray]:
    """Return measured, before, after of a validation segment in the comparison band, each [channel, n]."""
    segment, campaign = result.dataset.validation[index], result.dataset.campaign
    return {name: comparison_filter(campaign, segment, x) for name, x in raw_series(result, index).items()}


def raw_series(result: LoopResult, index: int) -> dict[str, FloatArray]:
    """Return measured, before, after of a validation segment, each [channel, n].

    A diverged series is left out, and `before` where no effect was added.
    """
    segment = result.dataset.validation[index]
    series = {"measured": segment.measured(segment.channels)}
    series |= {model: result.validations[model].series[index] for model in ("before", "after")}
    if result.before is result.after:
        del series["before"]
    return {name: x for name, x in series.items() if np.all(np.isfinite(x))}


def most_informative_window(result: LoopResult) -> Window:
    """Return the excerpt with the largest reduction of the error by the effect, else that of the largest motion."""
    candidates = [_best_window(result, i, segment) for i, segment in enumerate(result.dataset.validation)]
    # a campaign without validation runs is refused when it is read, so there is a candidate
    return max(candidates, key=lambda candidate: candidate[0])[1]


def _best_window(result: LoopResult, index: int, segment: Segment) -> tuple[float, Window]:
    """Return the best excerpt of a segment and its gain."""
    series = compared_series(result, index)
    measured = series["measured"]
    power = np.maximum(measured.var(axis=1, keepdims=True), 1e-300)
    gain = np.sum(measured**2 / power, axis=0)
    if {"before", "after"} <= set(series):
        squares = (measured - series["before"]) ** 2 - (measured - series["after"]) ** 2
        gain = np.sum(squares / power, axis=0)
    width = max(2, min(measured.shape[1], round(_window_seconds(segment) / segment.dt)))
    cumulated = np.cumsum(np.concatenate([[0.0], gain]))
    gains = cumulated[width:] - cumulated[:-width]
    first = _first_predicted(result, segment, len(gains))
    begin = first + int(np.argmax(gains[first:]))
    return float(gains[begin]), Window(index, segment, begin, begin + width)


def _first_predicted(result: LoopResult, segment: Segment, positions: int) -> int:
    """Return the first compared sample after those on which the initial state was estimated, where enough follow."""
    estimated = round(result.context.settings.initial_state.initial_state_duration / segment.dt)
    first = max(estimated - cut_samples(result.dataset.campaign, segment), 0)
    return first if not segment.is_rig and first < positions // 2 else 0


def _window_seconds(segment: Segment) -> float:
    if not segment.is_rig:
        return WINDOW_SECONDS
    f, power = periodogram(segment.columns[segment.channels[0]], 1.0 / segment.dt)
    return float(min(WINDOW_SECONDS, MAX_RIG_PERIODS / f[1 + int(np.argmax(power[1:]))]))


def shown_channels(segment: Segment) -> list[str]:
    """Return the compared channels of a segment, the leading ones first."""
    compared = compared_channels(segment)
    return [*(c for c in LEADING_CHANNELS if c in compared), *(c for c in compared if c not in LEADING_CHANNELS)]


def units_of(result: LoopResult, segment: Segment) -> Mapping[str, str]:
    """Return the unit of every channel: SI, or for a rig that of its run."""
    if not segment.is_rig:
        return {c.name: c.unit for c in columns_of(segment.kind).values()}
    runs = zip(result.dataset.campaign.runs, result.dataset.runs, strict=True)
    return next(run.units for entry, run in runs if entry.name == segment.file)


def channel_pictures(result: LoopResult, window: Window, channels: Sequence[str]) -> list[tuple[Picture, Picture]]:
    """Draw the excerpt and the spectrum of each channel."""
    series = compared_series(result, window.index)
    excerpts = draw_pictures((series_drawing(result, window, series, c) for c in channels), (5.4, 1.9), 0.08)
    spectra = draw_pictures((spectrum_drawing(result, window, series, c) for c in channels), (4.2, 1.9), 0.08)
    return list(zip(excerpts, spectra, strict=True))


def series_drawing(result: LoopResult, window: Window, series: Mapping[str, FloatArray], channel: str) -> Drawing:
    """Return the drawing of the excerpt of a channel."""
    segment = window.segment
    row = segment.channels.index(channel)
    rows = slice(window.begin, window.end, max(1, (window.end - window.begin) // MAX_LINE_POINTS))
    t = segment.columns["t"][cut_samples(result.dataset.campaign, segment) :]
    factor, unit = display_scale(series["measured"][row, rows], units_of(result, segment)[channel])

    def draw(ax: Axes) -> None:
        for name, line in LINES.items():
            if name in series:
                ax.plot(t[rows], factor * series[name][row, rows], **line)
        ax.margins(x=0)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(axis_label(channel, unit))

    return f"series-{channel}", f"{channel} over time: {LINES_TEXT}", draw


def spectrum_drawing(result: LoopResult, window: Window, series: Mapping[str, FloatArray], channel: str) -> Drawing:
    """Return the drawing of the power spectral density of a channel over the whole segment."""
    segment, band = window.segment, result.dataset.campaign.band
    row = segment.channels.index(channel)
    lines = {name: x[row] for name, x in raw_series(result, window.index).items()}
    excerpt = series["measured"][row, window.begin : window.end]
    factor, unit = display_scale(excerpt, units_of(result, segment)[channel])
    samples = min(segment.samples, max(MIN_SEGMENT_SAMPLES, segment.samples // SPECTRUM_SEGMENTS))
    low, high = (0.0, np.inf) if band is None else (0.5 * band[0], 1.5 * band[1])

    def draw(ax: Axes) -> None:
        ax.set(xscale="log", yscale="log")
        bottom: float | None = None
        for name, line in LINES.items():
            if name in lines:
                f, power = welch(lines[name], 1.0 / segment.dt, samples)
                shown = (f > 0) & (f >= low) & (f <= high)
                ax.plot(f[shown], factor**2 * power[shown], **line)
                if name == "measured":  # a noiseless simulation goes far below the sensor noise
                    bottom = 0.1 * factor**2 * float(power[shown].min())
        ax.set_ylim(bottom=bottom)
        ax.margins(x=0)
        left, right = ax.get_xlim()
        for span in ((left, band[0]), (band[1], right)) if band else ():
            ax.axvspan(*span, color="#f1f1f1", lw=0, zorder=0)
        ax.set_xlim(left, right)
        label_decades(ax)
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel(f"PSD [{squared_unit(unit)}/Hz]")

    return f"spectrum-{channel}", f"Spectrum of {channel}: {LINES_TEXT}", draw


def squared_unit(unit: str) -> str:
    """Return the unit of a square.

    >>> squared_unit("m/s²"), squared_unit("mm"), squared_unit("")
    ('(m/s²)²', 'mm²', '1')
    """
    return f"({unit})²" if "/" in unit else f"{unit}²" if unit else "1"


def label_decades(ax: Axes) -> None:
    """Label frequencies, and densities at few decades, without mathematical markup."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    label_frequencies(ax)
    digits = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    ax.yaxis.set_major_locator(LogLocator(numticks=5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda x, _: "10" + f"{round(np.log10(x))}".translate(digits)))
    ax.yaxis.set_minor_locator(NullLocator())


def label_frequencies(ax: Axes) -> None:
    """Label a logarithmic axis of frequencies as 1, 2, 5, 10."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    left, right = ax.get_xlim()
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if right < 1e4 * left else (1.0,), numticks=16))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    ax.xaxis.set_minor_locator(NullLocator())  # ticks dominate the time of a figure
