"""Texts, rows and plots of a recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from rich.text import Text

from railui.arrays import FloatArray
from railui.capture.protocol.load import WARNING_UTILISATION
from railui.desk.services.playing import StoredRecording
from railui.desk.services.recording import RecordingStatus
from railui.desk.state.playback import Playback, find_gaps
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar
from railui.desk.widgets.plot_data import LimitLine, Line, PlotData
from railui.io.number_format import typeset_unit

LOSS_COUNTS = ("lost", "missing", "crc errors")  # shown relative to the number of samples
NEUTRAL_COUNTS = ("samples", "frames", "queue")  # no sign of a fault
METER_RANGE: Final = 60.0  # dB below full scale at the left end of a level meter
METER_SECONDS: Final = 0.5  # s of which a level meter shows the highest value
CLIPPED_FRACTION: Final = 0.999  # of full scale, from which a sample is at the end of the range
MIN_AXIS_SPAN: Final = 0.01  # of the largest value: smaller changes do not fill the plot
MIN_NAMED_GAP: Final = 0.02  # of the seconds shown, from which a gap has its duration in the plot
ROLES: Final = {"adjust": "estimation", "validate": "validation"}  # words of a campaign's file


def link_rows(status: RecordingStatus) -> list[Bar]:
    """Return the load of the link, the counters of the recording, and the status of the logger."""
    rows = []
    load = status.link_load
    if load is not None:
        is_overloaded = load > WARNING_UTILISATION
        text = f"{100 * load:.0f} % used"
        rows.append(Bar("link", load, text, mark=WARNING_UTILISATION, is_emphasised=is_overloaded))
    sample_count = max(1, status.counts["samples"])
    for name, count in status.counts.items():
        fraction = count / sample_count if name in LOSS_COUNTS else 0.0
        rows.append(Bar(name, fraction, f"{count}", is_emphasised=name not in NEUTRAL_COUNTS and count > 0))
    return rows + [Bar(name, 0.0, f"{value:.4g}") for name, value in status.status.items() if value is not None]


def channel_rows(status: RecordingStatus) -> list[Bar]:
    """Return a row per channel: level meter, newest value, standard deviation, unit.

    The bar is the highest value of the last half second in decibels below full scale, the line that of the seconds
    shown. A channel of floating-point numbers has no full scale: its highest value so far stands for it.
    """
    rows = []
    is_recent = status.t >= status.t[-1] - METER_SECONDS if len(status.t) else np.zeros(0, dtype=bool)
    for i, (name, unit) in enumerate(zip(status.names, status.units, strict=True)):
        x = status.values[:, i]
        finite = x[np.isfinite(x)]
        if not len(finite):
            rows.append(Bar(name, 0.0, f"no value {typeset_unit(unit)}"))
            continue
        peak = float(np.max(np.abs(finite)))
        scale = status.full_scales[i]
        now = x[is_recent & np.isfinite(x)]
        level = meter_fraction(float(np.max(np.abs(now), initial=0.0)), scale if math.isfinite(scale) else peak)
        hold = meter_fraction(peak, scale) if math.isfinite(scale) else None
        is_clipped = name in status.clipped or (math.isfinite(scale) and peak >= CLIPPED_FRACTION * abs(scale))
        text = f"{'clipped ' if is_clipped else ''}{finite[-1]:.4g} ± {finite.std():.2g} {typeset_unit(unit)}"
        rows.append(Bar(name, level, text, mark=hold, is_emphasised=is_clipped))
    return rows


def meter_fraction(value: float, full_scale: float) -> float:
    """Return the length of a level meter, 0 .. 1, for a magnitude.

    >>> meter_fraction(1.0, 10.0), meter_fraction(0.0, 10.0)
    (0.6666666666666667, 0.0)
    """
    if value <= 0 or full_scale <= 0:
        return 0.0
    return min(1.0, max(0.0, 1.0 + 20.0 * math.log10(value / full_scale) / METER_RANGE))


def strip_plot(status: RecordingStatus, channel: int, seconds: float) -> PlotData:
    """Plot the last seconds of a channel with the gaps and the markers."""
    x = Axis("t", "s")
    interval = 1.0 / status.rate if status.rate > 0 else math.inf
    is_shown = status.t >= (status.t[-1] - seconds if len(status.t) else 0.0)
    t, values = status.t[is_shown], status.values[is_shown, channel]
    if len(t):
        x = Axis("t", "s", low=t[-1] - seconds, high=float(t[-1]))
    gaps = find_gaps(t, interval)
    lines = [Line(*interrupted(t, values, [at for at, _ in gaps], interval))]
    labels = [f"gap {duration:.3g} s" if duration > MIN_NAMED_GAP * seconds else "" for _, duration in gaps]
    limits = [LimitLine(at, label, is_vertical=True) for (at, _), label in zip(gaps, labels, strict=True)]
    limits += [LimitLine(at, text, is_vertical=True, role="other") for at, text in status.markers]
    return PlotData(x, _strip_axis(status, channel, values), lines, limits)


def _strip_axis(status: RecordingStatus, channel: int, values: FloatArray) -> Axis:
    """Return an axis that is not filled by changes that are small against the values."""
    name, unit = status.names[channel], typeset_unit(status.units[channel])
    finite = values[np.isfinite(values)]
    if not len(finite):
        return Axis(name, unit)
    low, high = float(finite.min()), float(finite.max())
    span = MIN_AXIS_SPAN * max(abs(low), abs(high))
    if high - low >= span:
        return Axis(name, unit)
    middle = 0.5 * (low + high)
    return Axis(name, unit, low=middle - span, high=middle + span)


def interrupted(t: FloatArray, x: FloatArray, gaps: Sequence[float], interval: float) -> tuple[FloatArray, FloatArray]:
    """Insert NaN behind the last sample before each gap, so that no line crosses it."""
    at = np.searchsorted(t, gaps, "right")
    return np.insert(t, at, np.asarray(gaps) + interval), np.insert(x, at, np.nan)


def playback_text(playback: Playback) -> Text:
    """Return name, position and speed of a replay."""
    run = playback.run
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"replay of {run.name}\n", "bold")
    state = "playing" if playback.is_playing else "paused"
    text.append(f"{playback.position:.1f} of {run.duration:.1f} s, speed ×{playback.speed:g}, {state}\n")
    counts = [(len(playback.gaps), "gap"), (len(run.markers), "marker"), (len(run.clipped), "clipped channel")]
    text.append(", ".join(f"{n} {word}{'' if n == 1 else 's'}" for n, word in counts), "dim")
    return text


def recording_rows(recordings: Sequence[StoredRecording], roles: dict[str, str]) -> list[Bar]:
    """Return a row per recording: name, duration, losses, role in the campaign."""
    rows = []
    for each in recordings:
        parts = [] if each.seconds is None else [f"{each.seconds:.1f} s"]
        if each.lost:
            parts.append(f"{each.lost} lost")
        if role := roles.get(str(each.path)):
            parts.append(ROLES[role])
        rows.append(Bar(each.path.name, 0.0, "  ".join(parts), is_emphasised=str(each.path) in roles))
    return rows
