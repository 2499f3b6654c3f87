"""Data of the viewer of whole runs: measured and simulated channels, quantised, for the script of the page."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import cut_samples
from railui.identification.result import LoopResult
from railui.report.loop.figures import compared_series, shown_channels, units_of
from railui.report.numbers import display_scale

MAX_NUMBERS = 900_000  # of all series together: 2.4 MB of the page
MAX_SAMPLES = 40_000  # of one series
LEVELS = 65_534  # of a quantised series


def overview_data(result: LoopResult) -> list[dict[str, Any]]:
    """Return the validation segments with their channels as the error compares them.

    Series are quantised to 16 bits of their range. Where they are long, only every n-th sample is contained (`stride`);
    channels that exceed the size of the page are left out.
    """
    segments = result.dataset.validation
    budget = MAX_NUMBERS // max(len(segments), 1)
    return [_segment_data(result, i, budget) for i in range(len(segments))]


def _segment_data(result: LoopResult, index: int, budget: int) -> dict[str, Any]:
    segment = result.dataset.validation[index]
    series = compared_series(result, index)
    samples = series["measured"].shape[1]
    stride = -(-samples // MAX_SAMPLES)
    count = max(budget // max(-(-samples // stride) * len(series), 1), 1)
    t = segment.columns["t"][cut_samples(result.dataset.campaign, segment) :]
    channels = []
    for name in shown_channels(segment)[:count]:
        row = segment.channels.index(name)
        factor, unit = display_scale(series["measured"][row], units_of(result, segment)[name])
        channels.append(
            {
                "name": name,
                "unit": unit,
                "series": {model: _quantised(factor * x[row, ::stride]) for model, x in series.items()},
            }
        )
    return {
        "file": segment.file,
        "start": round(float(t[0]), 6),
        "step": segment.dt * stride,
        "stride": stride,
        "channels": channels,
        "omitted": max(len(shown_channels(segment)) - count, 0),
    }


def _quantised(x: FloatArray) -> dict[str, Any]:
    """Return a series as base64 of little-endian 16-bit levels, with its offset and step."""
    low, high = float(x.min()), float(x.max())
    step = (high - low) / LEVELS or 1.0
    levels = np.rint((x - low) / step).astype("<u2")
    data = base64.b64encode(levels.tobytes()).decode("ascii")
    return {"low": float(f"{low:.9g}"), "step": float(f"{step:.9g}"), "data": data}
