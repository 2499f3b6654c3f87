"""Application of corrections to the columns of a measured run; the file itself is never altered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.corrections.correction import Correction, Corrections, gain_of_unit
from railui.core import Spline
from railui.runs.columns import column_names
from railui.runs.run import Run
from railui.track import distance_from_speed

TRACK_COLUMNS = column_names("bogie", "track")
HUM_BLOCK_SECONDS = 10.0  # in which a hum has one amplitude and phase
MIN_CORRECTED_SAMPLES = 50  # of a segment after its ends are cut


def corrected_run(run: Run, name: str, corrections: Corrections, wheelbase: float) -> Run:
    """Return a run with corrected columns; segments lose the samples at their ends that a delay leaves undefined.

    Parameters
    ----------
    name
        Name of the run in the campaign file.
    wheelbase
        Distance [m] of the trailing wheelset behind the leading one; any number for a rig.
    """
    channels, offset = corrections.of_run(name)
    if not channels and not offset:
        return run
    channels = tuple(_with_header_unit(c, run) for c in channels)
    columns = {k: x.copy() for k, x in run.columns.items()}
    slices = []
    for rows in run.segments:
        part = {k: x[rows] for k, x in run.columns.items()}
        corrected, trim = corrected_columns(part, channels, offset, wheelbase, float(run.columns["t"][0]))
        for k, x in corrected.items():
            columns[k][rows] = x
        kept = slice(rows.start + trim[0], rows.stop - trim[1])
        if kept.stop - kept.start >= MIN_CORRECTED_SAMPLES:
            slices.append(kept)
    unused = {c.channel for c in channels if c.leave_out}
    return replace(
        run,
        columns={k: x for k, x in columns.items() if k not in unused},
        segments=tuple(slices),
        responses=tuple(c for c in run.responses if c not in unused),
    )


def _with_header_unit(correction: Correction, run: Run) -> Correction:
    """Return the correction with its unit as a gain."""
    header = run.units.get(correction.channel, "")
    if correction.unit is None or not header:
        return correction
    return replace(correction, gain=correction.gain * gain_of_unit(correction.unit, header), unit=None)


def corrected_columns(
    columns: Mapping[str, FloatArray],
    corrections: Sequence[Correction],
    track_offset: float,
    wheelbase: float,
    start: float,
) -> tuple[dict[str, FloatArray], tuple[int, int]]:
    """Correct the columns of an unbroken segment.

    Parameters
    ----------
    columns
        Columns [n] of the segment.
    track_offset
        Distance [m] by which the track is recorded too far along the line.
    start
        Time [s] at which the clocks of the run start together.

    Returns
    -------
    dict, tuple of int
        Columns [n], and the numbers of samples at either end that no record covers.
    """
    c = dict(columns)
    corrections = [x for x in corrections if x.channel in c]
    for x in corrections:
        if x.swap_with in c:
            c[x.channel], c[x.swap_with] = c[x.swap_with], c[x.channel]
    t, trim = c["t"], np.zeros(len(c["t"]), dtype=bool)
    for x in corrections:
        if x.gain != 1.0:
            c[x.channel] = c[x.channel] / x.gain
        if x.hum:
            c[x.channel] = c[x.channel] - line_signal(t, c[x.channel], x.hum)
    if track_offset:
        s = distance(c)
        trim |= (s + track_offset < s[0]) | (s + track_offset > s[-1])
        for name in TRACK_COLUMNS:
            if name in c and np.any(c[name]):
                c[name] = Spline(s, c[name])(np.clip(s + track_offset, s[0], s[-1]))
    for x in corrections:
        if x.delay or x.clock_rate != 1.0:
            at = start + x.clock_rate * (t - start) + x.delay
            trim |= (at < t[0] - 1e-9) | (at > t[-1] + 1e-9)
            c[x.channel] = Spline(t, c[x.channel])(np.clip(at, t[0], t[-1]))
    for x in corrections:
        if x.gravity and "phiw" in c:
            c[x.channel] = c[x.channel] - x.gravity * roll_at(c, x.channel, wheelbase)
    good = np.flatnonzero(~trim)
    if not len(good):
        return c, (len(t), 0)
    return c, (int(good[0]), int(len(t) - 1 - good[-1]))


def distance(columns: Mapping[str, FloatArray]) -> FloatArray:
    """Return the distance [m] along the track: the column s, or the integral of the speed."""
    return columns["s"] if "s" in columns else distance_from_speed(columns["t"], columns["v"])


def roll_at(columns: Mapping[str, FloatArray], channel: str, wheelbase: float) -> FloatArray:
    """Return the cross-level [rad] below an accelerometer: under its wheelset, or the mean of both for the frame."""
    s, phiw = distance(columns), columns["phiw"]
    trailing = Spline(s, phiw)(np.maximum(s - wheelbase, s[0]))
    return {"ay1": phiw, "ay2": trailing}.get(channel, 0.5 * (phiw + trailing))


def line_signal(t: FloatArray, x: FloatArray, frequency: float, block_seconds: float = HUM_BLOCK_SECONDS) -> FloatArray:
    """Return the sinusoid [n] of a frequency [Hz] in a series, fitted in blocks by least squares."""
    fitted = np.zeros_like(x)
    blocks = max(round((t[-1] - t[0]) / block_seconds), 1)
    for rows in np.array_split(np.arange(len(t)), blocks):
        angle = 2.0 * np.pi * frequency * t[rows]
        basis = np.stack([np.cos(angle), np.sin(angle), np.ones(len(rows))], axis=1)
        coefficients = np.linalg.lstsq(basis, x[rows], rcond=None)[0]
        fitted[rows] = basis[:, :2] @ coefficients[:2]
    return fitted
