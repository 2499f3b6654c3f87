"""Free decays of a rig: which records they are, their frequency, and the integration steps that follow them.

The kernel chooses its steps by the vehicle at rest. A stiffening spring swings faster at large amplitudes, and over the
many periods of a free decay the phase error of the integration grows: 7 % of the motion after some 80 periods of 25
samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railui.campaign.segment import Segment
from railui.dsp.spectra import hann_periodogram, periodogram

MIN_PERIODS = 10  # of the motion in a record
POWER_SHARE = 0.9  # of a record, below its highest frequency of motion
MAX_PHASE = 0.12  # rad of that frequency in a step of the classical Runge-Kutta method: 2e-7 of phase error
MAX_STEPS = 4  # per sample, where noise fills the spectrum


def with_phase_steps(segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """Return the segments with the least integration steps that keep the phase of free decays."""
    decays = [s for s in segments if is_free_decay(s)]
    steps = max((phase_steps(s) for s in decays), default=1)
    if steps == 1:
        return tuple(segments)
    return tuple(replace(s, tables={}, least_steps=steps) if s in decays else s for s in segments)


def phase_steps(segment: Segment) -> int:
    """Compute the integration steps per sample that keep the phase of a motion as fast as the record contains."""
    x = segment.columns[segment.channels[0]]
    f, density = periodogram(x, 1.0 / segment.dt)
    highest = float(f[int(np.searchsorted(np.cumsum(density), POWER_SHARE * density.sum()))])
    return int(np.clip(np.ceil(2.0 * np.pi * highest * segment.dt / MAX_PHASE), 1, MAX_STEPS))


def is_free_decay(segment: Segment) -> bool:
    """True for a record of a rig without input that lasts some periods."""
    is_free = segment.kind == "rig" and not np.any(segment.columns.get("u", 0.0))
    return is_free and motion_frequency(segment) * segment.samples * segment.dt >= MIN_PERIODS


def motion_frequency(segment: Segment) -> float:
    """Frequency [Hz] at which the first channel has most power."""
    x = segment.columns[segment.channels[0]]
    f, density = hann_periodogram(x, 1.0 / segment.dt)
    return float(f[int(np.argmax(density))])
