"""Faults of a single channel: clipping, dropouts and mains hum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui.arrays import FloatArray
from railui.campaign.corrections.correction import Correction, Corrections
from railui.campaign.faults.fault import Fault
from railui.campaign.faults.rig_responses import driving_column
from railui.campaign.faults.saturation import is_motion, saturated_samples
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from railui.dsp.spectra import detrend, hann, hann_periodogram, periodogram

MAINS = ((50.0, 0.2), (60.0, 0.2), (50.0 / 3.0, 0.1))  # Hz, with tolerance
NEIGHBOURS = (0.4, 2.0)  # Hz from the line
LINE_REACH = 2  # frequencies of a spectrum to either side into which a window spreads a line
NEIGHBOURING_PERIODS = (-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6)  # of a drive: some of its harmonics may vanish
HARMONICS = 15  # of a periodic drive, a triangle at most


@dataclass(frozen=True)
class _Runs:
    """Runs of equal samples: first index, length."""

    start: NDArray[np.intp]
    length: NDArray[np.intp]


def _equal_runs(x: FloatArray) -> _Runs:
    edges = np.concatenate(([0], np.flatnonzero(np.diff(x) != 0) + 1, [len(x)]))
    return _Runs(edges[:-1], np.diff(edges))


def clipped_samples(x: FloatArray, settings: FaultSettings) -> int:
    """Count the samples of a series at an extreme where it was cut off.

    Samples pile up there: far more than in the narrow range below, however coarse the resolution is.

    >>> t = np.arange(2000) * 0.01
    >>> clipped_samples(np.sin(3 * t) + np.sin(7.3 * t), FaultSettings())
    0
    >>> clipped_samples(np.clip(np.sin(3 * t) + np.sin(7.3 * t), -1.2, 1.2), FaultSettings()) > 100
    True
    """
    runs = _equal_runs(x)
    steps = np.abs(np.diff(np.unique(x)))
    if len(steps) < 3:
        return 0
    side = max(settings.clipping_side_share * float(np.ptp(x)), 1.01 * float(np.min(steps)))
    count = 0
    for sign in (1.0, -1.0):
        y = sign * x
        extreme = y.max()
        at = (y[runs.start] == extreme) & (runs.length >= settings.min_equal_samples)
        number = int(runs.length[at].sum())
        near = int(np.sum((y < extreme) & (y >= extreme - side)))
        if at.sum() >= settings.min_fault_events and number > settings.clipping_pile_up * max(near, 1):
            count += number
    return count


def lost_samples(x: FloatArray, settings: FaultSettings) -> tuple[int, int]:
    """Count the samples and events of dropouts: zeros or repeated values with a jump at an end.

    >>> t = np.arange(2000) * 0.01
    >>> x = np.sin(3 * t) + np.sin(7.3 * t)
    >>> settings = FaultSettings()
    >>> lost_samples(x, settings), lost_samples(np.round(x, 1), settings)
    ((0, 0), (0, 0))
    >>> lost_samples(np.where((np.arange(2000) % 200 > 190), 0.0, x), settings)[1] > 5
    True
    """
    difference = np.diff(x)
    if not np.any(difference):
        return 0, 0
    runs = _equal_runs(x)
    steps = np.abs(difference[difference != 0])
    jump = max(settings.dropout_jump_steps * float(np.median(steps)), settings.dropout_jump_sd * float(np.std(x)))
    before = np.abs(np.diff(x, prepend=x[0]))[runs.start]
    after = np.abs(np.diff(x, append=x[-1]))[runs.start + runs.length - 1]
    is_fine = float(np.mean(runs.length[runs.length < settings.min_repeated_samples] > 1)) < settings.fine_repeat_share
    inner = (x[runs.start] < x.max()) & (x[runs.start] > x.min())
    lost = inner & (runs.length >= settings.min_equal_samples) & ((before > jump) | (after > jump))
    if is_fine:
        lost |= inner & (runs.length >= settings.min_repeated_samples)
    return int(runs.length[lost].sum()), int(lost.sum())


def hum_line(x: FloatArray, rate: float, ratio: float) -> tuple[float, float] | None:
    """Find a line at a mains frequency; return its frequency [Hz] and its power, None if there is none."""
    f, power = periodogram(x, rate)
    for mains, tolerance in MAINS:
        inside = np.flatnonzero(np.abs(f - mains) <= tolerance)
        sides = (np.abs(f - mains) > NEIGHBOURS[0]) & (np.abs(f - mains) < NEIGHBOURS[1])
        if len(inside) < 3 or mains + NEIGHBOURS[1] > 0.5 * rate:
            continue
        peak = inside[int(np.argmax(power[inside]))]
        line = float(power[max(peak - 1, 0) : peak + 2].sum() * f[1])
        usual = float(np.median(power[sides]))
        if power[peak] > ratio * usual and line > ratio * usual * f[1] and power[peak] > 3.0 * power[sides].max():
            return float(f[peak]), line
    return None


def waveform_faults(segments: Sequence[Segment], settings: FaultSettings, radius: float | None) -> list[Fault]:
    """Check every channel of all runs.

    Parameters
    ----------
    radius
        Rolling radius [m], whose speed of rotation is no hum; None on a rig.
    """
    channels = list(dict.fromkeys(c for s in segments for c in s.channels))
    faults = []
    for channel in channels:
        recorded = [s for s in segments if channel in s.columns]
        has_others = len(channels) > 1
        faults += _clipping(channel, recorded, settings, has_others)
        faults += _dropouts(channel, recorded, settings, has_others)
        faults += _hum(channel, recorded, settings, radius)
    return faults


def _left_out(channel: str, has_others: bool) -> Corrections:
    return Corrections((Correction(channel, leave_out=True),)) if has_others else Corrections()


def _clipping(channel: str, segments: Sequence[Segment], settings: FaultSettings, has_others: bool) -> list[Fault]:
    equal = {s: clipped_samples(s.columns[channel], settings) for s in segments}
    noisy = {s: 0 if equal[s] else _saturated_samples(channel, s, settings) for s in segments}
    counts = {s: equal[s] + noisy[s] for s in segments}
    files = tuple(dict.fromkeys(s.file for s, n in counts.items() if n))
    if not files:
        return []
    share = sum(counts.values()) / sum(s.samples for s in segments)
    text = f"{channel} is clipped: {sum(counts.values())} samples ({100.0 * share:.2f} %) in a row at its extreme"
    if any(noisy.values()):
        text += ", equal but for noise: an amplifier or a sensor saturates before the converter"
    serious = share > settings.serious_clipped_share
    return [Fault("clipping", (channel,), share, None, "1", files, text, serious, _left_out(channel, has_others))]


def _saturated_samples(channel: str, segment: Segment, settings: FaultSettings) -> int:
    """Count the samples of a channel on noisy plateaus at its extremes, which the force of a damper may have, too."""
    if segment.kind == "bench":
        return 0
    indices = saturated_samples(segment.columns[channel], settings)
    if channel == "z" and len(indices) and is_motion(segment.columns, indices, settings):
        return 0
    return len(indices)


def _dropouts(channel: str, segments: Sequence[Segment], settings: FaultSettings, has_others: bool) -> list[Fault]:
    counts = {s: lost_samples(s.columns[channel], settings) for s in segments}
    events = sum(n for _, n in counts.values())
    if events < settings.min_fault_events:
        return []
    files = tuple(dict.fromkeys(s.file for s, (_, n) in counts.items() if n))
    share = sum(n for n, _ in counts.values()) / sum(s.samples for s in segments)
    text = f"{channel} drops out {events} times: {100.0 * share:.2f} % of its samples are zeros or repeated values"
    serious = share > settings.serious_clipped_share and not segments[0].is_rig
    return [Fault("dropouts", (channel,), share, None, "1", files, text, serious, _left_out(channel, has_others))]


def hum_lines(
    channel: str, segments: Sequence[Segment], settings: FaultSettings, radius: float | None
) -> dict[Segment, tuple[float, float]]:
    """Find the segments of which a channel contains mains hum, with its frequency [Hz] and its power.

    radius: rolling radius [m]; None on a rig.
    """
    lines = {s: hum_line(s.columns[channel], 1.0 / s.dt, settings.hum_line_ratio) for s in segments}
    found = {s: line for s, line in lines.items() if line is not None}
    return {s: line for s, line in found.items() if not _is_of_motion(channel, s, line[0], radius, settings)}


def hum_of_rig(segments: Sequence[Segment], settings: FaultSettings) -> dict[tuple[str, str], float]:
    """Find the mains hum [Hz] in the channels of a rig, by run and channel."""
    rigs = [s for s in segments if s.is_rig]
    found = {}
    for channel in dict.fromkeys(c for s in rigs for c in s.channels):
        recorded = [s for s in rigs if channel in s.columns]
        for segment, (frequency, _) in hum_lines(channel, recorded, settings, None).items():
            found[segment.file, channel] = frequency
    return found


def _hum(channel: str, segments: Sequence[Segment], settings: FaultSettings, radius: float | None) -> list[Fault]:
    """Return one fault for each mains frequency of which a channel contains hum."""
    by_mains: dict[float, dict[Segment, tuple[float, float]]] = {}
    for s, line in hum_lines(channel, segments, settings, radius).items():
        by_mains.setdefault(_nearest_mains(line[0]), {})[s] = line
    return [_hum_fault(channel, lines, settings) for lines in by_mains.values()]


def _hum_fault(channel: str, lines: Mapping[Segment, tuple[float, float]], settings: FaultSettings) -> Fault:
    frequency = float(np.mean([f for f, _ in lines.values()]))
    share = max(power / float(np.var(s.columns[channel])) for s, (_, power) in lines.items())
    files = tuple(dict.fromkeys(s.file for s in lines))
    text = f"{channel} contains mains hum of {frequency:.2f} Hz, {100.0 * share:.2g} % of its power"
    serious = share > settings.serious_hum_share and not any(s.is_rig for s in lines)
    corrections = Corrections((Correction(channel, hum=round(frequency, 4)),))
    return Fault("hum", (channel,), frequency, None, "Hz", files, text, serious, corrections)


def _nearest_mains(frequency: float) -> float:
    return min((mains for mains, _ in MAINS), key=lambda mains: abs(mains - frequency))


def _is_of_motion(
    channel: str, segment: Segment, frequency: float, radius: float | None, settings: FaultSettings
) -> bool:
    """True if a wheel turns at the frequency, a rig is driven there, or its free motion has that frequency."""
    if radius is not None:
        turn = segment.mean_speed / (2.0 * np.pi * radius)
        return any(abs(k * turn - frequency) < settings.hum_turn_clearance for k in (1, 2, 3, 4))
    x, rate = segment.columns[channel], 1.0 / segment.dt
    drive = segment.columns.get(driving_column(segment))
    if drive is None or not np.ptp(drive):
        return _fades(x, frequency, rate, settings)
    line = hum_line(drive, rate, settings.hum_line_ratio)
    is_driven = line is not None and _nearest_mains(line[0]) == _nearest_mains(frequency)
    return is_driven or _is_harmonic(x, drive, frequency, rate, settings)


def _fades(x: FloatArray, frequency: float, rate: float, settings: FaultSettings) -> bool:
    """True where a line of a series [n] is weaker in its last third than in its first, which mains hum is not."""
    third = len(x) // 3
    angle = 2.0 * np.pi * frequency / rate * np.arange(third)
    wave = hann(third) * np.exp(-1j * angle)
    first, last = (float(abs(wave @ detrend(part))) for part in (x[:third], x[-third:]))
    return last < settings.min_steady_motion * first


def _is_harmonic(x: FloatArray, drive: FloatArray, frequency: float, rate: float, settings: FaultSettings) -> bool:
    """True where a line of a series [n] is no stronger than those some periods of the drive away.

    A law that is not linear answers a periodic drive at all multiples of its frequency, a symmetric one at the odd
    multiples.
    """
    f, of_drive = hann_periodogram(drive, rate)
    period = float(f[int(np.argmax(of_drive))])
    if not _is_periodic(f, of_drive, period, settings):
        return False
    _, power = hann_periodogram(x, rate)

    def at(line: float) -> float:
        return float(power[_near(f, line)].max(initial=0.0))

    neighbours = max(at(frequency + k * period) for k in NEIGHBOURING_PERIODS)
    return settings.hum_harmonic_ratio * neighbours > at(frequency)


def _is_periodic(f: FloatArray, power: FloatArray, period: float, settings: FaultSettings) -> bool:
    """True where a spectrum [F] is that of a motion which repeats itself: nearly all of it in multiples of one line."""
    if period < (2 * LINE_REACH + 1) * f[1]:
        return False
    lines = np.any([_near(f, k * period) for k in range(1, HARMONICS + 1)], axis=0)
    return bool(power[lines].sum() > settings.periodic_drive_share * power.sum())


def _near(f: FloatArray, line: float) -> NDArray[np.bool_]:
    return np.asarray(np.abs(f - line) <= LINE_REACH * f[1])
