"""Texts, rows and plots of a recording."""

from __future__ import annotations

from railui.capture.protocol.load import WARNING_UTILISATION
from railui.desk.services.recording import CHART_SECONDS, RecordingStatus
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar
from railui.desk.widgets.plot_data import LimitLine, Line, PlotData
from railui.io.number_format import typeset_unit

LOSS_COUNTS = ("lost", "missing", "crc errors")  # shown relative to the number of samples
NEUTRAL_COUNTS = ("samples", "frames", "queue")  # no sign of a fault


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
    """Return a row per channel: newest value, standard deviation, unit."""
    rows = []
    for i, (name, unit) in enumerate(zip(status.names, status.units, strict=True)):
        x = status.values[:, i]
        text = f"{x[-1]:10.4g} ± {x.std():.3g} {typeset_unit(unit)}" if len(x) else typeset_unit(unit)
        rows.append(Bar(name, 0.0, text))
    return rows


def strip_plot(status: RecordingStatus, channel: int) -> PlotData:
    """Plot the last seconds of a channel with the markers."""
    x = Axis("t", "s")
    if len(status.t):
        x = Axis("t", "s", low=status.t[-1] - CHART_SECONDS, high=float(status.t[-1]))
    y = Axis(status.names[channel], typeset_unit(status.units[channel]))
    markers = [LimitLine(t, text, is_vertical=True) for t, text in status.markers]
    return PlotData(x, y, [Line(status.t, status.values[:, channel])], markers)
