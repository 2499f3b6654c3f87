"""Integration steps of records of a rig, which keep phase and damping of its motion.

The kernel chooses its steps by the vehicle at rest, whose modes are well damped. In steps of phase theta the classical
Runge-Kutta method changes the frequency of a mode by theta^4/120 of it, and its damping ratio by theta^5/144: at
theta = 1 by more than the whole damping of a light resonance. A stiffening spring swings faster at large amplitudes,
and over the many periods of a free decay the error of the phase grows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railui.campaign.segment import Segment
from railui.dsp.spectra import periodogram

POWER_SHARE = 0.9  # of a record, below its highest frequency of motion
MAX_PHASE = 0.12  # rad of that frequency in a step: 2e-6 of the frequency, 2e-7 of damping ratio
MAX_STEPS = 8  # per sample, where noise fills the spectrum


def with_phase_steps(segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """Return the segments with the least integration steps that keep the phase of a rig's motion."""
    steps = max((phase_steps(s) for s in segments if s.kind == "rig"), default=1)
    if steps == 1:
        return tuple(segments)
    return tuple(replace(s, tables={}, least_steps=steps) if s.kind == "rig" else s for s in segments)


def phase_steps(segment: Segment) -> int:
    """Compute the integration steps per sample that keep the phase of a motion as fast as the record contains."""
    highest = max(_highest_frequency(segment, channel) for channel in segment.channels)
    return int(np.clip(np.ceil(2.0 * np.pi * highest * segment.dt / MAX_PHASE), 1, MAX_STEPS))


def _highest_frequency(segment: Segment, channel: str) -> float:
    f, density = periodogram(segment.columns[channel], 1.0 / segment.dt)
    return float(f[int(np.searchsorted(np.cumsum(density), POWER_SHARE * density.sum()))])
