"""Figures of the residuals: over time, spectrum against the noise model, autocorrelation, coherence with the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import cut_samples
from railui.identification.result import LoopResult
from railui.report.figures.drawing import GREEN, Drawing, Picture, axis_label, draw_pictures
from railui.report.loop.figures import (
    LINES,
    MAX_LINE_POINTS,
    Window,
    label_decades,
    label_frequencies,
    squared_unit,
    units_of,
)
from railui.report.loop.residuals import ChannelResidual, channel_residuals
from railui.report.numbers import display_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SENSOR_LINE: dict[str, Any] = {"color": "#444444", "lw": 1.0, "ls": (0, (1.0, 1.5))}
EXPECTED_LINE: dict[str, Any] = {"color": GREEN, "lw": 1.6}
CONFIDENCE_AREA: dict[str, Any] = {"color": "#dedede", "lw": 0, "zorder": 0}
LEAST_DENSITY = 0.03  # of the lowest density expected from noise, where the axis of a spectrum ends


@dataclass(frozen=True, eq=False)
class ResidualPictures:
    """Pictures of the residual of a channel; the last two of some channels only, no coherence without an input."""

    series: Picture
    spectrum: Picture
    autocorrelation: Picture | None
    coherence: Picture | None


def residual_pictures(
    result: LoopResult,
    window: Window,
    channels: Sequence[str],
    residuals: Mapping[str, ChannelResidual],
    full: int,
) -> dict[str, ResidualPictures]:
    """Draw the residuals of channels over the excerpt of a report, and their spectra over the whole segment.

    full: number of channels of which autocorrelation and coherence are drawn too.
    """
    shown = [residuals[name] for name in channels if name in residuals]
    units = units_of(result, window.segment)
    scales = {r.name: display_scale(_excerpt(window, r), units[r.name]) for r in shown}
    wide, narrow = (5.4, 1.7), (4.2, 1.7)
    series = draw_pictures((_series(result, window, r, *scales[r.name]) for r in shown), wide, 0.08)
    spectra = draw_pictures((_spectrum(result, r, *scales[r.name]) for r in shown), narrow, 0.08)
    main = shown[:full]
    correlations = {
        r.name: p for r, p in zip(main, draw_pictures(map(_autocorrelation, main), wide, 0.08), strict=True)
    }
    coherent = [r for r in main if r.coherence]
    curves = draw_pictures(map(_coherence, coherent), narrow, 0.08)
    coherences = {r.name: picture for r, picture in zip(coherent, curves, strict=True)}
    return {
        r.name: ResidualPictures(a, b, correlations.get(r.name), coherences.get(r.name))
        for r, a, b in zip(shown, series, spectra, strict=True)
    }


def _excerpt(window: Window, residual: ChannelResidual) -> FloatArray:
    return next(iter(residual.series.values()))[window.begin : window.end]


def _series(result: LoopResult, window: Window, residual: ChannelResidual, factor: float, unit: str) -> Drawing:
    rows = slice(window.begin, window.end, max(1, (window.end - window.begin) // MAX_LINE_POINTS))
    t = window.segment.columns["t"][cut_samples(result.dataset.campaign, window.segment) :]
    noise = factor * float(np.sqrt(np.mean(residual.expected**2)))

    def draw(ax: Axes) -> None:
        ax.axhspan(-2.0 * noise, 2.0 * noise, **CONFIDENCE_AREA)
        for model in ("before", "after"):
            if model in residual.series:
                ax.plot(t[rows], factor * residual.series[model][rows], **LINES[model])
        ax.margins(x=0)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(axis_label(f"residual {residual.name}", unit))

    return f"residual-{residual.name}", f"Residual of {residual.name} over time", draw


def _spectrum(result: LoopResult, residual: ChannelResidual, factor: float, unit: str) -> Drawing:
    f, expected = residual.expected_density
    used = residual.in_band(f)
    column = result.context.noise.columns.get(residual.name)

    def draw(ax: Axes) -> None:
        ax.set(xscale="log", yscale="log")
        for model in ("before", "after"):
            if model in residual.series:
                density = residual.density(residual.series[model])[1]
                ax.plot(f[used], factor**2 * density[used], **LINES[model])
        ax.plot(f[used], factor**2 * expected[used], **EXPECTED_LINE)
        if column is not None:
            ax.plot(f[used], factor**2 * column.spectrum.density(f[used], residual.dt), **SENSOR_LINE)
        ax.margins(x=0)
        least = float(expected[used].min()) if np.any(used) else 0.0
        if least > 0.0:
            bottom, top = ax.get_ylim()
            ax.set_ylim(max(bottom, LEAST_DENSITY * factor**2 * least), top)
        label_decades(ax)
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel(f"PSD [{squared_unit(unit)}/Hz]")

    return f"residual-spectrum-{residual.name}", f"Spectrum of the residual of {residual.name} and of its noise", draw


def _autocorrelation(residual: ChannelResidual) -> Drawing:
    found = {model: residual.whiteness(model) for model in ("before", "after") if model in residual.series}
    any_model = next(iter(found.values()))
    lags, expected, half = any_model.lags[1:], any_model.expected[1:], any_model.half_width

    def draw(ax: Axes) -> None:
        ax.fill_between(lags, expected - half, expected + half, **CONFIDENCE_AREA)
        for model, whiteness in found.items():
            ax.plot(lags, whiteness.correlation[1:], **LINES[model])
        ax.set_xlim(0.0, lags[-1])
        ax.set_ylim(-0.5, 0.75)
        ax.set_xlabel("lag [s]")
        ax.set_ylabel("autocorrelation")

    return f"whiteness-{residual.name}", f"Autocorrelation of the whitened residual of {residual.name}", draw


def _coherence(residual: ChannelResidual) -> Drawing:
    f = residual.frequencies
    used = residual.in_band(f)

    def draw(ax: Axes) -> None:
        ax.set(xscale="log")
        for key in ("measured", "before", "after"):
            if key in residual.coherence:
                ax.plot(f[used], residual.coherence[key][used], **LINES[key])
        ax.set_xlim(f[used][0], f[used][-1])
        ax.set_ylim(0.0, 1.03)
        label_frequencies(ax)
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel("coherence")

    return f"coherence-{residual.name}", f"Coherence of {residual.name} and of its residual with the input", draw


__all__ = ["ResidualPictures", "channel_residuals", "residual_pictures"]
