"""Drift of the sensors in records of a free decay.

A rig that swings freely about its rest position has no motion far below its lowest frequency, but for the shift of an
asymmetric spring, which follows the squared amplitude. What else is slow there is the sensor's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railui.arrays import FloatArray
from railui.campaign.free_decay import is_free_decay, motion_frequency
from railui.campaign.segment import Segment
from railui.campaign.settings.noise import NoiseSettings
from railui.dsp.spectra import hann

AVERAGED_PERIODS = 3  # of the motion in a Hann-weighted mean, which removes it
DRIFT_BAND_SHARE = 0.2  # of the frequency of the motion, up to which a drift is removed


def with_drift_removed(segments: Sequence[Segment], settings: NoiseSettings) -> tuple[Segment, ...]:
    """Return the segments of a rig with the edge below which free decays are not compared, where sensors drift.

    All decays are compared alike: a sensor that drifts in one record may do so in any.
    """
    limits = {i: DRIFT_BAND_SHARE * motion_frequency(s) for i, s in enumerate(segments) if is_free_decay(s)}
    drifts = any(drift_share(segments[i], c) > settings.max_drift_share for i in limits for c in segments[i].channels)
    if not drifts:
        return tuple(segments)
    limit = min(limits.values())
    return tuple(replace(s, drift_limit=limit) if i in limits else s for i, s in enumerate(segments))


def drift_share(segment: Segment, channel: str) -> float:
    """Slow part of a channel that does not follow the squared amplitude, over the channel, as standard deviations."""
    x = segment.columns[channel] - segment.columns[channel].mean()
    window = hann(round(AVERAGED_PERIODS / (motion_frequency(segment) * segment.dt)))
    slow, power = (np.convolve(y, window / window.sum(), "valid") for y in (x, x**2))
    rest = _residual(slow, np.stack([np.ones_like(slow), power - slow**2], axis=1))
    return float(rest.std() / max(x.std(), 1e-300))


def _residual(y: FloatArray, regressors: FloatArray) -> FloatArray:
    """Residual of a least-squares regression of y [n] on regressors [n, p]."""
    scaled = regressors / np.maximum(np.linalg.norm(regressors, axis=0), 1e-300)
    return np.asarray(y - scaled @ np.linalg.lstsq(scaled, y, rcond=None)[0])
