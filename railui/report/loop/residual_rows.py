"""Residuals of the channels on the loop page: pictures, size against noise, whiteness."""

from __future__ import annotations

from typing import Any

from railui.identification.result import LoopResult
from railui.report.loop.figures import Window, shown_channels
from railui.report.loop.residual_figures import residual_pictures
from railui.report.loop.residuals import channel_residuals
from railui.runs.columns import columns_of

MAX_CHANNELS = 12  # drawn: a vehicle of bodies has many sensors


def residual_rows(result: LoopResult, window: Window, full: int) -> list[dict[str, Any]]:
    """Return the residual of every shown channel: pictures, rms over noise and share of lags outside, by model.

    full: number of channels with autocorrelation and coherence.
    """
    captions = {column.name: column.caption for column in columns_of(window.segment.kind).values()}
    residuals = channel_residuals(result, window.index)
    channels = [name for name in shown_channels(window.segment) if name in residuals][:MAX_CHANNELS]
    pictures = residual_pictures(result, window, channels, residuals, full)
    rows = []
    for name in channels:
        residual, models = residuals[name], list(residuals[name].series)
        rows.append(
            {
                "name": name,
                "caption": captions[name],
                "pictures": pictures[name],
                "models": models,
                "ratios": [f"{residual.ratio_to_noise(m):.2f}" for m in models],
                "outside": [f"{100 * residual.whiteness(m).share_outside:.0f} %" for m in models],
            }
        )
    return rows
