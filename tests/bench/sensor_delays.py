"""Delays of channels and of the track: error, bias of the parameters, and the delay that the data check reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.comparison import band_pass, comparison_filter
from railui.campaign.dataset import Dataset
from railui.campaign.faults.diagnose import diagnose
from railui.identification.estimation.gauss_newton import GaussNewton
from railui.identification.estimation.identifiability import DETERMINED
from railui.identification.structure.candidates import Candidate, batch_candidates
from railui.identification.structure.score_test import output_differences
from tests.bench.sensor_sets import Identified
from tests.blind.faults import TRACK, PlantedFault, retimed, with_faults

SMALL_DELAY = 1e-3  # s, of the parallel model
PLANTED_DELAYS = (2e-3, 5e-3, 10e-3, 20e-3, 50e-3, 100e-3)  # s
ALL_LATE = "track"  # a track that is recorded early or late delays all channels alike
TIMING_FAULTS = ("delay", "clock", "track_offset")


@dataclass(frozen=True)
class DelayLimits:
    """Limits of a delay, to first order.

    Attributes
    ----------
    doubled_error
        Delay [s] at which the error is twice its noise floor.
    biased, parameter
        Delay [s] at which the first determined parameter is wrong by its standard deviation, and that parameter.
    shift, shifted
        Largest relative change [1/s] of a determined parameter per delay, and that parameter.
    """

    doubled_error: float
    biased: float
    parameter: str
    shift: float
    shifted: str


@dataclass(frozen=True)
class ChannelNoise:
    """Standard deviations of a channel.

    Attributes
    ----------
    signal, sensor, track
        In the band of the comparison: signal, sensor noise, response of the vehicle to track noise.
    total
        Sensor noise over all frequencies.
    sufficient
        White sensor noise over all frequencies that is in the band as large as the response to track noise.
    """

    signal: float
    sensor: float
    track: float
    total: float
    sufficient: float


def delay_limits(result: Identified) -> dict[str, DelayLimits]:
    """Compute the limits of every channel's delay, and of the track's, to first order about the calibrated model.

    The error counts after a new calibration, which absorbs a part of the delay; of a channel its own error counts, of
    the track the NRMSE over all channels.
    """
    fit = result.fit
    solver = GaussNewton.of_fit(result.context, fit)
    candidates = [Candidate("sensor_delay", c, None, ({"delay": SMALL_DELAY},)) for c in result.channels]
    linear = [solver.sensitivities(t, fit.x)[0][1:] for t in fit.segments]  # [p, channel, n]
    delayed = [_differences(result, k, candidates) for k in range(len(linear))]  # [channel, channel, n]
    matrix, _ = solver.equations(fit.normal, fit.x)
    products = sum(np.tensordot(j, d, ([1, 2], [1, 2])) for j, d in zip(linear, delayed, strict=True))  # [p, channel]
    bias = np.linalg.solve(matrix, products / fit.normal.variance)
    left = [d - np.tensordot(bias, j, (0, 0)) for d, j in zip(delayed, linear, strict=True)]
    lanes = {c: [i] for i, c in enumerate(result.channels)} | {ALL_LATE: [*range(len(result.channels))]}
    return {name: _limits(result, late, bias[:, late].sum(axis=1), left) for name, late in lanes.items()}


def _differences(result: Identified, index: int, candidates: Sequence[Candidate]) -> FloatArray:
    """Output differences per second of delay [delayed channel, channel, n] on a segment."""
    settings = result.context.settings
    parts = [
        output_differences(settings, result.fit.model, result.fit.segments[index], batch)[0]
        for batch in batch_candidates(candidates)
    ]
    return np.concatenate(parts) / SMALL_DELAY


def _power(series: Sequence[FloatArray]) -> FloatArray:
    """Sum of squares [channel] over segments [channel, n]."""
    return np.asarray(sum(np.sum(x**2, axis=-1) for x in series))


def _limits(result: Identified, late: list[int], bias: FloatArray, left: Sequence[FloatArray]) -> DelayLimits:
    """Limits where the channels `late` are late together.

    bias: change [p] per second of delay. left: differences [delayed channel, channel, n] that a calibration leaves.
    """
    fit = result.fit
    signal = _power([t.measured for t in fit.segments])
    floor = np.array([result.floor.channels[c] for c in result.channels])
    share = _power([x[late].sum(axis=0) for x in left]) / signal
    doubled = float(np.sqrt(3.0 * np.mean(floor[late] ** 2) / np.mean(share[late])))
    used = [i for i, (_, word, _, _) in enumerate(result.identifiability.classes) if word == DETERMINED]
    paths = [fit.free.paths[i] for i in used]
    in_sd, relative = np.abs(bias[used]) / fit.sd[used], np.abs(bias[used] / fit.x[used])
    worst, farthest = int(np.argmax(in_sd)), int(np.argmax(relative))
    return DelayLimits(doubled, float(1.0 / in_sd[worst]), paths[worst], float(relative[farthest]), paths[farthest])


def reported_delay(dataset: Dataset, name: str) -> float | None:
    """Return the smallest planted delay [s] of a channel or the track that the data check reports; None if none."""
    columns = TRACK if name == ALL_LATE else (name,)
    for delay in PLANTED_DELAYS:
        planted = PlantedFault("delay", columns, "", retimed(*columns, delay=delay))
        faults = [f for f in diagnose(with_faults(dataset, [planted])).faults if f.kind in TIMING_FAULTS]
        if any(name == ALL_LATE or name in f.channels for f in faults):
            return delay
    return None


def channel_noise(result: Identified) -> dict[str, ChannelNoise]:
    """Compute signal and noise of every channel in the band of the comparison, on the validation runs."""
    context = result.context
    segments = context.dataset.validation
    sections = band_pass(context.campaign.band, 1.0 / segments[0].dt)
    sensor = np.sqrt(context.noise.variance(result.channels, sections, segments[0].dt))
    noise = {}
    for c, sd in zip(result.channels, sensor, strict=True):
        signal = _rms_in_band(result, c)
        track = float(np.sqrt(max((result.floor.channels[c] * signal) ** 2 - sd**2, 0.0)))
        level = float(context.noise[c])
        noise[c] = ChannelNoise(signal, float(sd), track, level, level * track / float(sd))
    return noise


def _rms_in_band(result: Identified, channel: str) -> float:
    parts = [
        comparison_filter(result.context.campaign, s, s.measured([channel]))[0]
        for s in result.context.dataset.validation
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
