"""Windowed spectra of measured channels and of their responses in vehicles about the nominal model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railui.arrays import ComplexArray, FloatArray
from railui.campaign.faults.spectra import ROLL, track_series
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.dsp.spectra import detrend, hann
from railui.vehicle.model import Model

SEED = 7
MAX_DURATION = 60.0  # s of a segment that are simulated
SETTLING = 2.0  # s left out at its start
WINDOW_SECONDS = 5.12
MIN_WINDOWS = 3
BAND = (0.3, 8.0)  # Hz


@dataclass(frozen=True, eq=False)
class ResponseSpectra:
    """Transforms of a run: measured channels, and the responses of vehicles [vehicle] to the parts of the track.

    Attributes
    ----------
    f
        Frequencies [frequency] in Hz.
    time
        Middle of every window [window] from the start of the run [s].
    speed
        Mean speed [m/s].
    measured, roll
        Channels, and the cross-level where they are mounted [channel, window, frequency].
    alignment, level
        Responses to the alignment and to the cross-level [vehicle, channel, window, frequency].
    """

    f: FloatArray
    time: FloatArray
    speed: float
    measured: ComplexArray
    roll: ComplexArray
    alignment: ComplexArray
    level: ComplexArray


def vehicle_rows(settings: FaultSettings, model: Model, paths: Sequence[str]) -> FloatArray:
    """Return rows [vehicle, row] of the nominal model and of others, with log-normal estimated parameters."""
    rows = np.repeat(model.row[None], settings.response_vehicles, axis=0)
    columns = [model.columns[p] for p in paths if p in model.columns]
    normal = np.random.default_rng(SEED).standard_normal((len(rows) - 1, len(columns)))
    rows[1:, columns] *= np.exp(settings.response_parameter_log_sd * normal)
    return rows


def response_spectra(
    model: Model, rows: FloatArray, segment: Segment, names: Sequence[str], wheelbase: float, radius: float
) -> ResponseSpectra | None:
    """Simulate and transform a segment; None where it is too short. Vehicles that diverge have responses of NaN."""
    dt, length = segment.dt, round(WINDOW_SECONDS / segment.dt)
    skipped = round(SETTLING / dt)
    samples = min(segment.samples, round(MAX_DURATION / dt))
    if samples < skipped + length * (MIN_WINDOWS + 1) // 2:
        return None
    f = np.asarray(np.fft.rfftfreq(length, dt), dtype=np.float64)
    used = np.flatnonzero((f >= BAND[0]) & (f <= BAND[1]))

    def transform(x: FloatArray) -> ComplexArray:
        starts = range(skipped, samples - length + 1, length // 2)
        windows = [np.fft.rfft(detrend(x[..., i : i + length]) * hann(length))[..., used] for i in starts]
        return np.asarray(np.stack(windows, axis=-2))

    level_track = replace(segment, columns={**segment.columns, "phiw": np.zeros(segment.samples)}, tables={})
    both = _simulate(model, rows, segment.truncated(samples), names)
    alignment = _simulate(model, rows, level_track.truncated(samples), names)
    c = segment.columns
    roll = [
        track_series(c, "roll", ROLL[n].partition(".")[2], wheelbase, radius) if n in ROLL else 0.0 * c["t"]
        for n in names
    ]
    measured = transform(segment.measured(names))
    time = np.asarray(dt * (skipped + 0.5 * length + np.arange(measured.shape[1]) * (length // 2)), dtype=np.float64)
    return ResponseSpectra(
        f[used], time, segment.mean_speed, measured, transform(np.array(roll)), transform(alignment),
        transform(both - alignment),
    )  # fmt: skip


def _simulate(model: Model, rows: FloatArray, segment: Segment, names: Sequence[str]) -> FloatArray:
    """Simulate the channels [vehicle, channel, n] of a segment."""
    vehicles, batch = model.vehicles(segment.coach_forces), model.batch(rows)
    steps = int(np.max(vehicles.required_steps(batch, *segment.speeds, segment.dt)))
    table = segment.table(model.wheelset_spacing(), steps)
    series, diverged = vehicles.simulate(batch, table, segment.dt, steps, list(names), jobs=1)
    out = np.array(series)
    out[np.asarray(diverged) >= 0] = np.nan
    return out
