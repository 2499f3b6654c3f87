"""Stretches made ready for a fit: filtered, weighted, begun, and shortened where a part of them will do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railui.core import Filter
from railui.study.judge import initial_state, weights
from railui.study.measured import Measurement, Stretch, filter_for, filtered, steps_for
from railui.study.model import Model

Floats = NDArray[np.float64]
RIG_RATE = 400.0  # samples of a rig that count as a second of a vehicle


@dataclass(frozen=True, eq=False)
class Target:
    """A stretch made ready for the fit: measured channels filtered and weighted [channel, kept], start, steps."""

    stretch: Stretch
    filter: Filter
    y: Floats
    start: Floats
    steps: int


def targets(model: Model, measurement: Measurement, stretches: Sequence[Stretch]) -> list[Target]:
    """Stretches prepared for a model: weights from noise and what track noise leaves, initial states estimated."""
    ready = []
    for stretch in stretches:
        campaign = measurement.campaign
        w = weights(model, measurement, stretch)
        rate = 1.0 / stretch.dt
        every = 1 if campaign.band is None else max(1, int(rate / (2.4 * min(campaign.band[1], 0.45 * rate))))
        y = filtered(campaign, stretch, stretch.measured(stretch.channels))[:, ::every] * w[:, None]
        start = initial_state(model, stretch, measurement.noise)
        ready.append(Target(stretch, filter_for(campaign, stretch, w, every), y, start, steps_for(model, stretch)))
    return ready


def retarget(model: Model, ready: Sequence[Target], measurement: Measurement) -> list[Target]:
    """The same comparison for a model of another structure: steps, and initial states where they matter.

    That is where bodies were added, and on a rig, whose ringing lasts as long as its runs.
    """
    out = []
    for t in ready:
        grown = t.stretch.kind == "rig" or any(e.kind == "coach_mode" for e in model.effects)
        start = initial_state(model, t.stretch, measurement.noise) if grown else t.start
        out.append(replace(t, start=start, steps=max(t.steps, steps_for(model, t.stretch))))
    return out


def shortened(ready: Sequence[Target], measurement: Measurement, seconds: float) -> list[Target]:
    """The first seconds of every stretch (of a rig's as many samples), enough to tell candidates apart."""
    out = []
    for t in ready:
        rate = RIG_RATE if t.stretch.kind == "rig" else 1.0 / t.stretch.dt
        n = round(seconds * rate)
        if n >= t.stretch.samples:
            out.append(t)
            continue
        columns = {k: np.ascontiguousarray(x[:n]) for k, x in t.stretch.columns.items()}
        stretch = replace(t.stretch, columns=columns, tables={})
        weights, every = t.filter.weights, t.filter.every
        y = filtered(measurement.campaign, stretch, stretch.measured(stretch.channels))[:, ::every]
        short = filter_for(measurement.campaign, stretch, weights, every)
        out.append(replace(t, stretch=stretch, filter=short, y=y * weights[:, None]))
    return out


def restarted(model: Model, ready: Sequence[Target], measurement: Measurement) -> list[Target]:
    """The stretches of a fit with weights and initial states renewed for the adjusted model."""
    return targets(model, measurement, [t.stretch for t in ready])
